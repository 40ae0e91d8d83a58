//! Calibrating while somebody walks: gathers until enough was seen, tells how far it is, solves, puts the result in force
//! unless it failed.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use posefuse_calibration::{
    Collector, Coverage, Options, Reason, Report, Solution, Verdict, solve,
};
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_skeleton::{Calibration, SensorId, Timestamp};
use tokio::sync::mpsc;
use tonic::Status;

use super::Room;
use super::calibration::Calibrating;
use super::calibration_result::{failed, result};
use super::calibrations::listed;
use super::service::{Answers, answers};
use crate::fusion_thread::{Command, WalkFrame};
use crate::ingest::Sensor;
use v1::calibrate_event::Event;

/// Unless the client says how long, a walk ends when enough was seen, but not before the first and at the latest after
/// the second, seconds. The least is what the verdict's held-out seconds and the time offsets need.
const UNTIL_COVERED: [f64; 2] = [12.0, 120.0];
const SECONDS: std::ops::RangeInclusive<f64> = 2.0..=600.0;
/// A sensor whose agent is gone for so long has left the walk, ns; agents that lost their connection are back sooner.
const LEFT_NS: i64 = 3_000_000_000;
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
    let until_covered = request.seconds == 0.0;
    let seconds = if until_covered {
        UNTIL_COVERED[1]
    } else {
        request.seconds
    };
    if !SECONDS.contains(&seconds) {
        return Err(Status::invalid_argument(format!(
            "`seconds` must be 0 (until enough was seen) or a number from {} to {}, found {seconds}",
            SECONDS.start(),
            SECONDS.end()
        )));
    }
    let connected = room.registry.sensors().into_iter();
    let sensors: Vec<_> = connected.filter(|sensor| sensor.is_connected()).collect();
    if sensors.is_empty() {
        return Err(Status::failed_precondition(
            "calibration needs a sensor that watches the walk, none is connected; start an agent",
        ));
    }
    let right = room.begin_calibrating().await?;
    let (walk, frames) = mpsc::channel(WALK_QUEUE);
    room.commands.try_send(Command::Walk(walk))?;
    let (answer, queue) = mpsc::channel(4);
    let names = sensors
        .iter()
        .map(|sensor| (sensor.id(), sensor.name().to_owned()));
    let mut collector = Collector::new(names);
    for sensor in &sensors {
        collector.set_joint_set(sensor.id(), sensor.greeting().info.joint_set);
    }
    let session = Session {
        began: room.clock.now(),
        room: room.clone(),
        collector,
        sensors,
        gone: BTreeMap::new(),
        left: Vec::new(),
        peopled: BTreeMap::new(),
        seconds,
        until_covered,
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
    /// Those that were connected when the walk began.
    sensors: Vec<Arc<Sensor>>,
    /// Since when an agent is gone.
    gone: BTreeMap<SensorId, Timestamp>,
    /// The sensors that left the walk, and after how many seconds.
    left: Vec<(String, f64)>,
    /// Frames in which a sensor saw somebody.
    peopled: BTreeMap<SensorId, u64>,
    began: Timestamp,
    /// How long to gather at most.
    seconds: f64,
    /// Whether to end as soon as enough was seen.
    until_covered: bool,
    dry_run: bool,
    _right: Calibrating,
}

/// How a walk ended.
enum End {
    /// Enough was seen, or the time that was asked for is over.
    Done,
    /// The time is over, and not enough was seen.
    TooLittle(Coverage),
    /// The server stops.
    Stopping,
}

impl Session {
    async fn run(mut self, frames: mpsc::Receiver<WalkFrame>, answer: &Answer) {
        let too_little = match self.gather(frames, answer).await {
            End::Done => None,
            End::TooLittle(coverage) => Some(coverage),
            End::Stopping => {
                let stopping = Status::unavailable("the server is stopping");
                let _ = answer.send(Err(stopping)).await;
                return;
            }
        };
        let solving = v1::CalibrateProgress {
            solving: true,
            ..self.progress(&self.collector.coverage())
        };
        let _ = answer.send(Ok(event(Event::Progress(solving)))).await;
        let result = self.conclude(too_little).await;
        let _ = answer
            .send(result.map(|result| event(Event::Result(result))))
            .await;
    }

    /// Gathers until the walk is over.
    async fn gather(&mut self, mut frames: mpsc::Receiver<WalkFrame>, answer: &Answer) -> End {
        let room = self.room.clone();
        let mut beat = room.clock.sleep(Duration::ZERO);
        loop {
            tokio::select! {
                biased;
                () = room.stop.cancelled() => return End::Stopping,
                () = &mut beat => {
                    self.notice_leavers();
                    let coverage = self.collector.coverage();
                    let progress = self.progress(&coverage);
                    let elapsed = progress.elapsed_seconds;
                    let _ = answer.try_send(Ok(event(Event::Progress(progress))));
                    if let Some(end) = self.end(elapsed, coverage) {
                        return end;
                    }
                    beat = room.clock.sleep(BEAT);
                }
                frame = frames.recv() => match frame {
                    Some((sensor, time, bodies)) => {
                        *self.peopled.entry(sensor).or_default() += u64::from(!bodies.is_empty());
                        self.collector.add(sensor, time, &bodies);
                    }
                    None => return End::Stopping,
                }
            }
        }
    }

