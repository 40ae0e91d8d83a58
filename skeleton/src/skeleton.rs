//! A skeleton: the canonical joints, each either missing or with position, covariance, confidence and provenance.

use std::ops::{Index, IndexMut};

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::{Confidence, Frame, JOINT_COUNT, Joint, Position, SensorId, SensorSet, Transform};

/// Something for each canonical joint that has it; `None` where it is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointMap<T>([Option<T>; JOINT_COUNT]);

impl<T> Default for JointMap<T> {
    fn default() -> Self {
        Self([const { None }; JOINT_COUNT])
    }
}

impl<T> JointMap<T> {
    /// No joint at all.
    pub fn empty() -> Self {
        Self::default()
    }

    /// The joints that are there, in canonical order.
    pub fn iter(&self) -> impl Iterator<Item = (Joint, &T)> {
        Joint::ALL
            .into_iter()
            .zip(&self.0)
            .filter_map(|(joint, value)| Some((joint, value.as_ref()?)))
    }

    /// The same, to change them.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Joint, &mut T)> {
        Joint::ALL
            .into_iter()
            .zip(&mut self.0)
            .filter_map(|(joint, value)| Some((joint, value.as_mut()?)))
    }

    /// How many joints are there.
    pub fn len(&self) -> usize {
        self.0.iter().flatten().count()
    }

    /// Whether every joint is missing.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Each joint that is there, changed by `f`.
    pub fn map<U>(&self, mut f: impl FnMut(Joint, &T) -> U) -> JointMap<U> {
        self.filter_map(|joint, value| Some(f(joint, value)))
    }

    /// Each joint that is there, changed or dropped by `f`.
    pub fn filter_map<U>(&self, mut f: impl FnMut(Joint, &T) -> Option<U>) -> JointMap<U> {
        JointMap(std::array::from_fn(|i| {
            self.0[i].as_ref().and_then(|value| f(Joint::ALL[i], value))
        }))
    }
}

impl<T> Index<Joint> for JointMap<T> {
    type Output = Option<T>;

    fn index(&self, joint: Joint) -> &Option<T> {
        &self.0[joint as usize]
    }
}

impl<T> IndexMut<Joint> for JointMap<T> {
    fn index_mut(&mut self, joint: Joint) -> &mut Option<T> {
        &mut self.0[joint as usize]
    }
}

impl<T> FromIterator<(Joint, T)> for JointMap<T> {
    fn from_iter<I: IntoIterator<Item = (Joint, T)>>(joints: I) -> Self {
        let mut map = Self::default();
        for (joint, value) in joints {
            map[joint] = Some(value);
        }
        map
    }
}

/// The joints of one person in frame `F`.
pub type Skeleton<F> = JointMap<JointState<F>>;

impl<F: Frame> Skeleton<F> {
    /// The position of `joint`, if it is there.
    pub fn position(&self, joint: Joint) -> Option<Position<F>> {
        self[joint].as_ref().map(|state| state.position)
    }

    /// The same skeleton in another frame.
    pub fn transformed<To: Frame>(&self, to_from_frame: &Transform<To, F>) -> Skeleton<To> {
        self.map(|_, state| JointState {
            position: to_from_frame.apply(state.position),
            covariance: to_from_frame.rotate_covariance(&state.covariance),
            confidence: state.confidence,
            provenance: state.provenance,
        })
    }

    /// The mean of the torso joints that are there, or of all joints if no torso joint is.
    pub fn centre(&self) -> Option<Position<F>> {
        let mean = |joints: &mut dyn Iterator<Item = Position<F>>| {
            let (mut sum, mut count) = (nalgebra::Vector3::zeros(), 0.0);
            for position in joints {
                sum += position.vector();
                count += 1.0;
            }
            (count > 0.0).then(|| Position::from_vector(sum / count))
        };
        mean(
            &mut Joint::TORSO
                .into_iter()
                .filter_map(|joint| self.position(joint)),
        )
        .or_else(|| mean(&mut self.iter().map(|(_, state)| state.position)))
    }
}

/// What is known of one joint at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct JointState<F: Frame> {
    /// Where it is, metres.
    pub position: Position<F>,
    /// How uncertain that is, m^2, in the axes of `F`.
    pub covariance: Matrix3<f64>,
    /// How much it is to be trusted.
    pub confidence: Confidence,
    /// Where the knowledge comes from.
    pub provenance: Provenance,
}

impl<F: Frame> JointState<F> {
    /// A joint as a sensor measured it. Covariance is `sigma_m` squared in every direction.
    pub fn measured(
        position: Position<F>,
        sigma_m: f64,
        confidence: Confidence,
        sensor: SensorId,
    ) -> Self {
        Self {
            position,
            covariance: Matrix3::from_diagonal_element(sigma_m * sigma_m),
            confidence,
            provenance: Provenance::Measured(SensorSet::only(sensor)),
        }
    }

    /// Root mean square of the standard deviations along the three axes, metres.
    pub fn sigma_m(&self) -> f64 {
        (self.covariance.trace() / 3.0).max(0.0).sqrt()
    }
}

/// Where the knowledge of a joint comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Provenance {
    /// Measured with trust by these sensors.
    Measured(SensorSet),
    /// Inferred: no sensor measured it with trust; carried on from what these low-trust sensors said or from the past.
    Predicted(SensorSet),
    /// Filled in by an occlusion model.
    Repaired,
}

impl Provenance {
    /// The sensors behind it.
    pub fn sensors(self) -> SensorSet {
        match self {
            Self::Measured(sensors) | Self::Predicted(sensors) => sensors,
            Self::Repaired => SensorSet::EMPTY,
        }
    }
}
