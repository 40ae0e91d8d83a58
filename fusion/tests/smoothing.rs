//! Frames that wait are smoothed by what came after them: a little live, by everything offline.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input, Needs, RepairConfig, RepairModel};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Joint, RoomFrame, Timestamp};
use support::{Outcome, drain, drive, inputs, score};

/// What repair may remember of one person and of frames that wait two seconds, bytes.
const MOST_REPAIR: usize = 400_000;

type Events = Vec<(Timestamp, Input)>;

fn room(seconds: f64) -> (Arc<World>, Events) {
    let world = Arc::new(World::new(&Scenario::default()).unwrap());
    let events = inputs(&world, seconds);
    (world, events)
}

/// What comes before the stages, which look at one frame after another, and repair, which looks at other poses.
fn bare() -> Config {
    let mut config = Config {
        repair: RepairConfig::off(),
        ..Config::default()
    };
    for stage in &mut config.stages[1..] {
        stage.set_enabled(false);
    }
    config
}

fn live(events: &Events, look_ahead: usize) -> Vec<RoomFrame> {
    let mut config = bare();
    config.fuse.look_ahead = look_ahead;
    let mut outcome = Outcome::default();
    drive(
        &mut Engine::new(config),
        events.iter().cloned(),
        &mut outcome,
    );
    outcome.frames
}

fn offline(events: &Events, config: Config, frames: usize) -> Vec<RoomFrame> {
    let mut engine = Engine::new(config);
    engine.smooth_over(frames);
    let mut outcome = Outcome::default();
    drive(&mut engine, events.iter().cloned(), &mut outcome);
    engine.finish();
    drain(&mut engine, &mut outcome);
    outcome.frames
}

/// RMS distance of the joints in `frames` to those of the frames in `all` of the same times, m, after two seconds and up to
/// two before the end.
fn off_m(frames: &[RoomFrame], all: &[RoomFrame]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let end = all.last().unwrap().time.plus_ns(-2_000_000_000);
    for frame in frames {
        if support::scenario_seconds(frame.time) < 2.0 || frame.time > end {
            continue;
        }
        let other = all.binary_search_by_key(&frame.time, |f| f.time).unwrap();
        let (tracks, others) = (&frame.tracks, &all[other].tracks);
        assert_eq!(tracks.len(), others.len());
        for (track, other) in tracks.iter().zip(others) {
            for joint in Joint::ALL {
                let places = [track, other].map(|track| track.skeleton.position(joint));
                if let [Some(a), Some(b)] = places {
                    sum += (a.vector() - b.vector()).norm_squared();
                    count += 1.0;
                }
            }
        }
    }
    assert!(count > 500.0, "{count} joints were compared");
    f64::sqrt(sum / count)
}

#[test]
fn looking_further_ahead_comes_ever_nearer_to_offline() {
    let (world, events) = room(9.0);
    let all = offline(&events, bare(), 1000);
    let off: Vec<f64> = [0, 1, 3, 8, 20]
        .map(|look_ahead| off_m(&live(&events, look_ahead), &all))
        .to_vec();
    println!("RMS to all of it, m: {off:?}");
    assert!(off.windows(2).all(|w| w[1] < w[0]), "{off:?}");
    assert!(off[0] > 0.003 && off[4] < 0.1 * off[0], "{off:?}");
    // Blocks are as good as everything at once.
    let blocks = offline(&events, bare(), 90);
    assert_eq!(blocks.len(), all.len());
    let lacking = off_m(&blocks, &all);
    assert!(lacking < 1e-4, "{lacking} m");

    let now = score(&world, &live(&events, 0), 2.0);
    let later = score(&world, &all, 2.0);
    println!("{now:?}\n{later:?}");
    assert!(later.mpjpe_m < now.mpjpe_m, "{later:?} {now:?}");
    assert!(
        later.jitter_mps2 < 0.7 * now.jitter_mps2,
        "{later:?} {now:?}"
    );
}

