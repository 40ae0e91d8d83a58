//! Laws of repair: what it may touch, what it must fill, and that takes replay whatever answered.

#![allow(clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_fusion::{
    Config, Engine, Input, Needs, OcclusionModel, Output, RepairAnswer, RepairModel, RepairRequest,
    SimpleModel,
};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Joint, JointState, Provenance, Room, RoomFrame, Timestamp, TrackId};
use support::{Outcome, START_NS, drain, drive, inputs, scenario_seconds};

/// Both, for a tracker may take left for right.
const LEGS: [Joint; 6] = [
    Joint::KneeLeft,
    Joint::AnkleLeft,
    Joint::FootLeft,
    Joint::KneeRight,
    Joint::AnkleRight,
    Joint::FootRight,
];
/// They are hidden then, seconds.
const GAP_S: (f64, f64) = (3.0, 4.5);
const LENGTH_S: f64 = 6.0;

fn world() -> Arc<World> {
    let scenario = Scenario {
        seed: 5,
        ..Scenario::default()
    };
    Arc::new(World::new(&scenario).unwrap())
}

/// The simulated room, the legs hidden from every sensor during the gap.
fn hidden(world: &Arc<World>) -> Vec<(Timestamp, Input)> {
    let mut events = inputs(world, LENGTH_S);
    for (time, input) in &mut events {
        let at_s = scenario_seconds(*time);
        if let Input::Observation(observation) = input
            && (GAP_S.0..GAP_S.1).contains(&at_s)
        {
            for body in &mut observation.bodies {
                LEGS.into_iter()
                    .for_each(|joint| body.skeleton[joint] = None);
            }
        }
    }
    events
}

fn config(model: &str) -> Config {
    let mut config = Config::default();
    config.repair.model = model.into();
    config
}

fn fuse(config: Config, events: Vec<(Timestamp, Input)>) -> Vec<RoomFrame> {
    let mut outcome = Outcome::default();
    let mut engine = Engine::new(config);
    drive(&mut engine, events, &mut outcome);
    engine.finish();
    drain(&mut engine, &mut outcome);
    outcome.frames
}

type States = BTreeMap<(Timestamp, TrackId, Joint), JointState<Room>>;

fn states(frames: &[RoomFrame]) -> States {
    let mut states = BTreeMap::new();
    for frame in frames {
        for track in &frame.tracks {
            for (joint, state) in track.skeleton.iter() {
                states.insert((frame.time, track.id, joint), *state);
            }
        }
    }
    states
}

fn is_made_up(state: &JointState<Room>) -> bool {
    state.provenance == Provenance::Repaired
}

/// Mean distance of the hidden joints from the truth within the gap, metres, and how many were there.
fn error(world: &World, frames: &[RoomFrame]) -> (f64, usize) {
    let (mut sum, mut count) = (0.0, 0);
    for frame in frames {
        let at_s = scenario_seconds(frame.time);
        // The first sensor to lack the joints is not the last to have had them.
        if !(GAP_S.0 + 0.1..GAP_S.1 - 0.1).contains(&at_s) {
            continue;
        }
        let truth = world.truth(at_s);
        for track in &frame.tracks {
            for joint in LEGS {
                if let Some(state) = &track.skeleton[joint] {
                    sum += state.position.distance(truth[0].joints[joint].unwrap());
                    count += 1;
                }
            }
        }
    }
    (sum / count.max(1) as f64, count)
}

#[test]
fn hidden_legs_are_filled_in_and_what_was_measured_is_the_same_bits() {
    let world = world();
    let without = fuse(config("none"), hidden(&world));
    let with = fuse(config("gaussian"), hidden(&world));
    assert_eq!(without.len(), with.len());
    let after = states(&with);
    let (mut kept, mut unseen) = (0, BTreeMap::new());
    for frame in &without {
        for track in &frame.tracks {
            for joint in Joint::ALL {
                let measured = track.skeleton[joint]
                    .filter(|state| matches!(state.provenance, Provenance::Measured(_)));
                let Some(state) = measured else {
                    unseen.insert((track.id, joint), frame.time);
                    continue;
                };
                let found = &after[&(frame.time, track.id, joint)];
                if is_made_up(found) {
                    // Coming back from where it was made up to be.
                    let since_s = unseen
                        .get(&(track.id, joint))
                        .map_or(f64::INFINITY, |unseen| frame.time.since_seconds(*unseen));
                    assert!(
                        since_s < 0.8,
                        "{joint} touched {since_s} s after it was back"
                    );
                } else {
                    assert!(
                        *found == state,
                        "{joint} at {}",
                        scenario_seconds(frame.time)
                    );
                    kept += 1;
                }
            }
        }
    }
    assert!(kept > 2000, "{kept}");
    let (error_m, filled) = error(&world, &with);
    let (_, shown) = error(&world, &without);
    assert!(filled as f64 > 2.2 * shown as f64, "{filled} after {shown}");
    assert!(error_m < 0.25, "{error_m}");
    assert!(after.values().filter(|state| is_made_up(state)).count() > 80);
}

