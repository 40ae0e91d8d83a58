//! All of CMU's files, where they are.

use std::process::Command;

use super::*;

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
