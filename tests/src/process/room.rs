//! A room of processes: a server with folders of its own, and simulated sensors' agents.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_session::{DiskStorage, TakeReader};
use posefuse_simulator::{Scenario, World};
use tempfile::TempDir;
use tokio::time::Instant;
use tonic::transport::{Channel, Endpoint};

use super::Program;
use crate::simulated::{sensor_name, true_calibration};

/// A room of simulated sensors, `cam1`, `cam2` ...
pub struct Room {
    folder: TempDir,
    takes: PathBuf,
    address: SocketAddr,
    epoch_ns: String,
    sensors: usize,
    /// The server's process.
    pub server: Program,
}

impl Room {
    /// A running server that knows where the `sensors` of the simulated room stand; no agent yet.
    pub async fn new(sensors: usize) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let takes = folder.path().join("takes");
        Self::with_takes(sensors, folder, takes).await
    }

    /// The same, with takes elsewhere.
    pub async fn with_takes(sensors: usize, folder: TempDir, takes: PathBuf) -> Self {
        std::fs::write(
            folder.path().join("server.toml"),
            "[takes]\nmin_free_mb = 2\n",
        )
        .expect("a writable folder");
        let any_port = SocketAddr::from(([127, 0, 0, 1], 0));
        let (server, address) = start_server(folder.path(), &takes, any_port);
        let epoch = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let room = Self {
            folder,
            takes,
            address,
            epoch_ns: epoch.as_nanos().to_string(),
            sensors,
            server,
        };
        let world = World::new(&Scenario {
            sensors,
            ..Scenario::default()
        })
        .expect("a possible scenario");
        let calibration = Some(calibration_to_wire(&true_calibration(&world)));
        let request = v1::SetCalibrationRequest { calibration };
        room.client()
            .await
            .set_calibration(request)
            .await
            .expect("the server takes the calibration");
        room
    }

    /// Starts the server again, at the same address.
    pub fn restart_server(&mut self) {
        let (server, address) = start_server(self.folder.path(), &self.takes, self.address);
        assert_eq!(address, self.address);
        self.server = server;
    }

    /// Starts the agent of sensor `index` under its own name.
    pub fn agent(&self, index: usize) -> Program {
        self.agent_named(index, &sensor_name(index), &format!("agent{}", index + 1))
    }

    /// Starts an agent of sensor `index` with this sensor name; its log is `LOG.log`.
    pub fn agent_named(&self, index: usize, name: &str, log: &str) -> Program {
        let (sensor, sensors) = ((index + 1).to_string(), self.sensors.to_string());
        let server = format!("http://{}", self.address);
        let arguments = [
            "agent",
            "sim",
            "--name",
            name,
            "--sensor",
            &sensor,
            "--sensors",
            &sensors,
            "--server",
            &server,
            "--epoch-ns",
            &self.epoch_ns,
            "--exit-with-parent",
        ];
        Program::start(self.folder.path(), log, &arguments)
    }

    /// Starts the agents of all sensors and waits until all are live and people are seen.
    pub async fn agents(&self) -> Vec<Program> {
        let agents = (0..self.sensors).map(|index| self.agent(index)).collect();
        self.status_when("all sensors are live and fused", |status| {
            let live = status
                .sensors
                .iter()
                .filter(|s| s.state() == v1::SensorState::Live)
                .count();
            live == self.sensors && status.people > 0 && status.frames_per_second > 20.0
        })
        .await;
        agents
    }

    /// Any other command that goes on.
    pub fn program(&self, name: &str, arguments: &[&str]) -> Program {
        Program::start(self.folder.path(), name, arguments)
    }

    /// Where the server listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The server's address as programs take it.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// A connection to the server.
    pub async fn channel(&self) -> Channel {
        let endpoint = Endpoint::from_shared(self.url()).expect("an address");
        endpoint
            .connect()
            .await
            .expect("the server takes connections")
    }

    /// A client of the server.
    pub async fn client(&self) -> RoomClient<Channel> {
        RoomClient::new(self.channel().await)
    }

    /// The room as it is now.
    pub async fn status(&self) -> v1::RoomStatus {
        let answer = self
            .client()
            .await
            .get_status(v1::GetStatusRequest {})
            .await;
        answer.expect("the server answers").into_inner()
    }

    /// The first status for which `holds`; fails with the last one after 20 s.
    pub async fn status_when(
        &self,
        what: &str,
        holds: impl Fn(&v1::RoomStatus) -> bool,
    ) -> v1::RoomStatus {
        let mut client = self.client().await;
        let deadline = Instant::now() + Duration::from_secs(20);
        loop {
            let answer = client.get_status(v1::GetStatusRequest {}).await;
            let status = answer.expect("the server answers").into_inner();
            if holds(&status) {
                return status;
            }
            assert!(
                Instant::now() < deadline,
                "waited 20 s in vain until {what}: {status:#?}\n{}",
                self.server.said()
            );
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Begins a take.
    pub async fn start_take(&self, name: &str) -> v1::Take {
        let request = v1::StartTakeRequest {
            name: name.to_owned(),
            ..Default::default()
        };
        let answer = self.client().await.start_take(request).await;
        answer.expect("the take begins").into_inner()
    }

    /// Ends the take.
    pub async fn stop_take(&self) -> v1::Take {
        let answer = self.client().await.stop_take(v1::StopTakeRequest {}).await;
        answer.expect("the take ends").into_inner()
    }

    /// A take, as the list has it.
    pub async fn listed(&self, name: &str) -> v1::Take {
        let takes = self
            .client()
            .await
            .list_takes(v1::ListTakesRequest {})
            .await;
        let takes = takes.expect("the server lists takes").into_inner().takes;
        let found = takes.iter().find(|take| take.name == name);
        found
            .cloned()
            .unwrap_or_else(|| panic!("no take `{name}` in {takes:#?}"))
    }

    /// Reads a take from the disk.
    pub fn take(&self, name: &str) -> TakeReader {
        TakeReader::open(&DiskStorage::for_reading(&self.takes), name).expect("a readable take")
    }

    /// The world of the simulated sensors.
    pub fn world(&self) -> Arc<World> {
        let scenario = Scenario {
            sensors: self.sensors,
            ..Scenario::default()
        };
        Arc::new(World::new(&scenario).expect("a possible scenario"))
    }

    /// One number of `/metrics`; its name without prefix and labels.
    pub fn metric(&self, name: &str) -> f64 {
        let mut stream = TcpStream::connect(self.address).expect("the server takes connections");
        stream
            .set_read_timeout(Some(Duration::from_secs(5)))
            .expect("a socket");
        let request = format!(
            "GET /metrics HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n",
            self.address
        );
        stream
            .write_all(request.as_bytes())
            .expect("the server reads");
        let mut page = String::new();
        stream
            .read_to_string(&mut page)
            .expect("the server answers");
        let name = format!("posefuse_{name} ");
        let line = page.lines().find_map(|line| line.strip_prefix(&name));
        line.and_then(|value| value.trim().parse().ok())
            .unwrap_or_else(|| panic!("no {name} in\n{page}"))
    }
}

fn start_server(folder: &Path, takes: &Path, address: SocketAddr) -> (Program, SocketAddr) {
    let text = |path: &Path| path.to_str().expect("a plain path").to_owned();
    let (config, calibration) = (
        text(&folder.join("server.toml")),
        text(&folder.join("calibration.toml")),
    );
    let (address, takes) = (address.to_string(), text(takes));
    let arguments = [
        "server",
        "--json",
        "--listen",
        &address,
        "--takes",
        &takes,
        "--calibration",
        &calibration,
        "--config",
        &config,
        "--exit-with-parent",
    ];
    let server = Program::start(folder, "server", &arguments);
    let line = server.line();
    let address = line
        .split("http://")
        .nth(1)
        .and_then(|rest| rest.split(['"', '/']).next());
    let address = address.and_then(|address| address.parse().ok());
    (
        server,
        address.unwrap_or_else(|| panic!("no address in `{line}`")),
    )
}
