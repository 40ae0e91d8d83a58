//! The engine: inputs in, outputs out, in the order of a skeleton's journey.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_skeleton::{
    AgentTime, Calibration, Comparison, Observation, Room, RoomFrame, SensorId, SensorInfo,
    Skeleton, Timestamp, TrackId,
};
use serde::{Deserialize, Serialize};

use crate::clock::ClockEstimate;
use crate::intake::Intake;
use crate::ledger::Ledger;
use crate::people::{Comparer, People, Placed};
use crate::repair::RepairModel;
use crate::sensors::SensorState;
use crate::stages::Pipeline;
use crate::{ClockSample, Config, Input, Output, Rejection, RejectionReason};

/// Outputs kept for a caller that does not poll; then the oldest goes.
const MAX_OUTPUTS: usize = 4096;
/// Frames made by one input at most.
const MAX_FRAMES_PER_INPUT: usize = 64;

/// The fusion engine.
///
/// Feed it with [`Engine::handle`] and take from [`Engine::poll`] until that gives [`Output::WakeAt`].
/// Equal inputs in equal order give equal outputs, bit by bit.
#[derive(Clone, Debug)]
pub struct Engine {
    pub(crate) config: Config,
    pub(crate) state: State,
    placed: Vec<Placed>,
    origins: Vec<Option<Vector3<f64>>>,
    known: Vec<TrackId>,
    comparer: Comparer,
    /// Frames that smoothing offline goes back over at a time.
    smooth_over: Option<usize>,
}

/// All that the engine remembers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct State {
    pub(crate) now: Option<Timestamp>,
    pub(crate) sensors: Vec<Option<SensorState>>,
    pub(crate) calibration: Option<Arc<Calibration>>,
    intake: Intake,
    pub(crate) people: People,
    pub(crate) pipeline: Pipeline,
    /// The model outside the engine, if there is one.
    pub(crate) repair_model: Option<RepairModel>,
    /// Frames that wait until fusing has looked far enough ahead, oldest first.
    held: VecDeque<RoomFrame>,
    outputs: VecDeque<Output>,
    frames: u64,
    /// Time of the newest frame that went into the stages.
    newest: Option<Timestamp>,
    /// The last frame made had people in it.
    peopled: bool,
}

impl Engine {
    /// An engine that knows nothing yet. Check `config` with [`Config::validate`] first: a stage with impossible
    /// settings would pass joints on unfiltered.
    pub fn new(config: Config) -> Self {
        let state = State {
            now: None,
            sensors: Vec::new(),
            calibration: None,
            intake: Intake::default(),
            people: People::default(),
            pipeline: Pipeline::new(&config.stages),
            repair_model: None,
            held: VecDeque::new(),
            outputs: VecDeque::new(),
            frames: 0,
            newest: None,
            peopled: false,
        };
        Self::from_state(config, state)
    }

    pub(crate) fn from_state(config: Config, state: State) -> Self {
        let mut engine = Self {
            config,
            state,
            placed: Vec::new(),
            origins: Vec::new(),
            known: Vec::new(),
            comparer: Comparer::default(),
            smooth_over: None,
        };
        engine.note_origins();
        engine
    }

    /// The configuration it runs with.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// For takes, not for the live room: frames wait for at least `frames` newer ones (1 to 1000; at 30 Hz 90 are as
    /// good as all) and are smoothed by all that came after them (`kalman` only). Memory grows with `frames`, some 50
    /// kB per person each. Call before the first input, and [`Engine::finish`] after the last.
    pub fn smooth_over(&mut self, frames: usize) {
        let frames = frames.clamp(1, 1000);
        self.smooth_over = Some(frames);
        self.state.people.remember(2 * frames);
    }

    /// Gives every frame that waits for newer ones: nothing more will come.
    pub fn finish(&mut self) {
        self.release(0);
        self.give(|pipeline, give| pipeline.flush(give));
    }

    /// Takes one input. Never panics and never blocks: what cannot be used is rejected with a reason.
    pub fn handle(&mut self, input: Input) {
        match input {
            Input::Sensor(info) => self.greet(info),
            Input::Observation(observation) => self.observe(observation),
            Input::ClockSample(sample) => self.probe(&sample),
            Input::Calibration(calibration) => self.calibrate(calibration),
            Input::Mute { sensor, muted } => self.mute(sensor, muted),
            Input::RepairModel(model) => self.state.repair_model = model,
            Input::Repaired(answer) => self.advance(answer.received),
            Input::Tick(now) => self.advance(now),
        }
        self.make_frames();
    }

    /// The next output; after [`Output::WakeAt`] there is nothing more until the next input.
    pub fn poll(&mut self) -> Output {
        if let Some(output) = self.state.outputs.pop_front() {
            return output;
        }
        let wake = self.state.now.and_then(|now| {
            let anyone = self.must_go_on(now);
            self.state.intake.wake(now, anyone, &self.config.intake)
        });
        Output::WakeAt(wake)
    }

