//! The network with everybody in it, and what a test can do to it.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use futures_util::future::LocalBoxFuture;
use nalgebra::Isometry3;
use posefuse_agent::{
    AgentConfig, AgentReport, Parts, SourceConfig, SystemClock, source::SimConfig,
};
use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_session::TakeReader;
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::Calibration;
use tokio::sync::mpsc;
use tonic::Status;
use tonic::transport::Channel;
use turmoil::Sim;

use super::host::{self, Report, SERVER};
use super::operator::{self, Job};
use super::sensor::{Moved, SimulatedSensor};
use super::{Captures, Disk, Happening, Log};

/// What a network is made of.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Everything random follows from it.
    pub seed: u64,
    /// How many sensors, each with its agent.
    pub sensors: usize,
    /// Frames per second of each.
    pub rate_hz: f64,
    /// Longest time a packet takes; the shortest is 1 ms.
    pub max_latency: Duration,
    /// How often a packet to or from an agent breaks their link; turmoil's links then lose what is under way ...
    pub loss: f64,
    /// ... until a further packet repairs it, with this probability.
    pub repair: f64,
    /// How often packets are delivered.
    pub tick: Duration,
}

impl Plan {
    /// A room with a healthy network.
    pub fn new(seed: u64, sensors: usize) -> Self {
        Self {
            seed,
            sensors,
            rate_hz: 30.0,
            max_latency: Duration::from_millis(20),
            loss: 0.0,
            repair: 1.0,
            tick: Duration::from_millis(2),
        }
    }
}

/// A simulated network with a server, an operator and agents.
pub struct Lab {
    sim: Sim<'static>,
    world: Arc<World>,
    disk: Disk,
    log: Log,
    jobs: mpsc::UnboundedSender<Job>,
    url: String,
    seed: u64,
    loss: f64,
    agents: Vec<Agent>,
}

struct Agent {
    name: String,
    captures: Captures,
    report: Report,
    moved: Moved,
}

impl Lab {
    /// A server that knows where its sensors stand; no agent yet.
    pub fn new(plan: &Plan) -> Self {
        align_task_numbers();
        let mut sim = turmoil::Builder::new()
            .rng_seed(plan.seed)
            .simulation_duration(Duration::from_secs(3600))
            .tick_duration(plan.tick)
            .min_message_latency(Duration::from_millis(1))
            .max_message_latency(plan.max_latency)
            .repair_rate(plan.repair)
            .tcp_capacity(1024)
            .build();
        let (disk, log) = (Disk::default(), Log::default());
        let (for_disk, for_log) = (disk.clone(), log.clone());
        sim.host(SERVER, move || {
            host::server(host::server_config(), for_disk.clone(), for_log.clone())
        });
        let url = format!("http://{}:{}", sim.lookup(SERVER), host::PORT);
        let (jobs, wanted) = mpsc::unbounded_channel();
        let names = (0..plan.sensors).map(sensor_name);
        sim.client(
            "operator",
            operator::operate(url.clone(), names.collect(), wanted, log.clone()),
        );
        let scenario = Scenario {
            seed: plan.seed,
            sensors: plan.sensors,
            rate_hz: plan.rate_hz,
            ..Scenario::default()
        };
        let mut lab = Self {
            sim,
            world: Arc::new(World::new(&scenario).expect("a possible scenario")),
            disk,
            log,
            jobs,
            url,
            seed: plan.seed,
            loss: plan.loss,
            agents: Vec::new(),
        };
        let calibration = Some(calibration_to_wire(&true_calibration(&lab.world)));
        lab.ask(|mut room| {
            Box::pin(async move {
                room.set_calibration(v1::SetCalibrationRequest { calibration })
                    .await
            })
        });
        lab
    }

