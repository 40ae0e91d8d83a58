//! `posefuse server`: the server of a room, on this machine's network, clock and disk.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use posefuse_server::{Config, Parts, ServerError};
use serde::{Deserialize, Serialize};

use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::output::{Style, line, paint};
use crate::takes_folder::TakesFolder;
use crate::{output, paths, shutdown, values};

/// Run the server of a room: agents, tools and browsers all come to its one port
#[derive(Debug, Args)]
pub(crate) struct ServerArgs {
    /// Settings, as TOML [default: ~/.config/posefuse/server.toml, if it is there]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where to listen; port 0 takes any that is free [default: 127.0.0.1:7400]
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = values::listen)]
    listen: Option<SocketAddr>,
    /// Let other machines reach it. Traffic is not encrypted
    #[arg(long)]
    allow_remote: bool,
    #[command(flatten)]
    takes: TakesFolder,
    /// The file the calibration is kept in [default: ~/.local/share/posefuse/calibration.toml]
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// What fills in joints that no sensor sees: `auto`, `none`, a simple model (hold, damped, gaussian) or a network's name
    /// (`posefuse doctor` lists them)
    #[arg(long, value_name = "MODEL")]
    repair: Option<String>,
    /// Print every setting with its default, as TOML, and end
    #[arg(long)]
    print_config: bool,
    /// Read no configuration file
    #[arg(long, hide = true, conflicts_with = "config")]
    no_config: bool,
    /// If the port is taken, take any that is free
    #[arg(long, hide = true)]
    or_any_port: bool,
    /// End when stdin ends
    #[arg(long, hide = true)]
    exit_with_parent: bool,
}

/// What a server prints with `--json` once it listens.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Listening {
    /// The dashboard, and the address for agents and tools.
    pub(crate) url: String,
    /// The folder takes go to.
    pub(crate) takes: PathBuf,
}

pub(crate) fn run(args: &ServerArgs, global: &Global) -> anyhow::Result<Outcome> {
    if args.print_config {
        output::line(default_config().to_toml().trim_end())?;
        return Ok(Outcome::Done);
    }
    let config = configured(args)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .thread_name("network")
        .enable_all()
        .build()
        .context("cannot start the network threads")?;
    let result = runtime.block_on(serve(config, args, global));
    runtime.shutdown_background();
    result
}

/// The file, and over it the command line.
fn configured(args: &ServerArgs) -> anyhow::Result<Config> {
    let usual = paths::default_config();
    let mut config = match &args.config {
        Some(file) => read_config(file)?,
        None if !args.no_config && usual.is_file() => read_config(&usual)?,
        None => default_config(),
    };
    if let Some(listen) = args.listen {
        config.listen = listen;
    }
    config.allow_remote |= args.allow_remote;
    if let Some(folder) = args.takes.named() {
        config.takes.folder = folder.to_owned();
    }
    if let Some(file) = &args.calibration {
        config.calibration.file = file.clone();
    }
    if let Some(model) = &args.repair {
        config.fusion.repair.model = model.clone();
        config
            .validate()
            .map_err(|error| usage(format!("--repair: {error}")))?;
    }
    Ok(config)
}

/// Reads a server's configuration; folders that it does not name are the usual ones. A mistake in it is a wrong usage.
pub(crate) fn read_config(file: &Path) -> anyhow::Result<Config> {
    let shown = file.display();
    let text = std::fs::read_to_string(file).map_err(|error| {
        usage(format!(
            "the configuration `{shown}` cannot be read: {error}"
        ))
    })?;
    let mut config = Config::from_toml(&text)
        .map_err(|error| usage(format!("the configuration `{shown}`, {error}")))?;
    let table: toml::Table = toml::from_str(&text).unwrap_or_default();
    let names = |section: &str, key: &str| table.get(section).is_some_and(|s| s.get(key).is_some());
    let usual = default_config();
    if !names("takes", "folder") {
        config.takes.folder = usual.takes.folder;
    }
    if !names("calibration", "file") {
        config.calibration.file = usual.calibration.file;
    }
    Ok(config)
}

/// The defaults, with folders of this user.
fn default_config() -> Config {
    let mut config = Config::default();
    config.takes.folder = paths::default_takes();
    config.calibration.file = paths::default_calibration();
    config
}

async fn serve(mut config: Config, args: &ServerArgs, global: &Global) -> anyhow::Result<Outcome> {
    let stop = shutdown::service(args.exit_with_parent)?;
    if args.or_any_port
        && let Err(ServerError::PortInUse(_)) = posefuse_server::bind(&config).await
    {
        config.listen.set_port(0);
    }
    let parts = Parts::system(&config).await.map_err(on_the_command_line)?;
    let listening = Listening {
        url: url(parts
            .listener
            .local_addr()
            .context("the address listened on")?),
        takes: config.takes.folder.clone(),
    };
    if global.json {
        output::json(&listening)?;
    } else {
        greet(&listening)?;
    }
    posefuse_server::run(config, parts, async move { stop.cancelled().await }).await?;
    Ok(Outcome::Done)
}

/// The same remedy as an option.
fn on_the_command_line(error: ServerError) -> anyhow::Error {
    match error {
        ServerError::PortInUse(address) => {
            let (host, port) = (address.ip(), address.port());
            let next = SocketAddr::new(host, port.checked_add(1).unwrap_or(7400));
            anyhow!(
                "port {port} of {host} is in use: end the program that has it (`ss -ltnp` names it), \
                 or choose another port: --listen {next}"
            )
        }
        ServerError::NotLoopback(_) => anyhow!("{error} (on the command line: --allow-remote)"),
        error => error.into(),
    }
}

/// An address that a browser on this machine can open.
fn url(mut address: SocketAddr) -> String {
    if address.ip().is_unspecified() {
        let loopback = if address.is_ipv4() {
            Ipv4Addr::LOCALHOST.into()
        } else {
            Ipv6Addr::LOCALHOST.into()
        };
        address.set_ip(loopback);
    }
    format!("http://{address}")
}

fn greet(listening: &Listening) -> anyhow::Result<()> {
    let Listening { url, takes } = listening;
    line(format!("dashboard  {}", paint(Style::Bold, url)))?;
    line(format!("takes      {}", takes.display()))?;
    // Two: a calibration needs as many.
    for (head, sensor) in [("try it     ", 1), ("and        ", 2)] {
        line(format!(
            "{head}posefuse agent sim --sensor {sensor} --server {url}"
        ))?;
    }
    Ok(())
}