    /// What is known of the clock of `sensor`'s agent; `None` before the first answered probe.
    pub fn clock(&self, sensor: SensorId) -> Option<ClockEstimate> {
        let now = self.state.now?;
        self.sensor(sensor)?.clock.estimate(now, &self.config.clock)
    }

    /// A time of `sensor`'s agent in the server's clock; `None` before the first answered probe.
    pub fn map_time(&self, sensor: SensorId, time: AgentTime) -> Option<Timestamp> {
        self.sensor(sensor)?.clock.map(time)
    }

    /// Where this engine would take the bodies of `observation` to be, and when: in the room, put right by what the
    /// calibration in force knows. Nothing is refused and nothing remembered. `None` while the sensor's clock is not mapped
    /// or its place not known.
    pub fn locate(&self, observation: &Observation) -> Option<(Timestamp, Vec<Skeleton<Room>>)> {
        self.sensor(observation.sensor)?
            .locate(observation, &self.config)
    }

    /// Whether to keep, from now on, what the sensors see of each person, for [`Engine::take_comparisons`]. Frames do
    /// not depend on it, and snapshots do not keep it.
    pub fn compare_sensors(&mut self, enabled: bool) {
        self.comparer.enable(enabled);
    }

    /// What the sensors saw of each person since the last call, oldest first: at most five a second and person, and of
    /// those not taken the latest 256.
    pub fn take_comparisons(&mut self) -> impl Iterator<Item = Comparison> {
        self.comparer.take()
    }

    fn sensor(&self, id: SensorId) -> Option<&SensorState> {
        self.state.sensors.get(id.index())?.as_ref()
    }

    fn sensor_mut(&mut self, id: SensorId) -> Option<&mut SensorState> {
        self.state.sensors.get_mut(id.index())?.as_mut()
    }

    fn greet(&mut self, info: SensorInfo) {
        let id = info.id;
        if self.state.sensors.len() <= id.index() {
            self.state.sensors.resize(id.index() + 1, None);
        }
        match &mut self.state.sensors[id.index()] {
            Some(known) if known.info.name == info.name => known.info = info,
            slot => {
                *slot = Some(SensorState::new(info, self.state.calibration.as_deref()));
                self.state.people.forget_sensor(id);
            }
        }
        self.note_origins();
    }

    fn calibrate(&mut self, calibration: Arc<Calibration>) {
        let mut moved = false;
        for sensor in self.state.sensors.iter_mut().flatten() {
            let was_placed = sensor.place.is_some();
            moved |= sensor.put(Some(&calibration)) && was_placed;
        }
        self.state.calibration = Some(calibration);
        if moved {
            self.release(0);
            self.state.people.uproot();
            self.state.pipeline.restart_all();
        }
        self.note_origins();
    }

    fn mute(&mut self, id: SensorId, muted: bool) {
        if let Some(sensor) = self.sensor_mut(id) {
            sensor.muted = muted;
            sensor.ledger = Ledger::default();
            if muted {
                self.state.people.forget_sensor(id);
            }
        }
    }

    fn probe(&mut self, sample: &ClockSample) {
        self.advance(sample.returned);
        let config = self.config.clock;
        if let Some(sensor) = self.sensor_mut(sample.sensor) {
            sensor.clock.add(sample, &config);
        }
    }

    fn observe(&mut self, mut observation: Observation) {
        self.advance(observation.received);
        let id = observation.sensor;
        let clock = self.config.clock;
        let admitted = match self.sensor_mut(id) {
            Some(sensor) => sensor.admit(&observation, &clock),
            None => Err(RejectionReason::UnknownSensor),
        };
        let (time, place) = match admitted {
            Ok(admitted) => admitted,
            Err(reason) => return self.reject_frame(&observation, reason),
        };
        let muted = self.sensor(id).is_some_and(|sensor| sensor.muted);
        let intake = &mut self.state.intake;
        // Nobody waits for a sensor that is left out.
        if !muted {
            intake.arrived(id, time, observation.received, &self.config.intake);
        }
        if intake.is_late(time, &self.config.intake) {
            return self.reject_frame(&observation, RejectionReason::Late);
        }
        let Some(sensor) = self
            .state
            .sensors
            .get_mut(id.index())
            .and_then(Option::as_mut)
        else {
            return;
        };
        let outputs = &mut self.state.outputs;
        let mut rejected = [0_u64; crate::diagnostics::REASONS];
        let fresh = sensor.place_bodies(
            &mut observation,
            time,
            &place,
            &self.config,
            &mut self.placed,
            &mut |rejection| {
                rejected[crate::diagnostics::reason_index(rejection.reason)] += 1;
                put(outputs, Output::Rejected(rejection));
            },
        );
        for (total, new) in sensor.rejected.iter_mut().zip(rejected) {
            *total = total.saturating_add(new);
        }
        if !fresh || muted {
            return;
        }
        let origin = place.room_from_sensor.origin().vector();
        self.state
            .people
            .observe(id, origin, time, &self.placed, &self.config);
        self.state.people.watch(id, &place.room_from_sensor, time);
        let now = observation.received;
        self.state
            .intake
            .delivered(id, time, now, &self.config.intake);
    }

