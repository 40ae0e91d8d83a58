//! This machine: processors, clock, limits.

use std::fs;

use rustix::process::{Resource, getrlimit};

use super::Finding;

/// Sources of time that are read in nanoseconds and without a call into the kernel.
const GOOD_CLOCKS: [&str; 5] = [
    "tsc",
    "kvm-clock",
    "arch_sys_counter",
    "hyperv_clocksource_tsc_page",
    "riscv_clocksource",
];
/// A server with 64 sensors, some viewers and an open take stays below this.
const FILES_WANTED: u64 = 256;

pub(super) fn examine() -> Vec<Finding> {
    vec![program(), processors(), clock(), open_files()]
}

fn program() -> Finding {
    let build = if cfg!(debug_assertions) {
        "debug build"
    } else {
        "release build"
    };
    let found = format!("posefuse {} ({build})", env!("CARGO_PKG_VERSION"));
    if cfg!(debug_assertions) {
        Finding::doubtful(
            "program",
            found,
            "for a real room use the release build: cargo build --release",
        )
    } else {
        Finding::good("program", found)
    }
}

fn processors() -> Finding {
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let plural = if count == 1 {
        "processor"
    } else {
        "processors"
    };
    let load = fs::read_to_string("/proc/loadavg").ok();
    let load = load
        .as_deref()
        .and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    let Some(load) = load else {
        return Finding::good("processors", format!("{count} {plural}, load unknown"));
    };
    let found = format!("{count} {plural}, load {load:.1}");
    if load > 1.5 * count as f64 {
        Finding::doubtful(
            "processors",
            found,
            "other programs keep this machine busy: frames will come late; end some",
        )
    } else {
        Finding::good("processors", found)
    }
}

fn clock() -> Finding {
    let path = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    let Ok(source) = fs::read_to_string(path) else {
        return Finding::unknown("clock", "its source is not told on this system");
    };
    let source = source.trim();
    if GOOD_CLOCKS.contains(&source) {
        Finding::good("clock", source)
    } else {
        Finding::doubtful(
            "clock",
            format!("{source}, which is slow to read"),
            "choose a better one: echo tsc | sudo tee /sys/devices/system/clocksource/clocksource0/current_clocksource",
        )
    }
}

fn open_files() -> Finding {
    let limit = getrlimit(Resource::Nofile).current;
    match limit {
        Some(limit) if limit < FILES_WANTED => Finding::doubtful(
            "open files",
            format!("at most {limit}"),
            format!(
                "a room with many sensors and viewers needs more: ulimit -n {}",
                4 * FILES_WANTED
            ),
        ),
        Some(limit) => Finding::good("open files", format!("at most {limit}")),
        None => Finding::good("open files", "no limit"),
    }
}
