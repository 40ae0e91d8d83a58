//! A calibration by the server, with the walk's progress for each sensor.

use std::collections::BTreeMap;

use anyhow::bail;
use indicatif::ProgressBar;
use posefuse_proto::v1::{
    CalibrateProgress, CalibrateRequest, CalibrateResult, SensorProgress, calibrate_event::Event,
};
use tokio_util::sync::CancellationToken;

use super::verdict;
use crate::failure::Outcome;
use crate::global::Global;
use crate::room::{self, Room, ServerUrl};
use crate::views::CalibrationView;
use crate::{output, progress, shutdown};

pub(crate) async fn run(
    server: &ServerUrl,
    seconds: f64,
    dry_run: bool,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let stop = shutdown::on_signal()?;
    let mut client = room::connect(server).await?;
    output::note(format!(
        "walk about for {seconds:.0} s, alone, in curves, where as many sensors as possible see you"
    ));
    let request = CalibrateRequest { seconds, dry_run };
    let Some(result) = follow(&mut client, request, &stop).await? else {
        output::note("stopped; the calibration in force is as it was");
        return Ok(Outcome::Failed);
    };
    let view = CalibrationView::from(&result);
    if global.json {
        output::json_pretty(&view)?;
    } else {
        verdict::print(&view)?;
        output::line(if view.in_force {
            "this calibration is in force now"
        } else if dry_run {
            "a dry run: the calibration in force is as it was"
        } else {
            "not put in force: the calibration in force is as it was"
        })?;
    }
    Ok(verdict::outcome(&view))
}

/// Has the server calibrate and shows how the walk goes. `None` if `stop` came first, which cancels it.
pub(crate) async fn follow(
    client: &mut Room,
    request: CalibrateRequest,
    stop: &CancellationToken,
) -> anyhow::Result<Option<CalibrateResult>> {
    let events = client.calibrate(request).await;
    let mut events = events
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let mut bars = Bars::new();
    let result = loop {
        let event = tokio::select! {
            () = stop.cancelled() => break Ok(None),
            event = events.message() => event,
        };
        match event {
            Err(status) => break Err(room::refused(&status)),
            Ok(None) => {
                bail!("the server ended the calibration without a result; its log says why")
            }
            Ok(Some(event)) => match event.event {
                Some(Event::Progress(progress)) => bars.show(&progress),
                Some(Event::Result(result)) => break Ok(Some(result)),
                None => {}
            },
        }
    };
    bars.clear();
    result
}

/// A bar for the time and a line for each sensor.
struct Bars {
    time: ProgressBar,
    sensors: BTreeMap<String, ProgressBar>,
}

impl Bars {
    fn new() -> Self {
        let time = progress::bar(100, "calibrating");
        Self {
            time,
            sensors: BTreeMap::new(),
        }
    }

    fn show(&mut self, walk: &CalibrateProgress) {
        let share = walk.elapsed_seconds / walk.total_seconds.max(1e-3);
        self.time
            .set_position((share * 100.0).clamp(0.0, 100.0) as u64);
        let left = walk.total_seconds - walk.elapsed_seconds;
        self.time.set_message(if left > 0.05 {
            format!("{left:.0} s left")
        } else {
            "solving".to_owned()
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
    }

    fn clear(&self) {
        self.sensors
            .values()
            .for_each(ProgressBar::finish_and_clear);
        self.time.finish_and_clear();
    }
}

fn sensor_line(sensor: &SensorProgress) -> String {
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
        "{:>5} frames, {:>3} places on the floor, {with}",
        sensor.frames, sensor.cells
    )
}
