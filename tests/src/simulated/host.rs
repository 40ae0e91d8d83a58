//! What runs on the simulated hosts: the real server and the real agent, with the network, clock, disk and randomness
//! that are handed to them.

use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use posefuse_agent::{AgentConfig, AgentReport, Connector, Io};
use posefuse_server::{Config, Listener, Parts, SystemClock, Threads};
use posefuse_session::MemoryStorage;
use turmoil::net::{TcpListener, TcpStream};

use super::{Happening, Log};

pub(super) const SERVER: &str = "server";
pub(super) const PORT: u16 = 7400;
/// Civil time when the network begins, nanoseconds since 1970.
const UNIX_NS: i64 = 1_767_225_600_000_000_000;

/// The server's disk. It survives the server, not what had not been synced.
#[derive(Clone, Debug, Default)]
pub struct Disk(Arc<Mutex<Folders>>);

#[derive(Clone, Debug, Default)]
struct Folders {
    takes: MemoryStorage,
    calibration: MemoryStorage,
}

impl Disk {
    /// The take folder.
    pub fn takes(&self) -> MemoryStorage {
        self.0.lock().unwrap().takes.clone()
    }

    /// What a machine finds on the disk when it starts after its power was cut.
    fn mounted(&self) -> Folders {
        let mut folders = self.0.lock().unwrap();
        *folders = Folders {
            takes: folders.takes.after_power_cut(),
            calibration: folders.calibration.after_power_cut(),
        };
        folders.clone()
    }
}

/// Turmoil's TCP as the server takes it.
struct SimulatedListener(TcpListener);

impl Listener for SimulatedListener {
    type Io = TcpStream;

    async fn accept(&mut self) -> io::Result<(TcpStream, SocketAddr)> {
        self.0.accept().await
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.0.local_addr()
    }
}

/// One life of the server.
pub(super) async fn server(config: Config, disk: Disk, log: Log) -> turmoil::Result {
    let folders = disk.mounted();
    let listener = TcpListener::bind(("0.0.0.0", PORT)).await?;
    log.add(Happening::Listens);
    let since_start = turmoil::sim_elapsed().unwrap_or_default();
    let unix_ns = UNIX_NS + since_start.as_nanos() as i64;
    let parts = Parts {
        listener: SimulatedListener(listener),
        clock: Arc::new(SystemClock::with_unix_offset_ns(unix_ns)),
        takes: Arc::new(folders.takes),
        calibration: Arc::new(folders.calibration),
        threads: Threads::Inline,
    };
    posefuse_server::run(config, parts, std::future::pending()).await?;
    Ok(())
}

/// The shipped configuration, in a network of its own.
pub(super) fn server_config() -> Config {
    Config {
        listen: SocketAddr::from(([0, 0, 0, 0], PORT)),
        allow_remote: true,
        ..Config::default()
    }
}

/// Where an agent's report will be.
pub(super) type Report = Arc<Mutex<Option<AgentReport>>>;

/// One agent, to its end.
pub(super) async fn agent(
    source: Box<dyn posefuse_agent::SensorSource>,
    config: AgentConfig,
    parts: posefuse_agent::Parts,
    report: Report,
) -> turmoil::Result {
    let done = posefuse_agent::run_with(source, config, parts, std::future::pending()).await?;
    *report.lock().unwrap() = Some(done);
    Ok(())
}

/// Turmoil's TCP as an agent takes it; each attempt is logged.
pub(super) fn connector(agent: String, log: Log) -> Connector {
    Arc::new(move |uri| {
        log.add(Happening::Connects {
            agent: agent.clone(),
        });
        Box::pin(async move {
            let stream = connect(uri.host().unwrap_or_default()).await?;
            Ok(Box::new(stream) as Box<dyn Io>)
        })
    })
}

pub(super) async fn connect(host: &str) -> io::Result<TcpStream> {
    TcpStream::connect((host, PORT)).await
}
