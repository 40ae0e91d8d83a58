//! Origin and heading of the room, set by hand.

use clap::Args;
use nalgebra::Vector3;
use posefuse_calibration::moved;
use posefuse_proto::v1::{GetCalibrationRequest, SetCalibrationRequest};
use posefuse_proto::{calibration_from_wire, calibration_to_wire};

use super::print_poses;
use crate::failure::Outcome;
use crate::global::Global;
use crate::output::line;
use crate::room::{self, Room};

/// Furthest shift, metres.
const MAX_SHIFT_M: f64 = 100.0;

/// First the turn, then the shift. A point that was at x, y is then at the turned x, y plus the shift
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true).args(["turn", "shift"]))]
pub(super) struct MoveArgs {
    /// Turn everything by so many degrees about the room's origin, anticlockwise seen from above; 90 turns what was
    /// ahead (x) to the left (y)
    #[arg(long, value_name = "DEG", value_parser = degrees, allow_hyphen_values = true)]
    turn: Option<f64>,
    /// Shift everything by so many metres ahead, to the left and up
    #[arg(long, value_name = "X,Y[,Z]", value_parser = metres, allow_hyphen_values = true)]
    shift: Option<[f64; 3]>,
    /// Show where the sensors would stand, but leave the calibration in force as it is
    #[arg(long)]
    dry_run: bool,
}

pub(super) async fn run(
    client: &mut Room,
    args: &MoveArgs,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let current = client.get_calibration(GetCalibrationRequest {}).await;
    let current = current
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let turn = args.turn.unwrap_or(0.0).to_radians();
    let shift = Vector3::from(args.shift.unwrap_or_default());
    let moved = calibration_to_wire(&moved(&calibration_from_wire(&current)?, turn, shift));
    if !args.dry_run {
        let request = SetCalibrationRequest {
            calibration: Some(moved.clone()),
        };
        let set = client.set_calibration(request).await;
        set.map_err(|status| room::refused(&status))?;
    }
    print_poses(&moved.sensors, global)?;
    if !global.json {
        line(if args.dry_run {
            "a dry run: the calibration in force is as it was"
        } else {
            "in force now; `posefuse calibrations restore` takes it back"
        })?;
    }
    Ok(Outcome::Done)
}

fn degrees(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|degrees| degrees.abs() <= 360.0)
        .ok_or_else(|| "expected degrees, -360 to 360".to_owned())
}

fn metres(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().ok())
        .map(|number| number.filter(|metres| metres.abs() <= MAX_SHIFT_M))
        .collect();
    match numbers.as_deref() {
        Some([x, y]) => Ok([*x, *y, 0.0]),
        Some([x, y, z]) => Ok([*x, *y, *z]),
        _ => Err("expected two or three numbers in metres, like 1.5,-2 or 0,0,0.05".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_are_two_or_three_numbers_of_a_room_s_size() {
        assert_eq!(metres("1.5,-2"), Ok([1.5, -2.0, 0.0]));
        assert_eq!(metres("0, 0, 0.05"), Ok([0.0, 0.0, 0.05]));
        for wrong in ["1", "1,2,3,4", "1500,2", "NaN,1", "a,b", ""] {
            assert!(metres(wrong).is_err(), "{wrong}");
        }
        assert!(degrees("-90").is_ok() && degrees("NaN").is_err() && degrees("400").is_err());
    }
}
