//! The demo's processes: one server, one agent per simulated sensor. They never outlive this process, and end in
//! order: agents first, so that the server sees them leave.

use std::future::{Future, poll_fn};
use std::path::PathBuf;
use std::task::Poll;
use std::time::Duration;

use anyhow::Context;

use super::DemoArgs;
use super::scratch::Scratch;
use crate::children::Child;
use crate::commands::server::Listening;
use crate::failure::in_words;
use crate::output::{note, warn};
use crate::room::ServerUrl;

/// How long a child may take to come up, and to end.
const START_WITHIN: Duration = Duration::from_secs(15);
const STOP_WITHIN: Duration = Duration::from_secs(5);

/// The processes.
pub(super) struct Fleet {
    server: Option<Child>,
    agents: Vec<Child>,
    lost: Vec<String>,
    server_arguments: Vec<String>,
    agent_arguments: Vec<Vec<String>>,
    wanted_port: u16,
    verbose: bool,
    /// Holds the demo's calibration, so that the user's own room keeps its.
    _scratch: Scratch,
}

/// A server that is up.
pub(super) struct Server {
    pub(super) url: ServerUrl,
    pub(super) takes: PathBuf,
}

/// A process that ended by itself.
pub(super) struct Ended {
    /// Which agent; `None` is the server.
    agent: Option<usize>,
    /// Which and why, in words.
    pub(super) error: anyhow::Error,
}

impl Fleet {
    /// Nothing runs yet.
    pub(super) fn new(args: &DemoArgs, verbose: bool) -> anyhow::Result<Self> {
        let scratch =
            Scratch::in_folder(&std::env::temp_dir()).context("cannot make a temporary folder")?;
        let takes = std::path::absolute(args.takes.path()).context("the takes folder")?;
        let text = |path: PathBuf| path.display().to_string();
        let epoch_ns =
            i64::try_from(jiff::Timestamp::now().as_nanosecond()).context("this machine's date")?;
        let server_arguments = [
            "server".to_owned(),
            "--listen".to_owned(),
            args.listen.to_string(),
            "--or-any-port".to_owned(),
            "--no-config".to_owned(),
            "--takes".to_owned(),
            text(takes),
            "--calibration".to_owned(),
            text(scratch.path().join("calibration.toml")),
        ];
        Ok(Self {
            server: None,
            agents: Vec::new(),
            lost: Vec::new(),
            server_arguments: server_arguments.into(),
            agent_arguments: (0..args.sensors)
                .map(|index| agent_arguments(args, index, epoch_ns))
                .collect(),
            wanted_port: args.listen.port(),
            verbose,
            _scratch: scratch,
        })
    }

    /// Starts the server and waits until it listens.
    pub(super) async fn start_server(&mut self) -> anyhow::Result<Server> {
        let server = self.server.insert(Child::start(
            "server",
            &self.server_arguments,
            self.verbose,
        )?);
        let line = server.next_line(START_WITHIN).await?;
        let listening: Listening = serde_json::from_str(&line).context("the server's greeting")?;
        let url: ServerUrl = listening.url.parse().map_err(anyhow::Error::msg)?;
        let port = url.host_and_port().1;
        if self.wanted_port != 0 && port != self.wanted_port {
            note(format!(
                "port {} is in use by another program; port {port} is used instead",
                self.wanted_port
            ));
        }
        Ok(Server {
            url,
            takes: listening.takes,
        })
    }

    /// Starts the agents; they connect by themselves.
    pub(super) fn start_agents(&mut self, server: &ServerUrl) -> anyhow::Result<()> {
        for (index, arguments) in (0..).zip(&self.agent_arguments) {
            let mut arguments = arguments.clone();
            arguments.extend(["--server".to_owned(), server.to_string()]);
            self.agents
                .push(Child::start(&agent_name(index), &arguments, self.verbose)?);
        }
        Ok(())
    }

    /// Waits until a process ends that should not, and says which and why. Cancel-safe.
    pub(super) async fn any_ended(&mut self) -> Ended {
        let server = self.server.iter_mut().map(|child| (None, child));
        let agents = self
            .agents
            .iter_mut()
            .enumerate()
            .map(|(index, child)| (Some(index), child));
        let mut ends: Vec<_> = server
            .chain(agents)
            .map(|(agent, child)| {
                Box::pin(async move {
                    Ended {
                        agent,
                        error: child.ended().await,
                    }
                })
            })
            .collect();
        poll_fn(|context| {
            let mut polls = ends.iter_mut().map(|end| end.as_mut().poll(context));
            polls.find(Poll::is_ready).unwrap_or(Poll::Pending)
        })
        .await
    }

    /// Notes that a process has ended. The rest goes on without an agent, but not without the server or any agent.
    pub(super) fn goes_on_without(&mut self, ended: Ended) -> anyhow::Result<()> {
        let Some(index) = ended.agent.filter(|_| self.agents.len() > 1) else {
            return Err(ended.error);
        };
        warn(&format!("{}; the others go on", in_words(&ended.error)));
        self.lost.push(self.agents.remove(index).name().to_owned());
        Ok(())
    }

    /// Agents that ended before they were to.
    pub(super) fn lost(&self) -> &[String] {
        &self.lost
    }

    /// Ends the agents, then the server. Gives the names of those that had to be killed.
    pub(super) async fn stop(self) -> Vec<String> {
        let mut killed = Vec::new();
        let stops = self.agents.into_iter().map(|agent| {
            let name = agent.name().to_owned();
            tokio::spawn(async move { (name, agent.stop(STOP_WITHIN).await) })
        });
        for stop in stops.collect::<Vec<_>>() {
            if let Ok((name, None)) = stop.await {
                killed.push(name);
            }
        }
        if let Some(server) = self.server
            && server.stop(STOP_WITHIN).await.is_none()
        {
            killed.push("server".to_owned());
        }
        killed
    }
}

/// `posefuse agent sim`, all agents with the same room and the same beginning.
fn agent_arguments(args: &DemoArgs, index: u32, epoch_ns: i64) -> Vec<String> {
    let options = [
        ("--name", agent_name(index)),
        ("--sensor", (index + 1).to_string()),
        ("--sensors", args.sensors.to_string()),
        ("--people", args.people.to_string()),
        ("--seed", args.seed.to_string()),
        ("--epoch-ns", epoch_ns.to_string()),
        ("--drain", "1".to_owned()),
    ];
    let options = options
        .into_iter()
        .flat_map(|(option, value)| [option.to_owned(), value]);
    ["agent".to_owned(), "sim".to_owned()]
        .into_iter()
        .chain(options)
        .collect()
}

fn agent_name(index: u32) -> String {
    format!("cam{}", index + 1)
}
