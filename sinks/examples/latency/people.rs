//! Two simulated people, say, as the fusion thread would have them.

use nalgebra::Matrix3;
use posefuse_simulator::motion::{Cast, Performance, Situation};
use posefuse_skeleton::{
    Confidence, JointState, Provenance, RoomFrame, SensorId, SensorSet, Timestamp, Track, TrackId,
};

pub(crate) fn frames(people: usize, seconds: f64, rate_hz: f64) -> Vec<RoomFrame> {
    let performance = Performance::procedural(Cast {
        seed: 5,
        people,
        area_m: 4.0,
        hugs: false,
        situation: Situation::Everyday,
        away_s: 1.8,
    });
    let sensors = SensorId::new(0).map_or(SensorSet::EMPTY, SensorSet::only);
    let track = |person: usize, at_s: f64| Track {
        id: TrackId(person as u64),
        since: Timestamp::ZERO,
        sensors,
        skeleton: performance
            .pose(person, at_s)
            .map(|_, position| JointState {
                position: *position,
                covariance: Matrix3::from_diagonal_element(1e-4),
                confidence: Confidence::FULL,
                provenance: Provenance::Measured(sensors),
            }),
        hands: [None; 2],
    };
    let frame = |number: usize| {
        let at_s = 30.0 + number as f64 / rate_hz;
        RoomFrame {
            number: number as u64,
            time: Timestamp::from_seconds(at_s),
            look_ahead_ns: 0,
            tracks: (0..people).map(|person| track(person, at_s)).collect(),
        }
    };
    (0..(seconds * rate_hz) as usize).map(frame).collect()
}
