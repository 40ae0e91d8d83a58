//! Every real two-Kinect recording, read to its end, where they are present.
// Helpers of tests are tests too, but clippy takes only what bears #[test] for one.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use posefuse_agent::source::csv::Recording;

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("POSEFUSE_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"));
    let archive = folder.join("kinectv2_dual.tar.bz2");
    archive.exists().then_some(archive)
}

fn csv_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            csv_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "csv") {
            found.push(path);
        }
    }
}

#[test]
fn every_recording_is_read_to_its_end() {
    let Some(archive) = data() else {
        println!("SKIPPED: no kinectv2_dual.tar.bz2 in $POSEFUSE_DATA or ../shared/data");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let unpacked = Command::new("tar")
        .arg("xf")
        .arg(&archive)
        .arg("-C")
        .arg(folder.path())
        .status();
    assert!(unpacked.expect("tar is needed").success());
    let mut files = Vec::new();
    csv_files(folder.path(), &mut files);
    files.sort();
    assert_eq!(files.len(), 51, "the archive has 51 recordings");
    let (mut frames, mut stale, mut pairs, mut lines) = (0, 0, 0, 0);
    for file in &files {
        let text = std::fs::read_to_string(file).unwrap();
        let expected = text.lines().count() - 1;
        let both =
            ["1", "2"].map(|kinect| Recording::parse(text.as_bytes(), file, kinect).unwrap());
        let bodies = |recording: &Recording| {
            recording
                .frames
                .iter()
                .map(|f| f.bodies.len())
                .sum::<usize>()
        };
        assert_eq!(
            bodies(&both[0]) + bodies(&both[1]),
            expected,
            "{}",
            file.display()
        );
        assert_eq!(both[0].begins_ns, both[1].begins_ns);
        assert!(Recording::parse(text.as_bytes(), file, "3").is_err());
        for recording in &both {
            check(recording, file);
            frames += recording.frames.len();
            stale += recording
                .frames
                .windows(2)
                .filter(|pair| pair[0].captured_ns == pair[1].captured_ns)
                .count();
        }
        lines += expected;
        let people: BTreeSet<u64> = both[0]
            .frames
            .iter()
            .flat_map(|f| &f.bodies)
            .map(|body| body.tracking_id)
            .collect();
        pairs += usize::from(people.len() == 2);
    }
    println!(
        "{lines} lines, {frames} frames, {stale} of them stale, {pairs} files with two people"
    );
    assert_eq!(pairs, 9);
    let share = stale as f64 / frames as f64;
    assert!(
        (0.03..0.10).contains(&share),
        "5 to 8 % of the lines repeat a stale frame, found {share}"
    );
}

fn check(recording: &Recording, file: &Path) {
    assert!(!recording.frames.is_empty());
    for frame in &recording.frames {
        let delay_ms = (frame.delivered_ns - frame.captured_ns) / 1_000_000;
        assert!(
            (0..2_000).contains(&delay_ms),
            "{}: {delay_ms} ms on the way",
            file.display()
        );
    }
    // Optical axes: y points down, so heads have less of it than feet, but for stale or broken instants.
    let bodies = || recording.frames.iter().flat_map(|frame| &frame.bodies);
    let depth = |body: &&posefuse_agent::SourceBody| body.joints[3].unwrap().position.point().z;
    let in_range = bodies()
        .filter(|body| (0.5..6.0).contains(&depth(body)))
        .count();
    assert!(
        in_range * 100 >= bodies().count() * 98,
        "{}: heads are out of range",
        file.display()
    );
    let y = |body: &posefuse_agent::SourceBody, joint: usize| {
        body.joints[joint].unwrap().position.point().y
    };
    let upright = bodies()
        .filter(|body| y(body, 3) + 0.5 < y(body, 15))
        .count();
    assert!(
        upright * 10 > bodies().count() * 9,
        "{}: people stand on their heads",
        file.display()
    );
    // Facing the sensor, the person's left is at the sensor's right: larger x for the left shoulder.
    let x = |body: &posefuse_agent::SourceBody, joint: usize| {
        body.joints[joint].unwrap().position.point().x
    };
    let facing = bodies().filter(|body| x(body, 4) > x(body, 8)).count();
    assert!(
        facing * 2 > bodies().count(),
        "{}: people are mirrored",
        file.display()
    );
}
