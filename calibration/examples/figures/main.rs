//! The figures of calibration, against the simulator's truth: how exact it is beside plain SVD, whether it knows how exact it
//! is, and whether its verdict can be trusted.
//!
//! `cargo run --release -p posefuse-calibration --example figures [-- --seeds N --only accuracy|verdicts|covariance|coverage|time
//! --threads N]`. Exit code 1 if a promise is broken: a bad calibration passed, or more than two of a hundred good ones
//! did not.

#[path = "../../tests/common/simulated.rs"]
mod simulated;

mod accuracy;
mod bad;
mod coverage;
mod plain;
mod spoil;
mod survey;
mod verdicts;

use std::process::ExitCode;

/// What the command line asks for.
struct Arguments {
    /// Seeds per row.
    seeds: u64,
    /// The parts; all if empty.
    only: Vec<String>,
    threads: usize,
}

const PARTS: [&str; 5] = ["accuracy", "covariance", "coverage", "verdicts", "time"];

fn main() -> ExitCode {
    let arguments = match parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let wanted =
        |part: &str| arguments.only.is_empty() || arguments.only.iter().any(|only| only == part);
    let mut kept = true;
    if wanted("time") {
        accuracy::print_time();
    }
    if wanted("accuracy") || wanted("covariance") || wanted("coverage") {
        let rooms = survey::survey(arguments.seeds, arguments.threads, wanted("coverage"));
        if wanted("accuracy") {
            accuracy::print(&rooms);
        }
        if wanted("covariance") {
            accuracy::print_covariance(&rooms);
        }
        if wanted("coverage") {
            kept &= coverage::print(&rooms);
        }
    }
    if wanted("verdicts") {
        kept &= verdicts::print_bad(arguments.threads);
        kept &= verdicts::print_good(arguments.threads);
    }
    if kept {
        ExitCode::SUCCESS
    } else {
        println!("\nA promise is broken.");
        ExitCode::FAILURE
    }
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let mut arguments = Arguments {
        seeds: 10,
        only: Vec::new(),
        threads: 1,
    };
    while let Some(word) = words.next() {
        let value = words.next().ok_or(format!("{word} needs a value"))?;
        let number = || {
            value
                .parse()
                .map_err(|_| format!("{word}: {value} is no number"))
        };
        match word.as_str() {
            "--seeds" => arguments.seeds = number()?,
            "--threads" => arguments.threads = number()?.max(1) as usize,
            "--only" if PARTS.contains(&value.as_str()) => arguments.only.push(value),
            "--only" => return Err(format!("--only takes {}, found {value}", PARTS.join(", "))),
            _ => {
                return Err(format!(
                    "expected --seeds, --only or --threads, found {word}"
                ));
            }
        }
    }
    Ok(arguments)
}

/// `work` of every item, in their order, by this many threads.
fn each<T: Sync, R: Send>(items: &[T], threads: usize, work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = std::sync::atomic::AtomicUsize::new(0);
    let worker = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return done;
            };
            done.push((index, work(item)));
        }
    };
    let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        let results = workers.into_iter().map(|worker| worker.join());
        results
            .flat_map(|result| result.expect("a worker panicked"))
            .collect()
    });
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, result)| result).collect()
}
