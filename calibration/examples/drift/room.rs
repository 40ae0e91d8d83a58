//! A simulated room with engine and monitor, joined as server and agents would join them.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{
    Collector, DriftMonitor, DriftOptions, Options, SensorDrift, Solution, solve,
};
use posefuse_fusion::{ClockSample, Config, Engine, Input, Output};
use posefuse_simulator::motion::Clip;
use posefuse_simulator::{Layout, Scenario, SensorErrors, SimFrame, SimSensor, World};
use posefuse_skeleton::{
    Body, Calibration, JointSet, JointState, Observation, Position, SensorId, SensorInfo, Timestamp,
};

/// Server time at the scenario's start.
const START: Timestamp = Timestamp::from_ns(1_000_000_000_000);
const SECOND_NS: i64 = 1_000_000_000;
/// What arrives within so long is put in order, ns.
const SLOT_NS: i64 = 100_000_000;

/// What reaches the server in a tenth of a second.
pub(crate) type Slot = Vec<(Timestamp, Input)>;

/// What people do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    Walking,
    /// A person who stands for 70 s of every 90.
    Standing,
    TwoPeople,
    Nobody,
}

impl Motion {
    pub(crate) const ALL: [Self; 4] =
        [Self::Walking, Self::Standing, Self::TwoPeople, Self::Nobody];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Walking => "walking about",
            Self::Standing => "standing",
            Self::TwoPeople => "two people",
            Self::Nobody => "nobody",
        }
    }
}

/// How a sensor is moved: in its own axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    pub(crate) shift_m: Vector3<f64>,
    pub(crate) turn_rad: Vector3<f64>,
}

impl Move {
    fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.shift_m),
            UnitQuaternion::from_scaled_axis(self.turn_rad),
        )
    }
}

/// A room whose calibration was solved from its own first 30 s.
pub(crate) struct Room {
    world: Arc<World>,
    sensors: Vec<SimSensor>,
    waiting: Slot,
    now_ns: i64,
    pub(crate) brain: Brain,
}

/// What is fed; cheap to copy, so that several things can happen to one room.
#[derive(Clone)]
pub(crate) struct Brain {
    engine: Engine,
    pub(crate) monitor: DriftMonitor,
    deadline: Option<Timestamp>,
    next_look: Timestamp,
    collector: Option<Collector>,
    /// Everybody has left.
    empty: bool,
}

pub(crate) fn id(index: usize) -> SensorId {
    SensorId::new(index).expect("few sensors")
}

impl Room {
    pub(crate) fn new(
        seed: u64,
        (layout, sensors): (Layout, usize),
        rate_hz: f64,
        motion: Motion,
        errors: SensorErrors,
    ) -> Self {
        let scenario = Scenario {
            seed,
            layout,
            people: match motion {
                Motion::TwoPeople => 2,
                _ => 1,
            },
            sensors,
            rate_hz,
            errors,
            ..Scenario::default()
        };
        let world = match motion {
            Motion::Standing => World::with_clips(&scenario, [standing(&scenario)]),
            _ => World::new(&scenario),
        };
        let world = Arc::new(world.expect("a possible scenario"));
        let mut engine = Engine::new(Config::default());
        engine.compare_sensors(true);
        let names = |i: usize| (id(i), world.sensor_name(i).to_owned());
        let mut room = Self {
            sensors: (0..sensors)
                .map(|i| SimSensor::new(world.clone(), i))
                .collect(),
            waiting: Vec::new(),
            now_ns: 0,
            brain: Brain {
                engine,
                monitor: DriftMonitor::new(DriftOptions::default()),
                deadline: None,
                next_look: START,
                collector: Some(Collector::new((0..sensors).map(names))),
                empty: false,
            },
            world,
        };
        for index in 0..sensors {
            room.brain.feed(Input::Sensor(room.info(index)));
        }
        room.calibrate();
        room.brain.empty = motion == Motion::Nobody;
        room
    }

    /// Gathers 30 s and puts what they give in force, in engine and monitor.
    fn calibrate(&mut self) {
        for slot in self.record(30.0) {
            self.brain.run(&slot, None, &mut |_, _| {});
        }
        let walk = self.brain.collector.take().expect("gathered").walk();
        let options = Options::default();
        let Solution {
            calibration,
            report,
        } = solve(&walk, &options).expect("a calibration");
        if report.verdict != posefuse_calibration::Verdict::Passed {
            println!("  (calibration {}: {:?})", report.verdict, report.reasons);
        }
        self.put_in_force(&calibration);
    }

    fn put_in_force(&mut self, calibration: &Calibration) {
        let poses = (0..self.sensors.len())
            .filter_map(|i| Some((id(i), calibration.sensors.get(self.world.sensor_name(i))?)));
        self.brain.monitor.place(poses);
        self.brain
            .feed(Input::Calibration(Arc::new(calibration.clone())));
    }

    fn info(&self, index: usize) -> SensorInfo {
        SensorInfo {
            id: id(index),
            name: self.world.sensor_name(index).to_owned(),
            model: "simulated".to_owned(),
            joint_set: JointSet::KinectV2,
        }
    }

    /// The next `seconds` as they reach the server, slot by slot.
    pub(crate) fn record(&mut self, seconds: f64) -> Vec<Slot> {
        let slots = (seconds * SECOND_NS as f64) as i64 / SLOT_NS;
        (0..slots).map(|_| self.slot()).collect()
    }

