//! Calibrations in the forms of other programs: what is written reads back, and what no sensor can have is refused.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_calibration::formats::{Format, FormatError, export, import};
use posefuse_skeleton::{
    Calibration, FloorSource, Joint, JointMap, JointSet, PoseSigma, SensorPose, Transform,
};
use proptest::prelude::*;

fn pose(t: [f64; 3], turn: [f64; 3], time_offset_ns: i64) -> SensorPose {
    SensorPose {
        room_from_sensor: Transform::from_parts(
            Vector3::from(t),
            UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
        ),
        time_offset_ns,
        ..SensorPose::default()
    }
}

fn example() -> Calibration {
    let left = SensorPose {
        residual_median_m: 0.021,
        residual_p95_m: 0.06,
        samples: 1200,
        sigma: Some(PoseSigma {
            position_m: 0.003,
            rotation_rad: 0.001,
            time_s: 0.0004,
        }),
        ..pose([1.25, -2.0, 1.5], [1.2, -1.2, 1.2], -12_345_678)
    };
    let mut ray_bias_m = JointMap::default();
    ray_bias_m[Joint::Head] = Some(0.015);
    let mut offsets = JointMap::default();
    offsets[Joint::Neck] = Some(Vector3::new(0.0, 0.02, -0.01));
    Calibration {
        created: "2026-01-01T00:00:00Z".to_owned(),
        method: "svd".to_owned(),
        floor: FloorSource::Walk,
        verdict: "weak".to_owned(),
        sensors: [
            ("left".to_owned(), left),
            (
                "right.2".to_owned(),
                pose([0.0, 3.0, 1.0], [0.0, 0.0, 3.1], 0),
            ),
        ]
        .into(),
        ray_bias_m,
        joint_offsets_m: [(JointSet::Nite, offsets)].into(),
    }
}

fn assert_same_poses(a: &Calibration, b: &Calibration, format: Format) {
    assert_eq!(
        a.sensors.keys().collect::<Vec<_>>(),
        b.sensors.keys().collect::<Vec<_>>()
    );
    for (name, pose) in &a.sensors {
        let (one, other) = (&pose.room_from_sensor, &b.sensors[name].room_from_sensor);
        let off = one.origin().distance(other.origin());
        let turned = one.rotation().angle_to(&other.rotation());
        assert!(
            off < 1e-6 && turned < 1e-6,
            "{format:?} {name}: {off} m, {turned} rad"
        );
        if format != Format::Tf2Yaml {
            let ns = pose.time_offset_ns - b.sensors[name].time_offset_ns;
            assert!(ns.abs() <= 1, "{format:?} {name}: {ns} ns");
        }
    }
}

proptest! {
    #[test]
    fn every_form_gives_the_same_poses_back(
        sensors in prop::collection::btree_map(
            "[A-Za-z0-9][A-Za-z0-9_.-]{0,12}",
            (prop::array::uniform3(-50.0..50.0_f64), prop::array::uniform3(-1.8..1.8_f64), -9_000_000_000..9_000_000_000_i64),
            1..6,
        ),
    ) {
        let sensors = sensors.into_iter().map(|(name, (t, turn, offset))| (name, pose(t, turn, offset)));
        let calibration = Calibration { sensors: sensors.collect(), ..Calibration::default() };
        for format in Format::ALL {
            let text = export(&calibration, format);
            prop_assert_eq!(Format::detect(&text), Some(format), "{}", text);
            let read = import(&text, None).unwrap();
            // A name like `x_optical` is what another frame is called, too.
            if calibration.sensors.keys().all(|name| !name.contains("_optical") && !name.ends_with("_frame")) {
                assert_same_poses(&calibration, &read, format);
            }
        }
    }

    #[test]
    fn no_text_makes_it_panic(text in "\\PC{0,80}", format in 0..4_usize) {
        let _ = import(&text, None);
        let _ = import(&text, Some(Format::ALL[format]));
    }

    #[test]
    fn no_damage_to_a_file_makes_it_panic(format in 0..4_usize, at in 0..600_usize, put in "\\PC{0,3}") {
        let text = export(&example(), Format::ALL[format]);
        let (before, after) = text.split_at(text.floor_char_boundary(at));
        let after = after.get(1..).unwrap_or_default();
        let _ = import(&format!("{before}{put}{after}"), Some(Format::ALL[format]));
    }
}