/// The most bytes of state while `engine` has the first half of `events`, and the second; asked now and then.
fn most_state(engine: &mut Engine, events: &Events, outcome: &mut Outcome) -> [usize; 2] {
    let (mut deadline, mut most) = (None, [0, 0]);
    for (number, (time, input)) in events.iter().enumerate() {
        while let Some(due) = deadline.filter(|due| due < time) {
            engine.handle(Input::Tick(due));
            deadline = drain(engine, outcome);
        }
        engine.handle(input.clone());
        deadline = drain(engine, outcome);
        if number % 8 == 0 {
            let half = &mut most[usize::from(number >= events.len() / 2)];
            *half = engine.state().unwrap().len().max(*half);
        }
    }
    println!("most bytes of state in each half: {most:?}");
    most
}

#[test]
fn smoothing_a_take_gives_every_frame_once_and_remembers_no_more_than_its_blocks() {
    let (_, events) = room(14.0);
    let frames = 30;
    let mut engine = Engine::new(bare());
    engine.smooth_over(frames);
    let mut outcome = Outcome::default();
    let [early, late] = most_state(&mut engine, &events, &mut outcome);
    assert!(late < early + early / 10, "{early} {late}");
    // What `Engine::smooth_over` promises: some 50 kB per frame and person.
    assert!(late < frames * 60_000, "{late}");

    let waiting = outcome.frames.len();
    engine.finish();
    drain(&mut engine, &mut outcome);
    assert!((frames..=2 * frames).contains(&(outcome.frames.len() - waiting)));
    let times = |frames: &[RoomFrame]| frames.iter().map(|f| f.time).collect::<Vec<_>>();
    let numbers = outcome.frames.iter().map(|f| f.number);
    assert!(numbers.eq(1..=outcome.frames.len() as u64));
    let mut config = Config::default();
    config.fuse.look_ahead = 0;
    let mut live = Outcome::default();
    drive(&mut Engine::new(config), events.iter().cloned(), &mut live);
    assert_eq!(times(&outcome.frames), times(&live.frames));
}

/// Repair remembers the poses that windows reach back to, and frames that wait for later ones or for an answer: a few
/// seconds of each person, however long the take, whatever answers.
#[test]
fn with_repair_an_engine_remembers_no_more_than_its_windows() {
    let (_, events) = room(14.0);
    let plain = Config {
        repair: RepairConfig::off(),
        ..Config::default()
    };
    for (offline, after) in [(false, 0), (true, 63)] {
        let [_, without] = remembered(&events, plain.clone(), offline, None);
        let silent = RepairModel {
            name: "silent".to_owned(),
            needs: Needs {
                before: 63,
                after,
                rate_hz: 30.0,
            },
        };
        for outside in [None, Some(silent)] {
            let what = (offline, outside.is_some());
            let [early, late] = remembered(&events, Config::default(), offline, outside);
            assert!(late < early + early / 10, "{what:?}: {early} {late}");
            assert!(late < without + MOST_REPAIR, "{what:?}: {late} {without}");
        }
    }
}

/// [`most_state`] of an engine with this configuration, that smooths or that has a model outside which says nothing.
fn remembered(
    events: &Events,
    config: Config,
    offline: bool,
    outside: Option<RepairModel>,
) -> [usize; 2] {
    let mut engine = Engine::new(config);
    if offline {
        engine.smooth_over(30);
    }
    if outside.is_some() {
        engine.handle(Input::RepairModel(outside));
    }
    most_state(&mut engine, events, &mut Outcome::default())
}

#[test]
fn what_came_later_makes_every_place_more_certain_however_long_the_way_back() {
    let (_, events) = room(40.0);
    let live = live(&events, 0);
    for frames in [90, 1200] {
        let smooth = offline(&events, bare(), frames);
        let mut compared = 0;
        for frame in &smooth {
            let Ok(other) = live.binary_search_by_key(&frame.time, |f| f.time) else {
                continue;
            };
            for (track, other) in frame.tracks.iter().zip(&live[other].tracks) {
                for (joint, state) in track.skeleton.iter() {
                    let Some(filtered) = &other.skeleton[joint] else {
                        continue;
                    };
                    let (after, before) = (state.covariance.trace(), filtered.covariance.trace());
                    assert!(
                        after > 0.0 && after <= before * 1.01,
                        "{joint:?} at {} s: {after} of {before}, over {frames} frames",
                        support::scenario_seconds(frame.time)
                    );
                    compared += 1;
                }
            }
        }
        assert!(compared > 10_000, "{compared}");
    }
}
