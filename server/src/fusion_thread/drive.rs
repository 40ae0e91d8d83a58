//! The loop of the fusion thread: inputs and deadlines to the engine, what it gives to the sinks.

use std::future;
use std::sync::Arc;

use futures_util::future::BoxFuture;
use posefuse_fusion::{Engine, Input, Output};
use posefuse_skeleton::Timestamp;
use tokio::sync::{mpsc, oneshot, watch};

use super::command::{Command, WalkFrame};
use super::meters::{Meters, Snapshot};
use crate::drift::Tap;
use crate::record::{Preamble, Record, RecorderTap};
use crate::repair::Requests;
use crate::sinks::Subscribers;
use crate::{Clock, Threads};

/// Inputs taken from the queue at once.
const BATCH: usize = 64;
/// How often a snapshot goes out.
const PUBLISH_NS: i64 = 100_000_000;

/// Where the fusion thread's results go, besides a recorder and a walk that come and go.
pub(super) struct Ways {
    pub(super) subscribers: Subscribers,
    pub(super) live: posefuse_sinks::Tap,
    pub(super) tap: Tap,
    pub(super) repair: Requests,
    pub(super) publish: watch::Sender<Arc<Snapshot>>,
}

/// Everything the fusion thread owns.
pub(super) struct Driver {
    engine: Engine,
    clock: Arc<dyn Clock>,
    threads: Threads,
    subscribers: Subscribers,
    recorder: Option<RecorderTap>,
    walk: Option<mpsc::Sender<WalkFrame>>,
    tap: Tap,
    repair: Requests,
    live: posefuse_sinks::Tap,
    meters: Meters,
    publish: watch::Sender<Arc<Snapshot>>,
    /// When the engine wants to be woken.
    wake: Option<Timestamp>,
    next_publish: Timestamp,
}

impl Driver {
    pub(super) fn new(
        mut engine: Engine,
        clock: Arc<dyn Clock>,
        threads: Threads,
        ways: Ways,
    ) -> Self {
        engine.compare_sensors(ways.tap.compares());
        Self {
            engine,
            next_publish: clock.now(),
            clock,
            threads,
            subscribers: ways.subscribers,
            recorder: None,
            walk: None,
            tap: ways.tap,
            repair: ways.repair,
            live: ways.live,
            meters: Meters::default(),
            publish: ways.publish,
            wake: None,
        }
    }

    /// Runs until [`Command::End`], or until nobody is left who could send anything.
    pub(super) async fn drive(
        mut self,
        first: Vec<Input>,
        mut inputs: mpsc::Receiver<Input>,
        mut commands: mpsc::Receiver<Command>,
    ) {
        first.into_iter().for_each(|input| self.feed(input));
        let mut batch = Vec::with_capacity(BATCH);
        let mut alarm_time: Option<Timestamp> = None;
        let mut alarm: BoxFuture<'static, ()> = Box::pin(future::pending());
        loop {
            let deadline = self
                .wake
                .map_or(self.next_publish, |wake| wake.min(self.next_publish));
            // The engine's wish moves with nearly every frame, mostly to later: an alarm that rings too early costs
            // less than a new one each time.
            if alarm_time.is_none_or(|armed| deadline < armed) {
                alarm = self.clock.sleep_until(deadline);
                alarm_time = Some(deadline);
            }
            tokio::select! {
                biased;
                command = commands.recv() => match command {
                    None | Some(Command::End) => break,
                    Some(command) => self.obey(command, &mut inputs),
                },
                taken = inputs.recv_many(&mut batch, BATCH) => {
                    if taken == 0 {
                        break;
                    }
                    for input in batch.drain(..) {
                        self.tick_if_due();
                        self.feed(input);
                    }
                    if inputs.is_empty() {
                        self.threads.give_way();
                    }
                }
                () = &mut alarm => alarm_time = None,
            }
            self.tick_if_due();
            self.publish_if_due();
        }
        self.take_waiting(&mut inputs);
    }

