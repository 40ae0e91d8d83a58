//! A calibration by the server: the walk, the verdict, and whether to put it in force.

use anyhow::bail;
use posefuse_calibration::{Change, compare};
use posefuse_proto::calibration_from_wire;
use posefuse_proto::v1::{
    CalibrateRequest, CalibrateResult, Calibration, GetCalibrationRequest,
    RecalibrateSensorRequest, SetCalibrationRequest, calibrate_event::Event,
};
use tokio_util::sync::CancellationToken;

use super::ask::{self, Decision};
use super::coverage::Bars;
use super::verdict;
use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{self, Style, paint};
use crate::room::{self, Room, ServerUrl};
use crate::shutdown;
use crate::views::CalibrationView;

/// What to calibrate, and what to do with the outcome.
pub(super) struct Wish {
    /// `None`: until enough was seen.
    pub(super) seconds: Option<f64>,
    /// Only this sensor, from what all of them saw of late.
    pub(super) sensor: Option<String>,
    pub(super) dry_run: bool,
    /// Whether a person is asked before it is put in force.
    pub(super) ask: bool,
}

pub(super) async fn run(
    server: &ServerUrl,
    wish: Wish,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let stop = shutdown::on_signal()?;
    let mut client = room::connect(server).await?;
    loop {
        let Some(result) = once(&mut client, &wish, &stop).await? else {
            output::note("stopped; the calibration in force is as it was");
            return Ok(Outcome::Failed);
        };
        let mut view = CalibrationView::from(&result);
        if global.json {
            output::json_pretty(&view)?;
            return Ok(verdict::outcome(&view));
        }
        verdict::print(&view)?;
        if !wish.ask {
            conclude(&view, &wish)?;
            return Ok(verdict::outcome(&view));
        }
        if let Some(calibration) = &result.calibration {
            beside_the_one_in_force(&mut client, calibration).await?;
        }
        match ask::decision(view.verdict != "failed", &stop).await? {
            Decision::Accept => {
                let request = SetCalibrationRequest {
                    calibration: result.calibration,
                };
                let set = client.set_calibration(request).await;
                set.map_err(|status| room::refused(&status))?;
                view.in_force = true;
                conclude(&view, &wish)?;
                return Ok(verdict::outcome(&view));
            }
            Decision::Repeat => {}
            Decision::Keep => {
                output::line("the calibration in force is as it was")?;
                return Ok(verdict::outcome(&view));
            }
        }
    }
}

/// One walk, or one look at what was seen of late. `None`: stopped.
async fn once(
    client: &mut Room,
    wish: &Wish,
    stop: &CancellationToken,
) -> anyhow::Result<Option<CalibrateResult>> {
    let dry_run = wish.dry_run || wish.ask;
    if let Some(sensor) = &wish.sensor {
        output::note(format!(
            "placing `{sensor}` anew by what all sensors saw of late"
        ));
        let request = RecalibrateSensorRequest {
            sensor: sensor.clone(),
            dry_run,
        };
        let result = tokio::select! {
            () = stop.cancelled() => return Ok(None),
            result = client.recalibrate_sensor(request) => result,
        };
        let result = result.map_err(|status| room::refused(&status))?;
        return Ok(Some(result.into_inner()));
    }
    let how_long = match wish.seconds {
        Some(seconds) => format!("for {seconds:.0} s"),
        None => "until every sensor has seen enough".to_owned(),
    };
    output::note(format!(
        "one person: walk about {how_long}, in curves, turn around, reach up, where as many sensors as possible see you"
    ));
    let request = CalibrateRequest {
        seconds: wish.seconds.unwrap_or(0.0),
        dry_run,
    };
    follow(client, request, stop).await
}

fn conclude(view: &CalibrationView, wish: &Wish) -> anyhow::Result<()> {
    output::line(if view.in_force {
        "this calibration is in force now; earlier ones are kept: posefuse calibrations"
    } else if wish.dry_run {
        "a dry run: the calibration in force is as it was"
    } else {
        "not put in force: the calibration in force is as it was"
    })?;
    Ok(())
}

/// Says how far sensors would stand from where the calibration in force has them.
async fn beside_the_one_in_force(client: &mut Room, new: &Calibration) -> anyhow::Result<()> {
    let Ok(current) = client.get_calibration(GetCalibrationRequest {}).await else {
        return Ok(());
    };
    let before = calibration_from_wire(&current.into_inner())?;
    let after = calibration_from_wire(new)?;
    let moves: Vec<String> = compare(&before, &after)
        .into_iter()
        .map(|row| match row.change {
            Change::Moved { mm, deg, .. } => format!("{} {mm:.0} mm {deg:.1}°", row.sensor),
            Change::MissingBefore => format!("{} is new", row.sensor),
            Change::MissingAfter => format!("{} is left out", row.sensor),
        })
        .collect();
    output::line(paint(
        Style::Faint,
        &format!("beside the one in force: {}", moves.join(", ")),
    ))?;
    Ok(())
}

/// Has the server calibrate and shows how the walk goes. `None` if `stop` came first, which cancels it.
pub(crate) async fn follow(
    client: &mut Room,
    request: CalibrateRequest,
    stop: &CancellationToken,
) -> anyhow::Result<Option<CalibrateResult>> {
    let until_covered = request.seconds == 0.0;
    let events = client.calibrate(request).await;
    let mut events = events
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let mut bars = Bars::new(until_covered);
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
