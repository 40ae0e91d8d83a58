//! Sensors: their numbers inside one server, sets of them, and what is known of each.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::JointSet;

/// A sensor's number inside one server run: 0..64, given in order of first appearance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct SensorId(u8);

/// The number is beyond what one room may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a room has at most {max} sensors, sensor number {0} was asked for; names of sensors that are gone count until the server is started anew", max = SensorId::MAX_SENSORS)]
pub struct SensorIdError(pub usize);

impl SensorId {
    /// Most sensors one room may have.
    pub const MAX_SENSORS: usize = 64;

    /// The sensor with this number, below [`SensorId::MAX_SENSORS`].
    pub fn new(index: usize) -> Result<Self, SensorIdError> {
        if index < Self::MAX_SENSORS {
            Ok(Self(index as u8))
        } else {
            Err(SensorIdError(index))
        }
    }

    /// The number, for indexing.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl TryFrom<u8> for SensorId {
    type Error = SensorIdError;

    fn try_from(index: u8) -> Result<Self, Self::Error> {
        Self::new(usize::from(index))
    }
}

impl From<SensorId> for u8 {
    fn from(id: SensorId) -> u8 {
        id.0
    }
}

impl fmt::Display for SensorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A set of sensors of one room.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct SensorSet(u64);

impl SensorSet {
    /// No sensor.
    pub const EMPTY: Self = Self(0);

    /// Just `id`.
    pub fn only(id: SensorId) -> Self {
        Self(1 << id.0)
    }

    /// The set whose bit `i` says whether sensor `i` is in it.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// Bit `i` says whether sensor `i` is in the set.
    pub fn bits(self) -> u64 {
        self.0
    }

    /// Adds `id`.
    pub fn insert(&mut self, id: SensorId) {
        self.0 |= 1 << id.0;
    }

    /// Whether `id` is in the set.
    pub fn contains(self, id: SensorId) -> bool {
        self.0 & (1 << id.0) != 0
    }

    /// The sensors of either set.
    pub fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// How many sensors.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether it has no sensor.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The sensors, in order of their number.
    pub fn iter(self) -> impl Iterator<Item = SensorId> {
        (0..SensorId::MAX_SENSORS as u8)
            .map(SensorId)
            .filter(move |id| self.contains(*id))
    }
}

impl FromIterator<SensorId> for SensorSet {
    fn from_iter<I: IntoIterator<Item = SensorId>>(sensors: I) -> Self {
        let mut set = Self::EMPTY;
        sensors.into_iter().for_each(|id| set.insert(id));
        set
    }
}

/// What the server knows of a sensor from its agent's greeting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorInfo {
    /// Its number in this server run.
    pub id: SensorId,
    /// Its name, unique in the room, e.g. `left`.
    pub name: String,
    /// The device, e.g. `Kinect v2`.
    pub model: String,
    /// The joint set its agent sends.
    pub joint_set: JointSet,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_in() {
        let ids: Vec<_> = [0, 5, 63]
            .into_iter()
            .map(|i| SensorId::new(i).unwrap())
            .collect();
        let set: SensorSet = ids.iter().copied().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), ids);
        assert_eq!(set.len(), 3);
        assert!(SensorId::new(64).is_err());
    }
}