#[test]
fn json_holds_everything_that_toml_does() {
    let calibration = example();
    let from_json = import(&export(&calibration, Format::Json), None).unwrap();
    let from_toml = import(&export(&calibration, Format::Toml), None).unwrap();
    for (one, other) in [(&from_json, &calibration), (&from_toml, &from_json)] {
        assert_eq!(
            (&one.created, &one.method, one.floor, &one.verdict),
            (&other.created, &other.method, other.floor, &other.verdict)
        );
        let (a, b) = (&one.sensors["left"], &other.sensors["left"]);
        assert_eq!(a.samples, b.samples);
        assert!((a.residual_p95_m - b.residual_p95_m).abs() < 1e-9);
        let (a, b) = (a.sigma.unwrap(), b.sigma.unwrap());
        assert!((a.rotation_rad - b.rotation_rad).abs() < 1e-7);
        let bias = |c: &Calibration| c.ray_bias_m[Joint::Head].unwrap();
        assert!((bias(one) - bias(other)).abs() < 1e-9);
        let neck = |c: &Calibration| c.joint_offsets_m[&JointSet::Nite][Joint::Neck].unwrap();
        assert!((neck(one) - neck(other)).norm() < 1e-9);
    }
}

#[test]
fn what_other_programs_cannot_say_is_plain_after_import() {
    for format in [Format::Tf2Yaml, Format::OpenCvYaml] {
        let read = import(&export(&example(), format), None).unwrap();
        assert_eq!(
            (read.verdict.as_str(), read.floor),
            ("", FloorSource::Manual)
        );
        assert!(read.created.is_empty() && read.joint_offsets_m.is_empty());
        assert_eq!(read.method, "import");
    }
}

#[test]
fn opencv_s_extrinsics_take_the_room_to_the_sensor() {
    let text = export(&example(), Format::OpenCvYaml);
    // A point of the room, by hand through R and t of the file, is what the pose says.
    let data = |key: &str| -> Vec<f64> {
        let part = &text[text.find(&format!("{key}: !!opencv-matrix")).unwrap()..];
        let list = &part[part.find('[').unwrap() + 1..part.find(']').unwrap()];
        list.split(',').map(|n| n.trim().parse().unwrap()).collect()
    };
    let (r, t) = (data("R"), data("t"));
    let room = Vector3::new(0.3, -1.0, 1.7);
    let seen: Vec<f64> = (0..3)
        .map(|row| (0..3).map(|c| r[3 * row + c] * room[c]).sum::<f64>() + t[row])
        .collect();
    let pose = &example().sensors["left"];
    let expected = pose
        .room_from_sensor
        .inverse()
        .apply(posefuse_skeleton::Position::from_vector(room));
    assert!((expected.vector() - Vector3::from_vec(seen)).norm() < 1e-9);
}

const OPENCV: &str = "%YAML:1.0\n---\nsensors:\n   -\n      name: left\n      R: !!opencv-matrix\n         rows: 3\n         \
    cols: 3\n         dt: d\n         data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]\n      t: !!opencv-matrix\n         \
    rows: 3\n         cols: 1\n         dt: d\n         data: [ 0.5, 0., 2. ]\n";

