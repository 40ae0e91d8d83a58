//! `posefuse evaluate csv`: recordings of two Kinects, calibrated from themselves.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use posefuse_agent::source::csv::Recording;
use posefuse_calibration::{Options, Verdict, solve};
use posefuse_evaluate::{RecordedTruth, observed_body};
use posefuse_fusion::{ClockSample, Config, Input};
use posefuse_skeleton::{AgentTime, JointSet, Observation, SensorId, SensorInfo, Timestamp};

use super::material::Material;
use super::shown::CompareArgs;
use crate::failure::Outcome;
use crate::global::Global;
use crate::offline::{WalkTap, now_rfc3339};
use crate::{output, progress};

/// Server time of the recording's first delivery; clocks are mapped before it.
const START_NS: i64 = 1_000_000_000;
/// Time between two clock probes of a sensor.
const PROBE_NS: i64 = 500_000_000;

/// Recordings of two Kinects v2 (CSV), calibrated from themselves
#[derive(Debug, Args)]
pub(super) struct CsvArgs {
    /// The recordings
    #[arg(required = true, value_name = "FILE")]
    file: Vec<PathBuf>,
    /// Which Kinects: numbers, or their computers' addresses as the files have them
    #[arg(
        long,
        value_name = "WHICH,...",
        value_delimiter = ',',
        default_value = "1,2"
    )]
    kinects: Vec<String>,
    #[command(flatten)]
    compare: CompareArgs,
}

pub(super) fn run(args: &CsvArgs, global: &Global) -> anyhow::Result<Outcome> {
    let bar = progress::bar(args.file.len() as u64, "calibrating");
    let (mut materials, mut uncalibrated) = (Vec::new(), Vec::new());
    for file in &args.file {
        match material(file, &args.kinects)? {
            Ok(material) => materials.push(material),
            Err(problem) => uncalibrated.push(problem),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    for problem in &uncalibrated {
        output::warn(problem);
    }
    anyhow::ensure!(
        !materials.is_empty(),
        "none of the recordings could be calibrated from itself"
    );
    let mut about = vec![format!(
        "{} recordings of Kinects v2, each calibrated from itself.",
        materials.len()
    )];
    if !uncalibrated.is_empty() {
        about.push(format!("Left out: {}.", uncalibrated.join("; ")));
    }
    let outcome = args
        .compare
        .judge("Methods on recordings", &materials, about, global)?;
    Ok(match uncalibrated.is_empty() {
        true => outcome,
        false => Outcome::DoneWithLoss,
    })
}

/// The recording, or why it cannot be calibrated from itself.
fn material(file: &Path, kinects: &[String]) -> anyhow::Result<Result<Material, String>> {
    let name = file.file_stem().map(|stem| stem.to_string_lossy());
    let name = name.unwrap_or_default().into_owned();
    let (sensors, mut inputs) = inputs(file, kinects)?;
    let mut tap = WalkTap::new(&sensors, Config::default());
    inputs.iter().for_each(|(_, input)| tap.add(input));
    let options = Options {
        created: now_rfc3339(),
        ..Options::default()
    };
    let solution = match solve(&tap.walk(), &options) {
        Ok(solution) => solution,
        Err(error) => return Ok(Err(format!("`{name}` gives no calibration: {error}"))),
    };
    let median = solution.report.pairs.first().map(|pair| pair.median_mm);
    let median = median.map_or_else(String::new, |mm| format!(", sensors agree to {mm:.0} mm"));
    let verdict: Verdict = solution.report.verdict;
    let calibration = Input::Calibration(Arc::new(solution.calibration));
    inputs.insert(0, (Timestamp::ZERO, calibration));
    let inputs = Arc::new(inputs);
    Ok(Ok(Material {
        name,
        note: format!("calibration {verdict}{median}"),
        truth: RecordedTruth::default(),
        open: Box::new(move || {
            let (inputs, mut next) = (Arc::clone(&inputs), 0);
            Ok(Box::new(std::iter::from_fn(move || {
                next += 1;
                inputs.get(next - 1).cloned().map(Ok)
            })))
        }),
    }))
}

type Read = (Vec<SensorInfo>, Vec<(Timestamp, Input)>);

/// The recording as the engine would have had it, had every frame come at once: its logger held frames back by up to
/// a second, which says nothing of sensors or methods.
fn inputs(file: &Path, kinects: &[String]) -> anyhow::Result<Read> {
    let bytes = std::fs::read(file).with_context(|| format!("`{}`", file.display()))?;
    let (mut sensors, mut inputs) = (Vec::new(), Vec::new());
    for (index, kinect) in kinects.iter().enumerate() {
        let recording = Recording::parse(&bytes, file, kinect)?;
        let info = SensorInfo {
            id: SensorId::new(index)?,
            name: format!("kinect{}", index + 1),
            model: "Kinect v2 (recording)".to_owned(),
            joint_set: JointSet::KinectV2,
        };
        inputs.push((Timestamp::ZERO, Input::Sensor(info.clone())));
        let server = |ns: i64| Timestamp::from_ns(START_NS + ns - recording.begins_ns);
        let agent = |ns: i64| AgentTime::from_ns(START_NS + ns - recording.begins_ns);
        let probes = recording.begins_ns - START_NS / 2..recording.ends_ns;
        for at_ns in probes.step_by(PROBE_NS as usize) {
            let sample = ClockSample {
                sensor: info.id,
                sent: server(at_ns),
                returned: server(at_ns + 200_000),
                agent_received: agent(at_ns + 100_000),
                agent_sent: agent(at_ns + 100_000),
            };
            inputs.push((sample.returned, Input::ClockSample(sample)));
        }
        for (sequence, frame) in recording.frames.iter().enumerate() {
            let body = |body: &posefuse_agent::SourceBody| {
                observed_body(&info, body.tracking_id, &body.joints)
            };
            let received = server(frame.captured_ns + 1_000_000);
            let observation = Observation {
                sensor: info.id,
                sequence: sequence as u64,
                captured: agent(frame.captured_ns),
                received,
                bodies: frame.bodies.iter().map(body).collect(),
            };
            inputs.push((received, Input::Observation(observation)));
        }
        sensors.push(info);
    }
    inputs.sort_by_key(|(time, _)| *time);
    Ok((sensors, inputs))
}
