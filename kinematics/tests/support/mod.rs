//! People with a known truth, as tracks.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "tests")]

use nalgebra::{Matrix3, Vector3};
use posefuse_kinematics::{Body, Solved};
use posefuse_simulator::motion::{Cast, Performance, Situation};
use posefuse_skeleton::{
    Confidence, Joint, JointMap, JointState, Position, Provenance, Room, SensorId, SensorSet,
    Timestamp, Track, TrackId,
};

pub(crate) const RATE_HZ: f64 = 30.0;

pub(crate) fn performance(seed: u64) -> Performance {
    Performance::procedural(Cast {
        seed,
        people: 1,
        area_m: 2.6,
        hugs: false,
        situation: Situation::Everyday,
        away_s: 1.8,
    })
}

pub(crate) fn at(frame: usize) -> Timestamp {
    Timestamp::from_seconds(frame as f64 / RATE_HZ)
}

/// A track of these joints, each off by `noise` and said to be good for `sigma_m`.
pub(crate) fn noisy(
    joints: &JointMap<Position<Room>>,
    sigma_m: f64,
    mut noise: impl FnMut() -> f64,
) -> Track {
    let sensors = SensorSet::only(SensorId::new(0).unwrap());
    Track {
        id: TrackId(1),
        since: Timestamp::ZERO,
        sensors,
        skeleton: joints.map(|_, position| JointState {
            position: position.moved(Vector3::new(noise(), noise(), noise())),
            covariance: Matrix3::from_diagonal_element(sigma_m * sigma_m),
            confidence: Confidence::FULL,
            provenance: Provenance::Measured(sensors),
        }),
        hands: [None; 2],
    }
}

pub(crate) fn exact(joints: &JointMap<Position<Room>>) -> Track {
    noisy(joints, 0.001, || 0.0)
}

/// Noise with this standard deviation: the same every time.
pub(crate) fn noise(sigma_m: f64, seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut uniform = move || {
        // Marsaglia's xorshift64.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    // Twelve uniform numbers have variance 1.
    move || sigma_m * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0)
}

/// The measures of a procedural person, learned from the truth.
pub(crate) fn body(performance: &Performance) -> Body {
    let tracks: Vec<Track> = (0..900)
        .map(|frame| exact(&performance.pose(0, frame as f64 / RATE_HZ)))
        .collect();
    Body::learn(&tracks)
}

pub(crate) fn is_finite(solved: &Solved) -> bool {
    let turns = solved.pose.rotations.iter();
    solved.pose.root.is_finite()
        && turns.flat_map(|q| q.coords.iter()).all(|v| v.is_finite())
        && solved.joints.iter().all(|(_, p)| p.is_finite())
}

/// Mean distance of the joints that both have, metres.
pub(crate) fn mean_error(a: &JointMap<Position<Room>>, b: &JointMap<Position<Room>>) -> f64 {
    let both = Joint::ALL
        .into_iter()
        .filter_map(|j| Some(a[j]?.distance(b[j]?)));
    let (sum, count) = both.fold((0.0, 0), |(sum, count), d| (sum + d, count + 1));
    sum / f64::from(count)
}
