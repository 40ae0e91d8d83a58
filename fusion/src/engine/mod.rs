//! The engine: inputs in, outputs out, in the order of a skeleton's journey.
//!
//! `arrivals` takes what comes in, `frames` makes frames and sends them through the stages and repair.

mod arrivals;
mod frames;

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_skeleton::{
    AgentTime, Calibration, Comparison, JointSet, Observation, Room, RoomFrame, SensorId, Skeleton,
    Timestamp, TrackId,
};
use serde::{Deserialize, Serialize};

use crate::clock::ClockEstimate;
use crate::intake::Intake;
use crate::people::{Comparer, People, Placed};
use crate::repair::{Joints, Repair, RepairCounts};
use crate::sensors::SensorState;
use crate::stages::Pipeline;
use crate::{Config, Input, Output};

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
    /// The joints that the sensors' trackers have.
    trackable: Joints,
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
    pub(crate) repair: Repair,
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
            repair: Repair::default(),
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
            trackable: 0,
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
    /// kB per person each. Repair looks both ways, too. Call before the first input, and [`Engine::finish`] after the last.
    pub fn smooth_over(&mut self, frames: usize) {
        let frames = frames.clamp(1, 1000);
        self.smooth_over = Some(frames);
        self.state.people.remember(2 * frames);
    }

    /// Gives every frame that waits for newer ones: nothing more will come. Those in which something is missing may ask
    /// the model outside once more; whoever offered one answers ([`Input::Repaired`]) and calls this again, which gives all
    /// that is still waiting.
    pub fn finish(&mut self) {
        self.repair(|repair, at, out| repair.finish(at, out));
        self.release(0);
        self.give(|pipeline, give| pipeline.flush(give));
        self.repair(|repair, at, out| repair.flush(at, out));
    }

    /// Takes one input. Never panics and never blocks: what cannot be used is rejected with a reason.
    pub fn handle(&mut self, input: Input) {
        match input {
            Input::Sensor(info) => self.greet(info),
            Input::Observation(observation) => self.observe(observation),
            Input::ClockSample(sample) => self.probe(&sample),
            Input::Calibration(calibration) => self.calibrate(calibration),
            Input::Mute { sensor, muted } => self.mute(sensor, muted),
            Input::RepairModel(model) => self.state.repair.offer(model),
            Input::Repaired(answer) => {
                self.advance(answer.received);
                self.repair(|repair, at, _| repair.take(*answer, at));
            }
            Input::Tick(now) => self.advance(now),
        }
        self.make_frames();
        self.repair(Repair::tick);
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
        let wake = [wake, self.state.repair.wake()].into_iter().flatten().min();
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

    /// The model that makes up what no sensor sees; `None`: nothing is made up.
    pub fn repair_model(&self) -> Option<String> {
        let offline = self.smooth_over.is_some();
        self.state.repair.model(&self.config.repair, offline)
    }

    /// What repair has done since the engine's start.
    pub fn repair_counts(&self) -> RepairCounts {
        self.state.repair.counts()
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

    /// Time never goes back.
    fn advance(&mut self, now: Timestamp) {
        self.state.now = Some(self.state.now.map_or(now, |known| known.max(now)));
    }

    fn note_origins(&mut self) {
        let origin = |sensor: &Option<SensorState>| sensor.as_ref().and_then(SensorState::origin);
        self.origins.clear();
        self.origins.extend(self.state.sensors.iter().map(origin));
        self.origins.resize(SensorId::MAX_SENSORS, None);
        let sets = self
            .state
            .sensors
            .iter()
            .flatten()
            .map(|sensor| sensor.info.joint_set);
        self.trackable = sets
            .flat_map(JointSet::mappings)
            .fold(0, |bits, mapping| bits | 1 << mapping.joint as usize);
    }
}

fn put(outputs: &mut VecDeque<Output>, output: Output) {
    if outputs.len() == MAX_OUTPUTS {
        outputs.pop_front();
    }
    outputs.push_back(output);
}