    fn obey(&mut self, command: Command, inputs: &mut mpsc::Receiver<Input>) {
        match command {
            Command::Watch(subscriber, pace) => self.subscribers.add_watch(subscriber, pace),
            Command::WatchSensors(subscriber) => self.subscribers.add_watch_sensors(subscriber),
            Command::Record(recorder, reply) => {
                // A calibration that was put in force before the take belongs before it.
                self.take_waiting(inputs);
                self.begin_recording(recorder, reply);
            }
            Command::StopRecording(reply) => {
                self.take_waiting(inputs);
                self.recorder = None;
                let _ = reply.send(());
            }
            Command::Walk(walk) => self.walk = Some(walk),
            Command::End => {}
        }
    }

    fn begin_recording(&mut self, recorder: RecorderTap, reply: oneshot::Sender<Preamble>) {
        let state = self.engine.state();
        if let Err(error) = &state {
            tracing::warn!(%error, "the take begins without the engine's state");
        }
        let preamble = Preamble {
            start: self.clock.now(),
            inputs: self.engine.preamble(),
            state: state.ok(),
        };
        if reply.send(preamble).is_ok() {
            self.recorder = Some(recorder);
        }
    }

    /// Feeds what is in the queue now.
    fn take_waiting(&mut self, inputs: &mut mpsc::Receiver<Input>) {
        for _ in 0..inputs.len() {
            match inputs.try_recv() {
                Ok(input) => {
                    self.tick_if_due();
                    self.feed(input);
                }
                Err(_) => return,
            }
        }
    }

    fn tick_if_due(&mut self) {
        if let Some(wake) = self.wake {
            let now = self.clock.now();
            if now >= wake {
                self.feed(Input::Tick(now));
            }
        }
    }

    fn publish_if_due(&mut self) {
        let now = self.clock.now();
        if now >= self.next_publish {
            self.next_publish = now.plus_ns(PUBLISH_NS);
            let snapshot = self.meters.snapshot(&self.engine, now);
            self.publish.send_replace(Arc::new(snapshot));
            self.subscribers.forget_gone();
        }
    }

    /// One input through the engine, and everything that follows from it.
    fn feed(&mut self, input: Input) {
        let before = self.clock.now();
        self.meters.input(&input);
        self.subscribers.input(&input, before);
        self.record(|| Record::Input(input.clone()));
        let observed = match &input {
            Input::Observation(observation) => Some((
                observation.sensor,
                observation.captured,
                observation.received,
            )),
            _ => None,
        };
        self.tap(&input);
        self.engine.handle(input);
        self.tap.compared(&mut self.engine);
        let mut frames = 0;
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => {
                    frames += 1;
                    let now = self.clock.now();
                    // Asked once: one frame has one civil time, wherever it goes.
                    let unix_offset_ns = self.clock.unix_offset_ns();
                    self.subscribers.frame(&frame, now, unix_offset_ns);
                    let civil = || self.subscribers.civil(&frame, unix_offset_ns);
                    self.live.offer(&frame, civil);
                    self.meters.frame(&frame, now);
                    self.record(|| Record::Frame(frame));
                }
                Output::Rejected(rejection) => {
                    self.meters.rejected(&rejection);
                    self.record(|| Record::Rejection(rejection));
                }
                Output::Repair(request) => self.repair.ask(request),
                Output::WakeAt(wake) => {
                    self.wake = wake;
                    break;
                }
            }
        }
        let after = self.clock.now();
        self.meters.worked(before, after, frames);
        if let Some((sensor, captured, received)) = observed
            && let Some(mapped) = self.engine.map_time(sensor, captured)
        {
            self.meters.latency(sensor, received.since_ns(mapped));
        }
    }

    fn record(&mut self, message: impl FnOnce() -> Record) {
        if let Some(recorder) = &self.recorder
            && !recorder.offer(message())
        {
            self.recorder = None;
        }
    }

    /// Gives a sensor's frame to those who look at where sensors stand.
    fn tap(&mut self, input: &Input) {
        let Input::Observation(observation) = input else {
            return;
        };
        let Some(time) = self
            .engine
            .map_time(observation.sensor, observation.captured)
        else {
            return;
        };
        self.tap.frame(observation, time);
        if let Some(walk) = &self.walk {
            let frame = (observation.sensor, time, observation.bodies.clone());
            if let Err(mpsc::error::TrySendError::Closed(_)) = walk.try_send(frame) {
                self.walk = None;
            }
        }
    }
}
