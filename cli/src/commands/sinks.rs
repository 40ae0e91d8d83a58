//! `posefuse sinks`: the live outputs of a server, on and off.

use std::time::Duration;

use clap::{Args, Subcommand};
use posefuse_proto::v1::{GetStatusRequest, SinkState, SinkStatus, SwitchSinkRequest};
use serde::Serialize;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{self, Style, line, paint, print_table};
use crate::room::{self, DEFAULT_URL, Room, ServerUrl};

/// How often an output that was switched on is looked at again before it is taken to run.
const LOOKS: u32 = 4;
const BETWEEN_LOOKS: Duration = Duration::from_millis(150);

/// List the live outputs of a server, or switch one on or off until the server ends
///
/// Which are on when a server starts says its configuration, under `[sinks]`.
#[derive(Debug, Args)]
pub(crate) struct SinksArgs {
    #[command(subcommand)]
    action: Option<Action>,
    /// The server of the room
    #[arg(long, value_name = "URL", env = "POSEFUSE_SERVER", default_value = DEFAULT_URL, global = true)]
    server: ServerUrl,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List them, with what each sent and lost
    List,
    /// Switch one on
    On {
        /// Its name, e.g. osc
        name: String,
    },
    /// Switch one off
    Off {
        /// Its name, e.g. osc
        name: String,
    },
}

/// One output, as `--json` prints it.
#[derive(Serialize)]
struct SinkView {
    name: String,
    /// `off`, `running`, `failing`, or `always` for what is there for whoever asks.
    state: &'static str,
    place: String,
    /// Most frames a second; 0: every one.
    rate_hz: f64,
    clients: Option<u32>,
    delivered: u64,
    dropped: u64,
    p50_ms: Option<f64>,
    p99_ms: Option<f64>,
    trouble: String,
}

impl From<SinkStatus> for SinkView {
    fn from(sink: SinkStatus) -> Self {
        let state = match sink.state() {
            SinkState::Unspecified => "always",
            SinkState::Off => "off",
            SinkState::Running => "running",
            SinkState::Failing => "failing",
        };
        Self {
            state,
            name: sink.name,
            place: sink.place,
            rate_hz: sink.rate_hz,
            clients: sink.clients,
            delivered: sink.delivered,
            dropped: sink.dropped,
            p50_ms: sink.p50_ms,
            p99_ms: sink.p99_ms,
            trouble: sink.trouble,
        }
    }
}

pub(crate) async fn run(args: &SinksArgs, global: &Global) -> anyhow::Result<Outcome> {
    match &args.action {
        None | Some(Action::List) => list(&args.server, global).await,
        Some(Action::On { name }) => switch(&args.server, name, true, global).await,
        Some(Action::Off { name }) => switch(&args.server, name, false, global).await,
    }
}

async fn list(server: &ServerUrl, global: &Global) -> anyhow::Result<Outcome> {
    let (_, status) = room::connect_with_status(server).await?;
    let views: Vec<SinkView> = status.sinks.into_iter().map(SinkView::from).collect();
    if global.json {
        output::json_pretty(&views)?;
        return Ok(Outcome::Done);
    }
    let head = [
        "output",
        "state",
        "place",
        "clients",
        "sent",
        "lost",
        "p50/p99 ms",
    ];
    let mut rows = vec![head.map(|cell| paint(Style::Faint, cell)).to_vec()];
    rows.extend(views.iter().map(row));
    print_table(&rows)?;
    for sink in views.iter().filter(|sink| !sink.trouble.is_empty()) {
        output::warn(&format!("{}: {}", sink.name, sink.trouble));
    }
    Ok(Outcome::Done)
}

fn row(sink: &SinkView) -> Vec<String> {
    let latency = match (sink.p50_ms, sink.p99_ms) {
        (Some(p50), Some(p99)) => format!("{p50:.2}/{p99:.2}"),
        _ => String::new(),
    };
    vec![
        sink.name.clone(),
        state(sink),
        sink.place.clone(),
        sink.clients.map(|n| n.to_string()).unwrap_or_default(),
        sink.delivered.to_string(),
        sink.dropped.to_string(),
        latency,
    ]
}

fn state(sink: &SinkView) -> String {
    let style = match sink.state {
        "failing" => Style::Bad,
        "running" => Style::Good,
        _ => Style::Faint,
    };
    paint(style, sink.state)
}

async fn switch(
    server: &ServerUrl,
    name: &str,
    on: bool,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let mut client = room::connect(server).await?;
    let request = SwitchSinkRequest {
        name: name.to_owned(),
        on,
    };
    let sink = client
        .switch_sink(request)
        .await
        .map_err(|status| room::refused(&status))?;
    let mut view = SinkView::from(sink.into_inner());
    if on {
        view = settled(&mut client, view).await;
    }
    if global.json {
        output::json_pretty(&view)?;
    } else {
        line(format!(
            "{} {}  {}",
            paint(Style::Bold, &view.name),
            state(&view),
            view.place
        ))?;
        if on && !view.trouble.is_empty() {
            output::warn(&view.trouble);
        }
    }
    Ok(match view.state {
        "failing" => Outcome::DoneWithLoss,
        _ => Outcome::Done,
    })
}

/// The output when its first try is over: most that cannot work fail at once.
async fn settled(client: &mut Room, mut view: SinkView) -> SinkView {
    for _ in 0..LOOKS {
        if view.state == "failing" {
            break;
        }
        tokio::time::sleep(BETWEEN_LOOKS).await;
        let Ok(status) = client.get_status(GetStatusRequest {}).await else {
            break;
        };
        let mut all = status.into_inner().sinks.into_iter();
        if let Some(sink) = all.find(|sink| sink.name == view.name) {
            view = SinkView::from(sink);
        }
    }
    view
}
