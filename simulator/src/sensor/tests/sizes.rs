//! Noise, biases, spikes, interference: sizes as told.

use super::*;

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
