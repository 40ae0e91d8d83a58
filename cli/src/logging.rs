//! Diagnostics: `tracing` to stderr, as text or JSON. Lines never tear a progress bar.

use std::io::{self, IsTerminal, Write};

use tracing::Level;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

use crate::global::{Global, LogFormat};
use crate::{output, progress};

/// The variable that sets what is logged, in the syntax of `RUST_LOG`.
const FILTER: &str = "POSEFUSE_LOG";

/// Starts logging for this process. Called once.
pub(crate) fn init(global: &Global, default: Level) {
    let level = match global.verbose {
        0 => default,
        1 => default.max(Level::DEBUG),
        _ => Level::TRACE,
    };
    // Libraries below us (HTTP/2 frames and such) are of interest only when asked for by name.
    let usual = format!("warn,posefuse={level},{OURS}", OURS = ours(level));
    let filter = std::env::var(FILTER)
        .ok()
        .and_then(|text| EnvFilter::try_new(text).ok())
        .unwrap_or_else(|| EnvFilter::new(usual));
    // A closed stderr must not turn a log line into a panic: no internal errors to stderr either.
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(Stderr)
        .log_internal_errors(false);
    match global.log_format {
        LogFormat::Json => builder.json().flatten_event(true).init(),
        LogFormat::Text => builder
            .with_ansi(output::coloured(&io::stderr().is_terminal()))
            .with_target(level >= Level::DEBUG)
            .init(),
    }
}

fn ours(level: Level) -> String {
    [
        "agent",
        "calibration",
        "fusion",
        "proto",
        "server",
        "session",
        "simulator",
    ]
    .map(|name| format!("posefuse_{name}={level}"))
    .join(",")
}

/// Stderr, with progress bars taken off the screen while a line is written.
struct Stderr;

impl Write for Stderr {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        progress::suspended(|| io::stderr().write(line))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

impl MakeWriter<'_> for Stderr {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        Self
    }
}
