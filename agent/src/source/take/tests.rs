//! Takes recorded here, played back.

use std::sync::Arc;

use posefuse_proto::v1::{self, engine_input::Input as Wire};
use posefuse_session::{Storage, TakeHeader, TakeWriter, input_from_bytes};
use posefuse_skeleton::{AgentTime, Timestamp};
use prost::Message;

use super::*;
use crate::{SensorSource, SourceFrame};

struct Fixed(i64);

impl Clock for Fixed {
    fn monotonic_ns(&self) -> i64 {
        self.0
    }
    fn unix_ns(&self) -> i64 {
        self.0
    }
}

const MS: i64 = 1_000_000;
/// Server time of the take's start.
const START: i64 = 77_000 * MS;

fn joint_x(sensor: u32, frame: i64, joint: usize) -> f32 {
    sensor as f32 + frame as f32 * 0.01 + joint as f32 * 0.001
}

fn observation(sensor: u32, frame: i64, captured_ns: i64, received_ns: i64) -> Wire {
    let positions = (0..25).flat_map(|joint| [joint_x(sensor, frame, joint), -0.5, 2.5]);
    let mut body = v1::Body {
        tracking_id: 40 + u64::from(sensor),
        positions: positions.collect(),
        confidences: vec![0.75; 25],
        hands_closed: if sensor == 1 {
            vec![0.75, -1.0]
        } else {
            Vec::new()
        },
        orientations: if sensor == 1 {
            [0.0, 0.6, 0.0, 0.8].repeat(25)
        } else {
            Vec::new()
        },
    };
    body.confidences[3] = 0.0;
    Wire::Observation(v1::Observation {
        sensor,
        sequence: frame as u64,
        captured_ns,
        received_ns,
        bodies: vec![body],
    })
}

fn sensor(id: u32, name: &str) -> Wire {
    let joint_set = JointSet::Nite.name().to_owned();
    Wire::Sensor(v1::SensorInfo {
        id,
        name: name.into(),
        model: format!("model {id}"),
        joint_set,
    })
}

/// Two sensors, 10 frames each. The clock of `left` is 5 s behind the server's and steps back by a minute after its
/// frame 6; each odd frame of it takes 8 ms longer than the others.
fn record(folder: &Path) -> PathBuf {
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder).unwrap());
    let header = TakeHeader {
        name: "walk".into(),
        start: Some(Timestamp::from_ns(START)),
        ..TakeHeader::default()
    };
    let mut inputs = vec![sensor(0, "left"), sensor(1, "right"), sensor(2, "idle")];
    for frame in 0..10 {
        let at_ns = START + frame * 100 * MS;
        let own_ns = at_ns - 5_000 * MS - if frame > 6 { 60_000 * MS } else { 0 };
        inputs.push(observation(1, frame, at_ns - MS, at_ns));
        inputs.push(observation(
            0,
            frame,
            own_ns,
            at_ns + 10 * MS + (frame % 2) * 8 * MS,
        ));
    }
    let mut writer = TakeWriter::create(&storage, header, &[], None).unwrap();
    for input in inputs {
        let bytes = v1::EngineInput { input: Some(input) }.encode_to_vec();
        writer.input(&input_from_bytes(&bytes).unwrap()).unwrap();
    }
    writer.finish().unwrap();
    folder.join("walk.mcap")
}

fn play(config: &TakeConfig, now_ns: i64, frames: usize) -> (Vec<SourceFrame>, Replay<TakeTape>) {
    let mut source = open(config, &Fixed(now_ns)).unwrap();
    let played = (0..frames)
        .map_while(|_| source.next_frame().unwrap())
        .collect();
    (played, source)
}

fn due_ms(frames: &[SourceFrame]) -> Vec<i64> {
    frames
        .iter()
        .map(|frame| frame.due_ns.unwrap() / MS)
        .collect()
}

