//! The numbers that go into a network and come out, kept between calls so that nothing grows.

use posefuse_skeleton::JOINT_COUNT;

use crate::Manifest;
use crate::backend::{Input, Output, Session};

pub(crate) const JOINTS: usize = JOINT_COUNT;

/// Input and output of one call; each tensor in C order, all windows after each other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tensors {
    /// T.
    pub(crate) poses: usize,
    /// K.
    pub(crate) answers: usize,
    /// N x T x 25 x 3, room metres.
    pub(crate) pose: Vec<f32>,
    /// N x T x 25.
    pub(crate) mask: Vec<f32>,
    /// N x T x 25, seconds.
    pub(crate) age: Vec<f32>,
    /// N x K x 25 x 3, room metres.
    pub(crate) filled: Vec<f32>,
    /// N x K x 25, metres.
    pub(crate) sigma: Vec<f32>,
}

impl Tensors {
    pub(crate) fn of(manifest: &Manifest) -> Self {
        Self {
            poses: manifest.poses(),
            answers: manifest.filled(),
            ..Self::default()
        }
    }

    /// Empties the inputs.
    pub(crate) fn clear(&mut self) {
        self.pose.clear();
        self.mask.clear();
        self.age.clear();
    }

    /// Runs a network on the first `n` windows; its outputs are as many as they should be.
    ///
    /// # Errors
    /// What the runtime says, or how many there are.
    pub(crate) fn run(&mut self, session: &mut dyn Session, n: usize) -> Result<(), String> {
        let (joints, places) = ([n, self.poses, JOINTS], [n, self.poses, JOINTS, 3]);
        let input = |name, shape, values| Input {
            name,
            shape,
            values,
        };
        let inputs = [
            input("pose", &places[..], &self.pose[..]),
            input("mask", &joints, &self.mask),
            input("age", &joints, &self.age),
        ];
        let output = |name, values| Output { name, values };
        let mut outputs = [
            output("filled", &mut self.filled),
            output("sigma", &mut self.sigma),
        ];
        session.run(&inputs, &mut outputs)?;
        self.check_outputs(n)
    }

    /// Whether the outputs are as long as `n` windows need.
    fn check_outputs(&self, n: usize) -> Result<(), String> {
        let expected = n * self.answers * JOINTS;
        for (name, found, expected) in [
            ("filled", self.filled.len(), 3 * expected),
            ("sigma", self.sigma.len(), expected),
        ] {
            if found != expected {
                return Err(format!(
                    "output `{name}` has {found} values for {n} windows, expected {expected}"
                ));
            }
        }
        Ok(())
    }
}
