//! How far joints turn in recorded motion: `cargo run --release -p posefuse-kinematics --example ranges -- FOLDER [EVERY]`.
//!
//! Solves every motion file below FOLDER without limits, at 30 Hz, and prints for each angle the 0.5th and the 99.5th
//! percentile, and which share of all frames lies beyond the range that the solver uses (and more than 5 degrees beyond).
//! Only every EVERY-th file is read.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Matrix3;
use posefuse_kinematics::{Body, Config, Solver};
use posefuse_simulator::load::{find, load};
use posefuse_skeleton::{
    Confidence, JointMap, JointState, Position, Provenance, Room, SensorId, SensorSet, Timestamp,
    Track, TrackId,
};

const RATE_HZ: f64 = 30.0;
/// Of each clip so much is looked at, seconds.
const LONGEST_S: f64 = 60.0;
const SIGMA_M: f64 = 0.005;

/// Degrees, by bone and turn; with the range.
type Seen = BTreeMap<(&'static str, &'static str), (Vec<f64>, f64, f64)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = arguments.first().ok_or("expected: ranges FOLDER [EVERY]")?;
    let every: usize = arguments.get(1).map_or(Ok(1), |text| text.parse())?;
    let mut seen = Seen::new();
    let files = find(Path::new(folder))?;
    for file in files.iter().step_by(every.max(1)) {
        match load(file) {
            Ok(clip) => {
                let count = (clip.duration_s().min(LONGEST_S) * RATE_HZ) as usize;
                let poses = (0..count).map(|frame| clip.pose(frame as f64 / RATE_HZ));
                look(
                    &poses.map(|joints| track(&joints)).collect::<Vec<_>>(),
                    &mut seen,
                );
            }
            Err(reason) => eprintln!("{reason}"),
        }
    }
    println!(
        "{:16}{:16}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}",
        "bone", "turn", "low", "0.5 %", "99.5 %", "high", "beyond", "by 5 deg"
    );
    for ((bone, turn), (mut degrees, low, high)) in seen {
        degrees.sort_by(f64::total_cmp);
        let at = |share: f64| degrees[(share * (degrees.len() - 1) as f64) as usize];
        let beyond = |by: f64| {
            let outside = degrees.iter().filter(|d| **d < low - by || **d > high + by);
            100.0 * outside.count() as f64 / degrees.len() as f64
        };
        println!(
            "{bone:16}{turn:16}{low:8.0}{:8.0}{:8.0}{high:8.0}{:8.2}%{:8.2}%",
            at(0.005),
            at(0.995),
            beyond(0.0),
            beyond(5.0)
        );
    }
    Ok(())
}

fn look(tracks: &[Track], seen: &mut Seen) {
    let mut config = Config::default();
    config.limits.enabled = false;
    config.feet.enabled = false;
    let mut solver = Solver::new(&Body::learn(tracks), config);
    for (frame, track) in tracks.iter().enumerate() {
        if solver
            .step(track, Timestamp::from_seconds(frame as f64 / RATE_HZ))
            .is_none()
        {
            continue;
        }
        for angle in solver.angles() {
            let entry = seen.entry((angle.bone, angle.turn));
            let (degrees, ..) = entry.or_insert((Vec::new(), angle.low, angle.high));
            degrees.push(angle.degrees);
        }
    }
}

fn track(joints: &JointMap<Position<Room>>) -> Track {
    let sensors = SensorId::new(0).map_or(SensorSet::EMPTY, SensorSet::only);
    Track {
        id: TrackId(1),
        since: Timestamp::ZERO,
        sensors,
        skeleton: joints.map(|_, position| JointState {
            position: *position,
            covariance: Matrix3::from_diagonal_element(SIGMA_M * SIGMA_M),
            confidence: Confidence::FULL,
            provenance: Provenance::Measured(sensors),
        }),
        hands: [None; 2],
    }
}