#[test]
fn a_sensor_of_a_take_comes_again_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let config = TakeConfig::new(record(folder.path()), "right");
    let (frames, source) = play(&config, 1_000 * MS, 100);
    assert_eq!(
        due_ms(&frames),
        (0..10).map(|frame| 1_000 + frame * 100).collect::<Vec<_>>()
    );
    let description = source.description();
    assert_eq!(
        (description.model.as_str(), description.joint_set),
        ("model 1", JointSet::KinectV2)
    );
    for (number, frame) in frames.iter().enumerate() {
        let body = &frame.bodies[0];
        assert_eq!(body.tracking_id, 41);
        assert_eq!(
            (
                body.joints.len(),
                body.orientations.len(),
                body.orientations[4]
            ),
            (25, 25, [0.0, 0.6, 0.0, 0.8])
        );
        assert_eq!(body.hands_closed, [Some(0.75), None]);
        let raw = body.joints[5].unwrap();
        assert_eq!(raw.position.vector().x as f32, joint_x(1, number as i64, 5));
        assert_eq!((raw.confidence.get(), body.joints[3]), (0.75, None));
    }
}

#[test]
fn stamps_and_probes_are_by_one_clock_even_where_the_recorded_clock_stepped() {
    let folder = tempfile::tempdir().unwrap();
    let config = TakeConfig::new(record(folder.path()), "left");
    let (frames, source) = play(&config, 0, 100);
    assert_eq!(frames.len(), 10);
    assert!(
        frames
            .iter()
            .all(|frame| frame.bodies[0].orientations.is_empty())
    );
    assert_eq!(
        frames[0].captured,
        AgentTime::from_ns(START - 5_000 * MS),
        "the sensor's own epoch"
    );
    let shows = source.clock();
    let late = |frame: &SourceFrame| shows(frame.due_ns.unwrap()).since_ns(frame.captured) / MS;
    // The quickest frame counts as no time on the way; after the step that is again the quickest one.
    assert_eq!(
        frames.iter().map(late).collect::<Vec<_>>(),
        [0, 8, 0, 8, 0, 8, 0, 8, 0, 8]
    );
}

#[test]
fn faster_again_and_again_and_joined_midway() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = TakeConfig::new(record(folder.path()), "right");
    (config.replay.speed, config.replay.repeat) = (2.0, true);
    let (frames, _) = play(&config, 0, 25);
    // A round lasts from the first frame to a frame's time after the last of any sensor: 918 + 33 ms.
    assert_eq!(due_ms(&frames)[8..12], [400, 450, 475, 525]);
    let stamps = frames
        .windows(2)
        .map(|pair| pair[1].captured.since_ns(pair[0].captured) / MS);
    assert!(
        stamps.clone().all(|step| (25..=50).contains(&step)),
        "{:?}",
        stamps.collect::<Vec<_>>()
    );

    (config.replay.speed, config.replay.epoch_unix_ns) = (1.0, Some(0));
    let (frames, _) = play(&config, 10_000 * MS, 2);
    assert_eq!(
        due_ms(&frames),
        [10_013, 10_113],
        "the sixth frame of the eleventh round"
    );
}

#[test]
fn what_is_not_there_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = record(folder.path());
    let refused = |config: TakeConfig| open(&config, &Fixed(0)).err().unwrap().to_string();
    let error = refused(TakeConfig::new(&file, "centre"));
    assert!(
        error.contains("no sensor `centre`; there are left, right, idle"),
        "{error}"
    );
    let error = refused(TakeConfig::new(&file, "idle"));
    assert!(error.contains("no frame of sensor `idle`"), "{error}");
    let error = refused(TakeConfig::new(folder.path().join("run.mcap"), "left"));
    assert!(error.contains("run"), "{error}");
    let cut = folder.path().join("cut.mcap");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    assert!(refused(TakeConfig::new(&cut, "left")).contains("cut"));
    let mut slow = TakeConfig::new(&file, "left");
    slow.replay.speed = 0.0;
    assert!(refused(slow).contains("take source: `speed` must lie between"));
}
