//! What is hidden, out of view, or seen from behind.

use super::*;

#[test]
fn hidden_joints_are_guessed_and_a_share_of_them_with_confidence() {
    let world = world(SensorErrors {
        occlusion: true,
        hidden_error_mm: 90.0,
        overconfident: 0.2,
        ..SensorErrors::none()
    });
    let frames = frames(&world, 0, 6000);
    let (mut hidden, mut sure, mut total, mut errors) = (0.0, 0.0, 0.0, Vec::new());
    for frame in &frames {
        let deviations = deviations(&world, 0, frame);
        for ((_, _, error), raw) in deviations
            .iter()
            .zip(frame.bodies[0].joints.iter().flatten())
        {
            total += 1.0;
            if error.norm() > 1e-9 {
                hidden += 1.0;
                errors.push(error.norm());
                sure += f64::from(u8::from(raw.confidence == Confidence::FULL));
            } else {
                assert_eq!(raw.confidence, Confidence::FULL);
            }
        }
    }
    println!(
        "hidden {:.3}, of them sure {:.3}, error {:.3} m RMS",
        hidden / total,
        sure / hidden,
        rms(errors.iter().copied())
    );
    assert!(
        (0.05..0.4).contains(&(hidden / total)),
        "{}",
        hidden / total
    );
    assert!((sure / hidden - 0.2).abs() < 0.05, "{}", sure / hidden);
    assert!((0.08..0.25).contains(&rms(errors.into_iter())));
}

#[test]
fn one_person_hides_another() {
    let scenario = Scenario {
        people: 4,
        errors: SensorErrors {
            occlusion: true,
            ..SensorErrors::none()
        },
        ..Scenario::default()
    };
    let crowd = world_of(scenario.clone());
    let lost = frames(&crowd, 0, 900)
        .iter()
        .filter(|frame| frame.bodies.len() < 4)
        .count();
    assert!(
        lost > 10,
        "somebody is behind somebody in {lost} of 900 frames"
    );
    let alone = world_of(Scenario {
        people: 1,
        ..scenario
    });
    assert!(
        frames(&alone, 0, 900)
            .iter()
            .all(|frame| frame.bodies.len() == 1)
    );
}

#[test]
fn what_is_out_of_view_is_missing_and_who_comes_back_has_a_new_number() {
    let world = world_of(Scenario {
        area_m: 4.0,
        errors: SensorErrors {
            field_of_view: true,
            ..SensorErrors::none()
        },
        ..Scenario::default()
    });
    let (mut ids, mut missing) = (Vec::new(), 0);
    for sensor in 0..4 {
        let pose = world.room_from_sensor(sensor).inverse();
        for frame in frames(&world, sensor, 3000) {
            let truth = &world.truth(frame.at_ns as f64 * 1e-9)[0].joints;
            for body in &frame.bodies {
                if sensor == 0 {
                    ids.push(body.tracking_id);
                }
                for (joint, raw) in Joint::ALL.into_iter().zip(&body.joints) {
                    let inside = layout::in_view(pose.apply(truth[joint].unwrap()).vector());
                    assert_eq!(inside, raw.is_some());
                    missing += usize::from(!inside);
                }
            }
        }
    }
    ids.dedup();
    assert!(missing > 0 && ids.len() > 1, "{ids:?}");
    assert!(ids.windows(2).all(|pair| pair[1] == pair[0] + 1), "{ids:?}");
}

#[test]
fn swaps_are_perfect_mirrors_and_happen_only_from_behind() {
    let errors = SensorErrors {
        swaps: 0.7,
        ..SensorErrors::none()
    };
    let (mut swapped, mut behind, mut total) = (0, 0, 0);
    for seed in 0..6 {
        let world = world_of(Scenario {
            seed,
            errors: errors.clone(),
            ..Scenario::default()
        });
        let sensor_from_room = world.room_from_sensor(0).inverse();
        for frame in frames(&world, 0, 3000) {
            let truth = world.truth(frame.at_ns as f64 * 1e-9)[0]
                .joints
                .map(|_, p| sensor_from_room.apply(*p));
            let cosine = swap::facing_cosine(&truth, &sensor_from_room);
            let at = |joint: Joint| frame.bodies[0].joints[joint as usize].unwrap().position;
            let is = |label: Joint, real: Joint| at(label).distance(truth[real].unwrap()) < 1e-9;
            let mirrored = !is(Joint::WristLeft, Joint::WristLeft);
            assert!(
                Joint::ALL
                    .into_iter()
                    .all(|joint| is(joint, if mirrored { joint.mirrored() } else { joint }))
            );
            assert!(!mirrored || cosine < -0.09, "swapped at cosine {cosine}");
            swapped += usize::from(mirrored);
            behind += usize::from(cosine < -0.3);
            total += 1;
        }
    }
    let share = swapped as f64 / behind as f64;
    println!("behind {behind} of {total} frames, swapped {share:.2} of these");
    assert!((0.45..0.95).contains(&share), "{share}");
}

#[test]
fn imperfect_swaps_shake_and_may_be_partial() {
    let world = world(SensorErrors {
        swaps: 1.0,
        imperfect_swaps: true,
        ..SensorErrors::none()
    });
    let kinds: std::collections::BTreeSet<(bool, bool)> = frames(&world, 0, 7000)
        .iter()
        .map(|frame| {
            let off: Vec<_> = deviations(&world, 0, frame);
            let moved = |joint: Joint| off[joint as usize].2.norm() > 1e-9;
            assert!(!moved(Joint::Head));
            (moved(Joint::WristLeft), moved(Joint::AnkleLeft))
        })
        .collect();
    assert!(
        kinds.contains(&(false, false)) && kinds.contains(&(true, true)),
        "{kinds:?}"
    );
    assert!(kinds.len() > 2, "some swaps are partial: {kinds:?}");
}

#[test]
fn both_layouts_see_most_of_the_walk() {
    for layout in [Layout::Ring, Layout::Arc] {
        let world = world_of(Scenario {
            layout,
            ..Scenario::default()
        });
        for sensor in 0..4 {
            let frames = frames(&world, sensor, 900);
            let joints = frames
                .iter()
                .flat_map(|f| &f.bodies)
                .flat_map(|b| &b.joints)
                .flatten()
                .count();
            let share = joints as f64 / (900.0 * 25.0);
            assert!(share > 0.5, "{layout:?} {sensor} sees {share}");
        }
    }
}
