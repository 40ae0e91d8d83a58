//! The `kinectv2_dual` recordings of two real Kinect v2.
//!
//! The data is not part of the project. Where it lies: `POSEFUSE_DATA`, or `../shared/data` beside the project. Times are
//! the device's own, moved to the server's by the median difference, because the server's stamp of a row is up to 150 ms
//! off.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each test binary and the example use a part"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use posefuse_calibration::{Walk, WalkBody, WalkFrame, WalkJoint};
use posefuse_skeleton::{Confidence, Joint, JointMap, Position, Timestamp};

/// The logger counts from the year 1, which nanoseconds do not reach: counted from a day of the recordings here.
const SERVER_EPOCH_MS: i64 = 63_562_000_000_000;

/// Person, skeleton, times and joints of one row.
pub struct Row {
    pub kinect: String,
    pub person: u64,
    pub server_ns: i64,
    pub device_ns: i64,
    pub joints: JointMap<WalkJoint>,
}

/// Unpacks the recordings into a folder of the build, once per test process; `None` where there are none.
pub fn recordings() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let data = std::env::var_os("POSEFUSE_DATA").map_or(beside, PathBuf::from);
    let archive = data.join("kinectv2_dual.tar.bz2");
    if !archive.is_file() {
        println!(
            "SKIPPED: no recordings at {}; set POSEFUSE_DATA",
            archive.display()
        );
        return None;
    }
    let folder = std::env::temp_dir().join(format!("posefuse-kinects-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let status = Command::new("tar")
        .arg("-xjf")
        .arg(&archive)
        .arg("-C")
        .arg(&folder)
        .status();
    assert!(
        status.unwrap().success(),
        "tar could not unpack {}",
        archive.display()
    );
    Some(folder)
}

/// The rows of these `scenarios`; -9999 is missing.
pub fn rows(file: &Path, scenarios: &[i64]) -> Vec<Row> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.trim_start_matches('\u{feff}').lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').map(str::trim).collect();
    let columns = JointMap::<usize>::from_iter(Joint::ALL.iter().map(|joint| {
        let name = format!("{}_X", joint.name());
        (*joint, header.iter().position(|h| *h == name).unwrap())
    }));
    let row = |line: &str| {
        let cells: Vec<f64> = line
            .split(',')
            .map(|c| c.trim().parse().unwrap_or(f64::NAN))
            .collect();
        let wanted = scenarios.iter().any(|s| cells.get(2) == Some(&(*s as f64)));
        wanted.then(|| Row {
            kinect: line.split(',').nth(9).unwrap().trim().to_owned(),
            person: cells[4] as u64 * 100 + cells[5] as u64,
            server_ns: (cells[3] as i64 - SERVER_EPOCH_MS) * 1_000_000,
            device_ns: cells[6] as i64 * 100,
            joints: columns.filter_map(|_, x| joint([cells[*x], cells[x + 1], cells[x + 2]])),
        })
    };
    lines.filter_map(row).collect()
}

/// Kinect camera space (x to the sensor's left, y up, z forward) to optical axes.
fn joint([x, y, z]: [f64; 3]) -> Option<WalkJoint> {
    (x > -9000.0).then(|| WalkJoint {
        position: Position::new(-x, -y, z),
        confidence: Confidence::FULL,
    })
}

pub fn walk(rows: Vec<Row>) -> Walk {
    let mut differences: BTreeMap<String, Vec<i64>> = BTreeMap::new();
    for row in &rows {
        let difference = row.server_ns - row.device_ns;
        differences
            .entry(row.kinect.clone())
            .or_default()
            .push(difference);
    }
    for differences in differences.values_mut() {
        differences.sort_unstable();
    }
    let mut walk = Walk::default();
    let mut frames: BTreeMap<(String, i64), Vec<WalkBody>> = BTreeMap::new();
    for row in rows {
        let differences = &differences[&row.kinect];
        let server_from_device = differences[differences.len() / 2];
        let body = WalkBody {
            tracking_id: row.person,
            joints: row.joints,
        };
        frames
            .entry((row.kinect, row.device_ns + server_from_device))
            .or_default()
            .push(body);
    }
    for ((kinect, ns), bodies) in frames {
        let frame = WalkFrame {
            time: Timestamp::from_ns(ns),
            bodies,
        };
        walk.sensor_mut(&kinect).frames.push(frame);
    }
    walk
}

pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}
