//! The loaders on small files written here, and on all of CMU's files where they are.

mod cmu;
mod fixtures;

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use super::*;
use fixtures::{amc_text, asf_text, bvh_text, expmap_text};

fn at(pose: &JointMap<Position<Room>>, joint: Joint) -> Vector3<f64> {
    pose[joint].unwrap().vector()
}

fn close(a: Vector3<f64>, b: [f64; 3]) -> bool {
    (a - Vector3::from(b)).norm() < 1e-9
}

#[test]
fn a_bvh_becomes_a_clip_in_room_axes_and_metres() {
    let clip = bvh("fixture", &bvh_text("90")).unwrap();
    assert_eq!((clip.frames().len(), clip.rate_hz()), (2, 100.0));
    let first = &clip.frames()[0];
    // Toes at 100 - 5 - 82 - 6 = 7 cm are put at 2 cm.
    assert!(close(at(first, Joint::SpineBase), [0.0, 0.0, 0.95]));
    assert!(close(at(first, Joint::WristLeft), [0.0, 0.71, 1.45]));
    assert!(close(at(first, Joint::FootRight), [0.13, -0.09, 0.02]));
    let second = &clip.frames()[1];
    // File z is room x. Turned left: the left arm points backwards, its bent forearm to the body's front (left).
    assert!(close(at(second, Joint::SpineBase), [0.5, 0.0, 0.95]));
    assert!(close(at(second, Joint::ElbowLeft), [0.5 - 0.46, 0.0, 1.45]));
    assert!(close(
        at(second, Joint::WristLeft),
        [0.5 - 0.46, 0.25, 1.45]
    ));
}

#[test]
fn a_rest_pose_in_front_of_the_motion_is_left_out() {
    let text = bvh_text("0");
    assert_eq!(bvh("fixture", &text).unwrap().frames().len(), 1);
    // A motion that stays near its rest pose keeps its first frame.
    let lines: Vec<&str> = text.lines().collect();
    let (head, frames) = lines.split_at(lines.len() - 2);
    let still = format!("{}\n{}\n{}\n", head.join("\n"), frames[0], frames[0]);
    assert_eq!(bvh("fixture", &still).unwrap().frames().len(), 2);
}

#[test]
fn broken_bvh_files_are_refused_with_line_and_reason() {
    let text = bvh_text("90");
    let refused = |text: &str| bvh("broken", text).unwrap_err();
    let line_of = |needle: &str| text.lines().position(|line| line.contains(needle)).unwrap() + 1;
    let flaw = refused(&text.replace("OFFSET 0 45 0", "OFFSET 0 x 0"));
    assert_eq!(flaw.line, line_of("OFFSET 0 45 0"));
    assert!(flaw.reason.contains("`x`"), "{flaw}");
    let flaw = refused(&text.replace("Frames: 2", "Frames: 3"));
    assert!(flaw.reason.contains("expected 3 frames, found 2"), "{flaw}");
    let flaw = refused(text.trim_end().rsplit_once(' ').unwrap().0);
    assert_eq!(flaw.line, text.lines().count());
    assert!(flaw.reason.contains("found 47"), "{flaw}");
    let flaw = refused(&text.replace("LeftUpLeg", "Tail"));
    assert!(flaw.reason.contains("HipLeft"), "{flaw}");
    assert!(
        refused(&text.replace("0 100 50", "0 NaN 50"))
            .reason
            .contains("NaN")
    );
    assert!(
        refused(&text.replace("Zposition", "Wposition"))
            .reason
            .contains("Wposition")
    );
    let cut: Vec<&str> = text.lines().take(20).collect();
    assert!(refused(&cut.join("\n")).reason.contains("end of the file"));
    assert!(refused("").reason.contains("HIERARCHY"));
    assert!(
        refused(&text.replace("Frame Time: 0.01", "Frame Time: 0"))
            .reason
            .contains("rate")
    );
}

#[test]
fn acclaim_legs_hang_and_lift_about_their_own_axes() {
    let clip = acclaim("fixture", &asf_text(), &amc_text()).unwrap();
    assert_eq!(clip.frames().len(), 2);
    let unit = 0.0254 / 0.45;
    let (first, second) = (&clip.frames()[0], &clip.frames()[1]);
    let thigh = at(first, Joint::KneeLeft) - at(first, Joint::HipLeft);
    assert!(
        (thigh - Vector3::new(0.0, 0.0, -7.4 * unit)).norm() < 1e-6,
        "{thigh:?}"
    );
    let lifted = at(second, Joint::KneeLeft) - at(second, Joint::HipLeft);
    assert!(
        (lifted - Vector3::new(7.4 * unit, 0.0, 0.0)).norm() < 1e-6,
        "{lifted:?}"
    );
    assert!(at(first, Joint::WristLeft).y > 0.5 && at(first, Joint::WristRight).y < -0.5);
    assert_eq!(first.len(), 25);
}