    /// Whether the walk is over after `elapsed` seconds.
    fn end(&self, elapsed: f64, coverage: Coverage) -> Option<End> {
        let is_covered = coverage.share >= 1.0 && elapsed >= UNTIL_COVERED[0];
        if self.left.len() == self.sensors.len() || (self.until_covered && is_covered) {
            return Some(End::Done);
        }
        (elapsed >= self.seconds).then_some(if self.until_covered {
            End::TooLittle(coverage)
        } else {
            End::Done
        })
    }

    /// Leaves out the sensors whose agents went away and did not come back.
    fn notice_leavers(&mut self) {
        let now = self.room.clock.now();
        for sensor in &self.sensors {
            if sensor.is_connected() {
                self.gone.remove(&sensor.id());
                continue;
            }
            let since = *self.gone.entry(sensor.id()).or_insert(now);
            let name = sensor.name();
            if now.since_ns(since) >= LEFT_NS && !self.left.iter().any(|(left, _)| left == name) {
                tracing::warn!(sensor = name, "left while a calibration was gathered");
                self.collector.remove(sensor.id());
                self.left
                    .push((name.to_owned(), since.since_seconds(self.began)));
            }
        }
    }

    fn progress(&self, coverage: &Coverage) -> v1::CalibrateProgress {
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
        let elapsed = self.room.clock.now().since_seconds(self.began);
        v1::CalibrateProgress {
            elapsed_seconds: elapsed.min(self.seconds),
            total_seconds: self.seconds,
            sensors: sensors.collect(),
            share: coverage.share,
            // In the first second no frame may have come yet, from a sensor that is well.
            hint: if elapsed < 1.0 {
                String::new()
            } else {
                coverage.hint.clone()
            },
            solving: false,
        }
    }

    async fn conclude(self, too_little: Option<Coverage>) -> Result<v1::CalibrateResult, Status> {
        let left = self.left.iter().map(|(name, _)| name.as_str());
        let staying = self.sensors.len() - self.left.len();
        if staying == 0 || (staying == 1 && !self.left.is_empty()) {
            return Ok(failed(format!(
                "{} left during the walk, too few sensors stayed: see whether their agents run, and repeat",
                listed(left)
            )));
        }
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
        let solved = solved.map_err(|error| Status::internal(error.to_string()))?;
        let (mut calibration, mut report) = match solved {
            Ok(Solution {
                calibration,
                report,
            }) => (calibration, report),
            Err(error) => return Ok(failed(error.to_string())),
        };
        self.note_circumstances(&mut report, too_little);
        calibration.verdict = report.verdict.to_string();
        tracing::info!(verdict = %report.verdict, reasons = report.reasons.len(), "a calibration was solved");
        self.answer(calibration, &report).await
    }

    async fn answer(
        &self,
        calibration: Calibration,
        report: &Report,
    ) -> Result<v1::CalibrateResult, Status> {
        let mut result = result(report);
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

    /// Adds what the solver cannot know: who left, who came late, and that the walk was not ended by its coverage.
    fn note_circumstances(&self, report: &mut Report, too_little: Option<Coverage>) {
        let left = self.left.iter().map(|(name, seconds)| Reason {
            severity: Verdict::Weak,
            what: format!(
                "`{name}` left {seconds:.0} s into the walk and is not in this calibration"
            ),
            remedy: "see whether its agent runs, then calibrate again, or that sensor alone"
                .to_owned(),
            sensors: vec![name.clone()],
        });
        let registered = self.room.registry.sensors().into_iter();
        let is_new = |sensor: &Arc<Sensor>| {
            sensor.is_connected() && !self.sensors.iter().any(|known| known.id() == sensor.id())
        };
        let came = registered.filter(is_new).map(|sensor| Reason {
            severity: Verdict::Passed,
            what: format!(
                "`{}` came during the walk and is not in this calibration",
                sensor.name()
            ),
            remedy: "calibrate again, or that sensor alone".to_owned(),
            sensors: vec![sensor.name().to_owned()],
        });
        let ended = too_little.map(|coverage| Reason {
            severity: Verdict::Passed,
            what: format!(
                "the walk was ended by the clock after {:.0} s, {:.0} % of what is needed was seen",
                self.seconds,
                (coverage.share * 100.0).floor()
            ),
            remedy: coverage.hint,
            sensors: Vec::new(),
        });
        let notes: Vec<Reason> = left.chain(came).chain(ended).collect();
        for note in notes {
            report.verdict = report.verdict.max(note.severity);
            report.reasons.push(note);
        }
    }
}

fn event(event: Event) -> v1::CalibrateEvent {
    v1::CalibrateEvent { event: Some(event) }
}
