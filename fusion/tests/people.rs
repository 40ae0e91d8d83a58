//! People and faults on the simulator, which knows the truth.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{ClockSample, Config, Engine, FuseMethod, Input, RejectionReason};
use posefuse_simulator::{Scenario, SensorErrors, World};
use posefuse_skeleton::{Joint, Provenance, RoomFrame, Timestamp};
use support::{Outcome, START_NS, drain, drive, id, inputs, run, scenario_seconds, score};

#[test]
fn people_who_cross_keep_their_ids() {
    for seed in 1..=6 {
        for people in [2, 3] {
            let scenario = Scenario {
                seed,
                people,
                ..Scenario::default()
            };
            let (world, outcome) = run(&scenario, &Config::default(), 20.0);
            // Who stands still at the start, seen by one sensor and missed by two, is shown once they move.
            let score = score(&world, &outcome.frames, 3.0);
            assert_eq!(
                score.id_switches, 0,
                "seed {seed}, {people} people: {score:?}"
            );
            assert!(
                score.missed < 0.01,
                "seed {seed}, {people} people: {score:?}"
            );
            assert!(
                score.extra <= score.frames / 100,
                "seed {seed}, {people} people: {score:?}"
            );
        }
    }
}

#[test]
fn handling_left_and_right_is_the_largest_gain() {
    for method in [FuseMethod::Average, FuseMethod::Weighted] {
        let error = |swaps: bool| {
            let mut config = Config::default();
            config.fuse.method = method;
            config.fuse.swaps = swaps;
            let error = |seed| {
                let scenario = Scenario {
                    seed,
                    ..Scenario::default()
                };
                let (world, outcome) = run(&scenario, &config, 15.0);
                score(&world, &outcome.frames, 1.0).mpjpe_m
            };
            (1..=4).map(error).sum::<f64>() / 4.0
        };
        let (with, without) = (error(true), error(false));
        assert!(with < 0.045, "{method:?}: {with} m");
        assert!(
            with < 0.5 * without,
            "{method:?}: {with} m with, {without} m without"
        );
    }
}

/// Largest change of any trunk joint's error from one frame to the next, metres: what is seen as a jump. Only
/// joints that at least two sensors measure: where one is left, its own errors are all there is.
fn largest_jump(world: &World, frames: &[RoomFrame], from_s: f64, to_s: f64) -> f64 {
    let trunk = [
        Joint::SpineBase,
        Joint::SpineShoulder,
        Joint::Head,
        Joint::HipLeft,
        Joint::HipRight,
    ];
    let within = frames
        .iter()
        .filter(|f| (from_s..to_s).contains(&scenario_seconds(f.time)));
    let errors = within.map(|frame| {
        let truth = &world.truth(scenario_seconds(frame.time))[0];
        trunk.map(|joint| {
            let found = frame.tracks.first()?.skeleton[joint].as_ref()?;
            let well_seen = matches!(found.provenance, Provenance::Measured(by) if by.len() >= 2);
            well_seen.then_some(())?;
            Some(found.position.vector() - truth.joints[joint]?.vector())
        })
    });
    let errors: Vec<_> = errors.collect();
    let steps = errors.windows(2).flat_map(|w| w[0].into_iter().zip(w[1]));
    steps
        .filter_map(|(a, b)| Some((b? - a?).norm()))
        .fold(0.0, f64::max)
}

