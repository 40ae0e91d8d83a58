//! How a running command learns that it is to end: Ctrl-C, SIGTERM, or the end of the process that started it.

use std::io::{self, Read};
use std::time::Duration;

use anyhow::Context;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

/// How long a child may take to end in order once its parent is gone, before it ends anyhow.
const GRACE: Duration = Duration::from_secs(10);

/// A token that is cancelled at the first SIGINT, SIGTERM or SIGHUP; a second SIGINT or SIGTERM ends the process
/// at once. Needs a tokio runtime.
pub(crate) fn on_signal() -> anyhow::Result<CancellationToken> {
    let token = CancellationToken::new();
    let fired = token.clone();
    let mut interrupt = signal(SignalKind::interrupt()).context("cannot listen for Ctrl-C")?;
    let mut terminate = signal(SignalKind::terminate()).context("cannot listen for SIGTERM")?;
    let mut hangup = signal(SignalKind::hangup()).context("cannot listen for SIGHUP")?;
    tokio::spawn(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = hangup.recv() => {}
        }
        fired.cancel();
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
        std::process::exit(130);
    });
    Ok(token)
}

/// A token that is cancelled when stdin ends, which it does however the parent ends, and at SIGTERM. SIGINT is left
/// to the parent: a terminal sends it to the whole group, and the parent ends its children in order.
pub(crate) fn with_parent() -> anyhow::Result<CancellationToken> {
    let token = CancellationToken::new();
    let (at_end, at_signal) = (token.clone(), token.clone());
    std::thread::Builder::new()
        .name("parent-watch".into())
        .spawn(move || {
            wait_for_end_of(io::stdin().lock());
            at_end.cancel();
            std::thread::sleep(GRACE);
            std::process::exit(1);
        })
        .context("cannot start the thread that watches the parent")?;
    let mut interrupt = signal(SignalKind::interrupt()).context("cannot listen for Ctrl-C")?;
    let mut terminate = signal(SignalKind::terminate()).context("cannot listen for SIGTERM")?;
    tokio::spawn(async move {
        loop {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => break,
            }
        }
        at_signal.cancel();
    });
    Ok(token)
}

/// The token for a service: see the two above.
pub(crate) fn service(exit_with_parent: bool) -> anyhow::Result<CancellationToken> {
    if exit_with_parent {
        with_parent()
    } else {
        on_signal()
    }
}

fn wait_for_end_of(mut input: impl Read) {
    let mut buffer = [0; 256];
    loop {
        match input.read(&mut buffer) {
            Ok(0) => return,
            Err(error) if error.kind() != io::ErrorKind::Interrupted => return,
            Ok(_) | Err(_) => {}
        }
    }
}