    fn slot(&mut self) -> Slot {
        let end_ns = self.now_ns + SLOT_NS;
        for index in 0..self.sensors.len() {
            if self.now_ns % SECOND_NS == 0 {
                self.waiting.push(self.probe(index));
            }
            while self.sensors[index].next_at_ns() < end_ns {
                let frame = self.sensors[index].next_frame();
                let received = START.plus_ns(frame.at_ns + frame.arrival_delay_ns + 500_000);
                if !frame.dropped {
                    let input = Input::Observation(observation(&frame, index, received));
                    self.waiting.push((received, input));
                }
            }
        }
        self.now_ns = end_ns;
        self.waiting.sort_by_key(|(time, _)| *time);
        let due = self
            .waiting
            .partition_point(|(time, _)| *time < START.plus_ns(end_ns));
        self.waiting.drain(..due).collect()
    }

    fn probe(&self, index: usize) -> (Timestamp, Input) {
        let clock = self.world.sensor_clock(index);
        let (sent_ns, there_ns) = (self.now_ns, self.now_ns + 400_000);
        let returned = START.plus_ns(there_ns + 450_000);
        let sample = ClockSample {
            sensor: id(index),
            sent: START.plus_ns(sent_ns),
            returned,
            agent_received: clock.shows(there_ns),
            agent_sent: clock.shows(there_ns + 50_000),
        };
        (returned, Input::ClockSample(sample))
    }
}

impl Brain {
    /// Takes in what arrived; sensor `moved` has been moved. `look` gets each look with its time, seconds.
    pub(crate) fn run(
        &mut self,
        inputs: &[(Timestamp, Input)],
        moved: Option<(SensorId, Move)>,
        look: &mut dyn FnMut(f64, &[SensorDrift]),
    ) {
        for (time, input) in inputs {
            while let Some(due) = self.deadline.filter(|due| due < time) {
                self.feed(Input::Tick(due));
            }
            let mut input = input.clone();
            if let Input::Observation(seen) = &mut input
                && self.empty
            {
                seen.bodies.clear();
            }
            if let (Input::Observation(seen), Some((sensor, by))) = (&mut input, moved)
                && seen.sensor == sensor
            {
                displace(seen, &by.isometry().inverse());
            }
            self.gather(&input);
            self.feed(input);
            if *time >= self.next_look {
                self.next_look = time.plus_ns(SECOND_NS);
                look(time.since_seconds(START), &self.monitor.look(*time));
            }
        }
    }

    pub(crate) fn compare(&mut self, enabled: bool) {
        self.engine.compare_sensors(enabled);
    }

    /// Seconds that the engine takes for `slots`; `look` gets those that each look took, one per second of the room.
    pub(crate) fn time(&mut self, slots: &[Slot], mut look: impl FnMut(f64)) -> f64 {
        let mut engine_s = 0.0;
        for slot in slots {
            for (time, input) in slot {
                let input = input.clone();
                let start = Instant::now();
                while let Some(due) = self.deadline.filter(|due| due < time) {
                    self.handle(Input::Tick(due));
                }
                self.handle(input);
                let compared: Vec<_> = self.engine.take_comparisons().collect();
                engine_s += start.elapsed().as_secs_f64();
                compared.into_iter().for_each(|seen| self.monitor.add(seen));
                if *time >= self.next_look {
                    self.next_look = time.plus_ns(SECOND_NS);
                    let start = Instant::now();
                    self.monitor.look(*time);
                    look(start.elapsed().as_secs_f64());
                }
            }
        }
        engine_s
    }

    fn gather(&mut self, input: &Input) {
        if let (Some(collector), Input::Observation(seen)) = (&mut self.collector, input)
            && let Some(time) = self.engine.map_time(seen.sensor, seen.captured)
        {
            collector.add(seen.sensor, time, &seen.bodies);
        }
    }

    fn handle(&mut self, input: Input) {
        self.engine.handle(input);
        self.deadline = loop {
            if let Output::WakeAt(deadline) = self.engine.poll() {
                break deadline;
            }
        };
    }

    fn feed(&mut self, input: Input) {
        self.handle(input);
        for comparison in self.engine.take_comparisons() {
            self.monitor.add(comparison);
        }
    }
}

fn displace(seen: &mut Observation, sensor_from_before: &Isometry3<f64>) {
    for body in &mut seen.bodies {
        for (_, joint) in body.skeleton.iter_mut() {
            joint.position = Position::from_point(sensor_from_before * joint.position.point());
        }
    }
}

fn observation(frame: &SimFrame, index: usize, received: Timestamp) -> Observation {
    let body = |body: &posefuse_simulator::SimBody| Body {
        tracking_id: body.tracking_id,
        skeleton: JointSet::KinectV2
            .to_canonical(&body.joints)
            .map(|_, joint| {
                JointState::measured(joint.position, 0.02, joint.confidence, id(index))
            }),
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

/// Walks for 40 s, then again and again stands for 70 s where the walk has come to, and goes on for 20 s.
fn standing(scenario: &Scenario) -> Arc<Clip> {
    const RATE_HZ: f64 = 20.0;
    let walker = World::new(scenario).expect("a possible scenario");
    let mut at_s = 0.0;
    let frame = |i: usize| {
        let t = i as f64 / RATE_HZ;
        let is_walking = t < 40.0 || (t - 40.0) % 90.0 >= 70.0;
        at_s += if is_walking { 1.0 / RATE_HZ } else { 0.0 };
        let sway = Vector3::new((0.7 * t).sin(), (0.43 * t).sin(), 0.0) * 0.01;
        let pose = walker.performance().pose(0, at_s);
        pose.map(|_, position| position.moved(sway))
    };
    let frames = (0..(900.0 * RATE_HZ) as usize).map(frame).collect();
    Arc::new(Clip::new("standing", RATE_HZ, frames).expect("a clip"))
}