#[test]
fn opencv_files_are_read_as_opencv_writes_them_and_nonsense_is_refused() {
    let read = import(OPENCV, None).unwrap();
    let place = read.sensors["left"].room_from_sensor.origin().vector();
    assert!((place - Vector3::new(-0.5, 0.0, -2.0)).norm() < 1e-12);
    let vector = OPENCV.replacen("cols: 3", "cols: 1", 1).replace(
        "1., 0., 0., 0., 1., 0., 0., 0., 1.",
        "0., 0., 1.5707963267948966",
    );
    let turned = import(&vector, None).unwrap().sensors["left"].room_from_sensor;
    assert!((turned.rotation().angle() - 90f64.to_radians()).abs() < 1e-9);

    for (find, put, says) in [
        ("0., 0., 1. ]", "0., 0., -1. ]", "a reflection"),
        ("1., 0., 0., 0., 1.", "1., 0., 0., 0., 1.2", "orthonormal"),
        ("0.5, 0., 2.", "500., 0., 2000.", "millimetres: divide"),
        ("0.5, 0., 2.", ".Nan, 0., 2.", "OpenCV YAML"),
        ("rows: 3", "rows: 2", "3x3"),
        ("name: left", "nam: left", "name"),
        (
            "sensors:",
            "convention: upside_down\nsensors:",
            "upside_down",
        ),
    ] {
        assert!(OPENCV.contains(find), "{find}");
        let error = import(&OPENCV.replacen(find, put, 1), None)
            .unwrap_err()
            .to_string();
        assert!(error.contains(says), "{put}: {error}");
    }
}

fn stamped(parent: &str, child: &str, x: &str) -> String {
    format!(
        "- header:\n    stamp: {{sec: 0, nanosec: 0}}\n    frame_id: {parent}\n  child_frame_id: {child}\n  transform:\n    \
         translation: {{x: {x}, y: 0.0, z: 1}}\n    rotation: {{x: 0.0, y: 0.0, z: 0.0, w: 1.0}}\n"
    )
}

#[test]
fn ros_trees_are_followed_to_their_root() {
    let text = format!(
        "transforms:\n{}{}---\ntransforms:\n{}---\n",
        stamped("map", "mast", "1.0"),
        stamped("/mast", "/left_optical_frame", "0.5"),
        stamped("map", "right", "-2.0"),
    );
    let read = import(&text, None).unwrap();
    let x = |name: &str| read.sensors[name].room_from_sensor.origin().vector().x;
    assert_eq!(read.sensors.len(), 2);
    assert!((x("left") - 1.5).abs() < 1e-12 && (x("right") + 2.0).abs() < 1e-12);
    let list = stamped("map", "left_optical", "1.0");
    assert_eq!(import(&list, None).unwrap().sensors.len(), 1);
}

#[test]
fn ros_files_that_place_nothing_in_one_room_are_refused() {
    for (text, says) in [
        (
            stamped("here", "left", "1.0") + &stamped("there", "right", "1.0"),
            "several roots: here, there",
        ),
        (
            stamped("a", "b", "1.0") + &stamped("b", "a", "1.0"),
            "names no sensor",
        ),
        (
            stamped("map", "a", "1.0") + &stamped("map", "a", "2.0"),
            "twice",
        ),
        (stamped("map", "a", "1500.0"), "millimetres: divide"),
        (stamped("map", "a", ".nan"), "position_m must be"),
        (
            stamped("map", "a", "1.0").replace("w: 1.0", "w: 0.5"),
            "no unit quaternion",
        ),
    ] {
        let error = import(&text, None).unwrap_err().to_string();
        assert!(error.contains(says), "{text}\n{error}");
    }
}

#[test]
fn other_texts_and_other_versions_are_told_apart() {
    assert_eq!(import("hello there", None), Err(FormatError::Unknown));
    let newer = export(&example(), Format::Json)
        .replace("\"version\": 1", "\"version\": 2, \"more\": true");
    let error = import(&newer, None).unwrap_err().to_string();
    assert!(error.contains("version 2"), "{error}");
    let nan = export(&example(), Format::Json).replace("1.25", "NaN");
    let error = import(&nan, None).unwrap_err().to_string();
    assert!(error.contains("line"), "{error}");
}
