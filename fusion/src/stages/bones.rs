//! The room stage `bones`: a body's bones keep their lengths, softly.
//!
//! A person's lengths are learned as running medians of what was measured. Each bone is then a further, weak
//! measurement of its two ends: they move along it, the less certain end more. Positions stay soft; exact lengths
//! are for the kinematic output.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{
    BONES, Joint, JointState, Position, Provenance, Room, RoomFrame, Skeleton, TrackId,
};
use serde::{Deserialize, Serialize};

use crate::config_check::Checker;
use crate::length::Length;

/// `kind = "bones"`: draws bones softly to the person's own lengths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BonesConfig {
    /// Whether it runs.
    pub enabled: bool,
    /// Standard deviation of a bone's length: smaller is harder.
    pub sigma_mm: f64,
    /// A joint is moved by no more than this.
    pub max_correction_mm: f64,
}

impl Default for BonesConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            sigma_mm: 15.0,
            max_correction_mm: 40.0,
        }
    }
}

impl BonesConfig {
    pub(super) fn check(&self, at: &str, check: &mut Checker) {
        check.within(&format!("{at}.sigma_mm"), self.sigma_mm, 0.1, 1000.0);
        check.within(
            &format!("{at}.max_correction_mm"),
            self.max_correction_mm,
            0.0,
            1000.0,
        );
    }
}

/// Everybody's bone lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Bones {
    config: BonesConfig,
    people: BTreeMap<TrackId, [Length; BONES.len()]>,
}

impl Bones {
    pub(super) fn new(config: BonesConfig) -> Self {
        Self {
            config,
            people: BTreeMap::new(),
        }
    }

    /// Learns from `frame` and corrects it.
    pub(super) fn apply(&mut self, frame: &mut RoomFrame) {
        for track in &mut frame.tracks {
            let lengths = self.people.entry(track.id).or_default();
            for (bone, length) in BONES.iter().zip(lengths.iter_mut()) {
                learn(&track.skeleton, bone.parent, bone.child, length);
            }
            for (bone, length) in BONES.iter().zip(lengths.iter()) {
                if let Some(length_m) = length.known() {
                    self.config
                        .draw(&mut track.skeleton, bone.parent, bone.child, length_m);
                }
            }
        }
    }

    #[cfg(test)]
    pub(super) fn people(&self) -> usize {
        self.people.len()
    }

    /// Forgets who is not among `known` (ascending).
    pub(super) fn retain(&mut self, known: &[TrackId]) {
        self.people.retain(|id, _| known.binary_search(id).is_ok());
    }
}

fn learn(skeleton: &Skeleton<Room>, parent: Joint, child: Joint, length: &mut Length) {
    let measured = |state: &JointState<Room>| matches!(state.provenance, Provenance::Measured(_));
    if let (Some(a), Some(b)) = (&skeleton[parent], &skeleton[child])
        && measured(a)
        && measured(b)
    {
        length.learn(a.position.distance(b.position));
    }
}

impl BonesConfig {
    /// Moves both ends along the bone towards `length_m`.
    fn draw(&self, skeleton: &mut Skeleton<Room>, parent: Joint, child: Joint, length_m: f64) {
        let (Some(a), Some(b)) = (&skeleton[parent], &skeleton[child]) else {
            return;
        };
        let along = b.position.vector() - a.position.vector();
        let found_m = along.norm();
        if found_m < 1e-3 {
            return;
        }
        let direction: Vector3<f64> = along / found_m;
        let variance =
            |state: &JointState<Room>| (direction.transpose() * state.covariance * direction)[0];
        let (of_a, of_b) = (variance(a), variance(b));
        let sigma_m = self.sigma_mm * 1e-3;
        let error = (found_m - length_m) / (of_a + of_b + sigma_m * sigma_m);
        let limit = self.max_correction_mm * 1e-3;
        let shift = |variance: f64| direction * (error * variance).clamp(-limit, limit);
        let (a_at, b_at): (Position<Room>, Position<Room>) = (
            a.position.moved(shift(of_a)),
            b.position.moved(-shift(of_b)),
        );
        for (joint, at) in [(parent, a_at), (child, b_at)] {
            if let Some(state) = &mut skeleton[joint] {
                state.position = at;
            }
        }
    }
}
