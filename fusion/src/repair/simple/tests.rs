use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint};

use super::*;

/// A joint that walks 1 m/s along x, not seen from pose `from` to before `to`; the others are always seen.
fn window(poses: usize, from: usize, to: usize) -> Window {
    let step_s = 1.0 / RATE_HZ;
    let pose = |k: usize| {
        std::array::from_fn(|joint| {
            let missing = joint == 7 && (from..to).contains(&k);
            let seen = if missing { from - 1 } else { k };
            WindowJoint {
                position: Vector3::new(seen as f64 * step_s, 0.0, joint as f64 * 0.05),
                weight: if missing { 0.0 } else { 1.0 },
                confidence: if missing { 0.0 } else { 1.0 },
                age_s: ((k - seen) as f64 * step_s) as f32,
            }
        })
    };
    Window {
        step_s,
        poses: (0..poses).map(pose).collect(),
    }
}

fn x(model: SimpleModel, window: &Window, now: usize) -> f64 {
    let fills = model.fill_one(window, now);
    assert_eq!(fills.len(), 1, "only what is missing");
    fills[Joint::ALL[7]].unwrap().position.x
}

#[test]
fn each_does_what_its_name_says() {
    let window = window(40, 20, 30);
    let last = 19.0 / RATE_HZ;
    assert!((x(SimpleModel::Hold, &window, 24) - last).abs() < 1e-9);
    let gone = 5.0 / RATE_HZ;
    let went = x(SimpleModel::Damped, &window, 24) - last;
    assert!((0.5 * gone..gone).contains(&went), "{went}");
    assert!((x(SimpleModel::Linear, &window, 24) - 24.0 / RATE_HZ).abs() < 1e-6);
}

#[test]
fn uncertainty_grows_with_age() {
    let window = window(60, 5, 60);
    for model in [SimpleModel::Hold, SimpleModel::Damped, SimpleModel::Linear] {
        let sigma = |now| model.fill_one(&window, now)[Joint::ALL[7]].unwrap().sigma_m;
        assert!(sigma(6) < sigma(20) && sigma(20) < sigma(50), "{model:?}");
    }
}

#[test]
fn names_find_their_models_and_a_window_that_is_too_short_is_refused() {
    for model in SimpleModel::ALL {
        assert_eq!(SimpleModel::named(model.label()), Some(model));
        let mut model = model;
        let short = window(3, 2, 3);
        assert!(model.fill(&short, 2..4).is_err());
        assert_eq!(model.fill(&short, 1..3).unwrap().len(), 2);
    }
    assert_eq!(JOINT_COUNT, window(1, 1, 1).poses[0].len());
}