#[test]
fn better_models_come_nearer() {
    let world = world();
    let of = |model: &str| error(&world, &fuse(config(model), hidden(&world))).0;
    let (hold, gaussian) = (of("hold"), of("gaussian"));
    assert!(gaussian < 0.8 * hold, "{gaussian} against {hold}");
    let mut engine = Engine::new(config("auto"));
    engine.smooth_over(90);
    assert_eq!(engine.repair_model().as_deref(), Some("gaussian-two-sided"));
    let mut outcome = Outcome::default();
    drive(&mut engine, hidden(&world), &mut outcome);
    engine.finish();
    drain(&mut engine, &mut outcome);
    assert_eq!(
        outcome.frames.len(),
        fuse(config("none"), hidden(&world)).len()
    );
    let numbers: Vec<u64> = outcome.frames.iter().map(|frame| frame.number).collect();
    assert!(numbers.iter().copied().eq(1..=numbers.len() as u64));
    let (both_ways, _) = error(&world, &outcome.frames);
    // Nobody recorded moves like the simulated, and the gap is long: little is to be won.
    assert!(both_ways < gaussian, "{both_ways} against {gaussian}");
}

#[test]
fn nothing_jumps_where_legs_go_and_come_back() {
    let world = world();
    let with = fuse(config("gaussian"), hidden(&world));
    let fastest = |frames: &[RoomFrame], from_s: f64, to_s: f64| {
        let mut fastest = 0.0_f64;
        for pair in frames.windows(2) {
            let at_s = scenario_seconds(pair[1].time);
            let elapsed_s = pair[1].time.since_seconds(pair[0].time);
            let (Some(a), Some(b)) = (pair[0].tracks.first(), pair[1].tracks.first()) else {
                continue;
            };
            if !(from_s..to_s).contains(&at_s) {
                continue;
            }
            for joint in LEGS {
                let place = |track: &posefuse_skeleton::Track| track.skeleton.position(joint);
                if let (Some(a), Some(b)) = (place(a), place(b)) {
                    fastest = fastest.max(a.distance(b) / elapsed_s);
                }
            }
        }
        fastest
    };
    let usual = fastest(&with, 1.0, GAP_S.0);
    let seams = fastest(&with, GAP_S.0, GAP_S.1 + 0.6);
    // 2 m/s are 6 cm in a frame, on top of how fast the leg moves anyway.
    assert!(seams < usual + 2.0, "{seams} m/s, else {usual} m/s");
}

#[test]
fn a_joint_is_made_up_for_as_long_as_configured() {
    let world = world();
    let mut config = config("gaussian");
    config.repair.max_s = 0.6;
    let frames = fuse(config, hidden(&world));
    let there = |from_s: f64, to_s: f64| {
        let mut frames = frames
            .iter()
            .filter(|frame| (from_s..to_s).contains(&scenario_seconds(frame.time)));
        frames.all(|frame| frame.tracks[0].skeleton[Joint::AnkleLeft].is_some())
    };
    assert!(there(GAP_S.0, GAP_S.0 + 0.5));
    assert!(!there(GAP_S.0 + 0.8, GAP_S.0 + 1.0));
    assert!(there(GAP_S.1 + 0.2, LENGTH_S - 0.5));
}

/// What a driver does with requests.
enum Answers {
    At,
    Never,
    Wrong,
}

struct Run {
    frames: Vec<RoomFrame>,
    inputs: Vec<Input>,
    engine: Engine,
    requests: u64,
    most_waiting: u64,
}

/// A model outside that answers as `answers` say; every input is kept, as a take would.
fn outside(events: Vec<(Timestamp, Input)>, answers: &Answers) -> Run {
    let model = RepairModel {
        name: "outside".into(),
        needs: SimpleModel::Damped.needs(),
    };
    let mut run = Run {
        frames: Vec::new(),
        inputs: Vec::new(),
        engine: Engine::new(config("auto")),
        requests: 0,
        most_waiting: 0,
    };
    let mut deadline = run.give(Input::RepairModel(Some(model)), answers);
    for (time, input) in events {
        while let Some(due) = deadline.filter(|due| *due < time) {
            deadline = run.give(Input::Tick(due), answers);
        }
        deadline = run.give(input, answers);
    }
    // The second time, what was asked the first time is not waited for any more.
    for _ in 0..2 {
        run.engine.finish();
        run.take(answers);
    }
    run
}

impl Run {
    fn give(&mut self, input: Input, answers: &Answers) -> Option<Timestamp> {
        self.inputs.push(input.clone());
        self.engine.handle(input);
        self.take(answers)
    }

