//! The one thread that fuses: it owns the engine, takes inputs from one bounded queue, and hands results to the sinks.
//!
//! The order in which it takes inputs is the order a take records. It shares no lock with anybody: requests come over
//! a channel between two inputs, what it knows goes out as a [`Snapshot`] ten times a second.

mod command;
mod drive;
mod meters;
mod queue;
mod refusals;

use std::sync::Arc;

use posefuse_fusion::{Engine, Input};
use tokio::sync::{mpsc, oneshot, watch};

pub(crate) use command::{Command, Commands, WalkFrame};
pub(crate) use meters::{SensorView, Snapshot};
pub(crate) use queue::{Inputs, Pushed};
pub(crate) use refusals::Unused;

use crate::drift::{self, Seen};
use crate::repair::{self, Meter, Repair};
use crate::sinks::{Counters, Subscribers};
use crate::{Clock, ServerError, Threads};

/// Requests that may wait between two inputs.
const COMMANDS: usize = 64;

/// The running fusion thread, as the rest of the server sees it.
pub(crate) struct Fusion {
    pub(crate) inputs: Inputs,
    pub(crate) commands: Commands,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) counters: Arc<Counters>,
    /// What the watch over the sensors' places lives on, and how much of it found no room.
    pub(crate) seen: mpsc::Receiver<Seen>,
    pub(crate) missed: drift::Missed,
    /// What came of the windows that the model beside the engine was asked to fill.
    pub(crate) repair: Arc<Meter>,
    /// Comes when the thread has ended.
    pub(crate) ended: oneshot::Receiver<()>,
}

/// Starts the thread; `first` is what the engine is to know before anything else, `repair` the model beside it, `live` what
/// leads to the live streams.
pub(crate) fn start(
    config: &crate::Config,
    mut first: Vec<Input>,
    repair: Repair,
    live: posefuse_sinks::Tap,
    clock: Arc<dyn Clock>,
    threads: Threads,
) -> Result<Fusion, ServerError> {
    config.fusion.validate()?;
    let engine = Engine::new(config.fusion.clone());
    let (input_sender, input_queue) = mpsc::channel(config.ingest.queue);
    let (command_sender, command_queue) = mpsc::channel(COMMANDS);
    let (publish, snapshot) = watch::channel(Arc::new(Snapshot::default()));
    let counters = Arc::new(Counters::default());
    let (tap, seen) = drift::tap(&config.drift);
    let missed = tap.missed();
    let inputs = Inputs::new(input_sender, config.ingest.max_wait_ms);
    let model = repair.for_engine();
    first.extend(model.map(|model| Input::RepairModel(Some(model))));
    let (requests, repair) = repair::start(repair, inputs.clone(), clock.clone(), threads)?;
    let ways = drive::Ways {
        subscribers: Subscribers::new(counters.clone(), config.timecode),
        live,
        tap,
        repair: requests,
        publish,
    };
    let driver = drive::Driver::new(engine, clock, threads, ways);
    let ended = threads.spawn("fusion", driver.drive(first, input_queue, command_queue))?;
    Ok(Fusion {
        inputs,
        commands: Commands::new(command_sender),
        snapshot,
        counters,
        seen,
        missed,
        repair,
        ended,
    })
}
