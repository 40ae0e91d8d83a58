//! Calibrating while somebody walks: gathers, tells how far it is, solves, puts the result in force unless it failed.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use posefuse_calibration::{Collector, Coverage, Options, Report, Solution, Verdict, solve};
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_skeleton::{SensorId, Timestamp};
use tokio::sync::mpsc;
use tonic::Status;

use super::Room;
use super::calibration::Calibrating;
use super::service::{Answers, answers};
use crate::fusion_thread::{Command, WalkFrame};
use v1::calibrate_event::Event;

/// Gathered for so long unless the client says otherwise, seconds.
const USUAL_SECONDS: f64 = 30.0;
const SECONDS: std::ops::RangeInclusive<f64> = 2.0..=600.0;
/// Between two messages of progress.
const BEAT: Duration = Duration::from_millis(250);
/// Frames that may wait for the collector.
const WALK_QUEUE: usize = 1024;

type Answer = mpsc::Sender<Result<v1::CalibrateEvent, Status>>;

/// Starts to gather; the stream tells of it. Dropping the stream cancels.
pub(super) async fn calibrate(
    room: Arc<Room>,
    request: v1::CalibrateRequest,
) -> Result<Answers<v1::CalibrateEvent>, Status> {
    let seconds = match request.seconds {
        0.0 => USUAL_SECONDS,
        seconds => seconds,
    };
    if !SECONDS.contains(&seconds) {
        return Err(Status::invalid_argument(format!(
            "`seconds` must be a number from {} to {}, found {seconds}",
            SECONDS.start(),
            SECONDS.end()
        )));
    }
    let sensors: Vec<_> = room
        .registry
        .sensors()
        .iter()
        .filter(|sensor| sensor.is_connected())
        .map(|sensor| (sensor.id(), sensor.name().to_owned()))
        .collect();
    if sensors.is_empty() {
        return Err(Status::failed_precondition(
            "calibration needs a sensor that watches the walk, none is connected; start an agent",
        ));
    }
    let right = room.begin_calibrating().await?;
    let (walk, frames) = mpsc::channel(WALK_QUEUE);
    room.commands.try_send(Command::Walk(walk))?;
    let (answer, queue) = mpsc::channel(4);
    let session = Session {
        began: room.clock.now(),
        room: room.clone(),
        collector: Collector::new(sensors),
        peopled: BTreeMap::new(),
        seconds,
        dry_run: request.dry_run,
        _right: right,
    };
    room.tasks.spawn(async move {
        tokio::select! {
            () = answer.closed() => tracing::info!("a calibration was cancelled"),
            () = session.run(frames, &answer) => {}
        }
    });
    Ok(answers(queue))
}

struct Session {
    room: Arc<Room>,
    collector: Collector,
    /// Frames in which a sensor saw somebody.
    peopled: BTreeMap<SensorId, u64>,
    began: Timestamp,
    seconds: f64,
    dry_run: bool,
    _right: Calibrating,
}

impl Session {
    async fn run(mut self, frames: mpsc::Receiver<WalkFrame>, answer: &Answer) {
        if !self.gather(frames, answer).await {
            let stopping = Status::unavailable("the server is stopping");
            let _ = answer.send(Err(stopping)).await;
            return;
        }
        let result = self.conclude().await.map(|result| v1::CalibrateEvent {
            event: Some(Event::Result(result)),
        });
        let _ = answer.send(result).await;
    }

