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
/// In this frame the agent starts again, if it does; the next clock probe comes 10 frames later.
const RESTART: usize = 140;
/// How long a frame is on its way, seconds.
const DELAY_S: f64 = 0.04;

/// What the sensor saw. `restarted_ns`: by how much the agent's clock is behind once the agent has started again.
fn observed(restarted_ns: Option<i64>) -> TakeReader {
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
        let restarted_ns = restarted_ns.filter(|_| frame >= RESTART);
        let behind_ns = restarted_ns.unwrap_or(BEHIND_NS);
        let agent_time = |time: Timestamp| AgentTime::from_ns(time.ns() - behind_ns);
        if frame % 30 == 0 {
            // The way is slower by now, too: the new clock's probes never come back as quickly as the old one's.
            let one_way_ns = restarted_ns.map_or(1_000_000, |_| 3_000_000);
            let answered = agent_time(now.plus_ns(-one_way_ns));
            let sample = ClockSample {
                sensor: id,
                sent: now.plus_ns(-2 * one_way_ns),
                returned: now,
                agent_received: answered,
                agent_sent: answered,
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
            received: now.plus_ns((DELAY_S * 1e9) as i64),
            bodies: bodies.collect(),
        };
        writer.input(&Input::Observation(observation)).unwrap();
    }
    writer.finish().unwrap();
    TakeReader::open(&*storage, "raw").unwrap()
}

/// The exported table, and by row the seconds and how far the worst joint is from the truth of that time, metres.
fn rows(take: &TakeReader) -> (Exported, Vec<(f64, f64)>) {
    let options = Options {
        source: Source::Sensors,
        ..Options::of_format(Format::Csv)
    };
    let exported = Exported::of(take, &options);
    assert_eq!(exported.names(), ["raw-sensors.csv"]);
    let world = world();
    let row = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        let seconds: f64 = cells[1].parse().unwrap();
        let truth = world.truth(seconds);
        let person = truth
            .iter()
            .find(|person| cells[4] == format!("sim1-body{}", person.id));
        let mut worst = 0f64;
        for (joint, position) in person.unwrap().joints.iter() {
            for axis in 0..3 {
                let cell: f64 = cells[5 + 5 * joint as usize + axis].parse().unwrap();
                worst = worst.max((cell - position.vector()[axis]).abs());
            }
        }
        (seconds, worst)
    };
    let text = exported.text("raw-sensors.csv");
    let rows = text.lines().skip(1).map(row).collect();
    (exported, rows)
}

#[test]
fn bodies_of_a_sensor_stand_in_the_room_at_the_time_of_capture() {
    let (exported, rows) = rows(&observed(None));
    let people = exported
        .report
        .people
        .iter()
        .map(|person| person.person.to_string());
    assert_eq!(people.collect::<Vec<_>>(), ["sim1-body1", "sim1-body2"]);
    let worst = rows.iter().map(|row| row.1).fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst} m");
    assert_eq!(rows.len(), 2 * FRAMES);
}

#[test]
fn an_agent_that_starts_again_is_followed_by_its_new_clock() {
    // One that starts from nothing, one that is by now ahead of the server's, and one that is hardly off.
    for behind_ns in [99_000_000_000, -1_000_000_000_000, BEHIND_NS - 100_000_000] {
        let (exported, rows) = rows(&observed(Some(behind_ns)));
        assert_eq!(
            rows.len(),
            2 * FRAMES,
            "{behind_ns}: a gap, or rows at false times"
        );
        for person in &exported.report.people {
            let span = (person.from_s, person.to_s);
            assert!(
                (span.0, span.1) == (0.0, time(FRAMES - 1).since_seconds(START)),
                "{span:?}"
            );
        }
        let seconds = |frame: usize| time(frame).since_seconds(START);
        // Until the new clock is probed, a frame is caught when it comes at the latest.
        let unsure = seconds(RESTART - 2)..seconds(RESTART + 10) + DELAY_S + 0.1;
        for (at, off) in rows {
            let bound = if unsure.contains(&at) { 0.2 } else { 1e-3 };
            assert!(off < bound, "{behind_ns}: {off} m at {at} s");
        }
    }
}
