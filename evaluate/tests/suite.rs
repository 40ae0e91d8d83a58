//! Simulated rooms: what a method that smooths afterwards gives, whether swaps are counted by what truly was, what repair
//! is laid beside, and that left-out sensors are found where they are.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::sync::Arc;

use posefuse_evaluate::suite::{Setting, Suite};
use posefuse_evaluate::{
    Group, Metrics, SimulatedRoom, leave_one_out, left_out_alike, perfect_calibration, preset,
};
use posefuse_fusion::Input;
use posefuse_simulator::{Layout, Scenario, SensorErrors, World};
use posefuse_skeleton::Timestamp;

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

#[test]
fn repair_is_told_of_beside_the_same_method_without_it() {
    let kalman = preset("kalman").unwrap();
    let suite = Suite {
        settings: vec![Setting::named("arc2").unwrap()],
        seeds: vec![1],
        seconds: 5.0,
        skip_s: 1.0,
        methods: vec![kalman.clone(), kalman.with_repair("none", None)],
        calibrate: &|world: &Arc<World>| Ok(perfect_calibration(world)),
        threads: 1,
    };
    let group = suite.groups(&suite.run(&|_, _| {}).unwrap()).remove(0);
    assert_eq!(of(&group, "kalman").repair, None);
    let effect = of(&group, "kalman+none").repair.clone().unwrap();
    assert!(effect.hidden > 100 && effect.seen > 1000, "{effect:?}");
    assert_eq!(effect.with_mm, effect.without_mm, "`none` changes nothing");
    assert_eq!(effect.most_changed_mm, Some(0.0));
    let hidden = of(&group, "kalman").own_error_occluded.mean_mm;
    assert!((effect.without_mm.unwrap() / hidden.unwrap() - 1.0).abs() < 0.05);
}

/// Two sensors without any error and with biases that the calibration knows: whatever is left out, is where the other says.
#[test]
fn a_left_out_sensor_is_found_where_it_is_by_every_method() {
    let scenario = Scenario {
        sensors: 2,
        layout: Layout::Arc,
        errors: SensorErrors {
            ray_bias_mm: 40.0,
            ..SensorErrors::none()
        },
        ..Scenario::default()
    };
    let world = Arc::new(World::new(&scenario).unwrap());
    let calibration = Input::Calibration(Arc::new(perfect_calibration(&world)));
    let from = SimulatedRoom::server_time(1.0);
    let all = ["weighted", "kalman-1"].map(|name| {
        let mut inputs = || {
            let first = std::iter::once((Timestamp::ZERO, calibration.clone()));
            first.chain(SimulatedRoom::new(&world, 4.0).unwrap())
        };
        leave_one_out(&preset(name).unwrap(), &mut inputs, from)
    });
    let tallies = left_out_alike(&all);
    for tally in &tallies {
        assert_eq!(tally.left_out_medians.len(), 2);
        for median_m in &tally.left_out_medians {
            assert!(*median_m < 0.01, "{median_m}");
        }
        assert!(tally.left_out.count() > 3000);
        assert_eq!(tally.left_out.count(), tallies[0].left_out.count());
    }
}
