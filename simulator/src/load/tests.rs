//! The loaders on small files written here, and on all of CMU's files where they are.

use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use super::*;

/// A T-posed body of 1.7 m in centimetres whose left hip is at +x and head at +y, as most BVH files have it.
const BVH: &str = "\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 45 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 10 0
      }
    }
    JOINT LeftArm
    {
      OFFSET 18 30 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftForeArm
      {
        OFFSET 28 0 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftHand
        {
          OFFSET 25 0 0
          CHANNELS 3 Zrotation Xrotation Yrotation
          End Site
          {
            OFFSET 15 0 0
          }
        }
      }
    }
    JOINT RightArm
    {
      OFFSET -18 30 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT RightForeArm
      {
        OFFSET -28 0 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT RightHand
        {
          OFFSET -25 0 0
          CHANNELS 3 Zrotation Xrotation Yrotation
          End Site
          {
            OFFSET -15 0 0
          }
        }
      }
    }
  }
  JOINT LeftUpLeg
  {
    OFFSET 9 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftLeg
    {
      OFFSET 0 -42 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftFoot
      {
        OFFSET 0 -40 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET 0 -6 13
        }
      }
    }
  }
  JOINT RightUpLeg
  {
    OFFSET -9 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT RightLeg
    {
      OFFSET 0 -42 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT RightFoot
      {
        OFFSET 0 -40 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET 0 -6 13
        }
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
";

/// The fixture with two frames: at rest 1 m up, then turned left by 90 degrees with the left forearm bent by 90.
fn bvh_text() -> String {
    let zeros = vec!["0"; 3 * 14];
    let mut second = zeros.clone();
    // Node order: Hips, Spine, Head, LeftArm, LeftForeArm ..; the forearm's y rotation is its third.
    second[3 * 4 - 1] = "-90";
    let rest = format!("0 100 0 0 0 0 {}\n", zeros.join(" "));
    format!("{BVH}{rest}0 100 50 0 0 90 {}\n", second.join(" "))
}

fn at(pose: &JointMap<Position<Room>>, joint: Joint) -> Vector3<f64> {
    pose[joint].unwrap().vector()
}

fn close(a: Vector3<f64>, b: [f64; 3]) -> bool {
    (a - Vector3::from(b)).norm() < 1e-9
}

#[test]
fn a_bvh_becomes_a_clip_in_room_axes_and_metres() {
    let clip = bvh("fixture", &bvh_text()).unwrap();
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
fn broken_bvh_files_are_refused_with_line_and_reason() {
    let text = bvh_text();
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

/// A skeleton with CMU's bones, thighs 20 degrees outwards.
fn asf_text() -> String {
    let bones = [
        ("lhipjoint", "1 -1 0", 1.5, ""),
        ("lfemur", "0.34202 -0.939693 0", 7.4, "dof rx ry rz"),
        ("ltibia", "0.34202 -0.939693 0", 7.2, "dof rx"),
        ("lfoot", "0 -0.2 1", 2.3, "dof rx rz"),
        ("ltoes", "0 0 1", 1.1, "dof rx"),
        ("lowerback", "0 1 0", 2.0, "dof rx ry rz"),
        ("upperback", "0 1 0", 2.0, "dof rx ry rz"),
        ("thorax", "0 1 0", 2.0, "dof rx ry rz"),
        ("lowerneck", "0 1 0", 1.6, "dof rx ry rz"),
        ("upperneck", "0 1 0", 1.6, "dof rx ry rz"),
        ("head", "0 1 0", 1.6, "dof rx ry rz"),
        ("lclavicle", "1 0.2 0", 3.4, "dof ry rz"),
        ("lhumerus", "1 0 0", 5.0, "dof rx ry rz"),
        ("lradius", "1 0 0", 3.5, "dof rx"),
        ("lwrist", "1 0 0", 1.8, "dof ry"),
        ("lhand", "1 0 0", 0.8, "dof rx rz"),
        ("lfingers", "1 0 0", 0.6, "dof rx"),
        ("lthumb", "0.7 0 0.7", 0.7, "dof rx rz"),
    ];
    let mut text = ":version 1.10\n:name test\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n\
        :root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n:bonedata\n"
        .to_owned();
    let middle = [
        "lowerback",
        "upperback",
        "thorax",
        "lowerneck",
        "upperneck",
        "head",
    ];
    for side in ["l", "r"] {
        for (name, direction, length, dof) in bones {
            if middle.contains(&name) && side == "r" {
                continue;
            }
            let (name, direction) = if side == "r" {
                (
                    format!("r{}", &name[1..]),
                    format!("-{direction}").replace("--", ""),
                )
            } else {
                (name.to_owned(), direction.to_owned())
            };
            let axis = match &name[1..] {
                "femur" if side == "l" => "0 0 20",
                "femur" => "0 0 -20",
                _ => "0 0 0",
            };
            text += &format!(
                "begin\n  name {name}\n  direction {direction}\n  length {length}\n  axis {axis} XYZ\n  {dof}\nend\n"
            );
        }
    }
    text += ":hierarchy\nbegin\nroot lhipjoint rhipjoint lowerback\nlowerback upperback\nupperback thorax\n\
        thorax lowerneck lclavicle rclavicle\nlowerneck upperneck\nupperneck head\n";
    for side in ["l", "r"] {
        for chain in [
            &["hipjoint", "femur", "tibia", "foot", "toes"][..],
            &["clavicle", "humerus", "radius", "wrist", "hand", "fingers"],
            &["wrist", "thumb"],
        ] {
            for pair in chain.windows(2) {
                text += &format!("{side}{} {side}{}\n", pair[0], pair[1]);
            }
        }
    }
    text + "end\n"
}

/// Two frames: legs straight down; then the left leg lifted forwards by 90 degrees.
fn amc_text() -> String {
    let mut text = "#!OML:ASF\n:FULLY-SPECIFIED\n:DEGREES\n".to_owned();
    for (number, lift) in [(1, "0"), (2, "-90")] {
        text += &format!("{number}\nroot 1 17 2 0 0 0\nlfemur {lift} 0 -20\nrfemur 0 0 20\n");
        for name in [
            "lowerback",
            "upperback",
            "thorax",
            "lowerneck",
            "upperneck",
            "head",
        ] {
            text += &format!("{name} 0 0 0\n");
        }
        for side in ["l", "r"] {
            for (name, count) in [
                ("tibia", 1),
                ("foot", 2),
                ("toes", 1),
                ("clavicle", 2),
                ("humerus", 3),
                ("radius", 1),
                ("wrist", 1),
                ("hand", 2),
                ("fingers", 1),
                ("thumb", 2),
            ] {
                text += &format!("{side}{name}{}\n", " 0".repeat(count));
            }
        }
    }
    text
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

/// Rest pose and one frame in which legs hang straight and the root has turned left by 90 degrees.
fn expmap_text() -> String {
    let mut values = vec![0.0; 117];
    values[..3].copy_from_slice(&[0.0, 17.0, 0.0]);
    let down = 20f64.to_radians();
    values[3 + 3 * 2 + 2] = down;
    values[3 + 3 * 8 + 2] = -down;
    let line = |values: &[f64]| {
        values
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(",")
            + "\n"
    };
    let rest = line(&values);
    values[4] = -std::f64::consts::FRAC_PI_2;
    rest + &line(&values)
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

fn data_folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("POSEFUSE_DATA").map_or(beside, PathBuf::from);
    folder.join("cmu_bvh.tar.bz2").is_file().then_some(folder)
}

fn motion_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() {
            motion_files(&path, files);
        } else if ["bvh", "amc", "txt"].contains(&extension.as_str()) {
            files.push(path);
        }
    }
}

#[test]
fn every_cmu_file_is_read_and_is_a_person() {
    let Some(data) = data_folder() else {
        println!("SKIPPED: no CMU data; set POSEFUSE_DATA to the folder with cmu_bvh.tar.bz2");
        return;
    };
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    for archive in ["cmu_bvh", "cmu_asfamc", "cmu_expmap"] {
        let into = folder.join(archive);
        std::fs::create_dir_all(&into).unwrap();
        let from = data.join(format!("{archive}.tar.bz2"));
        let status = Command::new("tar")
            .arg("xjf")
            .arg(from)
            .arg("-C")
            .arg(&into)
            .status()
            .unwrap();
        assert!(status.success(), "tar could not unpack {archive}");
    }
    let mut files = Vec::new();
    motion_files(folder, &mut files);
    assert!(files.len() > 100, "only {} files", files.len());
    for path in &files {
        let clip = load(path).unwrap_or_else(|error| panic!("{error}"));
        looks_like_a_person(&clip, path);
    }
    println!("{} files read", files.len());
}

/// Upright most of the time, left on the left of where the toes point, limbs of human length, feet on the floor.
fn looks_like_a_person(clip: &Clip, path: &Path) {
    let path = path.display();
    let step = (clip.frames().len() / 200).max(1);
    let sampled: Vec<_> = clip.frames().iter().step_by(step).collect();
    let share = |holds: &dyn Fn(&JointMap<Position<Room>>) -> bool| {
        sampled.iter().filter(|pose| holds(pose)).count() as f64 / sampled.len() as f64
    };
    for pose in &sampled {
        assert_eq!(pose.len(), 25, "{path}");
    }
    let feet = |pose: &JointMap<Position<Room>>| {
        at(pose, Joint::FootLeft)
            .z
            .min(at(pose, Joint::FootRight).z)
    };
    assert!(
        share(&|pose| at(pose, Joint::Head).z > feet(pose) + 0.8) > 0.9,
        "{path}: not upright"
    );
    let forwards = share(&|pose| {
        let left = at(pose, Joint::HipLeft) - at(pose, Joint::HipRight);
        let toes = at(pose, Joint::FootLeft) - at(pose, Joint::AnkleLeft)
            + at(pose, Joint::FootRight)
            - at(pose, Joint::AnkleRight);
        left.cross(&Vector3::z()).dot(&toes) > 0.0
    });
    assert!(
        forwards > 0.9,
        "{path}: toes point forwards in {forwards} of the frames"
    );
    let knees = share(&|pose| {
        let left = at(pose, Joint::HipLeft) - at(pose, Joint::HipRight);
        let straight = (at(pose, Joint::HipLeft) + at(pose, Joint::AnkleLeft)) / 2.0;
        let bend = at(pose, Joint::KneeLeft) - straight;
        left.cross(&Vector3::z()).dot(&bend) > -0.03
    });
    assert!(
        knees > 0.8,
        "{path}: knees bend forwards in {knees} of the frames"
    );
    let height =
        at(sampled[sampled.len() / 2], Joint::Head) - at(sampled[sampled.len() / 2], Joint::Neck);
    assert!(
        (0.05..0.3).contains(&height.norm()),
        "{path}: neck to head {} m",
        height.norm()
    );
    assert!(
        share(&|pose| feet(pose) > -0.12) > 0.95,
        "{path}: sinks into the floor"
    );
    let lowest = sampled
        .iter()
        .map(|pose| feet(pose))
        .fold(f64::INFINITY, f64::min);
    assert!(lowest < 0.1, "{path}: floats at {lowest} m");
}
