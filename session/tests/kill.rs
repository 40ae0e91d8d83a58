//! kill -9 at any moment costs at most half a second, and nothing that was acknowledged.
#![allow(clippy::unwrap_used)]

mod support;

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_session::{DiskStorage, RecoveryOutcome, Storage, TakeReader, recover};
use posefuse_skeleton::Timestamp;

const FOLDER: &str = "POSEFUSE_KILL_TEST_FOLDER";
const ROUNDS: u64 = 10;

/// Not a test: the process that is killed. Records in real time and tells what it gave and what is acknowledged.
#[test]
#[ignore = "run by `kill_9_costs_at_most_half_a_second`"]
fn child() {
    let Some(folder) = std::env::var_os(FOLDER) else {
        return;
    };
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder).unwrap());
    let mut recorder = support::Recorder::new();
    let start = Timestamp::ZERO;
    recorder.begin(&storage, "t", start, Default::default());
    let begun = Instant::now();
    let mut out = std::io::stderr();
    for input in support::arrivals(20.0, 1) {
        let due = Duration::from_nanos(support::time_of(&input).ns().max(0) as u64);
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
        let now = support::time_of(&input);
        recorder.arrive(input);
        let given = recorder.live.frames.len();
        let flushed = recorder.writer.as_mut().unwrap().flush(now).unwrap();
        let at = begun.elapsed().as_nanos();
        writeln!(out, "at {at} given {given} durable {}", flushed.frames).unwrap();
    }
}

struct Said {
    at_ns: u128,
    given: u64,
    durable: u64,
}

fn parse(line: &str) -> Option<Said> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let ["at", at, "given", given, "durable", durable] = words[..] else {
        return None;
    };
    Some(Said {
        at_ns: at.parse().ok()?,
        given: given.parse().ok()?,
        durable: durable.parse().ok()?,
    })
}

fn one_round(after: Duration) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["child", "--exact", "--ignored", "--nocapture"])
        .env(FOLDER, folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let begun = Instant::now();
    let mut said: Vec<Said> = Vec::new();
    let mut killed = false;
    for line in lines {
        said.extend(line.ok().as_deref().and_then(parse));
        if !killed && !said.is_empty() && begun.elapsed() >= after {
            child.kill().unwrap();
            killed = true;
        }
    }
    child.wait().unwrap();
    assert!(
        killed,
        "the child ended by itself after {} lines",
        said.len()
    );

    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder.path()).unwrap());
    let recoveries = recover(&storage).unwrap();
    assert!(
        matches!(recoveries[0].outcome, RecoveryOutcome::Recovered { .. }),
        "{recoveries:?}"
    );
    let take = TakeReader::open(&*storage, "t").unwrap();
    let read = take.frames().map(Result::unwrap).count() as u64;
    let last = said.last().unwrap();
    assert!(
        read >= last.durable,
        "{} were acknowledged, {read} read back",
        last.durable
    );
    // The moment the first lost frame was given, until the kill.
    let lost_from = said.iter().find(|line| line.given > read);
    lost_from.map_or(0.0, |from| (last.at_ns - from.at_ns) as f64 * 1e-9)
}

#[test]
fn kill_9_costs_at_most_half_a_second() {
    let seed = u64::from(std::process::id());
    let mut worst: f64 = 0.0;
    for round in 0..ROUNDS {
        // Spread over the flush interval, from a start that differs in each run.
        let milliseconds = 500 + (seed * 37 + round * 131) % 700;
        worst = worst.max(one_round(Duration::from_millis(milliseconds)));
    }
    eprintln!("worst of {ROUNDS} kills: {worst:.3} s lost");
    assert!(
        worst > 0.0,
        "no kill cost anything: this test shows nothing"
    );
    assert!(worst <= 0.5, "{worst} s were lost");
}
