//! Bookkeeping: what sensors captured, what a take holds, what the server counted.

use std::collections::BTreeMap;

use posefuse_proto::{agent_body, bodies_from_agent, v1};
use posefuse_session::TakeReader;
use posefuse_skeleton::{JointSet, Observation};

use crate::simulated::CapturedFrame;

/// Reasons for which the server refuses a whole frame before the engine: it is counted and not recorded.
const NOT_RECORDED: [&str; 5] = [
    "wrong-length",
    "too-many-bodies",
    "malformed",
    "duplicate",
    "queue-full",
];

/// A take's observations by sensor name, in the order they were recorded.
pub fn observations(take: &TakeReader) -> BTreeMap<String, Vec<Observation>> {
    let sensors = take.sensors().expect("a readable take");
    let mut by_name: BTreeMap<String, Vec<Observation>> = BTreeMap::new();
    for observation in take.observations() {
        let observation = observation.expect("a readable take");
        let info = sensors.iter().find(|info| info.id == observation.sensor);
        let name = info.expect("a sensor that was announced").name.clone();
        by_name.entry(name).or_default().push(observation);
    }
    by_name
}

/// Each frame once, in order, with what its sensor captured: fails for the first observation that is another one.
pub fn assert_as_captured(sensor: &str, captured: &[CapturedFrame], recorded: &[Observation]) {
    let mut last = None;
    for observation in recorded {
        let sequence = observation.sequence;
        assert!(
            last < Some(sequence),
            "{sensor}: frame {sequence} after {last:?}"
        );
        last = Some(sequence);
        let frame = &captured[sequence as usize];
        assert_eq!(
            observation.captured, frame.captured,
            "{sensor}: time of frame {sequence}"
        );
        let bodies: Vec<_> = frame
            .bodies
            .iter()
            .map(|body| agent_body(body.tracking_id, &body.joints))
            .collect();
        let expected = bodies_from_agent(observation.sensor, JointSet::KinectV2, &bodies);
        assert_eq!(
            Ok(&observation.bodies),
            expected.as_ref(),
            "{sensor}: bodies of frame {sequence}"
        );
    }
}

/// Frames of this sensor that came to the server and were refused there, by its own account.
pub fn not_recorded(status: &v1::SensorStatus) -> u64 {
    NOT_RECORDED
        .iter()
        .filter_map(|reason| status.rejected.get(*reason))
        .sum()
}

/// The status of one sensor.
pub fn sensor<'a>(status: &'a v1::RoomStatus, name: &str) -> &'a v1::SensorStatus {
    let is =
        |sensor: &&v1::SensorStatus| sensor.info.as_ref().is_some_and(|info| info.name == name);
    status
        .sensors
        .iter()
        .find(is)
        .unwrap_or_else(|| panic!("no sensor `{name}` in {status:#?}"))
}
