//! Each error source does what its number says, and nothing else.

use std::sync::Arc;

use nalgebra::Vector3;

use super::*;
use crate::{Layout, Scenario};

fn world(errors: SensorErrors) -> Arc<World> {
    world_of(Scenario {
        errors,
        ..Scenario::default()
    })
}

fn world_of(scenario: Scenario) -> Arc<World> {
    Arc::new(World::new(&scenario).unwrap())
}

fn frames(world: &Arc<World>, sensor: usize, count: usize) -> Vec<SimFrame> {
    let mut sensor = SimSensor::new(Arc::clone(world), sensor);
    (0..count).map(|_| sensor.next_frame()).collect()
}

/// What is wrong with each joint of the only person, in the sensor's frame: joint, true place, error.
fn deviations(
    world: &Arc<World>,
    sensor: usize,
    frame: &SimFrame,
) -> Vec<(Joint, Vector3<f64>, Vector3<f64>)> {
    let sensor_from_room = world.room_from_sensor(sensor).inverse();
    let truth = &world.truth(frame.at_ns as f64 * 1e-9)[0].joints;
    let Some(body) = frame.bodies.first() else {
        return Vec::new();
    };
    Joint::ALL
        .into_iter()
        .zip(&body.joints)
        .filter_map(|(joint, raw)| {
            let at = sensor_from_room.apply(truth[joint]?).vector();
            Some((joint, at, raw.as_ref()?.position.vector() - at))
        })
        .collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

fn near(found: f64, expected: f64, share: f64) {
    assert!(
        (found / expected - 1.0).abs() < share,
        "found {found}, expected {expected}"
    );
}

#[test]
fn a_perfect_sensor_tells_the_truth() {
    for sensor in 0..4 {
        let world = world(SensorErrors::none());
        for frame in frames(&world, sensor, 300) {
            assert_eq!(
                (frame.captured.ns(), frame.arrival_delay_ns),
                (frame.at_ns, 0)
            );
            let deviations = deviations(&world, sensor, &frame);
            assert_eq!(deviations.len(), 25);
            assert!(deviations.iter().all(|(_, _, error)| error.norm() < 1e-9));
        }
    }
}

#[test]
fn frames_do_not_depend_on_who_else_looks_or_when_one_begins() {
    let scenario = Scenario {
        people: 2,
        errors: SensorErrors::harsh(),
        ..Scenario::default()
    };
    let shared = world_of(scenario.clone());
    let mut sensors: Vec<SimSensor> = (0..4)
        .map(|i| SimSensor::new(Arc::clone(&shared), i))
        .collect();
    let mut third = Vec::new();
    for _ in 0..400 {
        for (index, sensor) in sensors.iter_mut().enumerate() {
            let frame = sensor.next_frame();
            if index == 2 {
                third.push(frame);
            }
        }
    }
    assert_eq!(frames(&world_of(scenario.clone()), 2, 400), third);
    let mut late = SimSensor::new(world_of(scenario), 2);
    late.skip_to(8.0);
    let first = late.next_frame();
    assert!(first.at_ns >= 8_000_000_000 && first.at_ns < 8_034_000_000);
    assert_eq!(first, third[first.number as usize]);
}

#[test]
fn white_noise_is_that_of_the_depth() {
    let world = world(SensorErrors {
        white_noise: 1.0,
        ..SensorErrors::none()
    });
    let (mut lateral, mut axial) = (Vec::new(), Vec::new());
    for frame in frames(&world, 0, 1500) {
        for (_, at, error) in deviations(&world, 0, &frame) {
            if (at.z - 3.0).abs() < 0.1 {
                let along = error.dot(&at.normalize());
                axial.push(along);
                lateral.push((error - at.normalize() * along).norm() / 2f64.sqrt());
            }
        }
    }
    assert!(axial.len() > 1000, "{}", axial.len());
    println!(
        "at 3 m: lateral {:.2} mm, axial {:.2} mm",
        1e3 * rms(lateral.iter().copied()),
        1e3 * rms(axial.iter().copied())
    );
    near(rms(lateral.into_iter()), 1.5 * 0.8 * 3.0 / 585.0, 0.06);
    near(
        rms(axial.into_iter()),
        0.0012 + 0.0019 * 2.6f64.powi(2),
        0.06,
    );
}

#[test]
fn slow_noise_has_its_size_and_remembers_for_its_time() {
    let errors = SensorErrors {
        correlated_lateral_mm: 6.0,
        correlated_axial_mm: 10.0,
        ..SensorErrors::none()
    };
    let world = world(errors);
    let frames = frames(&world, 1, 6000);
    let errors: Vec<Vec<_>> = frames
        .iter()
        .map(|frame| deviations(&world, 1, frame))
        .collect();
    let axial = |k: usize, j: usize| {
        let (_, at, error) = errors[k][j];
        error.dot(&at.normalize()) * 3.0 / at.z
    };
    let side = |k: usize, j: usize| {
        let (_, at, error) = errors[k][j];
        (error - at.normalize() * error.dot(&at.normalize())).norm() / 2f64.sqrt()
    };
    let all = || (0..frames.len() - 12).flat_map(|k| (0..25).map(move |j| (k, j)));
    near(rms(all().map(|(k, j)| axial(k, j))), 0.010, 0.05);
    near(rms(all().map(|(k, j)| side(k, j))), 0.006, 0.05);
    let variance = rms(all().map(|(k, j)| axial(k, j))).powi(2);
    let count = all().count() as f64;
    let kept = all()
        .map(|(k, j)| axial(k, j) * axial(k + 12, j))
        .sum::<f64>()
        / count
        / variance;
    assert!(
        (kept - (-1.0f64).exp()).abs() < 0.05,
        "after 0.4 s {kept} of it is left"
    );
}

#[test]
fn biases_are_constant_in_the_body_and_towards_the_sensor() {
    let on = |body_bias_mm, ray_bias_mm, ray_bias_spread_mm, sensor_bias_mm| {
        world(SensorErrors {
            body_bias_mm,
            ray_bias_mm,
            ray_bias_spread_mm,
            sensor_bias_mm,
            ..SensorErrors::none()
        })
    };
    let ray = on(0.0, 15.0, 0.0, 0.0);
    for (_, at, error) in deviations(&ray, 2, &frames(&ray, 2, 1)[0]) {
        assert!((error + at.normalize() * 0.015).norm() < 1e-9);
    }
    let spread = on(0.0, 15.0, 6.0, 0.0);
    let size = |sensor: usize, at: usize| -> Vec<f64> {
        let frame = &frames(&spread, sensor, at)[at - 1];
        deviations(&spread, sensor, frame)
            .iter()
            .map(|(_, _, error)| error.norm())
            .collect()
    };
    let (first, later, other) = (size(0, 1), size(0, 90), size(3, 50));
    assert!(
        first
            .iter()
            .zip(&later)
            .chain(first.iter().zip(&other))
            .all(|(a, b)| (a - b).abs() < 1e-9)
    );
    assert!((0.003..0.010).contains(&rms(first.iter().map(|v| v - 0.015))));
    // A body bias moves with the body, the same for all sensors.
    let body = on(10.0, 0.0, 0.0, 0.0);
    let in_body = |sensor: usize, at: usize| {
        let frame = &frames(&body, sensor, at)[at - 1];
        let truth = &body.truth(frame.at_ns as f64 * 1e-9)[0].joints;
        let pose = body.room_from_sensor(sensor).inverse();
        let axes = noise::body_axes(&truth.map(|_, p| pose.apply(*p)));
        deviations(&body, sensor, frame)
            .into_iter()
            .map(|(_, _, e)| axes.transpose() * e)
            .collect::<Vec<_>>()
    };
    let (first, later) = (in_body(0, 1), in_body(3, 200));
    assert!(first.iter().zip(&later).all(|(a, b)| (a - b).norm() < 1e-9));
    near(
        rms(first.iter().flat_map(|e| e.iter().copied())),
        0.010,
        0.25,
    );
    let own = on(0.0, 0.0, 0.0, 8.0);
    let of = |sensor: usize| deviations(&own, sensor, &frames(&own, sensor, 1)[0])[3].2;
    assert!(of(0).norm() > 1e-4 && (of(0) - of(1)).norm() > 1e-4);
}

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
fn spikes_come_as_often_as_told_with_full_confidence() {
    let world = world(SensorErrors {
        spikes_per_s: 0.15,
        ..SensorErrors::none()
    });
    let frames = frames(&world, 0, 30 * 600);
    let (mut begun, mut before) = (0, false);
    for frame in &frames {
        let jumped: Vec<_> = deviations(&world, 0, frame)
            .into_iter()
            .filter(|(_, _, error)| error.norm() > 1e-9)
            .collect();
        for (joint, _, error) in &jumped {
            assert!((0.1..0.61).contains(&error.norm()));
            assert_eq!(
                frame.bodies[0].joints[*joint as usize].unwrap().confidence,
                Confidence::FULL
            );
        }
        begun += usize::from(!jumped.is_empty() && !before);
        before = !jumped.is_empty();
    }
    // 90 are expected, some of which overlap.
    assert!((60..=120).contains(&begun), "{begun} in 600 s");
}

#[test]
fn clocks_drops_delays_and_stale_frames() {
    let world = world(SensorErrors {
        clock_offset_ms: 50.0,
        clock_drift_ppm: 50.0,
        clock_jitter_ms: 2.0,
        drops: 0.02,
        delay_ms: 15.0,
        delay_jitter_ms: 3.0,
        stale: 0.06,
        white_noise: 1.0,
        ..SensorErrors::none()
    });
    let clock = world.sensor_clock(1);
    assert!(
        clock.offset_ns != 0
            && clock.offset_ns.abs() <= 50_000_000
            && clock.drift_ppm.abs() <= 50.0
    );
    assert_ne!(clock, world.sensor_clock(2));
    let frames = frames(&world, 1, 10_000);
    let jitter = frames
        .iter()
        .map(|f| f.captured.since_ns(clock.shows(f.at_ns)) as f64 * 1e-9);
    near(rms(jitter), 0.002, 0.05);
    let hour = 3_600_000_000_000;
    let gained = clock.shows(hour).ns() - hour - clock.offset_ns;
    near(gained as f64, hour as f64 * clock.drift_ppm * 1e-6, 1e-6);
    let dropped = frames.iter().filter(|frame| frame.dropped).count() as f64 / 10_000.0;
    assert!((dropped - 0.02).abs() < 0.006, "{dropped}");
    assert!(
        frames
            .iter()
            .all(|frame| frame.bodies.is_empty() == frame.dropped)
    );
    let stale = frames
        .windows(2)
        .filter(|pair| !pair[0].dropped && pair[0].bodies == pair[1].bodies)
        .count();
    assert!((stale as f64 / 10_000.0 - 0.06).abs() < 0.012, "{stale}");
    assert!(
        frames
            .iter()
            .all(|frame| frame.arrival_delay_ns >= 15_000_000)
    );
    let spaced = frames
        .windows(2)
        .all(|pair| ((pair[1].at_ns - pair[0].at_ns) - 33_333_333).abs() <= 1);
    assert!(spaced, "30 frames per second");
}

#[test]
fn interference_grows_with_the_number_of_structured_light_sensors() {
    let noise_with = |structured_light: usize| {
        let world = world_of(Scenario {
            structured_light,
            errors: SensorErrors {
                white_noise: 1.0,
                interference: 0.35,
                ..SensorErrors::none()
            },
            ..Scenario::default()
        });
        let frames = frames(&world, 0, 300);
        let missing = frames
            .iter()
            .flat_map(|f| &f.bodies[0].joints)
            .filter(|j| j.is_none())
            .count();
        let errors = frames.iter().flat_map(|frame| deviations(&world, 0, frame));
        (rms(errors.map(|(_, _, error)| error.norm())), missing)
    };
    let (alone, whole) = noise_with(1);
    let (four, holes) = noise_with(4);
    assert_eq!((alone, whole), noise_with(0));
    near(four / alone, 1.0 + 3.0 * 0.35, 0.03);
    assert!(whole == 0 && holes > 200, "{holes} of 7500 joints lost");
}

#[test]
fn impossible_scenarios_are_refused_by_name() {
    let refused = |scenario: Scenario| World::new(&scenario).unwrap_err().to_string();
    let none = Scenario {
        sensors: 0,
        ..Scenario::default()
    };
    assert!(refused(none).contains("`sensors` must be 1 to 64, found 0"));
    let crowd = Scenario {
        people: 9,
        ..Scenario::default()
    };
    assert!(refused(crowd).contains("`people`"));
    let errors = SensorErrors {
        drops: f64::NAN,
        ..SensorErrors::none()
    };
    assert!(
        refused(Scenario {
            errors,
            ..Scenario::default()
        })
        .contains("`errors.drops`")
    );
}

#[test]
fn scenarios_are_read_from_toml_and_typos_refused() {
    let text = "seed = 5\nlayout = \"arc\"\n[errors]\nspikes_per_s = 0.0\n";
    let scenario: Scenario = toml::from_str(text).unwrap();
    let errors = SensorErrors {
        spikes_per_s: 0.0,
        ..SensorErrors::default()
    };
    let expected = Scenario {
        seed: 5,
        layout: Layout::Arc,
        errors,
        ..Scenario::default()
    };
    assert_eq!(scenario, expected);
    assert_eq!(
        toml::from_str::<Scenario>(&toml::to_string(&scenario).unwrap()).unwrap(),
        scenario
    );
    let typo = toml::from_str::<Scenario>("[errors]\nspikes = 1.0\n").unwrap_err();
    assert!(typo.to_string().contains("spikes_per_s"), "{typo}");
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
