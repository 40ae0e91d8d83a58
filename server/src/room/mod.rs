//! The service `posefuse.v1.Room`: what the dashboard, the command line and any other client can see and do.

mod calibrate;
mod calibration;
mod calibration_result;
mod calibrations;
mod catalogue;
mod history;
mod mute;
mod plan;
mod recording;
mod replay;
mod sensors;
mod service;
mod sinks;
mod status;
mod takes;
mod timecode;
mod trigger;
mod watchman;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use futures_util::stream::select_all;
use posefuse_proto::v1;
use posefuse_session::Storage;
use posefuse_skeleton::SensorId;
use tokio::sync::{Semaphore, watch};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tonic::Status;

pub use calibration::Config as CalibrationConfig;
pub(crate) use calibration::{CalibrationStore, REMEDY};
pub(crate) use calibration_result::{failed as calibration_failed, result as calibration_result};
pub use recording::BUILD;
pub(crate) use takes::Takes;
pub(crate) use timecode::stamp;
pub use timecode::{Config as TimecodeConfig, Zone as TimecodeZoneName};
pub use trigger::Config as TriggerConfig;
pub(crate) use trigger::{Order, Triggers, Way};
pub(crate) use watchman::{Noted, watch_over};

use crate::drift::Drift;
use crate::fusion_thread::{Command, Commands, Inputs, Snapshot};
use crate::ingest::{Registry, watch_depth};
use crate::net::{Connections, EncodedStream};
use crate::repair::Meter;
use crate::sinks::{Counters, FramePace, Pace, SensorSubscriber, place, subscribe};
use crate::{Clock, Threads};

/// Everything the service needs of the rest of the server.
pub(crate) struct Room {
    pub(crate) config: crate::Config,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) threads: Threads,
    pub(crate) storage: Arc<dyn Storage>,
    pub(crate) registry: Arc<Registry>,
    pub(crate) inputs: Inputs,
    pub(crate) commands: Commands,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) counters: Arc<Counters>,
    /// What came of the windows that the model beside the engine was asked to fill.
    pub(crate) repair: Arc<Meter>,
    /// Live streams to other programs.
    pub(crate) sinks: posefuse_sinks::Sinks,
    /// One for each subscriber there may be.
    pub(crate) places: Arc<Semaphore>,
    pub(crate) connections: Arc<Connections>,
    pub(crate) calibration: CalibrationStore,
    pub(crate) takes: Takes,
    /// What came of other programs' orders to start and stop takes.
    pub(crate) triggers: Triggers,
    /// Whether the sensors still stand where they should.
    pub(crate) drift: Drift,
    /// What the watchman last saw the sensors do.
    pub(crate) noted: Noted,
    /// Held while a sensor is muted or taken in again.
    pub(crate) muting: tokio::sync::Mutex<()>,
    /// Held while a take starts or stops and while the calibration changes: never both, so no sensor moves in a take.
    pub(crate) changing: tokio::sync::Mutex<()>,
    /// Free bytes where takes go; `u64::MAX`: unknown.
    pub(crate) disk_free: AtomicU64,
    /// The turn to make a plan.
    pub(crate) planning: Arc<Semaphore>,
    pub(crate) tasks: TaskTracker,
    pub(crate) stop: CancellationToken,
}

/// The service; cheap to clone.
#[derive(Clone)]
pub(crate) struct RoomService(pub(crate) Arc<Room>);

impl RoomService {
    /// The room as it is now.
    pub(crate) fn status(&self) -> v1::RoomStatus {
        status::status(&self.0)
    }

    /// What the fusion thread last told.
    pub(crate) fn snapshot(&self) -> Arc<Snapshot> {
        self.0.snapshot.borrow().clone()
    }

    pub(crate) fn connections(&self) -> &Connections {
        &self.0.connections
    }

    /// Fused frames, encoded.
    pub(crate) fn open_watch(
        &self,
        request: tonic::Request<v1::WatchRequest>,
    ) -> Result<EncodedStream, Status> {
        let (subscriber, stream) = subscribe(&self.0.config.watch, &self.0.places)?;
        let pace = FramePace::new(request.into_inner().max_rate_hz);
        self.0.commands.try_send(Command::Watch(subscriber, pace))?;
        Ok(stream)
    }

    /// Sensors' frames, encoded.
    pub(crate) fn open_watch_sensors(
        &self,
        request: tonic::Request<v1::WatchSensorsRequest>,
    ) -> Result<EncodedStream, Status> {
        let request = request.into_inner();
        if request.sensors.len() > SensorId::MAX_SENSORS {
            return Err(Status::invalid_argument(format!(
                "`sensors` names {}, a room has at most {}",
                request.sensors.len(),
                SensorId::MAX_SENSORS
            )));
        }
        let (subscriber, stream) = subscribe(&self.0.config.watch, &self.0.places)?;
        let subscriber = SensorSubscriber {
            subscriber,
            names: request.sensors,
            paces: vec![Pace::new(request.max_rate_hz); SensorId::MAX_SENSORS],
        };
        self.0
            .commands
            .try_send(Command::WatchSensors(subscriber))?;
        Ok(stream)
    }

    /// Sensors' depth previews, encoded.
    pub(crate) fn open_watch_depth(
        &self,
        request: tonic::Request<v1::WatchDepthRequest>,
    ) -> Result<EncodedStream, Status> {
        let request = request.into_inner();
        let place = Arc::new(place(&self.0.config.watch, &self.0.places)?);
        let mut streams = Vec::new();
        // A sensor that is named twice is watched once.
        let names: BTreeSet<_> = [&request.sensor]
            .into_iter()
            .chain(&request.more_sensors)
            .collect();
        for name in names {
            let sensor = self.0.registry.named(name).ok_or_else(|| {
                Status::not_found(format!("no sensor called `{name}` has joined this room"))
            })?;
            let (clock, stop) = (self.0.clock.clone(), self.0.stop.clone());
            let place = place.clone();
            streams.push(watch_depth(
                sensor,
                request.max_rate_hz,
                place,
                clock,
                stop,
            )?);
        }
        Ok(Box::pin(select_all(streams)))
    }
}

impl Room {
    /// Free bytes where takes go, as last looked up.
    fn disk_free(&self) -> Option<u64> {
        let free = self.disk_free.load(Ordering::Relaxed);
        (free != u64::MAX).then_some(free)
    }
}
