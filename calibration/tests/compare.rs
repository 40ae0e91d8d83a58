//! How two calibrations differ, whatever room frames they have.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{Change, compare, moved};
use posefuse_skeleton::{Calibration, SensorPose, Transform};
use proptest::prelude::*;

fn ring(count: usize) -> Calibration {
    let pose = |index: usize| {
        let angle = index as f64 * std::f64::consts::TAU / count as f64;
        let place = Translation3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.5);
        let look = UnitQuaternion::from_euler_angles(-1.6, 0.1 * index as f64, angle + 1.5);
        let pose = SensorPose {
            room_from_sensor: Transform::from_isometry(Isometry3::from_parts(place, look)),
            time_offset_ns: -3_000_000 * index as i64,
            ..SensorPose::default()
        };
        (format!("cam{index}"), pose)
    };
    Calibration {
        sensors: (0..count).map(pose).collect(),
        ..Calibration::default()
    }
}

fn by_how_much(before: &Calibration, after: &Calibration) -> Vec<(f64, f64, f64)> {
    compare(before, after)
        .into_iter()
        .map(|row| match row.change {
            Change::Moved { mm, deg, ms } => (mm, deg, ms),
            other => panic!("{}: {other:?}", row.sensor),
        })
        .collect()
}

proptest! {
    #[test]
    fn another_room_frame_is_no_difference(
        count in 1..6_usize, turn in -3.0..3.0_f64, shift in prop::array::uniform3(-5.0..5.0_f64),
    ) {
        let before = ring(count);
        let after = moved(&before, turn, Vector3::from(shift));
        for (mm, deg, ms) in by_how_much(&before, &after) {
            prop_assert!(mm < 1e-6 && deg < 1e-6 && ms.abs() < 1e-9, "{mm} mm {deg} deg {ms} ms");
        }
    }

    #[test]
    fn the_one_sensor_that_moved_is_found(
        count in 3..6_usize, which in 0..3_usize, turn in -3.0..3.0_f64, mm in 20.0..200.0_f64, deg in 1.0..8.0_f64,
    ) {
        let before = ring(count);
        let mut after = moved(&before, turn, Vector3::new(1.0, -2.0, 0.3));
        let pose = after.sensors.values_mut().nth(which).unwrap();
        let bump = Isometry3::from_parts(
            (Vector3::new(0.6, 0.0, 0.8) * mm * 1e-3).into(),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 1.0, 0.0) * deg.to_radians()),
        );
        pose.room_from_sensor = Transform::from_isometry(pose.room_from_sensor.isometry() * bump);
        pose.time_offset_ns += 7_000_000;
        for (index, (found_mm, found_deg, ms)) in by_how_much(&before, &after).into_iter().enumerate() {
            let (wanted_mm, wanted_deg, wanted_ms) = if index == which { (mm, deg, 7.0) } else { (0.0, 0.0, 0.0) };
            // What the fit gives way is little beside the bump.
            prop_assert!((found_mm - wanted_mm).abs() < 0.05 * mm, "{index}: {found_mm} mm of {wanted_mm}");
            prop_assert!((found_deg - wanted_deg).abs() < 0.05 * deg, "{index}: {found_deg} deg of {wanted_deg}");
            prop_assert!((ms - wanted_ms).abs() < 1e-6);
        }
    }
}

#[test]
fn sensors_of_only_one_calibration_are_named() {
    let mut before = ring(4);
    let mut after = before.clone();
    before.sensors.remove("cam0");
    after.sensors.remove("cam3");
    let rows = compare(&before, &after);
    let change = |name: &str| rows.iter().find(|row| row.sensor == name).unwrap().change;
    assert_eq!(rows.len(), 4);
    assert_eq!(change("cam0"), Change::MissingBefore);
    assert_eq!(change("cam3"), Change::MissingAfter);
    assert!(matches!(change("cam1"), Change::Moved { mm, .. } if mm < 1e-6));
    assert!(compare(&Calibration::default(), &Calibration::default()).is_empty());
}

#[test]
fn a_room_turned_by_hand_turns_its_sensors_about_the_vertical() {
    let mut room = Calibration::default();
    let pose = SensorPose {
        room_from_sensor: Transform::from_parts(
            Vector3::new(2.0, 0.0, 1.0),
            UnitQuaternion::identity(),
        ),
        ..SensorPose::default()
    };
    room.sensors.insert("left".to_owned(), pose);
    let turned = moved(&room, 90f64.to_radians(), Vector3::new(0.0, 0.0, 0.5));
    let place = turned.sensors["left"].room_from_sensor.origin().vector();
    assert!(
        (place - Vector3::new(0.0, 2.0, 1.5)).norm() < 1e-12,
        "{place}"
    );
}
