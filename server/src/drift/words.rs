//! A finding in words.

use posefuse_calibration::SensorDrift;
use posefuse_skeleton::SensorId;

/// By how much it moved: `about 3 cm and 1.2 degrees`.
pub(super) fn amount(drift: &SensorDrift) -> String {
    let (shift_cm, turn_deg) = (drift.moved_m * 1e2, drift.turned_rad.to_degrees());
    let shift = format!("{shift_cm:.0} cm");
    let turn = format!("{turn_deg:.1} degrees");
    match (shift_cm >= 1.0, turn_deg >= 0.4) {
        (true, true) => format!("about {shift} and {turn}"),
        (false, true) => format!("about {turn}"),
        (true, false) => format!("about {shift}"),
        (false, false) => format!("an amount that puts people {:.0} cm off", drift.off_m * 1e2),
    }
}

/// What happened.
pub(super) fn what(
    drift: &SensorDrift,
    name: &str,
    name_of: impl Fn(SensorId) -> String,
) -> String {
    match drift.instead {
        Some(other) => format!(
            "either sensor {name} or sensor {} has moved by {} (two sensors cannot tell which)",
            name_of(other),
            amount(drift)
        ),
        None => format!("sensor {name} has moved by {}", amount(drift)),
    }
}

/// What happened and what to do.
pub(super) fn trouble(
    drift: &SensorDrift,
    name: &str,
    name_of: impl Fn(SensorId) -> String,
) -> String {
    let what = what(drift, name, name_of);
    let which = if drift.instead.is_some() {
        "find out which, walk about for 20 s in view of both, then press Recalibrate on that one's card or run \
         `posefuse calibrate --sensor NAME`"
            .to_owned()
    } else {
        format!(
            "walk about for 20 s in its view, then press Recalibrate on its card or run `posefuse calibrate --sensor {name}`"
        )
    };
    format!("{what}: {which}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drift(moved_m: f64, turned_deg: f64, instead: Option<usize>) -> SensorDrift {
        SensorDrift {
            sensor: SensorId::new(0).unwrap(),
            residual_m: 0.06,
            usual_m: 0.03,
            moved_m,
            turned_rad: turned_deg.to_radians(),
            sigma_m: 0.002,
            sigma_rad: 0.001,
            off_m: 0.03,
            significance: 9.0,
            alarm: true,
            since: None,
            instead: instead.map(|index| SensorId::new(index).unwrap()),
        }
    }

    #[test]
    fn the_sensor_is_named_with_what_to_do() {
        let name_of = |_| "right".to_owned();
        let one = trouble(&drift(0.031, 0.1, None), "left", name_of);
        assert!(
            one.starts_with("sensor left has moved by about 3 cm: "),
            "{one}"
        );
        assert!(one.contains("Recalibrate") && one.contains("posefuse calibrate --sensor left"));
        let turned = trouble(&drift(0.004, 1.24, None), "left", name_of);
        assert!(
            turned.contains("about 1.2 degrees") && !turned.contains(" cm"),
            "{turned}"
        );
        let either = trouble(&drift(0.05, 2.0, Some(1)), "left", name_of);
        assert!(
            either.starts_with("either sensor left or sensor right"),
            "{either}"
        );
    }
}
