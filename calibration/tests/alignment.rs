//! Laws of rigid alignment.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{Degenerate, PointPair, kabsch};
use posefuse_skeleton::{Position, Room, Sensor, Transform};
use proptest::prelude::*;

type Pair = PointPair<Room, Sensor>;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-size..size, -size..size, -size..size].prop_map(Vector3::from)
}

fn motion() -> impl Strategy<Value = Transform<Room, Sensor>> {
    (vector(5.0), vector(3.0)).prop_map(|(shift, turn)| {
        Transform::from_parts(shift, UnitQuaternion::from_scaled_axis(turn))
    })
}

fn pairs(points: &[Vector3<f64>], room_from_sensor: &Transform<Room, Sensor>) -> Vec<Pair> {
    let pair = |point: &Vector3<f64>| {
        let from = Position::from_vector(*point);
        PointPair {
            to: room_from_sensor.apply(from),
            from,
            weight: 1.0,
        }
    };
    points.iter().map(pair).collect()
}

/// Twice the area of the largest triangle, relative to the longest side squared: 0 on a line.
fn off_line(points: &[Vector3<f64>]) -> f64 {
    let d: Vec<_> = points[1..].iter().map(|p| p - points[0]).collect();
    let longest = d.iter().map(|d| d.norm()).fold(0.0, f64::max);
    let area = d
        .iter()
        .flat_map(|a| d.iter().map(move |b| a.cross(b).norm()))
        .fold(0.0, f64::max);
    area / (longest * longest)
}

proptest! {
    #[test]
    fn exact_data_gives_the_motion_back(
        points in prop::collection::vec(vector(2.0), 3..30),
        room_from_sensor in motion(),
    ) {
        prop_assume!(off_line(&points) > 0.01);
        let fit = kabsch(&pairs(&points, &room_from_sensor)).unwrap();
        let off = room_from_sensor.inverse().then(&fit.to_from_from);
        let off = off.isometry();
        prop_assert!(off.translation.vector.norm() < 1e-9, "{off}");
        prop_assert!(off.rotation.angle() < 1e-9, "{off}");
        prop_assert!(fit.rms_m < 1e-9);
    }

    #[test]
    fn whatever_the_data_the_answer_is_no_reflection(
        points in prop::collection::vec((vector(2.0), vector(2.0), 0.0..1.0), 4..20),
    ) {
        let pairs: Vec<Pair> = points
            .iter()
            .map(|(to, from, weight)| PointPair {
                to: Position::from_vector(*to),
                from: Position::from_vector(*from),
                weight: *weight,
            })
            .collect();
        if let Ok(fit) = kabsch(&pairs) {
            let rotation = fit.to_from_from.rotation().to_rotation_matrix();
            prop_assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn no_other_motion_fits_better(
        points in prop::collection::vec((vector(1.0), vector(0.1)), 4..20),
        room_from_sensor in motion(),
        nudge in (vector(0.05), vector(0.05)),
    ) {
        let exact: Vec<_> = points.iter().map(|(p, _)| *p).collect();
        prop_assume!(off_line(&exact) > 0.01);
        let mut pairs = pairs(&exact, &room_from_sensor);
        for (pair, (_, noise)) in pairs.iter_mut().zip(&points) {
            pair.to = pair.to.moved(*noise);
        }
        let Ok(fit) = kabsch(&pairs) else { return Ok(()) };
        let rms = |t: &Transform<Room, Sensor>| {
            let squares: f64 = pairs.iter().map(|p| t.apply(p.from).distance(p.to).powi(2)).sum();
            (squares / pairs.len() as f64).sqrt()
        };
        let nudge = Translation3::from(nudge.0) * UnitQuaternion::from_scaled_axis(nudge.1);
        let other = Transform::from_isometry(nudge * fit.to_from_from.isometry());
        prop_assert!((rms(&fit.to_from_from) - fit.rms_m).abs() < 1e-9);
        prop_assert!(fit.rms_m <= rms(&other) + 1e-9);
    }
}

#[test]
fn a_mirrored_cloud_is_not_answered_with_a_mirror() {
    let points: Vec<_> = (0..8)
        .map(|i| {
            Vector3::new(
                f64::from(i & 1),
                f64::from(i >> 1 & 1) * 2.0,
                f64::from(i >> 2) * 3.0 + f64::from(i),
            )
        })
        .collect();
    let mirrored: Vec<Pair> = points
        .iter()
        .map(|p| PointPair {
            to: Position::new(-p.x, p.y, p.z),
            from: Position::from_vector(*p),
            weight: 1.0,
        })
        .collect();
    let fit = kabsch(&mirrored).unwrap();
    let determinant = fit
        .to_from_from
        .rotation()
        .to_rotation_matrix()
        .matrix()
        .determinant();
    assert!(
        (determinant - 1.0).abs() < 1e-12 && fit.rms_m > 0.1,
        "{fit:?}"
    );
}

#[test]
fn weightless_outliers_do_not_matter_and_flatness_is_told() {
    let room_from_sensor = Transform::from_parts(
        Vector3::new(1.0, 2.0, 3.0),
        UnitQuaternion::from_euler_angles(0.1, 0.2, 3.0),
    );
    let flat: Vec<_> = (0..9)
        .map(|i| Vector3::new(f64::from(i % 3), f64::from(i / 3), 1.0))
        .collect();
    let mut pairs = pairs(&flat, &room_from_sensor);
    pairs.push(PointPair {
        to: Position::new(50.0, 0.0, 0.0),
        from: Position::new(0.0, 50.0, 0.0),
        weight: 0.0,
    });
    let fit = kabsch(&pairs).unwrap();
    assert!(fit.rms_m < 1e-12 && fit.singular_ratio < 1e-6, "{fit:?}");
}

#[test]
fn what_determines_no_motion_is_refused() {
    let still = Transform::identity();
    let line: Vec<_> = (0..9)
        .map(|i| Vector3::new(1.0, 2.0, 3.0) * f64::from(i))
        .collect();
    assert!(matches!(
        kabsch(&pairs(&line, &still)),
        Err(Degenerate::Line(_))
    ));
    let place = [Vector3::new(1.0, 2.0, 3.0); 5];
    assert!(matches!(
        kabsch(&pairs(&place, &still)),
        Err(Degenerate::Line(_))
    ));
    assert_eq!(
        kabsch(&pairs(&line[..2], &still)),
        Err(Degenerate::TooFew(2))
    );
    assert_eq!(kabsch::<Room, Sensor>(&[]), Err(Degenerate::TooFew(0)));
    let mut pairs = pairs(&[Vector3::x(), Vector3::y(), Vector3::z()], &still);
    pairs[1].weight = -1.0;
    assert_eq!(kabsch(&pairs), Err(Degenerate::NotFinite));
    pairs[1].weight = 1.0;
    pairs[2].to = Position::new(f64::NAN, 0.0, 0.0);
    assert_eq!(kabsch(&pairs), Err(Degenerate::NotFinite));
}
