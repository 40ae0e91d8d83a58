//! Fusing again with a model beside the engine: recorded answers are replayed, another model answers in their place.
#![allow(clippy::unwrap_used)]

mod support;

use std::ops::Range;
use std::sync::Arc;

use posefuse_fusion::{Config, Fill, Input, ModelError, Needs, OcclusionModel, Window};
use posefuse_session::{
    MemoryStorage, Recorded, RefuseOptions, RefuseReport, Storage, TakeOptions, TakeReader, Topic,
    refuse, refuse_with,
};
use posefuse_skeleton::{Joint, JointMap, Provenance, RoomFrame, Timestamp};
use support::{BUILD, Recorder, arrivals, time_of};

const ARM: [Joint; 5] = [
    Joint::ElbowLeft,
    Joint::WristLeft,
    Joint::HandLeft,
    Joint::HandTipLeft,
    Joint::ThumbLeft,
];

/// Holds every joint a hand's breadth above where it was last seen.
struct Above {
    name: &'static str,
    asked: u64,
    fails: bool,
}

impl Above {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            asked: 0,
            fails: false,
        }
    }
}

impl OcclusionModel for Above {
    fn name(&self) -> &str {
        self.name
    }

    fn needs(&self) -> Needs {
        Needs {
            before: 5,
            after: 0,
            rate_hz: 30.0,
        }
    }

    fn fill(
        &mut self,
        window: &Window,
        wanted: Range<usize>,
    ) -> Result<Vec<JointMap<Fill>>, ModelError> {
        self.asked += 1;
        if self.fails {
            return Err(ModelError {
                model: self.name.to_owned(),
                reason: "out of ideas".to_owned(),
            });
        }
        let fill = |pose: usize| {
            let joints = Joint::ALL.into_iter().zip(&window.poses[pose]);
            let above = |position| position + nalgebra::Vector3::new(0.0, 0.0, 0.1);
            joints
                .map(|(joint, known)| {
                    let fill = Fill {
                        position: above(known.position),
                        sigma_m: 0.1,
                        rotation: None,
                    };
                    (joint, fill)
                })
                .collect()
        };
        Ok(wanted.map(fill).collect())
    }
}

/// A take of somebody whose left lower arm nobody sees for a second and a half.
fn take(storage: &Arc<dyn Storage>) {
    let options = TakeOptions {
        min_free_bytes: 0,
        ..TakeOptions::default()
    };
    let mut recorder = Recorder::new();
    let hidden = Timestamp::from_seconds(2.0)..Timestamp::from_seconds(3.5);
    for mut input in arrivals(4.0, 1) {
        if let Input::Observation(seen) = &mut input
            && hidden.contains(&seen.received)
        {
            for body in &mut seen.bodies {
                ARM.into_iter()
                    .for_each(|joint| body.skeleton[joint] = None);
            }
        }
        let now = time_of(&input);
        if recorder.writer.is_none() && now >= Timestamp::from_seconds(1.0) {
            recorder.begin(storage, "t", now, options);
        }
        recorder.arrive(input);
    }
    recorder.writer.take().unwrap().finish().unwrap();
}

fn with(storage: &Arc<dyn Storage>, from: &str, to: &str, model: &mut Above) -> RefuseReport {
    let options = RefuseOptions {
        build: BUILD.into(),
        repair: Some(model.name.into()),
        name: Some(to.into()),
        ..RefuseOptions::default()
    };
    refuse_with(storage, from, &options, Some(model), &mut |_| {}).unwrap()
}

fn inputs(storage: &dyn Storage, name: &str) -> Vec<Input> {
    let take = TakeReader::open(storage, name).unwrap();
    let entries = take.entries(&[Topic::Inputs], None);
    let input = |entry: Recorded| match entry {
        Recorded::Input(input) => Some(input),
        _ => None,
    };
    entries
        .filter_map(|entry| input(entry.unwrap().decode().unwrap()))
        .collect()
}

fn frames(storage: &dyn Storage, name: &str) -> Vec<RoomFrame> {
    let take = TakeReader::open(storage, name).unwrap();
    let entries = take.entries(&[Topic::Frames], None);
    let frame = |entry: Recorded| match entry {
        Recorded::Frame(frame) => Some(frame),
        _ => None,
    };
    entries
        .filter_map(|entry| frame(entry.unwrap().decode().unwrap()))
        .collect()
}