    fn reject_frame(&mut self, observation: &Observation, reason: RejectionReason) {
        if let Some(sensor) = self.sensor_mut(observation.sensor) {
            sensor.count(reason);
        }
        let rejection = Rejection {
            sensor: observation.sensor,
            time: observation.received,
            reason,
            joint: None,
        };
        put(&mut self.state.outputs, Output::Rejected(rejection));
    }

    /// Time never goes back.
    fn advance(&mut self, now: Timestamp) {
        self.state.now = Some(self.state.now.map_or(now, |known| known.max(now)));
    }

    /// Whether frames go on though no sensor says anything: somebody is there, or left just now.
    fn must_go_on(&self, now: Timestamp) -> bool {
        let time = self.state.newest.unwrap_or(now);
        self.state.peopled || self.state.people.anyone(time, &self.config.associate)
    }

    fn make_frames(&mut self) {
        let Some(now) = self.state.now else {
            return;
        };
        for _ in 0..MAX_FRAMES_PER_INPUT {
            let anyone = self.must_go_on(now);
            let Some(time) = self.state.intake.due(now, anyone, &self.config.intake) else {
                return;
            };
            self.make_frame(time, now);
        }
    }

    fn make_frame(&mut self, time: Timestamp, now: Timestamp) {
        let sensors = &mut self.state.sensors;
        let tracks =
            self.state
                .people
                .frame(time, &self.origins, &self.config, |sensor, residual_m| {
                    if let Some(Some(sensor)) = sensors.get_mut(sensor.index()) {
                        sensor.add_residual(residual_m);
                    }
                });
        let trusted = self.config.fuse.min_confidence;
        (self.comparer).look(time, &self.state.people, &self.state.sensors, trusted);
        self.keep_account(time);
        for id in self.state.people.take_flipped() {
            self.state.pipeline.restart(id);
        }
        self.known.clear();
        self.known.extend(self.state.people.ids());
        self.known.sort_unstable();
        self.state.pipeline.retain(&self.known);

        self.state.peopled = !tracks.is_empty();
        self.state.newest = Some(time);
        let frame = RoomFrame {
            number: 0,
            time,
            look_ahead_ns: 0,
            tracks,
        };
        self.state.held.push_back(frame);
        self.release_ready();
        // Nobody is there: nothing is left to wait for, and perhaps nothing will come.
        if !self.must_go_on(now) {
            self.release(0);
            self.give(|pipeline, give| pipeline.flush(give));
        }
    }

    /// Notes each sensor's part in the frame of `time`.
    fn keep_account(&mut self, time: Timestamp) {
        let elapsed_s = self
            .state
            .newest
            .map_or(0.0, |last| time.since_seconds(last));
        let sensors = &mut self.state.sensors;
        for sensor in sensors.iter_mut().flatten() {
            sensor.ledger.forget(elapsed_s);
        }
        for part in self.state.people.parts() {
            if let Some(Some(sensor)) = sensors.get_mut(part.sensor.index()) {
                sensor.ledger.add(part);
            }
        }
    }

    /// Sends the frames held back on, looked back at from the present, but for the newest `keep`.
    fn release(&mut self, keep: usize) {
        let State { held, people, .. } = &mut self.state;
        let ready = held.len().saturating_sub(keep);
        people.look_back(&mut held.make_contiguous()[..ready]);
        for _ in 0..ready {
            if let Some(frame) = self.state.held.pop_front() {
                self.give(|pipeline, give| pipeline.push(frame, give));
            }
        }
    }

    /// Sends on what has waited long enough. Smoothing offline goes back over many frames at once, each of which is
    /// then looked at twice at most, however far it looks ahead.
    fn release_ready(&mut self) {
        match self.smooth_over {
            Some(frames) if self.state.held.len() >= 2 * frames => self.release(frames),
            Some(_) => {}
            None => self.release(self.config.fuse.look_ahead_frames()),
        }
    }

    /// Numbers the frames that `run` gets out of the stages and puts them out.
    fn give(&mut self, run: impl FnOnce(&mut Pipeline, &mut dyn FnMut(RoomFrame))) {
        let State {
            pipeline,
            outputs,
            frames,
            newest,
            ..
        } = &mut self.state;
        run(pipeline, &mut |mut frame| {
            *frames += 1;
            frame.number = *frames;
            frame.look_ahead_ns = newest.map_or(0, |newest| newest.since_ns(frame.time));
            put(outputs, Output::Frame(frame));
        });
    }

    fn note_origins(&mut self) {
        let origin = |sensor: &Option<SensorState>| sensor.as_ref().and_then(SensorState::origin);
        self.origins.clear();
        self.origins.extend(self.state.sensors.iter().map(origin));
        self.origins.resize(SensorId::MAX_SENSORS, None);
    }
}

fn put(outputs: &mut VecDeque<Output>, output: Output) {
    if outputs.len() == MAX_OUTPUTS {
        outputs.pop_front();
    }
    outputs.push_back(output);
}
