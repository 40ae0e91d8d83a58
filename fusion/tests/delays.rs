//! Sensors whose trackers need unequal time: by a calibration's offsets, and by how late their frames come.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, FuseMethod, Input, RejectionReason};
use posefuse_simulator::{Scenario, SensorErrors, World};
use posefuse_skeleton::{Calibration, SensorSet, Timestamp};
use support::{Outcome, drive, id, inputs, score};

const MS: i64 = 1_000_000;
/// The sensor that is late, of four.
const SLOW: usize = 2;

fn fuse(events: impl IntoIterator<Item = (Timestamp, Input)>, config: &Config) -> Outcome {
    let mut events: Vec<_> = events.into_iter().collect();
    events.sort_by_key(|(time, _)| *time);
    let mut outcome = Outcome::default();
    drive(&mut Engine::new(config.clone()), events, &mut outcome);
    outcome
}

/// Observations changed by `change`, all else as it is.
fn with_frames(
    world: &Arc<World>,
    seconds: f64,
    change: impl Fn(&mut posefuse_skeleton::Observation),
) -> impl Iterator<Item = (Timestamp, Input)> {
    inputs(world, seconds)
        .into_iter()
        .map(move |(time, mut input)| match &mut input {
            Input::Observation(observation) => {
                change(observation);
                (observation.received, input)
            }
            _ => (time, input),
        })
}

/// Share of the joints after 3 s to which `sensor` contributed.
fn share_of(sensor: usize, outcome: &Outcome) -> f64 {
    let (mut with, mut all) = (0.0, 0.0);
    for frame in &outcome.frames {
        if support::scenario_seconds(frame.time) < 3.0 {
            continue;
        }
        for (_, joint) in frame.tracks.iter().flat_map(|t| t.skeleton.iter()) {
            let by: SensorSet = joint.provenance.sensors();
            with += f64::from(u8::from(by.contains(id(sensor))));
            all += 1.0;
        }
    }
    with / all
}

#[test]
fn offsets_of_a_calibration_work_in_both_directions() {
    let world = Arc::new(
        World::new(&Scenario {
            sensors: 3,
            errors: SensorErrors::none(),
            ..Scenario::default()
        })
        .unwrap(),
    );
    // The first tracker stamps its frames 100 ms late, the second 50, the third at once; each arrives 5 ms after its
    // stamp. Against the second that is -50 and +50 ms.
    let late = [100, 50, 0];
    let offsets = [-50, 0, 50];
    for shift_ms in [0, 1000, -1000] {
        let delayed = with_frames(&world, 8.0, |observation| {
            let late_ns = late[observation.sensor.index()] * MS;
            observation.captured = observation.captured.plus_ns(late_ns);
            observation.received = observation.received.plus_ns(late_ns + 5 * MS);
        });
        let events = delayed.map(|(time, mut input)| {
            if let Input::Calibration(calibration) = &mut input {
                let calibration: &mut Calibration = Arc::make_mut(calibration);
                for (pose, offset) in calibration.sensors.values_mut().zip(offsets) {
                    pose.time_offset_ns = (offset + shift_ms) * MS;
                }
            }
            (time, input)
        });
        let outcome = fuse(events, &Config::default());
        let found = score(&world, &outcome.frames, 3.0);
        assert!(
            found.mpjpe_m < 0.012,
            "offsets moved by {shift_ms} ms: {found:?}"
        );
        for sensor in 0..3 {
            let share = share_of(sensor, &outcome);
            assert!(share > 0.9, "sensor {sensor} is in {share} of all joints");
        }
    }
}

/// Everything of `world`, sensor number [`SLOW`] late by `late_ms`.
fn one_late(world: &Arc<World>, late_ms: i64) -> impl Iterator<Item = (Timestamp, Input)> {
    with_frames(world, 15.0, move |observation| {
        if observation.sensor.index() == SLOW {
            observation.received = observation.received.plus_ns(late_ms * MS);
        }
    })
}

fn ring(seed: u64) -> Arc<World> {
    let scenario = Scenario {
        seed,
        ..Scenario::default()
    };
    Arc::new(World::new(&scenario).unwrap())
}

#[test]
fn a_sensor_that_is_150_ms_late_contributes_and_does_no_harm() {
    for method in [FuseMethod::Weighted, FuseMethod::Average] {
        let mut config = Config::default();
        config.fuse.method = method;
        let (mut with, mut without) = (0.0, 0.0);
        for seed in 1..=4 {
            let world = ring(seed);
            let outcome = fuse(one_late(&world, 150), &config);
            let on_time = fuse(one_late(&world, 0), &config);
            let others = inputs(&world, 15.0).into_iter().filter(
                |(_, input)| !matches!(input, Input::Observation(o) if o.sensor.index() == SLOW),
            );
            let others = fuse(others, &config);
            let [found, best, alone] =
                [&outcome, &on_time, &others].map(|outcome| score(&world, &outcome.frames, 3.0));
            let [share, usual] = [&outcome, &on_time].map(|outcome| share_of(SLOW, outcome));
            println!(
                "{method:?}, seed {seed}: {:.1} mm with it, {:.1} were it on time, {:.1} without it; in {:.0} % of all joints, {:.0} % were it on time",
                found.mpjpe_m * 1e3,
                best.mpjpe_m * 1e3,
                alone.mpjpe_m * 1e3,
                share * 100.0,
                usual * 100.0
            );
            assert!(
                share > 0.9 * usual,
                "it is in {share} of all joints, not in {usual}"
            );
            let late = outcome.rejections.iter().filter(|r| {
                r.reason == RejectionReason::Late && support::scenario_seconds(r.time) > 3.0
            });
            assert_eq!(late.count(), 0, "late though it is waited for");
            assert_eq!(found.id_switches, 0);
            with += found.mpjpe_m / 4.0;
            without += alone.mpjpe_m / 4.0;
        }
        assert!(
            with < without,
            "{method:?}: {with} m with it, {without} m without"
        );
    }
}

#[test]
fn sensors_alike_hold_nothing_back_and_one_too_late_is_not_waited_for() {
    let usual = held_ms(0);
    println!("{usual:.0} ms from capture to frame, all on time");
    for (late_ms, added_ms) in [(30, 0.0..=20.0), (150, 60.0..=150.0), (400, -1.0..=1.0)] {
        let added = held_ms(late_ms) - usual;
        println!("{late_ms} ms late: {added:.0} ms more");
        assert!(
            added_ms.contains(&added),
            "{late_ms} ms late, {added} ms more"
        );
    }
}

/// From a frame's time to when it comes out: the median, ms.
fn held_ms(late_ms: i64) -> f64 {
    let mut config = Config::default();
    config.stages.clear();
    let mut events: Vec<_> = one_late(&ring(1), late_ms).collect();
    events.sort_by_key(|(time, _)| *time);
    let mut engine = Engine::new(config);
    let mut held = Vec::new();
    for (time, input) in events {
        let mut outcome = Outcome::default();
        drive(&mut engine, [(time, input)], &mut outcome);
        let later = outcome
            .frames
            .iter()
            .filter(|f| support::scenario_seconds(f.time) > 5.0);
        held.extend(later.map(|frame| time.since_ns(frame.time) as f64 * 1e-6));
    }
    held.sort_by(f64::total_cmp);
    held[held.len() / 2]
}
