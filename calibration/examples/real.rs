//! The solver on real recordings: every file of `kinectv2_dual`, held-out cross-view residual beside plain SVD.
//!
//! `cargo run --release -p posefuse-calibration --example real` prints, per file: angle between the sensors, seconds shared,
//! plain SVD's median and RMS distance, the solver's on frames it never saw, its verdict, the share of frames with left and
//! right exchanged, and for files above what is known of their angle what is odd about them. Then the medians by angle.
//!
//! Plain SVD is judged on all frames, those it was fitted to included, which favours it.

#[path = "../tests/common/kinects.rs"]
mod kinects;
#[path = "figures/plain.rs"]
mod plain;

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Isometry3;
use posefuse_calibration::{Options, PairRow, Report, Walk, solve};

/// What a robust fit per take leaves in these recordings, by angle, mm.
const KNOWN_MM: [(&str, f64); 3] = [("0", 20.0), ("1", 48.0), ("2", 64.0)];

fn main() {
    let Some(folder) = kinects::recordings() else {
        return;
    };
    println!(
        "{:<42} {:>5} {:>6} {:>13} {:>13} {:>7} {:>5} {:>5}  what is odd",
        "file", "angle", "s", "SVD med/rms", "ours med/rms", "verdict", "swap", "agree"
    );
    let mut by_angle: BTreeMap<&str, [Vec<f64>; 2]> = BTreeMap::new();
    for (experiment, scenarios) in [
        ("Experiments_1_2_3_6", &[1, 2, 3, 6][..]),
        ("Experiments_4", &[4]),
    ] {
        let folder = folder.join(experiment).join("Original");
        if !folder.is_dir() {
            continue;
        }
        for file in kinects::files(&folder) {
            let single = experiment.ends_with("_6");
            if let Some((angle, plain, ours)) = line(&file, scenarios)
                && single
            {
                let medians = by_angle.entry(angle).or_default();
                medians[0].push(plain);
                medians[1].push(ours);
            }
        }
    }
    for (angle, [plain, ours]) in &mut by_angle {
        let known = KNOWN_MM
            .iter()
            .find(|(a, _)| a == angle)
            .map_or(0.0, |k| k.1);
        println!(
            "configuration {angle}, {} files with one person: median of medians {:.1} mm, plain SVD {:.1} mm, known {known} mm",
            ours.len(),
            middle(ours),
            middle(plain)
        );
    }
    let _ = std::fs::remove_dir_all(folder);
}

/// Prints one file; its angle and both medians.
fn line(file: &Path, scenarios: &[i64]) -> Option<(&'static str, f64, f64)> {
    let name = file.file_name()?.to_string_lossy().into_owned();
    let (angle, known) = *KNOWN_MM
        .iter()
        .find(|(a, _)| name.contains(&format!("Kinect_{a}_")))?;
    let walk = kinects::walk(kinects::rows(file, scenarios));
    if walk.sensors.len() < 2 {
        println!("{name:<42} {angle:>5} one sensor only");
        return None;
    }
    let [plain_median, plain_rms] = plain_residual(&walk)?;
    match solve(&walk, &Options::default()) {
        Ok(solution) => {
            let report = &solution.report;
            let pair = report.pairs.first()?;
            println!(
                "{name:<42} {angle:>5} {:>6.0} {plain_median:>7.0}/{plain_rms:<5.0} {:>7.0}/{:<5.0} {:>7} {:>4.0}% {:>4.0}%  {}",
                pair.shared_s,
                pair.median_mm,
                pair.rms_after_mm,
                report.verdict,
                pair.mirrored_share * 100.0,
                pair.agreeing_share * 100.0,
                odd(pair, report, known)
            );
            // Seconds that are too few for held-out frames have no residual.
            (pair.samples > 0).then_some((angle, plain_median, pair.median_mm))
        }
        Err(error) => {
            println!(
                "{name:<42} {angle:>5} {plain_median:>14.0}/{plain_rms:<5.0} no answer: {error}"
            );
            None
        }
    }
}

/// The verdict's main reason; for a file above what is `known` of its angle, what of its figures explains that.
fn odd(pair: &PairRow, report: &Report, known: f64) -> String {
    let complaint = report.reasons.first().map(|r| r.what.clone());
    let mut odd: Vec<String> = complaint.into_iter().collect();
    if pair.median_mm <= known {
        return odd.join("; ");
    }
    if pair.shared_s < 15.0 {
        odd.push(format!("only {:.0} s seen by both", pair.shared_s));
    }
    if pair.mirrored_share > 0.15 {
        odd.push(format!(
            "left and right exchanged in {:.0} %",
            pair.mirrored_share * 100.0
        ));
    }
    if pair.agreeing_share < 0.8 {
        odd.push(format!(
            "most joints disagree in {:.0} %",
            (1.0 - pair.agreeing_share) * 100.0
        ));
    }
    let [first, second] = pair.halves_mm;
    if (first - second).abs() > 20.0 {
        odd.push(format!(
            "{first:.0} mm in the first half, {second:.0} in the second"
        ));
    }
    odd.join("; ")
}

/// Median and RMS distance of the joints of nearest frames under plain SVD, mm.
fn plain_residual(walk: &Walk) -> Option<[f64; 2]> {
    let calibration = plain::solve(walk, 0.0);
    let pose = |index: usize| -> Option<Isometry3<f64>> {
        let pose = calibration.sensors.get(&walk.sensors[index].name)?;
        Some(*pose.room_from_sensor.isometry())
    };
    let (room_from_a, room_from_b) = (pose(0)?, pose(1)?);
    let mut distances: Vec<f64> = plain::pairs(&walk.sensors[0], &walk.sensors[1], 0.0)
        .iter()
        .map(|pair| (room_from_a * pair.to.point() - room_from_b * pair.from.point()).norm() * 1e3)
        .collect();
    let squares: f64 = distances.iter().map(|d| d * d).sum();
    let rms = (squares / distances.len().max(1) as f64).sqrt();
    Some([middle(&mut distances), rms])
}

fn middle(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