#[test]
fn a_sensor_that_dies_leaves_no_jump_and_nobody_behind() {
    for seed in 1..=3 {
        let scenario = Scenario {
            seed,
            ..Scenario::default()
        };
        let world = Arc::new(World::new(&scenario).unwrap());
        let mut alive = Outcome::default();
        drive(
            &mut Engine::new(Config::default()),
            inputs(&world, 9.0),
            &mut alive,
        );
        let usual = largest_jump(&world, &alive.frames, 5.9, 6.4);
        for dead in 0..4 {
            let died = Timestamp::from_ns(START_NS + 6_000_000_000);
            let events = inputs(&world, 9.0).into_iter().filter(|(time, input)| {
                let of_dead = match input {
                    Input::Observation(o) => o.sensor == id(dead),
                    Input::ClockSample(s) => s.sensor == id(dead),
                    _ => false,
                };
                !(of_dead && *time > died)
            });
            let mut outcome = Outcome::default();
            drive(&mut Engine::new(Config::default()), events, &mut outcome);
            let handover = largest_jump(&world, &outcome.frames, 5.9, 6.4);
            assert!(
                handover < usual + 0.03,
                "seed {seed}, sensor {dead}: {handover} m, with it {usual} m"
            );
            let after = score(&world, &outcome.frames, 6.0);
            assert!(
                after.missed == 0.0 && after.id_switches == 0,
                "seed {seed}, sensor {dead}: {after:?}"
            );
            assert!(after.frames > 60);
        }
    }
}

#[test]
fn when_all_sensors_die_the_people_fade_and_the_engine_sleeps() {
    let world = Arc::new(World::new(&Scenario::default()).unwrap());
    let mut engine = Engine::new(Config::default());
    let mut outcome = Outcome::default();
    drive(&mut engine, inputs(&world, 3.0), &mut outcome);
    let alive = outcome.frames.len();
    let mut ticks = 0;
    while let Some(due) = drain(&mut engine, &mut outcome) {
        engine.handle(Input::Tick(due));
        ticks += 1;
        assert!(ticks < 100, "the engine never sleeps");
    }
    let after = &outcome.frames[alive..];
    let shown = after.iter().filter(|f| !f.tracks.is_empty()).count();
    assert!((8..=20).contains(&shown), "{shown} frames carried on");
    assert!(
        after.last().unwrap().tracks.is_empty(),
        "the last frame says that nobody is there"
    );
    assert!(
        outcome
            .frames
            .windows(2)
            .all(|w| w[0].time < w[1].time && w[0].number + 1 == w[1].number)
    );
}

#[test]
fn a_stepping_clock_is_held_back_and_in_step_again_without_a_false_stamp() {
    for step_s in [30.0, -30.0, -3600.0, 0.4, -0.4] {
        let world = Arc::new(World::new(&Scenario::default()).unwrap());
        let step_ns = (step_s * 1e9) as i64;
        let stepped_at = Timestamp::from_ns(START_NS + 5_000_000_000);
        let events = inputs(&world, 12.0).into_iter().map(|(time, mut input)| {
            match &mut input {
                Input::Observation(o) if o.sensor == id(0) && time >= stepped_at => {
                    o.captured = o.captured.plus_ns(step_ns);
                }
                Input::ClockSample(s) if s.sensor == id(0) && s.sent >= stepped_at => {
                    *s = ClockSample {
                        agent_received: s.agent_received.plus_ns(step_ns),
                        agent_sent: s.agent_sent.plus_ns(step_ns),
                        ..*s
                    };
                }
                _ => {}
            }
            (time, input)
        });
        let mut engine = Engine::new(Config::default());
        let mut outcome = Outcome::default();
        drive(&mut engine, events, &mut outcome);
        let held = |r: &&posefuse_fusion::Rejection| {
            r.sensor == id(0) && r.reason == RejectionReason::ClockStep && r.time >= stepped_at
        };
        let first = outcome
            .rejections
            .iter()
            .find(held)
            .expect("not detected")
            .time;
        let last = outcome.rejections.iter().rfind(held).unwrap().time;
        assert!(
            first.since_seconds(stepped_at) <= 1.0,
            "step {step_s} s: detected {first:?}"
        );
        assert!(
            last.since_seconds(stepped_at) <= 3.0,
            "step {step_s} s: held until {last:?}"
        );
        let used = outcome
            .frames
            .iter()
            .filter(|f| f.time > last.plus_ns(200_000_000));
        let with_it = used
            .filter(|f| f.tracks.iter().any(|t| t.sensors.contains(id(0))))
            .count();
        assert!(
            with_it > 30,
            "step {step_s} s: sensor back in {with_it} frames"
        );
        assert_eq!(engine.clock(id(0)).unwrap().steps, 1, "step {step_s} s");
        // Nothing stamped falsely: the others hold the person, and the error stays what it is.
        let during = score(&world, &outcome.frames, 5.0);
        assert!(
            during.mpjpe_m < 0.06 && during.missed == 0.0,
            "step {step_s} s: {during:?}"
        );
    }
}

