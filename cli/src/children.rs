//! Child processes of this same program: started with a pipe on stdin that ends when the parent ends, however it
//! does (`--exit-with-parent`), their log lines gathered, and ended in order by closing that pipe.

use std::collections::VecDeque;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use serde::Deserialize;
use tokio::io::{AsyncBufReadExt, AsyncRead, BufReader};
use tokio::process::{ChildStdin, ChildStdout, Command};
use tokio::task::JoinHandle;

use crate::output;

/// Lines of a child's log that are kept to explain why it ended.
const TAIL: usize = 20;

/// A running child.
#[derive(Debug)]
pub(crate) struct Child {
    name: String,
    process: tokio::process::Child,
    stdin: Option<ChildStdin>,
    stdout: tokio::io::Lines<BufReader<ChildStdout>>,
    log: Log,
    reader: JoinHandle<()>,
}

/// The last lines of a child's stderr.
#[derive(Clone, Debug, Default)]
struct Log {
    tail: Arc<Mutex<VecDeque<String>>>,
    quiet: Arc<AtomicBool>,
}

/// One line of a child's log, as its `--log-format json` writes it.
#[derive(Deserialize)]
struct LogLine {
    level: String,
    message: String,
}

impl Child {
    /// Starts `posefuse ARGUMENTS`; `name` names it in messages. With `verbose` its whole log is shown, otherwise
    /// what is at least a warning.
    pub(crate) fn start(name: &str, arguments: &[String], verbose: bool) -> anyhow::Result<Self> {
        let mut command = Command::new(this_program()?);
        command
            .arg0("posefuse")
            .args(arguments)
            .args(["--exit-with-parent", "--json", "--log-format", "json"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .kill_on_drop(true)
            // A terminal's Ctrl-C must not reach it, not even before it can handle one: its parent ends it.
            .process_group(0);
        let mut process = command
            .spawn()
            .with_context(|| format!("cannot start {name} as a process"))?;
        let (stdin, stdout, stderr) = (
            process.stdin.take(),
            process.stdout.take(),
            process.stderr.take(),
        );
        let (Some(stdout), Some(stderr)) = (stdout, stderr) else {
            bail!("{name} has been started without pipes");
        };
        let log = Log::default();
        let reader = tokio::spawn(log.clone().gather(name.to_owned(), stderr, verbose));
        Ok(Self {
            name: name.to_owned(),
            process,
            stdin,
            stdout: BufReader::new(stdout).lines(),
            log,
            reader,
        })
    }

    /// What it is called in messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The next line it prints, within `limit`. An error if it ends first, with its last words.
    pub(crate) async fn next_line(&mut self, limit: Duration) -> anyhow::Result<String> {
        match tokio::time::timeout(limit, self.stdout.next_line()).await {
            Err(_) => bail!(
                "{} did not come up within {} s; try again with -v to see what it says",
                self.name,
                limit.as_secs()
            ),
            Ok(Ok(Some(line))) => Ok(line),
            Ok(_) => Err(self.ended().await),
        }
    }

    /// Waits until it ends, and says why. Cancel-safe.
    pub(crate) async fn ended(&mut self) -> anyhow::Error {
        let status = self.process.wait().await;
        // Its last lines are in the pipe still; a grandchild that holds it open must not hold us.
        if !self.reader.is_finished() {
            let _ = tokio::time::timeout(Duration::from_secs(1), &mut self.reader).await;
        }
        let killed = status.as_ref().is_ok_and(|s| s.signal().is_some());
        let how = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        // Who is killed has not said why: its last line is about something else.
        match self.log.last_words().filter(|_| !killed) {
            Some(words) => anyhow!("{} ended: {words}", self.name),
            None => anyhow!("{} ended without a word ({how})", self.name),
        }
    }

    /// Asks it to end by closing its stdin, waits for `grace`, then kills it. `None` if it had to be killed.
    pub(crate) async fn stop(mut self, grace: Duration) -> Option<ExitStatus> {
        self.log.quiet.store(true, Ordering::Relaxed);
        drop(self.stdin.take());
        if let Ok(status) = tokio::time::timeout(grace, self.process.wait()).await {
            return status.ok();
        }
        // It may have ended this instant; then there is nothing to kill, which is as well.
        let _ = self.process.kill().await;
        None
    }
}

impl Log {
    async fn gather(self, name: String, stderr: impl AsyncRead + Unpin, verbose: bool) {
        let mut lines = BufReader::new(stderr).lines();
        while let Ok(Some(line)) = lines.next_line().await {
            let parsed: Option<LogLine> = serde_json::from_str(&line).ok();
            let grave = parsed
                .as_ref()
                .is_some_and(|l| matches!(l.level.as_str(), "WARN" | "ERROR"));
            let text = parsed.map_or(line, |line| line.message);
            if verbose {
                output::note(format!("[{name}] {text}"));
            } else if grave && !self.quiet.load(Ordering::Relaxed) {
                output::warn(&format!("{name}: {text}"));
            }
            let mut tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
            if tail.len() == TAIL {
                tail.pop_front();
            }
            tail.push_back(text);
        }
    }

    /// Its error, or failing that its last line.
    fn last_words(&self) -> Option<String> {
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let error = tail
            .iter()
            .rev()
            .find_map(|line| Some(line.strip_prefix("error: ")?.to_owned()));
        error.or_else(|| tail.back().cloned())
    }
}

/// This program's own file. Through /proc it is found even if it was replaced since it started.
fn this_program() -> anyhow::Result<PathBuf> {
    let through_proc = PathBuf::from("/proc/self/exe");
    if through_proc.exists() {
        return Ok(through_proc);
    }
    std::env::current_exe().context("cannot find this program's own file to start it again")
}
