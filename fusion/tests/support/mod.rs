//! A simulated room and the engine, joined as server and agents would join them.

#![allow(dead_code, clippy::unwrap_used)]

pub(crate) mod judge;

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_evaluate::compare;
use posefuse_fusion::{ClockSample, Config, Engine, Input, Output, Rejection};
use posefuse_simulator::{BodyTruth, Scenario, SimFrame, SimSensor, World};
use posefuse_skeleton::{
    Body, Joint, JointSet, JointState, Observation, RoomFrame, SensorId, SensorInfo, Skeleton,
    Timestamp,
};

/// Server time at the scenario's start.
pub(crate) const START_NS: i64 = 1_000_000_000_000;
/// Time between two clock probes of a sensor.
const PROBE_EVERY_NS: i64 = 500_000_000;

/// A reproducible number in 0..1.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }
}

pub(crate) fn id(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

/// The scenario's second at which a frame was captured.
pub(crate) fn scenario_seconds(time: Timestamp) -> f64 {
    (time.ns() - START_NS) as f64 * 1e-9
}

pub(crate) fn info(world: &World, index: usize) -> SensorInfo {
    SensorInfo {
        id: id(index),
        name: world.sensor_name(index).to_owned(),
        model: "simulated".into(),
        joint_set: JointSet::ALL[0],
    }
}

pub(crate) fn observation(frame: &SimFrame, index: usize, received: Timestamp) -> Observation {
    let body = |body: &posefuse_simulator::SimBody| Body {
        tracking_id: body.tracking_id,
        skeleton: Joint::ALL
            .into_iter()
            .zip(&body.joints)
            .filter_map(|(joint, raw)| {
                let raw = raw.as_ref()?;
                Some((
                    joint,
                    JointState::measured(raw.position, 0.02, raw.confidence, id(index)),
                ))
            })
            .collect::<Skeleton<_>>(),
        orientations: None,
        hands_closed: [None; 2],
    };
    Observation {
        sensor: id(index),
        sequence: frame.number,
        captured: frame.captured,
        received,
        bodies: frame.bodies.iter().map(body).collect(),
    }
}

/// Everything that reaches the engine in `seconds` of `world`, in order of arrival: greetings, calibration, clock
/// probes with uneven delays, frames with their own delays. Ticks are left to [`drive`].
pub(crate) fn inputs(world: &Arc<World>, seconds: f64) -> Vec<(Timestamp, Input)> {
    inputs_and_truth(world, seconds, &mut |_, _, _| {})
}

/// The same; `truth` is told of every frame that arrives, with the number of its sensor, what is true of its bodies.
pub(crate) fn inputs_and_truth(
    world: &Arc<World>,
    seconds: f64,
    truth: &mut dyn FnMut(usize, &SimFrame, &[BodyTruth]),
) -> Vec<(Timestamp, Input)> {
    let start = Timestamp::from_ns(START_NS);
    let end_ns = (seconds * 1e9) as i64;
    let mut dice = Dice(world.scenario().seed);
    let mut events = Vec::new();
    for index in 0..world.sensor_count() {
        events.push((start, Input::Sensor(info(world, index))));
        let clock = world.sensor_clock(index);
        for at_ns in (0..end_ns).step_by(PROBE_EVERY_NS as usize) {
            let mut delay_ns = || 200_000 + (-1e6 * (1.0 - dice.roll()).ln()) as i64;
            let there = at_ns + delay_ns();
            let back = there + 50_000;
            let returned = start.plus_ns(back + delay_ns());
            let sample = ClockSample {
                sensor: id(index),
                sent: start.plus_ns(at_ns),
                returned,
                agent_received: clock.shows(there),
                agent_sent: clock.shows(back),
            };
            events.push((returned, Input::ClockSample(sample)));
        }
        let mut sensor = SimSensor::new(Arc::clone(world), index);
        while sensor.next_at_ns() < end_ns {
            let frame = sensor.next_frame();
            let network_ns = 300_000 + (dice.roll() * 700_000.0) as i64;
            let received = start.plus_ns(frame.at_ns + frame.arrival_delay_ns + network_ns);
            if !frame.dropped {
                truth(index, &frame, sensor.truth());
                events.push((
                    received,
                    Input::Observation(observation(&frame, index, received)),
                ));
            }
        }
    }
    events.push((
        start,
        Input::Calibration(Arc::new(world.true_calibration())),
    ));
    events.sort_by_key(|(time, _)| *time);
    events
}

/// What came out.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) frames: Vec<RoomFrame>,
    pub(crate) rejections: Vec<Rejection>,
}

