//! The switchboard: sinks on and off, and how each is.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::hub::Outlets;
use crate::kind::UnknownKind;
use crate::meter::Meter;
use crate::queue::frames;
use crate::sink::Sink;
use crate::{Config, Frames, Kind, SinkState, SinkStatus};

/// Frames that may wait for one sink.
const QUEUE: usize = 4;
/// A sink that failed is tried again after this, then after twice as long, up to [`LONGEST_WAIT`].
const FIRST_WAIT: Duration = Duration::from_secs(1);
const LONGEST_WAIT: Duration = Duration::from_secs(10);

/// All sinks. Cheap to clone.
#[derive(Clone)]
pub struct Sinks(Arc<Board>);

struct Board {
    lines: Vec<Line>,
    outlets: Outlets,
    tasks: TaskTracker,
}

struct Line {
    sink: Arc<dyn Sink>,
    from_start: bool,
    meter: Arc<Meter>,
    /// Ends its task; `None`: it is off.
    running: Mutex<Option<CancellationToken>>,
    /// Its task, of now or of before it was switched off.
    task: Mutex<Option<JoinHandle<()>>>,
}

/// Why a sink cannot be switched.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SwitchError {
    /// There is none of that name.
    #[error(transparent)]
    Unknown(#[from] UnknownKind),
}

impl Sinks {
    pub(crate) fn new(config: &Config, outlets: Outlets) -> Self {
        let lines = config.sinks().into_iter().map(|(from_start, sink)| Line {
            sink: sink.into(),
            from_start,
            meter: Arc::default(),
            running: Mutex::default(),
            task: Mutex::default(),
        });
        Self(Arc::new(Board {
            lines: lines.collect(),
            outlets,
            tasks: TaskTracker::new(),
        }))
    }

    /// Starts those that are on from the start, as tasks of the current runtime.
    pub fn start(&self) {
        for line in self.0.lines.iter().filter(|line| line.from_start) {
            self.0.switch_on(line);
        }
    }

    /// Switches a sink on or off by its [name](Kind::name); nothing happens when it is so already.
    ///
    /// # Errors
    /// There is no such sink.
    pub fn switch(&self, name: &str, on: bool) -> Result<SinkStatus, SwitchError> {
        let kind: Kind = name.parse()?;
        let line = self.0.lines.iter().find(|line| line.sink.kind() == kind);
        let line = line.ok_or_else(|| UnknownKind(name.to_owned()))?;
        match on {
            true => self.0.switch_on(line),
            false => self.0.switch_off(line),
        }
        Ok(line.status())
    }

    /// How each sink is.
    pub fn statuses(&self) -> Vec<SinkStatus> {
        self.0.lines.iter().map(Line::status).collect()
    }

    /// Frames whose bodies were solved for whichever sinks are on, and frames that came faster than that and went to none.
    pub fn solved_and_missed(&self) -> [u64; 2] {
        self.0.outlets.counts()
    }

    /// Whether no sink gets anything any more, by a fault of the program.
    pub fn is_broken(&self) -> bool {
        self.0.outlets.is_broken()
    }

    /// Switches all off and waits until their tasks have ended.
    pub async fn stop(&self) {
        for line in &self.0.lines {
            self.0.switch_off(line);
        }
        self.0.tasks.close();
        self.0.tasks.wait().await;
    }
}

impl Board {
    fn switch_on(&self, line: &Line) {
        let mut running = line.running();
        if running.is_some() || self.tasks.is_closed() {
            return;
        }
        let (sink, meter) = (line.sink.clone(), line.meter.clone());
        let (frames_in, frames) = frames(QUEUE, meter.clone());
        self.outlets.open(sink.kind(), frames_in, sink.rate_hz());
        let stop = CancellationToken::new();
        *running = Some(stop.clone());
        tracing::info!(sink = %sink.kind(), place = sink.place(), "on");
        let mut task = line.task.lock().unwrap_or_else(PoisonError::into_inner);
        let before = task.take();
        *task = Some(self.tasks.spawn(async move {
            // What it holds, a port say, must be free first.
            if let Some(before) = before {
                let _ = before.await;
            }
            meter.set_trouble(String::new());
            let _ = stop
                .run_until_cancelled_owned(again_and_again(sink, frames, meter.clone()))
                .await;
            meter.set_trouble(String::new());
            meter.set_clients(0);
        }));
    }

    fn switch_off(&self, line: &Line) {
        if let Some(stop) = line.running().take() {
            stop.cancel();
            self.outlets.close(line.sink.kind());
            tracing::info!(sink = %line.sink.kind(), "off");
        }
    }
}

/// Runs a sink, and again after a while when it fails.
async fn again_and_again(sink: Arc<dyn Sink>, frames: Frames, meter: Arc<Meter>) {
    let mut wait = FIRST_WAIT;
    loop {
        let before = meter.delivered();
        match sink.run(frames.clone(), meter.clone()).await {
            Ok(()) => meter.set_trouble(String::new()),
            Err(trouble) => {
                tracing::warn!(sink = %sink.kind(), "{trouble}");
                meter.set_trouble(trouble);
            }
        }
        meter.set_clients(0);
        if meter.delivered() > before {
            wait = FIRST_WAIT;
        }
        tokio::time::sleep(wait).await;
        wait = (wait * 2).min(LONGEST_WAIT);
    }
}

impl Line {
    fn running(&self) -> std::sync::MutexGuard<'_, Option<CancellationToken>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn status(&self) -> SinkStatus {
        let is_on = self.running().is_some();
        let trouble = self.meter.trouble();
        let latency = self.meter.latency_ms();
        SinkStatus {
            kind: self.sink.kind(),
            state: match (is_on, trouble.is_empty()) {
                (false, _) => SinkState::Off,
                (true, true) => SinkState::Running,
                (true, false) => SinkState::Failing,
            },
            place: self.sink.place(),
            rate_hz: self.sink.rate_hz(),
            clients: self.sink.counts_clients().then(|| self.meter.clients()),
            delivered: self.meter.delivered(),
            dropped: self.meter.dropped(),
            p50_ms: latency.map(|[p50, _]| p50),
            p99_ms: latency.map(|[_, p99]| p99),
            trouble,
        }
    }
}
