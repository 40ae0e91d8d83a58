//! A calibration's text: what it keeps, what it looks like, what it refuses.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_skeleton::calibration_text::{CalibrationFileError, from_toml, to_toml};
use posefuse_skeleton::{Calibration, FloorSource, SensorPose, Transform};
use proptest::prelude::*;

fn calibration(position: [f64; 3], turn: [f64; 3], name: &str) -> Calibration {
    let pose = SensorPose {
        room_from_sensor: Transform::from_parts(
            Vector3::from(position),
            UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
        ),
        time_offset_ns: -12_345_678,
        residual_median_m: 0.0234,
        residual_p95_m: 0.0617,
        samples: 51_234,
        ..SensorPose::default()
    };
    Calibration {
        created: "2024-05-01T12:00:00Z".to_owned(),
        method: "svd".to_owned(),
        floor: FloorSource::Walk,
        sensors: BTreeMap::from([(name.to_owned(), pose)]),
        ..Calibration::default()
    }
}

fn usual() -> String {
    to_toml(&calibration([3.0, -0.5, 1.2], [0.0; 3], "left"))
}

fn refused(find: &str, put: &str) -> CalibrationFileError {
    let text = usual();
    assert!(text.contains(find), "{text}");
    from_toml(&text.replacen(find, put, 1)).unwrap_err()
}

#[test]
fn a_person_can_read_it() {
    let expected = "\
# Where each sensor stands: room x forward, y left, z up, metres.
# The sensor looks along its own z, its x is to the right and its y down.
version = 1
created = \"2024-05-01T12:00:00Z\"
method = \"svd\"
floor = \"walk\" # walk, manual or assumed

[sensors.\"left\"]
position_m = [3.000000000, -0.500000000, 1.200000000]
# roll 0.00, pitch 0.00, yaw 0.00 degrees
orientation_xyzw = [0.000000000000, 0.000000000000, 0.000000000000, 1.000000000000]
time_offset_ms = -12.345678 # added to its capture times
residual_median_mm = 23.400000
residual_p95_mm = 61.700000
samples = 51234
";
    assert_eq!(usual(), expected);
}

proptest! {
    #[test]
    fn what_is_written_is_read(
        position in [-9.0..9.0, -9.0..9.0, -9.0..9.0],
        turn in [-1.8..1.8, -1.8..1.8, -1.8..1.8],
        name in ".{1,12}",
    ) {
        let written = calibration(position, turn, &name);
        let read = from_toml(&to_toml(&written)).unwrap();
        let (a, b) = (&written.sensors[&name], &read.sensors[&name]);
        let off = a.room_from_sensor.inverse().then(&b.room_from_sensor);
        prop_assert!(off.isometry().translation.vector.norm() < 1e-8);
        prop_assert!(off.isometry().rotation.angle() < 1e-8);
        prop_assert_eq!(a.time_offset_ns, b.time_offset_ns);
        prop_assert!((a.residual_median_m - b.residual_median_m).abs() < 1e-9);
        prop_assert_eq!(a.samples, b.samples);
        prop_assert_eq!((&written.created, &written.method, written.floor), (&read.created, &read.method, read.floor));
    }

    #[test]
    fn no_text_makes_it_panic(text in "\\PC{0,200}") {
        let _ = from_toml(&text);
    }
}

#[test]
fn hand_edited_nonsense_is_refused_by_name() {
    let value = |error: &CalibrationFileError, wanted: &str| {
        assert!(
            matches!(error, CalibrationFileError::Value { key, .. } if *key == wanted),
            "{error}"
        );
        assert!(error.to_string().contains("`left`"), "{error}");
    };
    value(&refused("3.000000000", "nan"), "position_m");
    value(&refused("3.000000000", "inf"), "position_m");
    value(&refused("3.000000000", "3000.0"), "position_m");
    value(&refused("1.000000000000]", "-0.5]"), "orientation_xyzw");
    value(&refused("1.000000000000]", "0.0]"), "orientation_xyzw");
    value(&refused("1.000000000000]", "nan]"), "orientation_xyzw");
    value(&refused("-12.345678", "nan"), "time_offset_ms");
    value(&refused("23.400000", "-1.0"), "residual_median_mm");
    value(&refused("61.700000", "inf"), "residual_p95_mm");
}

#[test]
fn typing_errors_and_other_files_are_refused() {
    let syntax = |error: CalibrationFileError, part: &str| {
        assert!(matches!(error, CalibrationFileError::Syntax(_)), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    };
    syntax(refused("position_m", "positon_m"), "positon_m");
    syntax(refused("method", "metod"), "metod");
    syntax(refused("\"walk\"", "\"wlak\""), "wlak");
    // A rotation matrix where the quaternion belongs, e.g. a reflection from another program.
    let matrix = "orientation_xyzw = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]\n#";
    syntax(refused("orientation_xyzw", matrix), "orientation_xyzw");
    syntax(from_toml("").unwrap_err(), "version");
    syntax(from_toml("not toml at all").unwrap_err(), "calibrate again");
    assert_eq!(
        refused("version = 1", "version = 2\nnew_key = 3"),
        CalibrationFileError::Version {
            found: 2,
            expected: 1
        }
    );
    let empty = Calibration {
        sensors: BTreeMap::new(),
        ..calibration([0.0; 3], [0.0; 3], "a")
    };
    assert_eq!(
        from_toml(&to_toml(&empty)),
        Err(CalibrationFileError::Empty)
    );
}

#[test]
fn a_quaternion_typed_with_three_decimals_is_taken_and_made_unit() {
    let text = usual().replacen(
        "[0.000000000000, 0.000000000000, 0.000000000000, 1.000000000000]",
        "[0.5, -0.5, 0.5, -0.499]",
        1,
    );
    let rotation = from_toml(&text).unwrap().sensors["left"]
        .room_from_sensor
        .rotation();
    assert!((rotation.norm() - 1.0).abs() < 1e-12);
}
