//! Laws of the whole engine: order, place, duplicates, replay, configurations.

#![allow(clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use posefuse_fusion::{
    BUILD, Config, Engine, FuseMethod, Input, IntakeMode, RepairConfig, SmoothConfig, SmoothFilter,
    SnapshotError, Stage,
};
use posefuse_simulator::{Scenario, SensorErrors, World};
use posefuse_skeleton::{
    AgentTime, Calibration, Joint, RoomFrame, SensorId, SensorInfo, Timestamp, Track, Transform,
};
use support::{Outcome, drain, drive, id, inputs, run, score};

fn scenario() -> Scenario {
    Scenario {
        seed: 11,
        people: 2,
        ..Scenario::default()
    }
}

fn world(scenario: &Scenario) -> Arc<World> {
    Arc::new(World::new(scenario).unwrap())
}

fn fuse(events: impl IntoIterator<Item = (Timestamp, Input)>, config: &Config) -> Outcome {
    let mut outcome = Outcome::default();
    drive(&mut Engine::new(config.clone()), events, &mut outcome);
    outcome
}

/// Largest distance of any joint between two runs, which must have the same frames, people and joints.
fn largest_difference(
    a: &[RoomFrame],
    b: &[RoomFrame],
    map: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> f64 {
    assert_eq!(a.len(), b.len());
    assert!(
        a.iter().map(|f| f.tracks.len()).sum::<usize>() > 100,
        "nothing was compared"
    );
    let mut largest = 0.0_f64;
    let mut names = BTreeMap::new();
    for (a, b) in a.iter().zip(b) {
        assert_eq!(a.time, b.time);
        assert_eq!(a.tracks.len(), b.tracks.len(), "at {:?}", a.time);
        for a in &a.tracks {
            let a_at = map(a.skeleton.centre().unwrap().vector());
            let off = |t: &&Track| (t.skeleton.centre().unwrap().vector() - a_at).norm();
            let b = b
                .tracks
                .iter()
                .min_by(|s, t| off(s).total_cmp(&off(t)))
                .unwrap();
            let ids = names.entry(a.id).or_insert(b.id);
            assert_eq!(
                *ids, b.id,
                "ids may differ between runs, but each stays one person's"
            );
            for joint in Joint::ALL {
                match (a.skeleton.position(joint), b.skeleton.position(joint)) {
                    (Some(a), Some(b)) => {
                        largest = largest.max((map(a.vector()) - b.vector()).norm())
                    }
                    (a, b) => assert_eq!(a.is_none(), b.is_none(), "{joint}"),
                }
            }
        }
    }
    largest
}

/// Frames of all sensors at the same instants and received at once, in the given order of sensors.
fn in_step(world: &Arc<World>, order: &[usize]) -> Vec<(Timestamp, Input)> {
    let mut events: Vec<(Timestamp, Input)> = Vec::new();
    for (time, mut input) in inputs(world, 4.0) {
        if let Input::Observation(observation) = &mut input {
            // 30 Hz ticks common to all; the world is noisy, so what each sees stays its own.
            let tick = observation.sequence as i64 * 33_333_333;
            let sensor = observation.sensor.index();
            observation.captured = world.sensor_clock(sensor).shows(tick);
            observation.received = Timestamp::from_ns(support::START_NS + tick + 20_000_000);
            // Frames are made at once until every sensor is known, and a filter remembers that.
            if tick < 300_000_000 {
                observation.bodies.clear();
            }
            events.push((observation.received, input));
        } else {
            events.push((time, input));
        }
    }
    let rank = |input: &Input| match input {
        Input::Observation(o) => order.iter().position(|i| *i == o.sensor.index()).unwrap(),
        _ => 0,
    };
    events.sort_by_key(|(time, input)| (*time, rank(input)));
    events
}

#[test]
fn the_order_of_sensors_in_one_instant_does_not_matter() {
    let world = world(&Scenario {
        errors: SensorErrors {
            clock_jitter_ms: 0.0,
            clock_offset_ms: 0.0,
            clock_drift_ppm: 0.0,
            swaps: 0.0,
            drops: 0.0,
            ..SensorErrors::default()
        },
        ..scenario()
    });
    for mode in [IntakeMode::Async, IntakeMode::Window] {
        let mut config = Config::default();
        config.intake.mode = mode;
        // Exactly equal capture times need an exact clock.
        let settle = |frames: Vec<RoomFrame>| -> Vec<RoomFrame> {
            frames
                .into_iter()
                .filter(|f| support::scenario_seconds(f.time) > 0.5)
                .collect()
        };
        let exact = |order: &[usize]| {
            let events = in_step(&world, order).into_iter().map(|(time, mut input)| {
                if let Input::ClockSample(s) = &mut input {
                    s.agent_received =
                        AgentTime::from_ns(s.sent.ns() - support::START_NS + 500_000);
                    s.agent_sent = s.agent_received;
                    s.returned = s.sent.plus_ns(1_000_000);
                }
                (time, input)
            });
            settle(fuse(events, &config).frames)
        };
        let one = exact(&[0, 1, 2, 3]);
        let other = exact(&[3, 1, 0, 2]);
        let difference = largest_difference(&one, &other, |p| p);
        assert!(difference < 1e-9, "{mode:?}: {difference} m");
    }
}

#[test]
fn moving_the_room_moves_the_result() {
    let world = world(&scenario());
    let moved = Isometry3::new(Vector3::new(4.0, -7.0, 0.3), Vector3::z() * 2.2);
    let move_room = |calibration: &Calibration| {
        let mut calibration = calibration.clone();
        for pose in calibration.sensors.values_mut() {
            pose.room_from_sensor =
                Transform::from_isometry(moved * pose.room_from_sensor.isometry());
        }
        calibration
    };
    let events = || inputs(&world, 6.0);
    let there = events().into_iter().map(|(time, input)| match input {
        Input::Calibration(c) => (time, Input::Calibration(Arc::new(move_room(&c)))),
        other => (time, other),
    });
    for filter in [
        SmoothFilter::SavitzkyGolay,
        SmoothFilter::OneEuro,
        SmoothFilter::Holt,
    ] {
        let config = with_filter(filter);
        let here = fuse(events(), &config);
        let there = fuse(there.clone(), &config);
        let difference = largest_difference(&here.frames, &there.frames, |p| {
            moved.transform_point(&p.into()).coords
        });
        assert!(difference < 1e-8, "{filter:?}: {difference} m");
    }
}

fn with_filter(filter: SmoothFilter) -> Config {
    let mut config = Config::default();
    config.stages[2] = Stage::Smooth(SmoothConfig {
        filter,
        ..SmoothConfig::default()
    });
    config
}

#[test]
fn exact_duplicates_of_all_sensors_change_only_the_covariance() {
    let world = world(&scenario());
    let twin = |sensor: SensorId| id(sensor.index() + 4);
    let doubled = || {
        let mut events = Vec::new();
        for (time, input) in inputs(&world, 5.0) {
            let copy = match &input {
                Input::Sensor(info) => Some(Input::Sensor(SensorInfo {
                    id: twin(info.id),
                    name: format!("{}-twin", info.name),
                    ..info.clone()
                })),
                Input::Observation(o) => {
                    let mut o = o.clone();
                    o.sensor = twin(o.sensor);
                    Some(Input::Observation(o))
                }
                Input::ClockSample(s) => Some(Input::ClockSample(posefuse_fusion::ClockSample {
                    sensor: twin(s.sensor),
                    ..*s
                })),
                Input::Calibration(_)
                | Input::Mute { .. }
                | Input::RepairModel(_)
                | Input::Repaired(_)
                | Input::Tick(_) => None,
            };
            let input = match input {
                Input::Calibration(c) => {
                    let mut c = (*c).clone();
                    let twins: Vec<_> = c
                        .sensors
                        .iter()
                        .map(|(name, pose)| (format!("{name}-twin"), pose.clone()))
                        .collect();
                    c.sensors.extend(twins);
                    Input::Calibration(Arc::new(c))
                }
                other => other,
            };
            events.push((time, input));
            events.extend(copy.map(|copy| (time, copy)));
        }
        events
    };
    for method in [FuseMethod::Average, FuseMethod::Weighted] {
        let mut config = Config::default();
        config.fuse.method = method;
        // The grid makes both runs fuse at the same times; bones and repair weigh by covariance, which does change.
        config.intake.mode = IntakeMode::Window;
        config.stages[1].set_enabled(false);
        config.repair = RepairConfig::off();
        let single = fuse(inputs(&world, 5.0), &config).frames;
        let double = fuse(doubled(), &config).frames;
        let late = |frames: Vec<RoomFrame>| -> Vec<RoomFrame> {
            frames
                .into_iter()
                .filter(|f| support::scenario_seconds(f.time) > 1.0)
                .collect()
        };
        let (single, double) = (late(single), late(double));
        let difference = largest_difference(&single, &double, |p| p);
        assert!(difference < 1e-9, "{method:?}: {difference} m");
        let trace = |f: &RoomFrame| {
            f.tracks[0].skeleton[Joint::SpineBase]
                .as_ref()
                .unwrap()
                .covariance
                .trace()
        };
        assert!(trace(&double[50]) < 0.6 * trace(&single[50]));
    }
}

#[test]
fn a_stream_that_comes_twice_counts_once() {
    let world = world(&Scenario {
        errors: SensorErrors {
            swaps: 0.0,
            ..SensorErrors::default()
        },
        ..scenario()
    });
    let twin = id(4);
    let mut events = Vec::new();
    for (time, input) in inputs(&world, 5.0) {
        let copy = match &input {
            Input::Sensor(info) if info.id == id(1) => Some(Input::Sensor(SensorInfo {
                id: twin,
                name: "twin".into(),
                ..info.clone()
            })),
            Input::Observation(o) if o.sensor == id(1) => {
                let mut o = o.clone();
                o.sensor = twin;
                Some(Input::Observation(o))
            }
            Input::ClockSample(s) if s.sensor == id(1) => {
                Some(Input::ClockSample(posefuse_fusion::ClockSample {
                    sensor: twin,
                    ..*s
                }))
            }
            _ => None,
        };
        let input = match input {
            Input::Calibration(c) => {
                let mut c = (*c).clone();
                let pose = c.sensors[world.sensor_name(1)].clone();
                c.sensors.insert("twin".into(), pose);
                Input::Calibration(Arc::new(c))
            }
            other => other,
        };
        events.push((time, input));
        events.extend(copy.map(|copy| (time, copy)));
    }
    let mut config = Config::default();
    // The grid makes both runs fuse at the same times; who is left and who is right is put to the vote.
    config.intake.mode = IntakeMode::Window;
    config.fuse.swaps = false;
    let single = fuse(inputs(&world, 5.0), &config).frames;
    let double = fuse(events, &config).frames;
    let difference = largest_difference(&single, &double, |p| p);
    assert!(difference < 1e-9, "{difference} m");
}

#[test]
fn equal_inputs_give_equal_bits_and_a_restored_engine_goes_on_as_if_nothing_had_happened() {
    let world = world(&Scenario {
        errors: SensorErrors::harsh(),
        ..scenario()
    });
    for mode in [IntakeMode::Async, IntakeMode::Window] {
        let mut config = Config::default();
        config.intake.mode = mode;
        let whole = fuse(inputs(&world, 5.0), &config);
        assert_eq!(whole.frames, fuse(inputs(&world, 5.0), &config).frames);

        let mut events = inputs(&world, 5.0);
        let rest = events.split_off(events.len() / 2);
        let mut outcome = Outcome::default();
        let mut engine = Engine::new(config.clone());
        drive(&mut engine, events, &mut outcome);
        let snapshot = engine.state().unwrap();
        let mut restored = Engine::restore(config.clone(), &snapshot).unwrap();
        assert_eq!(restored.state().unwrap(), snapshot);
        drop(engine);
        drive(&mut restored, rest, &mut outcome);
        assert_eq!(outcome.frames, whole.frames);
        assert_eq!(outcome.rejections, whole.rejections);

        let mut other = config.clone();
        other.fuse.swaps = false;
        assert!(
            Engine::restore(other, &snapshot)
                .unwrap_err()
                .to_string()
                .contains("another configuration")
        );
    }
}

#[test]
fn a_snapshot_of_other_code_is_refused() {
    let mut snapshot = Engine::new(Config::default()).state().unwrap();
    let build = BUILD.as_bytes();
    let at = snapshot
        .windows(build.len())
        .position(|bytes| bytes == build);
    // The fingerprint's last digit.
    let digit = &mut snapshot[at.unwrap() + build.len() - 2];
    *digit = if *digit == b'0' { b'1' } else { b'0' };
    let error = Engine::restore(Config::default(), &snapshot).unwrap_err();
    assert!(matches!(error, SnapshotError::OtherBuild(_)), "{error}");
    assert!(error.to_string().contains(BUILD), "{error}");
}

#[test]
fn the_preamble_lets_a_cold_engine_begin_at_once() {
    let world = world(&scenario());
    let config = Config::default();
    let mut events = inputs(&world, 20.0);
    let rest = events.split_off(events.len() * 3 / 4);
    let mut engine = Engine::new(config.clone());
    let mut before = Outcome::default();
    drive(&mut engine, events, &mut before);

    let mut cold = Engine::new(config);
    let mut outcome = Outcome::default();
    engine
        .preamble()
        .into_iter()
        .for_each(|input| cold.handle(input));
    drain(&mut cold, &mut outcome);
    let now = AgentTime::from_ns(15_000_000_000);
    let (warm, again) = (
        engine.map_time(id(1), now).unwrap(),
        cold.map_time(id(1), now).unwrap(),
    );
    assert!(again.since_ns(warm).abs() < 1000, "{warm:?} {again:?}");
    let first = rest.iter().map(|(time, _)| *time).min().unwrap();
    drive(&mut cold, rest, &mut outcome);
    let peopled = outcome
        .frames
        .iter()
        .find(|f| f.tracks.len() == 2)
        .expect("nobody was seen");
    assert!(
        peopled.time.since_seconds(first) < 0.3,
        "{:?}",
        peopled.time
    );
    assert!(
        outcome
            .rejections
            .iter()
            .all(|r| r.reason.name() != "clock-unknown")
    );
}

#[test]
fn every_combination_of_stages_runs_and_each_filter_in_each_mode() {
    let scenario = Scenario {
        people: 1,
        ..scenario()
    };
    for mode in [IntakeMode::Async, IntakeMode::Window] {
        for filter in [
            SmoothFilter::SavitzkyGolay,
            SmoothFilter::OneEuro,
            SmoothFilter::Holt,
        ] {
            for on in 0..8_u32 {
                let mut config = with_filter(filter);
                config.intake.mode = mode;
                for (bit, stage) in config.stages.iter_mut().enumerate() {
                    stage.set_enabled(on & (1 << bit) != 0);
                }
                config.validate().unwrap();
                let (world, outcome) = run(&scenario, &config, 3.0);
                let score = score(&world, &outcome.frames, 1.0);
                assert!(score.frames > 50, "{mode:?} {filter:?} {on:03b}: {score:?}");
                assert!(
                    score.missed == 0.0 && score.mpjpe_m < 0.08,
                    "{mode:?} {filter:?} {on:03b}: {score:?}"
                );
                let smooth = on & 4 != 0 && filter == SmoothFilter::SavitzkyGolay;
                let expected = 1 + usize::from(smooth);
                assert_eq!(config.look_ahead_frames(), expected);
                let ahead = outcome.frames[40].look_ahead_ns;
                assert_eq!(ahead > 0, expected > 0, "{ahead} ns");
            }
        }
    }
}
