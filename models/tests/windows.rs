//! Windows of the engine through a network: long and short ones, several at once, and answers that are nonsense.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use posefuse_fusion::{Fill, OcclusionModel};
use posefuse_models::Ask;
use posefuse_skeleton::{Joint, JointMap};

mod support;
use support::{LEFT_ARM, open, walking};

fn same(a: &[JointMap<Fill>], b: &[JointMap<Fill>]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert_eq!(a.len(), b.len());
        for ((joint, a), (_, b)) in a.iter().zip(b.iter()) {
            let far = (a.position - b.position).norm();
            assert!(far < 1e-5, "{joint:?} {far}");
            assert!((a.sigma_m - b.sigma_m).abs() < 1e-5);
        }
    }
}

#[test]
fn only_what_was_not_measured_with_trust_is_filled_near_the_person() {
    let mut model = open("tiny-gru");
    let mut window = walking(8, 4);
    window.poses[7][Joint::FootLeft as usize].weight = 0.3;
    let fills = model.fill(&window, 7..8).unwrap();
    let mut expected = LEFT_ARM.to_vec();
    expected.push(Joint::FootLeft);
    let joints: Vec<Joint> = fills[0].iter().map(|(joint, _)| joint).collect();
    assert_eq!(joints, expected);
    for (_, fill) in fills[0].iter() {
        assert!(fill.sigma_m > 0.0 && fill.position.norm() < 3.0);
    }
}

#[test]
fn a_longer_window_is_cut_and_a_shorter_one_made_longer_by_a_person_who_was_not_there() {
    let mut model = open("tiny-gru");
    let long = walking(30, 20);
    let mut cut = long.clone();
    cut.poses.drain(..22);
    same(
        &model.fill(&long, 29..30).unwrap(),
        &model.fill(&cut, 7..8).unwrap(),
    );
    let short = walking(3, 2);
    let mut padded = short.clone();
    let mut first = short.poses[0];
    for joint in &mut first {
        joint.weight = 0.0;
        joint.age_s = posefuse_fusion::MAX_AGE_S;
    }
    for _ in 0..5 {
        padded.poses.insert(0, first);
    }
    same(
        &model.fill(&short, 2..3).unwrap(),
        &model.fill(&padded, 7..8).unwrap(),
    );
}

#[test]
fn several_windows_at_once_give_what_each_gives_alone() {
    for name in ["tiny-gru", "tiny-conv", "tiny-lstm"] {
        let mut model = open(name);
        let windows = [walking(8, 2), walking(8, 5), walking(20, 9), walking(5, 1)];
        let asks: Vec<Ask> = windows
            .iter()
            .map(|window| Ask {
                window,
                wanted: window.poses.len() - 2..window.poses.len(),
            })
            .collect();
        let together = model.fill_all(&asks);
        for (ask, together) in asks.iter().zip(together) {
            let alone = model.fill(ask.window, ask.wanted.clone()).unwrap();
            assert_eq!(alone.len(), 2);
            same(&together.unwrap(), &alone);
        }
    }
}

#[test]
fn a_gap_longer_than_the_network_is_filled_without_a_jump_between_its_windows() {
    let mut model = open("tiny-conv");
    let window = walking(60, 15);
    let fills = model.fill(&window, 15..50).unwrap();
    assert_eq!(fills.len(), 35);
    let hand: Vec<_> = fills
        .iter()
        .map(|fill| fill[Joint::HandLeft].unwrap().position)
        .collect();
    let steps = hand.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    // The person walks 33 mm from pose to pose.
    let longest = steps.fold(0.0, f64::max);
    assert!(longest < 0.1, "{longest}");
}

#[test]
fn an_answer_that_is_no_number_is_a_failure_of_that_window_alone() {
    let mut model = open("fragile");
    let good = walking(8, 4);
    let mut old = good.clone();
    old.poses[7][Joint::HandLeft as usize].age_s = 6.0;
    let ask = |window| Ask {
        window,
        wanted: 7..8,
    };
    let answers = model.fill_all(&[ask(&good), ask(&old), ask(&good)]);
    assert!(answers[0].is_ok() && answers[2].is_ok());
    let error = answers[1].as_ref().unwrap_err();
    assert_eq!(error.model, "fragile");
    assert!(error.reason.contains("away from the person"), "{error}");
}

#[test]
fn a_window_that_makes_no_sense_is_refused_before_the_network_sees_it() {
    let mut model = open("tiny-gru");
    let mut window = walking(8, 4);
    for wanted in [8..9, 3..3] {
        assert!(model.fill(&window, wanted).is_err());
    }
    window.poses[3][2].position.x = f64::NAN;
    let error = model.fill(&window, 7..8).unwrap_err();
    assert!(error.reason.contains("no number"), "{error}");
    let mut fast = walking(8, 4);
    fast.step_s = 1.0 / 60.0;
    let error = model.fill(&fast, 7..8).unwrap_err();
    assert!(
        error.reason.contains("60.0 Hz, it needs 30.0 Hz"),
        "{error}"
    );
    let none = posefuse_fusion::Window {
        step_s: 1.0 / 30.0,
        poses: Vec::new(),
    };
    assert!(model.fill(&none, 0..1).is_err());
}