/// Takes everything there is; the next deadline.
pub(crate) fn drain(engine: &mut Engine, outcome: &mut Outcome) -> Option<Timestamp> {
    loop {
        match engine.poll() {
            Output::Frame(frame) => outcome.frames.push(frame),
            Output::Rejected(rejection) => outcome.rejections.push(rejection),
            // No test of these offers a model.
            Output::Repair(_) => {}
            Output::WakeAt(deadline) => return deadline,
        }
    }
}

/// Feeds `events`, with ticks at the engine's own deadlines between them.
pub(crate) fn drive(
    engine: &mut Engine,
    events: impl IntoIterator<Item = (Timestamp, Input)>,
    outcome: &mut Outcome,
) {
    let mut deadline = drain(engine, outcome);
    for (time, input) in events {
        while let Some(due) = deadline.filter(|due| *due < time) {
            engine.handle(Input::Tick(due));
            deadline = drain(engine, outcome);
        }
        engine.handle(input);
        deadline = drain(engine, outcome);
    }
}

/// Runs `scenario` for `seconds` through a new engine.
pub(crate) fn run(scenario: &Scenario, config: &Config, seconds: f64) -> (Arc<World>, Outcome) {
    let world = Arc::new(World::new(scenario).unwrap());
    let mut outcome = Outcome::default();
    let mut engine = Engine::new(config.clone());
    drive(&mut engine, inputs(&world, seconds), &mut outcome);
    (world, outcome)
}

/// How good a run was.
#[derive(Debug, Default)]
pub(crate) struct Score {
    /// Mean per-joint position error, m.
    pub(crate) mpjpe_m: f64,
    /// 95th percentile of the joint errors, m.
    pub(crate) p95_m: f64,
    /// RMS of the fused joints' acceleration, m/s^2.
    pub(crate) jitter_mps2: f64,
    /// Share of person-frames without a track.
    pub(crate) missed: f64,
    /// Track-frames without a person.
    pub(crate) extra: usize,
    /// How often a person's track id changed.
    pub(crate) id_switches: usize,
    pub(crate) frames: usize,
}

/// Compares what came out after `from_s` with the truth.
pub(crate) fn score(world: &World, frames: &[RoomFrame], from_s: f64) -> Score {
    let mut errors = Vec::new();
    let mut score = Score::default();
    let mut owner = BTreeMap::new();
    let mut people = 0;
    let later = || frames.iter().filter(|f| scenario_seconds(f.time) >= from_s);
    for frame in later() {
        let truth = world.truth(scenario_seconds(frame.time));
        people += truth.len();
        let comparison = compare(frame, &truth);
        for pair in &comparison.pairs {
            errors.extend(pair.errors.iter().map(|(_, error)| *error));
            let before = owner.insert(pair.person, pair.track);
            score.id_switches += usize::from(before.is_some_and(|before| before != pair.track));
        }
        score.missed += comparison.missed.len() as f64;
        score.extra += comparison.extra.len();
        score.frames += 1;
    }
    score.missed /= people.max(1) as f64;
    errors.sort_unstable_by(f64::total_cmp);
    score.mpjpe_m = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    score.p95_m = errors
        .get(errors.len() * 95 / 100)
        .copied()
        .unwrap_or(f64::NAN);
    score.jitter_mps2 = jitter(later());
    score
}

/// RMS second difference of joint positions over frames, m/s^2.
fn jitter<'a>(frames: impl Iterator<Item = &'a RoomFrame>) -> f64 {
    let frames: Vec<&RoomFrame> = frames.collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for w in frames.windows(3) {
        let (h1, h2) = (
            w[1].time.since_seconds(w[0].time),
            w[2].time.since_seconds(w[1].time),
        );
        for track in &w[1].tracks {
            let find = |f: &'a RoomFrame| f.tracks.iter().find(|t| t.id == track.id);
            let (Some(a), Some(c)) = (find(w[0]), find(w[2])) else {
                continue;
            };
            for joint in Joint::ALL {
                let p =
                    |t: &posefuse_skeleton::Track| t.skeleton.position(joint).map(|p| p.vector());
                if let (Some(a), Some(b), Some(c)) = (p(a), p(track), p(c)) {
                    let acceleration = ((c - b) / h2 - (b - a) / h1) * (2.0 / (h1 + h2));
                    sum += acceleration.norm_squared();
                    count += 1.0;
                }
            }
        }
    }
    f64::sqrt(sum / f64::max(count, 1.0))
}
