//! What each sensor saw: through its clock and its place into the room.

use std::sync::Arc;

use posefuse_export::{Format, Options, Source};
use posefuse_session::{ClockSample, Input, MemoryStorage, Storage, TakeReader, TakeWriter};
use posefuse_skeleton::{
    AgentTime, Body, JointSet, Observation, SensorId, SensorInfo, Skeleton, Timestamp,
};

use crate::take::{Exported, FRAMES, START, header, measured, time, world};

/// What the agent's clock shows is so much behind the server's, nanoseconds.
const BEHIND_NS: i64 = 5_000_000_000;

fn agent_time(time: Timestamp) -> AgentTime {
    AgentTime::from_ns(time.ns() - BEHIND_NS)
}

fn observed() -> TakeReader {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
    let world = world();
    let id = SensorId::new(0).unwrap();
    let info = SensorInfo {
        id,
        name: "sim1".to_owned(),
        model: "Simulated".to_owned(),
        joint_set: JointSet::KinectV2,
    };
    let preamble = [
        Input::Sensor(info),
        Input::Calibration(Arc::new(world.true_calibration())),
    ];
    let mut writer = TakeWriter::create(&storage, header("raw"), &preamble, None).unwrap();
    let sensor_from_room = world.room_from_sensor(0).inverse();
    for frame in 0..FRAMES {
        let now = time(frame);
        if frame % 30 == 0 {
            let sample = ClockSample {
                sensor: id,
                sent: now.plus_ns(-2_000_000),
                returned: now,
                agent_received: agent_time(now.plus_ns(-1_000_000)),
                agent_sent: agent_time(now.plus_ns(-1_000_000)),
            };
            writer.input(&Input::ClockSample(sample)).unwrap();
        }
        let bodies = world.truth(time(frame).since_seconds(START));
        let bodies = bodies.iter().map(|person| {
            let skeleton: Skeleton<_> = measured(&person.joints).transformed(&sensor_from_room);
            Body {
                tracking_id: 72_057_594_037_927_936 + person.id,
                skeleton,
                orientations: None,
                hands_closed: [None; 2],
            }
        });
        let observation = Observation {
            sensor: id,
            sequence: frame as u64,
            captured: agent_time(now),
            received: now.plus_ns(40_000_000),
            bodies: bodies.collect(),
        };
        writer.input(&Input::Observation(observation)).unwrap();
    }
    writer.finish().unwrap();
    TakeReader::open(&*storage, "raw").unwrap()
}

#[test]
fn bodies_of_a_sensor_stand_in_the_room_at_the_time_of_capture() {
    let options = Options {
        source: Source::Sensors,
        ..Options::of_format(Format::Csv)
    };
    let exported = Exported::of(&observed(), &options);
    assert_eq!(exported.names(), ["raw-sensors.csv"]);
    let people = exported
        .report
        .people
        .iter()
        .map(|person| person.person.to_string());
    assert_eq!(people.collect::<Vec<_>>(), ["sim1-body1", "sim1-body2"]);
    let (text, world) = (exported.text("raw-sensors.csv"), world());
    let mut worst = 0f64;
    for row in text.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let seconds: f64 = cells[1].parse().unwrap();
        let truth = world.truth(seconds);
        let person = truth
            .iter()
            .find(|person| cells[3] == format!("sim1-body{}", person.id));
        for (joint, position) in person.unwrap().joints.iter() {
            for axis in 0..3 {
                let cell: f64 = cells[4 + 4 * joint as usize + axis].parse().unwrap();
                worst = worst.max((cell - position.vector()[axis]).abs());
            }
        }
    }
    assert!(worst < 1e-3, "{worst} m");
    assert_eq!(text.lines().count(), 1 + 2 * FRAMES);
}
