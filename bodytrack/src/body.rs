//! What the tracker says of a person.

use posefuse_skeleton::{Confidence, JointMap, Position, Sensor};

/// One person in one depth image.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedBody {
    /// The tracker's own number for this person: kept while they are followed, never given twice.
    pub id: u64,
    /// Where the joints are and how far each is to be trusted: a confidence is the probability that the joint is within
    /// 10 cm of the truth.
    pub joints: JointMap<(Position<Sensor>, Confidence)>,
    /// Which way the person faces, if that can be told.
    pub facing: Option<Facing>,
    /// The probability that the left and the right hand is closed, where a hand is seen well enough to say.
    pub hands_closed: [Option<f64>; 2],
}

/// Which side of a person the sensor sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Chest and face.
    Front,
    /// The back.
    Back,
    /// One of the sides.
    Side,
}