#[test]
fn clocks_are_known_within_their_bounds() {
    let scenario = Scenario {
        seed: 5,
        ..Scenario::default()
    };
    let world = Arc::new(World::new(&scenario).unwrap());
    let mut engine = Engine::new(Config::default());
    let mut outcome = Outcome::default();
    let mut checked = 0;
    for (time, input) in inputs(&world, 30.0) {
        engine.handle(input);
        drain(&mut engine, &mut outcome);
        for index in 0..world.sensor_count() {
            let at_ns = time.ns() - START_NS;
            let shown = world.sensor_clock(index).shows(at_ns);
            if let (Some(mapped), Some(clock)) =
                (engine.map_time(id(index), shown), engine.clock(id(index)))
            {
                let off_ns = mapped.since_ns(time);
                assert!(
                    off_ns.abs() <= clock.error_ns + 1000,
                    "{off_ns} ns off, {clock:?}"
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 1000);
    for index in 0..4 {
        let clock = engine.clock(id(index)).unwrap();
        let truth = world.sensor_clock(index);
        assert!(
            (clock.drift_ppm + truth.drift_ppm).abs() < 20.0,
            "{clock:?} {truth:?}"
        );
        assert!(clock.error_ns < 5_000_000, "{clock:?}");
    }
}

#[test]
fn what_is_refused_is_named_and_the_rest_goes_on() {
    let world = Arc::new(
        World::new(&Scenario {
            errors: SensorErrors::harsh(),
            ..Scenario::default()
        })
        .unwrap(),
    );
    let events = inputs(&world, 5.0)
        .into_iter()
        .filter_map(|(time, input)| match input {
            // Sensor 0 never greets, sensor 1 is in no calibration, sensor 2 never answers a probe.
            Input::Sensor(info) if info.id == id(0) => None,
            Input::Calibration(c) => {
                let mut c = (*c).clone();
                c.sensors.remove("sim2");
                Some((time, Input::Calibration(Arc::new(c))))
            }
            Input::ClockSample(s) if s.sensor == id(2) => None,
            other => Some((time, other)),
        });
    let mut engine = Engine::new(Config::default());
    let mut outcome = Outcome::default();
    drive(&mut engine, events, &mut outcome);
    let reasons = |index: usize| {
        let of = outcome
            .rejections
            .iter()
            .filter(|r| r.sensor == id(index) && r.joint.is_none());
        of.map(|r| r.reason)
            .collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(
        reasons(0).into_iter().collect::<Vec<_>>(),
        [RejectionReason::UnknownSensor]
    );
    assert!(reasons(1).contains(&RejectionReason::Uncalibrated));
    assert_eq!(
        reasons(2).into_iter().collect::<Vec<_>>(),
        [RejectionReason::ClockUnknown]
    );
    assert!(
        reasons(3).contains(&RejectionReason::Repeated),
        "stale frames"
    );
    assert!(
        outcome
            .frames
            .iter()
            .any(|f| f.tracks.iter().any(|t| t.sensors.contains(id(3))))
    );
    let all = engine.diagnostics();
    assert_eq!(
        all.iter().map(|d| d.sensor.index()).collect::<Vec<_>>(),
        [1, 2, 3]
    );
    let good = &all[2];
    assert!(
        good.calibrated && good.residual_m.is_some_and(|m| m < 0.05),
        "{good:?}"
    );
    assert!(
        good.latency_ns
            .is_some_and(|ns| (10_000_000..40_000_000).contains(&ns)),
        "{good:?}"
    );
    assert!(!all[0].calibrated);
}
