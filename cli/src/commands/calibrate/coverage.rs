//! How a walk comes along, live on the terminal: what has been covered, what to do next, how long it takes at most.

use std::collections::BTreeMap;

use indicatif::ProgressBar;
use posefuse_proto::v1::{CalibrateProgress, SensorProgress};

use crate::output::{Style, paint_err};
use crate::progress;

/// Width of a sensor's bar.
const CELLS: usize = 20;

/// A bar for the whole, a line for what to do, a bar for each sensor.
pub(super) struct Bars {
    whole: ProgressBar,
    hint: Option<ProgressBar>,
    sensors: BTreeMap<String, ProgressBar>,
    /// Whether the walk ends by itself.
    until_covered: bool,
}

impl Bars {
    pub(super) fn new(until_covered: bool) -> Self {
        Self {
            whole: progress::bar(100, "calibrating"),
            hint: None,
            sensors: BTreeMap::new(),
            until_covered,
        }
    }

    pub(super) fn show(&mut self, walk: &CalibrateProgress) {
        let left = (walk.total_seconds - walk.elapsed_seconds).max(0.0);
        let share = if self.until_covered {
            walk.share
        } else {
            walk.elapsed_seconds / walk.total_seconds.max(1e-3)
        };
        self.whole
            .set_position((share * 100.0).clamp(0.0, 100.0) as u64);
        self.whole
            .set_message(match (walk.solving, self.until_covered) {
                (true, _) => "solving".to_owned(),
                (false, true) => format!("ends when all is covered, at most {left:.0} s more"),
                (false, false) => format!("{left:.0} s left"),
            });
        let hint = self.hint.get_or_insert_with(|| progress::detail("now"));
        hint.set_message(match (walk.solving, walk.hint.as_str()) {
            (true, _) => "the walk is over, you may stand still".to_owned(),
            (false, "") => "go on: walk in curves, turn around, reach up".to_owned(),
            (false, hint) => hint.to_owned(),
        });
        let mut sensors: Vec<_> = walk.sensors.iter().collect();
        sensors.sort_by(|a, b| a.sensor.cmp(&b.sensor));
        for sensor in sensors {
            let line = self
                .sensors
                .entry(sensor.sensor.clone())
                .or_insert_with(|| progress::detail(&sensor.sensor));
            line.set_message(sensor_line(sensor));
        }
        // One that left the walk.
        for (name, line) in &self.sensors {
            if !walk.sensors.iter().any(|sensor| sensor.sensor == *name) {
                line.set_message(paint_err(Style::Bad, "its agent is gone; it is left out"));
            }
        }
    }

    pub(super) fn clear(&self) {
        self.sensors
            .values()
            .chain(&self.hint)
            .for_each(ProgressBar::finish_and_clear);
        self.whole.finish_and_clear();
    }
}

/// Red while little was seen, green when it is enough.
fn sensor_line(sensor: &SensorProgress) -> String {
    let share = sensor.share.clamp(0.0, 1.0);
    let style = match share {
        s if s >= 1.0 => Style::Good,
        s if s >= 0.5 => Style::Doubtful,
        _ => Style::Bad,
    };
    let full = (share * CELLS as f64).floor() as usize;
    let bar = format!("{}{}", "█".repeat(full), "░".repeat(CELLS - full));
    let percent = (share * 100.0).floor();
    format!(
        "{} {percent:>3} %  {}",
        paint_err(style, &bar),
        words(sensor)
    )
}

fn words(sensor: &SensorProgress) -> String {
    if sensor.frames == 0 {
        return "has seen nobody yet".to_owned();
    }
    let shared = sensor.shared.iter().collect::<BTreeMap<_, _>>();
    let best = shared.iter().max_by_key(|(_, frames)| **frames);
    let with = best.map_or_else(
        || "alone so far: walk where another sensor sees you too".to_owned(),
        |(other, frames)| format!("{frames} together with {other}"),
    );
    format!(
        "{} frames, {} places on the floor, {with}",
        sensor.frames, sensor.cells
    )
}