#[test]
fn broken_acclaim_files_are_refused_with_line_and_reason() {
    let refused = |asf: &str, amc: &str| acclaim("broken", asf, amc).unwrap_err();
    let (asf, amc) = (asf_text(), amc_text());
    let flaw = refused(&asf, &amc.replacen("ltibia 0", "ltibia 0 0", 1));
    assert!(
        flaw.reason.contains("expected 1 numbers, found 2"),
        "{flaw}"
    );
    let line = amc
        .lines()
        .position(|line| line.starts_with("ltibia"))
        .unwrap()
        + 1;
    assert_eq!(flaw.line, line);
    assert!(
        refused(&asf, &amc.replacen("ltibia 0\n", "", 1))
            .reason
            .contains("`ltibia`")
    );
    assert!(
        refused(&asf, &amc.replacen("lfemur", "tail", 1))
            .reason
            .contains("`tail`")
    );
    assert!(
        refused(&asf, &amc.replacen("\n2\n", "\n3\n", 1))
            .reason
            .contains("frame number 2")
    );
    assert!(
        refused(&asf, ":DEGREES\n")
            .reason
            .contains("at least one frame")
    );
    assert!(
        refused(&asf.replace(":hierarchy", ":tree"), &amc)
            .reason
            .contains(":hierarchy")
    );
    assert!(
        refused(&asf.replacen("length 7.4", "length long", 1), &amc)
            .reason
            .contains("`long`")
    );
    assert!(
        refused(&asf.replace("angle deg", "angle gon"), &amc)
            .reason
            .contains("`gon`")
    );
}

#[test]
fn exponential_maps_turn_the_other_way_round() {
    let clip = expmap("fixture", &expmap_text()).unwrap();
    assert_eq!((clip.frames().len(), clip.rate_hz()), (1, 120.0));
    let pose = &clip.frames()[0];
    let thigh = at(pose, Joint::KneeLeft) - at(pose, Joint::HipLeft);
    assert!(
        thigh.xy().norm() < 1e-3 && thigh.z < -0.4,
        "legs hang: {thigh:?}"
    );
    let left = at(pose, Joint::HipLeft) - at(pose, Joint::HipRight);
    assert!(
        left.x < -0.17,
        "turned left, the left hip is behind: {left:?}"
    );
    assert_eq!(pose.len(), 25);
}

#[test]
fn broken_exponential_maps_are_refused_with_line_and_reason() {
    let text = expmap_text();
    let refused = |text: &str| expmap("broken", text).unwrap_err();
    let flaw = refused(text.trim_end().rsplit_once(',').unwrap().0);
    assert_eq!(
        (flaw.line, flaw.reason.contains("found 116")),
        (2, true),
        "{flaw}"
    );
    assert!(
        refused(&text.replacen("17", "inf", 1))
            .reason
            .contains("`inf`")
    );
    assert!(
        refused(text.lines().next().unwrap())
            .reason
            .contains("no frame")
    );
    assert!(refused("").reason.contains("no frame"));
}

#[test]
fn files_are_found_by_their_kind_and_named_when_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let amc = write("35_01.amc", &amc_text());
    let error = load(&amc).unwrap_err().to_string();
    assert!(
        error.contains("35_01.amc") && error.contains("35.asf"),
        "{error}"
    );
    let asf = write("35.asf", &asf_text());
    assert_eq!(load(&amc).unwrap().name(), "35_01");
    write("35.asf", "nothing");
    let error = load(&amc).unwrap_err().to_string();
    assert!(
        error.contains(&*asf.to_string_lossy()) && error.contains("line 1"),
        "{error}"
    );
    assert!(matches!(
        load(&folder.join("a.fbx")),
        Err(LoadError::UnknownKind { .. })
    ));
    assert!(matches!(
        load(&folder.join("none.bvh")),
        Err(LoadError::Unreadable { .. })
    ));
}

#[test]
fn salsa_is_danced_at_its_real_speed() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("salsa");
    std::fs::create_dir(&folder).unwrap();
    let text = bvh_text("0").replace("Frame Time: 0.01", "Frame Time: 0.00833333");
    for (place, rate_hz) in [(temporary.path(), 120.0), (&*folder, 60.0)] {
        let path = place.join("01.bvh");
        std::fs::write(&path, &text).unwrap();
        let found = load(&path).unwrap().rate_hz();
        assert!((found - rate_hz).abs() < 0.01, "{found}");
    }
}