fn answers(storage: &dyn Storage, name: &str) -> u64 {
    let is_answer = |input: &&Input| matches!(input, Input::Repaired(_));
    inputs(storage, name).iter().filter(is_answer).count() as u64
}

fn repaired(frames: &[RoomFrame]) -> usize {
    let states = frames.iter().flat_map(|frame| &frame.tracks);
    let joints = states.flat_map(|track| track.skeleton.iter());
    joints
        .filter(|(_, state)| state.provenance == Provenance::Repaired)
        .count()
}

#[test]
fn a_model_answers_at_once_and_its_answers_are_replayed_without_it() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    take(&storage);
    let mut model = Above::new("above");
    let report = with(&storage, "t", "above", &mut model);
    assert!(model.asked > 10 && !report.identical, "{report:?}");
    assert_eq!(answers(&*storage, "above"), model.asked);
    let first = frames(&*storage, "above");
    assert!(repaired(&first) > 10, "{}", repaired(&first));
    let header = TakeReader::open(&*storage, "above")
        .unwrap()
        .header()
        .clone();
    let config: Config = posefuse_fusion::parse_toml(&header.config_toml).unwrap();
    assert_eq!(config.repair.model, "above");
    // Without the model: bit for bit.
    let options = RefuseOptions {
        build: BUILD.into(),
        name: Some("replayed".into()),
        ..RefuseOptions::default()
    };
    let replayed = refuse(&storage, "above", &options, &mut |_| {}).unwrap();
    assert!(replayed.identical, "{replayed:?}");
    assert_eq!(answers(&*storage, "replayed"), model.asked);
}

#[test]
fn another_model_takes_the_place_of_the_recorded_answers() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    take(&storage);
    let mut first = Above::new("first");
    with(&storage, "t", "first", &mut first);
    let mut second = Above::new("second");
    let report = with(&storage, "first", "second", &mut second);
    assert!(second.asked > 10 && report.frames > 40, "{report:?}");
    assert_eq!(answers(&*storage, "second"), second.asked);
    let models: Vec<String> = inputs(&*storage, "second")
        .into_iter()
        .filter_map(|input| match input {
            Input::RepairModel(model) => Some(model.map_or_else(String::new, |model| model.name)),
            _ => None,
        })
        .collect();
    assert_eq!(models, ["second"]);
    // By a simple model: the recorded answers and the model behind them are gone.
    let options = RefuseOptions {
        build: BUILD.into(),
        repair: Some("hold".into()),
        name: Some("held".into()),
        ..RefuseOptions::default()
    };
    refuse(&storage, "second", &options, &mut |_| {}).unwrap();
    assert_eq!(answers(&*storage, "held"), 0);
    let is_model = |input: &Input| matches!(input, Input::RepairModel(Some(_)));
    assert!(!inputs(&*storage, "held").iter().any(is_model));
    assert!(repaired(&frames(&*storage, "held")) > 10);
}

#[test]
fn a_model_that_fails_leaves_the_frames_to_the_engine_and_none_is_lost() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    take(&storage);
    let mut good = Above::new("model");
    let expected = with(&storage, "t", "good", &mut good).frames;
    let mut bad = Above {
        fails: true,
        ..Above::new("model")
    };
    let report = with(&storage, "t", "bad", &mut bad);
    assert_eq!((report.frames, bad.asked > 10), (expected, true));
    assert!(repaired(&frames(&*storage, "bad")) > 10);
}

#[test]
fn smoothing_asks_the_model_and_not_the_recording() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    take(&storage);
    let mut model = Above::new("above");
    with(&storage, "t", "above", &mut model);
    let options = RefuseOptions {
        build: BUILD.into(),
        smooth: true,
        name: Some("smooth".into()),
        ..RefuseOptions::default()
    };
    let mut again = Above::new("above");
    let report = refuse_with(&storage, "above", &options, Some(&mut again), &mut |_| {}).unwrap();
    assert!(again.asked > 10 && report.frames > 40, "{report:?}");
    assert_eq!(answers(&*storage, "smooth"), again.asked);
}