    /// Gathers until the time is over; `false`: the server stops.
    async fn gather(&mut self, mut frames: mpsc::Receiver<WalkFrame>, answer: &Answer) -> bool {
        let end = self.began.plus_ns((self.seconds * 1e9) as i64);
        let room = self.room.clone();
        let mut beat = room.clock.sleep(Duration::ZERO);
        loop {
            tokio::select! {
                biased;
                () = room.stop.cancelled() => return false,
                () = &mut beat => {
                    let progress = self.progress(self.collector.coverage());
                    let _ = answer.try_send(Ok(v1::CalibrateEvent { event: Some(Event::Progress(progress)) }));
                    if room.clock.now() >= end {
                        return true;
                    }
                    beat = room.clock.sleep(BEAT);
                }
                frame = frames.recv() => match frame {
                    Some((sensor, time, bodies)) => {
                        *self.peopled.entry(sensor).or_default() += u64::from(!bodies.is_empty());
                        self.collector.add(sensor, time, &bodies);
                    }
                    None => return false,
                }
            }
        }
    }

    fn progress(&self, coverage: Coverage) -> v1::CalibrateProgress {
        let name_of = |sensor| {
            let found = self.collector.sensors().find(|(id, _)| *id == sensor);
            found.map_or_else(String::new, |(_, name)| name.to_owned())
        };
        let sensors = coverage.sensors.iter().map(|sensor| v1::SensorProgress {
            sensor: sensor.name.clone(),
            frames: self.peopled.get(&sensor.sensor).copied().unwrap_or(0),
            cells: sensor.cells.len() as u32,
            shared: sensor
                .shared_frames
                .iter()
                .map(|(other, frames)| (name_of(*other), *frames))
                .collect(),
            share: sensor.share,
            covered: sensor
                .cells
                .iter()
                .flat_map(|(right, ahead)| [*right, *ahead])
                .collect(),
        });
        v1::CalibrateProgress {
            elapsed_seconds: self
                .room
                .clock
                .now()
                .since_seconds(self.began)
                .min(self.seconds),
            total_seconds: self.seconds,
            sensors: sensors.collect(),
            share: coverage.share,
            hint: coverage.hint.clone(),
            solving: false,
        }
    }

    async fn conclude(self) -> Result<v1::CalibrateResult, Status> {
        let walk = self.collector.walk();
        let options = Options {
            created: self.room.clock.rfc3339(),
            ..Options::default()
        };
        let solved = self
            .room
            .threads
            .blocking(move || solve(&walk, &options))
            .await;
        let solution = match solved.map_err(|error| Status::internal(error.to_string()))? {
            Ok(solution) => solution,
            Err(error) => {
                return Ok(v1::CalibrateResult {
                    verdict: v1::Verdict::Failed.into(),
                    reasons: vec![error.to_string()],
                    ..Default::default()
                });
            }
        };
        let Solution {
            calibration,
            report,
        } = solution;
        tracing::info!(verdict = %report.verdict, reasons = report.reasons.len(), "a calibration was solved");
        let mut result = result(&report);
        if report.verdict == Verdict::Failed {
            return Ok(result);
        }
        result.calibration = Some(calibration_to_wire(&calibration));
        if !self.dry_run {
            self.room.put_in_force(calibration).await?;
            result.in_force = true;
        }
        Ok(result)
    }
}

fn result(report: &Report) -> v1::CalibrateResult {
    let verdict = match report.verdict {
        Verdict::Passed => v1::Verdict::Passed,
        Verdict::Weak => v1::Verdict::Weak,
        Verdict::Failed => v1::Verdict::Failed,
    };
    let reasons = report
        .reasons
        .iter()
        .map(|reason| format!("{}: {}", reason.what, reason.remedy));
    let pairs = report.pairs.iter().map(|pair| v1::PairResidual {
        a: pair.a.clone(),
        b: pair.b.clone(),
        before_rms_m: pair.rms_before_mm * 1e-3,
        after_median_m: pair.median_mm * 1e-3,
        after_p95_m: pair.p95_mm * 1e-3,
        samples: pair.samples,
        agreeing_share: pair.agreeing_share,
        mirrored_share: pair.mirrored_share,
        ..Default::default()
    });
    v1::CalibrateResult {
        verdict: verdict.into(),
        reasons: reasons.collect(),
        calibration: None,
        in_force: false,
        pairs: pairs.collect(),
        ..Default::default()
    }
}