    /// Starts the agents of all sensors; each sensor ends after `seconds`, and its agent when all is delivered.
    pub fn start_agents(&mut self, seconds: f64) {
        for index in 0..self.world.sensor_count() {
            let name = sensor_name(index);
            let (captures, report) = (Captures::default(), Report::default());
            let moved = Moved::default();
            let displaced = moved.clone();
            let unused = SourceConfig::Sim(SimConfig {
                scenario: Scenario::default(),
                sensor: 0,
                epoch_unix_ns: None,
            });
            let server = posefuse_agent::parse_server(&self.url).expect("an address");
            let config = AgentConfig::new(server, &name, unused);
            let connector = host::connector(name.clone(), self.log.clone());
            let seed = self.seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
            let (world, kept, ended) = (self.world.clone(), captures.clone(), report.clone());
            self.sim.client(name.clone(), async move {
                let clock = Arc::new(SystemClock::new());
                let source = SimulatedSensor::new(&world, index, &*clock, seconds, kept, displaced);
                let parts = Parts {
                    clock,
                    connector,
                    seed,
                    source_thread: false,
                };
                host::agent(Box::new(source), config, parts, ended).await
            });
            self.sim.set_link_fail_rate(name.clone(), SERVER, self.loss);
            self.agents.push(Agent {
                name,
                captures,
                report,
                moved,
            });
        }
    }

    /// Time since the network began.
    pub fn now(&self) -> Duration {
        self.sim.elapsed()
    }

    /// What happened.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Lets time pass.
    pub fn run_for(&mut self, time: Duration) {
        let end = self.now() + time;
        while self.now() < end {
            self.step();
        }
    }

    fn step(&mut self) {
        if let Err(error) = self.sim.step() {
            panic!("at {:?}: {error}", self.now());
        }
    }

    /// Lets time pass until `holds`; fails after `limit`.
    pub fn run_until(&mut self, what: &str, limit: Duration, mut holds: impl FnMut(&Self) -> bool) {
        let end = self.now() + limit;
        while !holds(self) {
            assert!(self.now() < end, "waited {limit:?} in vain until {what}");
            self.step();
        }
    }

    /// Lets time pass until `is` happens; fails after `limit`. Gives the time from now to then.
    pub fn until_happens(
        &mut self,
        what: &str,
        limit: Duration,
        is: impl Fn(&Happening) -> bool,
    ) -> Duration {
        let from = self.now();
        self.run_until(what, limit, |lab| lab.log.first(from, &is).is_some());
        self.log
            .first(from, &is)
            .map_or(Duration::MAX, |at| at - from)
    }

    /// Lets time pass until every agent has ended, and gives their reports by sensor.
    pub fn until_agents_end(&mut self, limit: Duration) -> Vec<AgentReport> {
        let report = |agent: &Agent| agent.report.lock().unwrap().clone();
        self.run_until("all agents have delivered everything", limit, |lab| {
            lab.agents.iter().all(|agent| report(agent).is_some())
        });
        self.agents.iter().filter_map(report).collect()
    }

    /// Moves a sensor from where the world has it, in its own optical axes, metres. Its agent must run.
    pub fn move_sensor(&mut self, sensor: usize, by: Isometry3<f64>) {
        *self.agents[sensor].moved.lock().unwrap() = Some(by);
    }

