use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::*;

const SCALE_M: f64 = 0.19;
const POSES: usize = 90;
/// Joints of the left leg.
const LEG: [usize; 3] = [13, 14, 15];

/// Somebody who walks about as the table's first latents say, all joints seen.
fn motion() -> Vec<[Vector3<f64>; JOINT_COUNT]> {
    let pose = |k: usize| {
        let swing = k as f64 * 0.16;
        let mut latent = Latent::zeros();
        for index in 0..3 {
            let size = TABLE.variance[index].sqrt();
            latent[index] = size * (swing / (1.0 + index as f64) + index as f64).sin();
        }
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4 + k as f64 * 0.01);
        let place = Vector3::new(0.02 * k as f64, 1.0, 0.9);
        std::array::from_fn(|joint| {
            place + turn * (TABLE.mean[joint] + TABLE.basis[joint] * latent) * SCALE_M
        })
    };
    (0..POSES).map(pose).collect()
}

/// The motion as a window, `hidden` joints not seen from pose `from` to before `to`; `moved` as a whole.
fn window(hidden: &[usize], from: usize, to: usize, moved: &Isometry3<f64>) -> Window {
    let motion = motion();
    let step_s = 1.0 / RATE_HZ;
    let poses = (0..POSES).map(|k| {
        std::array::from_fn(|joint| {
            let missing = hidden.contains(&joint) && (from..to).contains(&k);
            let seen = if missing { from - 1 } else { k };
            WindowJoint {
                position: (moved * nalgebra::Point3::from(motion[seen][joint])).coords,
                weight: if missing { 0.0 } else { 1.0 },
                confidence: if missing { 0.0 } else { 1.0 },
                age_s: ((k - seen) as f64 * step_s) as f32,
            }
        })
    });
    Window {
        step_s,
        poses: poses.collect(),
    }
}

fn here() -> Isometry3<f64> {
    Isometry3::identity()
}

fn off(fills: &JointMap<Fill>, now: usize) -> f64 {
    let truth = motion()[now];
    let joints = LEG.map(|j| (fills[Joint::ALL[j]].unwrap().position - truth[j]).norm());
    joints.iter().sum::<f64>() / 3.0
}

#[test]
fn a_hidden_leg_is_where_the_statistics_have_it() {
    let window = window(&LEG, 61, 80, &here());
    for now in [61, 65, 75] {
        let (one, both) = (
            fill(&window, now, Sides::Before),
            fill(&window, now, Sides::Both),
        );
        assert_eq!(one.len(), 3, "only what is missing");
        let held = LEG.map(|j| (motion()[60][j] - motion()[now][j]).norm());
        let held = held.iter().sum::<f64>() / 3.0;
        assert!(
            off(&one, now) < 0.7 * held,
            "{now}: {} of {held}",
            off(&one, now)
        );
        assert!(off(&both, now) < 1.1 * off(&one, now) + 0.01, "{now}");
    }
}

#[test]
fn moving_the_room_moves_the_fills() {
    let moved = Isometry3::from_parts(
        Translation3::new(3.0, -5.0, 0.4),
        UnitQuaternion::from_euler_angles(0.0, 0.0, 2.3),
    );
    for (hidden, sides) in [
        (&LEG[..], Sides::Before),
        (&LEG[..], Sides::Both),
        // Without pelvis, hips and legs, as behind a desk.
        (&[0, 12, 13, 14, 15, 16, 17, 18, 19][..], Sides::Before),
    ] {
        let a = fill(&window(hidden, 61, 80, &here()), 70, sides);
        let b = fill(&window(hidden, 61, 80, &moved), 70, sides);
        assert_eq!(a.len(), hidden.len());
        for (joint, a) in a.iter() {
            let b = b[joint].unwrap();
            let there = (moved * nalgebra::Point3::from(a.position)).coords;
            assert!((there - b.position).norm() < 1e-8, "{joint}");
            assert!((a.sigma_m - b.sigma_m).abs() < 1e-9, "{joint}");
        }
    }
}

#[test]
fn it_is_less_sure_the_longer_a_joint_is_gone_and_goes_on_where_it_was() {
    let window = window(&LEG, 30, 90, &here());
    let sigma = |now| {
        fill(&window, now, Sides::Before)[Joint::AnkleLeft]
            .unwrap()
            .sigma_m
    };
    assert!(sigma(30) < 0.5 * sigma(38) && sigma(38) < sigma(60));
    let first = off(&fill(&window, 30, Sides::Before), 30);
    assert!(first < 0.02, "{first}");
}

#[test]
fn a_weak_measurement_is_left_to_the_engine_and_tells_of_its_neighbours() {
    let mut window = window(&[14, 15], 61, 80, &here());
    let blind = fill(&window, 75, Sides::Before)[Joint::FootLeft].unwrap();
    let truth = motion()[75];
    let ankle = &mut window.poses[75][14];
    (ankle.position, ankle.weight, ankle.age_s) = (truth[14], 0.8, 0.0);
    let fills = fill(&window, 75, Sides::Before);
    let told = fills[Joint::FootLeft].unwrap();
    assert!((told.position - truth[15]).norm() < (blind.position - truth[15]).norm());
    assert!(told.sigma_m < blind.sigma_m);
    // What the others say of the ankle does not change with where it seems to be.
    let said = fills[Joint::AnkleLeft].unwrap();
    window.poses[75][14].position.x += 0.03;
    let again = fill(&window, 75, Sides::Before)[Joint::AnkleLeft].unwrap();
    assert!((said.position - again.position).norm() < 0.012);
}

#[test]
fn hardly_anything_seen_says_nothing() {
    let all: Vec<usize> = (0..JOINT_COUNT - 3).collect();
    let window = window(&all, 61, 80, &here());
    assert!(fill(&window, 70, Sides::Before).is_empty());
}
