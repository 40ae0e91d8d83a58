//! Sensors that a person mutes: for the room they are not there, until they are taken in again.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input, IntakeMode};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{RoomFrame, SensorId, Timestamp};
use proptest::prelude::*;
use support::{Outcome, drain, drive, id, inputs};

/// The slowest a sensor that is taken in again may be to have a part in somebody, seconds: its own delay, a frame or
/// two, and the time until its left and right are believed.
const TAKEN_IN_S: f64 = 0.5;

fn at(seconds: f64) -> Timestamp {
    Timestamp::from_ns(support::START_NS).plus_ns((seconds * 1e9) as i64)
}

fn is_from(input: &Input, sensor: SensorId) -> bool {
    matches!(input, Input::Observation(o) if o.sensor == sensor)
}

fn fuse(events: &[(Timestamp, Input)], config: &Config) -> Vec<RoomFrame> {
    let mut outcome = Outcome::default();
    let mut engine = Engine::new(config.clone());
    drive(&mut engine, events.iter().cloned(), &mut outcome);
    outcome.frames
}

fn uses(frame: &RoomFrame, sensor: SensorId) -> bool {
    let tracks = || frame.tracks.iter();
    tracks().any(|track| track.sensors.contains(sensor))
        || tracks()
            .flat_map(|track| track.skeleton.iter())
            .any(|(_, state)| state.provenance.sensors().contains(sensor))
}

/// What arrives, with the sensor muted from one second on, to another.
fn with_mute(
    mut events: Vec<(Timestamp, Input)>,
    sensor: SensorId,
    from_s: f64,
    to_s: f64,
) -> Vec<(Timestamp, Input)> {
    for (seconds, muted) in [(from_s, true), (to_s, false)] {
        let time = at(seconds);
        let index = events.partition_point(|(other, _)| *other < time);
        events.insert(index, (time, Input::Mute { sensor, muted }));
    }
    events
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_muted_sensor_is_as_good_as_absent(
        seed in 1..1000_u64,
        which in 0..4_usize,
        from_s in 1.2..1.8_f64,
        window in any::<bool>(),
        delay_ms in prop_oneof![Just(0_i64), Just(150)],
    ) {
        let sensor = id(which);
        let (to_s, end_s) = (from_s + 0.9, from_s + 1.9);
        let scenario = Scenario { seed, people: 2, ..Scenario::default() };
        let world = Arc::new(World::new(&scenario).unwrap());
        let mut config = Config::default();
        if window {
            config.intake.mode = IntakeMode::Window;
        }
        let mut events = inputs(&world, end_s);
        // A slow sensor holds the others' present back, but not while it is muted.
        for (time, input) in &mut events {
            if let Input::Observation(seen) = input && seen.sensor == sensor {
                *time = time.plus_ns(delay_ms * 1_000_000);
                seen.received = *time;
            }
        }
        events.sort_by_key(|(time, _)| *time);
        let events = with_mute(events, sensor, from_s, to_s);
        let silent = |time: Timestamp| time >= at(from_s) && time < at(to_s);
        let absent: Vec<_> = events
            .iter()
            .filter(|(time, input)| !(is_from(input, sensor) && silent(*time)))
            .cloned()
            .collect();
        prop_assert!(absent.len() + 15 < events.len(), "nothing was muted");

        let muted = fuse(&events, &config);
        let absent = fuse(&absent, &config);
        let until = |frames: &[RoomFrame], seconds: f64| -> Vec<RoomFrame> {
            frames.iter().filter(|f| f.time < at(seconds)).cloned().collect()
        };
        // Frames are fused somewhat after they are captured: those of the last 0.4 s may have been fused unmuted.
        let settled_s = to_s - 0.4;
        prop_assert_eq!(until(&muted, settled_s), until(&absent, settled_s));
        // What comes this late the room has to learn to wait for.
        let late = delay_ms > 0;
        let used = |from: f64, to: f64| {
            let frames = muted.iter().filter(move |f| f.time >= at(from) && f.time < at(to));
            frames.map(|f| uses(f, sensor)).collect::<Vec<_>>()
        };
        let before = used(0.0, from_s);
        let between = used(from_s, settled_s);
        prop_assert!(late || before.contains(&true), "it never had a part");
        prop_assert!(between.len() > 8 && !between.contains(&true), "{between:?}");
        let after = used(to_s, end_s);
        prop_assert!(late || after.contains(&true), "it was not taken in again: {after:?}");
    }
}

#[test]
fn a_sensor_that_is_taken_in_again_has_a_part_at_once_and_a_preamble_keeps_it_muted() {
    let world = Arc::new(World::new(&Scenario::default()).unwrap());
    let sensor = id(1);
    let events = with_mute(inputs(&world, 6.0), sensor, 1.5, 4.0);
    let config = Config::default();
    let whole = fuse(&events, &config);
    let first = whole
        .iter()
        .find(|frame| frame.time >= at(4.0) && uses(frame, sensor))
        .unwrap();
    let late_s = support::scenario_seconds(first.time) - 4.0;
    assert!(late_s < TAKEN_IN_S, "{late_s} s");

    let middle = events.partition_point(|(time, _)| *time < at(2.5));
    let (first, rest) = events.split_at(middle);
    let mut engine = Engine::new(config.clone());
    drive(&mut engine, first.iter().cloned(), &mut Outcome::default());
    let preamble = engine.preamble();
    let mute = Input::Mute {
        sensor,
        muted: true,
    };
    assert!(preamble.contains(&mute));
    for (mutes, begins_muted) in [(true, true), (false, false)] {
        let mut cold = Engine::new(config.clone());
        let kept = preamble.iter().filter(|input| mutes || **input != mute);
        kept.cloned().for_each(|input| cold.handle(input));
        let mut outcome = Outcome::default();
        drain(&mut cold, &mut outcome);
        drive(&mut cold, rest.iter().cloned(), &mut outcome);
        let used = |from: f64, to: f64| {
            let mut within = outcome.frames.iter();
            within.any(|f| f.time >= at(from) && f.time < at(to) && uses(f, sensor))
        };
        assert_eq!(used(2.5, 3.8), !begins_muted);
        assert!(used(4.0, 6.0), "it was not taken in again");
    }
}