    fn take(&mut self, answers: &Answers) -> Option<Timestamp> {
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => self.frames.push(frame),
                Output::Rejected(_) => {}
                Output::Repair(request) => {
                    self.requests += 1;
                    let counts = self.engine.repair_counts();
                    let open = counts.asked - counts.answered - counts.late - counts.failed;
                    self.most_waiting = self.most_waiting.max(open);
                    if let Some(answer) = answer(&request, answers) {
                        self.give(Input::Repaired(Box::new(answer)), answers);
                    }
                }
                Output::WakeAt(deadline) => return deadline,
            }
        }
    }
}

fn answer(request: &RepairRequest, answers: &Answers) -> Option<RepairAnswer> {
    assert_eq!(
        request.window.poses.len(),
        SimpleModel::Damped.needs().poses()
    );
    match answers {
        Answers::At => {
            let fills = SimpleModel::Damped.fill(&request.window, request.wanted.clone());
            Some(request.answer(fills.unwrap()))
        }
        Answers::Never => None,
        Answers::Wrong => Some(request.answer(Vec::new())),
    }
}

#[test]
fn a_model_outside_answers_and_the_take_replays_without_it() {
    let world = world();
    let live = outside(hidden(&world), &Answers::At);
    let counts = live.engine.repair_counts();
    assert!(
        live.requests > 40 && counts.asked == live.requests,
        "{counts:?}"
    );
    assert_eq!(
        (counts.answered, counts.late, counts.failed),
        (live.requests, 0, 0)
    );
    assert_eq!(live.engine.repair_model().as_deref(), Some("outside"));
    let mut replay = Engine::new(config("auto"));
    let mut outcome = Outcome::default();
    for input in &live.inputs {
        replay.handle(input.clone());
        drain(&mut replay, &mut outcome);
    }
    for _ in 0..2 {
        replay.finish();
        drain(&mut replay, &mut outcome);
    }
    assert!(outcome.frames == live.frames);
    let inside = fuse(config("damped"), hidden(&world));
    let (a, b) = (error(&world, &live.frames).0, error(&world, &inside).0);
    assert!((a - b).abs() < 0.01, "{a} against {b}");
}

#[test]
fn past_the_deadline_the_simple_model_answers_and_it_is_counted() {
    let world = world();
    let inside = fuse(config("gaussian"), hidden(&world));
    let silent = outside(hidden(&world), &Answers::Never);
    let counts = silent.engine.repair_counts();
    assert!(counts.late > 40 && counts.answered == 0, "{counts:?}");
    assert!(silent.most_waiting <= 33, "{}", silent.most_waiting);
    assert_eq!(silent.frames.len(), inside.len());
    for (a, b) in silent.frames.iter().zip(&inside) {
        let same = (a.number, a.time) == (b.number, b.time) && a.tracks == b.tracks;
        assert!(same, "frame {} at {}", a.number, scenario_seconds(a.time));
    }
    let failing = outside(hidden(&world), &Answers::Wrong);
    let counts = failing.engine.repair_counts();
    assert_eq!((counts.failed, counts.late), (failing.requests, 0));
    assert!(failing.frames == inside);
}

#[test]
fn late_and_unknown_answers_are_ignored_and_counted() {
    let world = world();
    let mut silent = outside(hidden(&world), &Answers::Never);
    let before = silent.engine.repair_counts();
    let frames = silent.frames.len();
    let stray = RepairAnswer {
        number: 1,
        received: Timestamp::from_ns(START_NS),
        fills: Vec::new(),
    };
    silent.give(Input::Repaired(Box::new(stray)), &Answers::Never);
    let after = silent.engine.repair_counts();
    assert_eq!(after.unknown, before.unknown + 1);
    assert_eq!(silent.frames.len(), frames);
}

#[test]
fn a_snapshot_within_a_gap_goes_on_with_the_same_bits() {
    let world = world();
    for model in ["gaussian", "gaussian-two-sided"] {
        let events = hidden(&world);
        let middle = START_NS + ((GAP_S.0 + 0.7) * 1e9) as i64;
        let split = events.iter().position(|(t, _)| t.ns() > middle).unwrap();
        let mut engine = Engine::new(config(model));
        let mut outcome = Outcome::default();
        drive(&mut engine, events[..split].to_vec(), &mut outcome);
        let state = engine.state().unwrap();
        let mut restored = Engine::restore(config(model), &state).unwrap();
        let (mut first, mut second) = (Outcome::default(), Outcome::default());
        drive(&mut engine, events[split..].to_vec(), &mut first);
        drive(&mut restored, events[split..].to_vec(), &mut second);
        assert!(first.frames.len() > 30);
        assert!(first.frames == second.frames);
    }
}

#[test]
fn a_model_that_wants_too_much_counts_as_none() {
    let mut engine = Engine::new(config("auto"));
    for rate_hz in [f64::NAN, 0.0, 1e9] {
        let needs = Needs {
            before: 10,
            after: 0,
            rate_hz,
        };
        let name = "greedy".to_owned();
        engine.handle(Input::RepairModel(Some(RepairModel { name, needs })));
        assert_eq!(engine.repair_model().as_deref(), Some("gaussian"));
    }
}