    /// Asks what is to be refused, and gives the refusal.
    pub fn ask_in_vain<T: Send + 'static>(
        &mut self,
        request: impl FnOnce(RoomClient<Channel>) -> Asked<T> + Send + 'static,
    ) -> Status {
        let refused = self.try_ask(request).err();
        refused.expect("the server refuses")
    }

    /// Cuts an agent off: packets vanish.
    pub fn partition(&self, sensor: usize) {
        self.sim.partition(sensor_name(sensor), SERVER);
    }

    /// Ends [`Lab::partition`].
    pub fn repair(&self, sensor: usize) {
        self.sim.repair(sensor_name(sensor), SERVER);
    }

    /// Holds an agent's packets and the server's to it.
    pub fn hold(&self, sensor: usize) {
        self.sim.hold(sensor_name(sensor), SERVER);
    }

    /// Ends [`Lab::hold`]: what was held arrives.
    pub fn release(&self, sensor: usize) {
        self.sim.release(sensor_name(sensor), SERVER);
    }

    /// Cuts the server's power.
    pub fn crash_server(&mut self) {
        self.sim.crash(SERVER);
    }

    /// Starts it again.
    pub fn start_server(&mut self) {
        self.sim.bounce(SERVER);
    }

    /// Asks the server, as soon as it can be reached, and waits for the answer.
    pub fn ask<T: Send + 'static>(
        &mut self,
        request: impl FnOnce(RoomClient<Channel>) -> Asked<T> + Send + 'static,
    ) -> T {
        let answer = self.try_ask(request);
        answer.expect("the server does as asked").into_inner()
    }

    fn try_ask<T: Send + 'static>(
        &mut self,
        request: impl FnOnce(RoomClient<Channel>) -> Asked<T> + Send + 'static,
    ) -> Result<tonic::Response<T>, Status> {
        let answer: Answer<T> = Arc::default();
        let given = answer.clone();
        let job: Job = Box::new(move |client| {
            Box::pin(async move {
                let result = request(client).await;
                *given.lock().unwrap() = Some(result);
            })
        });
        self.jobs.send(job).expect("the operator is there");
        self.run_until("the server answers", Duration::from_secs(10), |_| {
            answer.lock().unwrap().is_some()
        });
        let result = answer.lock().unwrap().take();
        result.expect("an answer")
    }

    /// Begins a take.
    pub fn start_take(&mut self, name: &str) -> v1::Take {
        let request = v1::StartTakeRequest {
            name: name.to_owned(),
            ..Default::default()
        };
        self.ask(|mut room| Box::pin(async move { room.start_take(request).await }))
    }

    /// Ends the take.
    pub fn stop_take(&mut self) -> v1::Take {
        self.ask(|mut room| Box::pin(async move { room.stop_take(v1::StopTakeRequest {}).await }))
    }

    /// The room as it is now.
    pub fn status(&mut self) -> v1::RoomStatus {
        self.ask(|mut room| Box::pin(async move { room.get_status(v1::GetStatusRequest {}).await }))
    }

    /// Reads a take from the server's disk.
    pub fn take(&self, name: &str) -> TakeReader {
        TakeReader::open(&self.disk.takes(), name).expect("a readable take")
    }

    /// What each sensor captured so far: name and frames.
    pub fn captured(&self) -> Vec<(String, Vec<super::CapturedFrame>)> {
        let frames = |agent: &Agent| (agent.name.clone(), agent.captures.lock().unwrap().clone());
        self.agents.iter().map(frames).collect()
    }
}

/// Lets the process's next task have a round number. Tokio ends a crashed host's tasks in an order that depends on
/// their numbers, which count through the whole process: without this, what a lab does would depend on the labs before
/// it. Where tests share a process as threads (`cargo test`), traces may differ all the same.
fn align_task_numbers() {
    /// A multiple of the lists that tokio spreads a runtime's tasks over.
    const ROUND: u64 = 64;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .expect("a runtime");
    let number = || runtime.spawn(async {}).id().to_string().parse::<u64>();
    while number().is_ok_and(|number| (number + 1) % ROUND != 0) {}
}

/// Where an answer will be.
type Answer<T> = Arc<Mutex<Option<Result<tonic::Response<T>, Status>>>>;

/// An answer under way.
pub type Asked<T> = LocalBoxFuture<'static, Result<tonic::Response<T>, Status>>;

/// The name of sensor `index` and of its host.
pub fn sensor_name(index: usize) -> String {
    format!("cam{}", index + 1)
}

/// Where the simulated sensors truly stand, by the names that agents get here.
pub fn true_calibration(world: &World) -> Calibration {
    let truth = world.true_calibration();
    Calibration {
        created: "2026-01-01T00:00:00Z".to_owned(),
        sensors: (truth.sensors.into_iter())
            .filter_map(|(name, pose)| Some((sensor_name(world.sensor_index(&name)?), pose)))
            .collect(),
        ..truth
    }
}
