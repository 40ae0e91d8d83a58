//! Simulated rooms: what a method that smooths afterwards gives, and whether swaps are counted by what truly was.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::sync::Arc;

use posefuse_evaluate::suite::{Setting, Suite};
use posefuse_evaluate::{Group, Metrics, perfect_calibration, preset};
use posefuse_simulator::World;

fn ring3(methods: &[&str]) -> Group {
    let suite = Suite {
        settings: vec![Setting::named("ring3").unwrap()],
        seeds: vec![1],
        seconds: 5.0,
        skip_s: 1.0,
        methods: methods.iter().map(|name| preset(name).unwrap()).collect(),
        calibrate: &|world: &Arc<World>| Ok(perfect_calibration(world)),
        threads: 1,
    };
    let cells = suite.run(&|_, _| {}).unwrap();
    suite.groups(&cells).remove(0)
}

fn of<'a>(group: &'a Group, method: &str) -> &'a Metrics {
    &group.of(method).unwrap().all
}

#[test]
fn smoothing_afterwards_loses_no_frame_waits_for_none_and_is_steadier() {
    let group = ring3(&["kalman-0", "offline"]);
    let (live, after) = (of(&group, "kalman-0"), of(&group, "offline"));
    assert_eq!(after.frames, live.frames, "the last frames are given, too");
    assert_eq!(after.look_ahead_ms, None);
    assert!(live.look_ahead_ms.unwrap() < 1.0);
    assert!(after.jitter_mps2.unwrap() < 0.8 * live.jitter_mps2.unwrap());
}

#[test]
fn swaps_are_counted_by_what_sensors_truly_exchanged() {
    let group = ring3(&["mean", "menard"]);
    let right = |method| of(&group, method).swaps_right.unwrap();
    // In a ring of three somebody is always seen from behind, and nobody but the engine can know.
    assert!((0.2..0.9).contains(&right("mean")), "{}", right("mean"));
    assert!(right("menard") > 0.95, "{}", right("menard"));
}
