//! The control file: what is simulated, and what is plugged in. TOML; unknown keys are refused.

use std::path::{Path, PathBuf};

use posefuse_simulator::Scenario;
use serde::Deserialize;
use thiserror::Error;

/// The variable that names the control file.
pub(crate) const VARIABLE: &str = "POSEFUSE_VIRTUAL";

/// What the control file says. Only `plugged` is looked at again when the file changes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Control {
    /// Which sensors are plugged in, from 0; absent: all.
    pub(crate) plugged: Option<Vec<usize>>,
    /// How much faster than this computer's clock the sensors' clocks run, parts per million.
    pub(crate) drift_ppm: f64,
    /// How long after its capture a frame comes at the soonest, milliseconds.
    pub(crate) delay_ms: f64,
    /// By how much longer it takes at most, milliseconds; evenly spread.
    pub(crate) jitter_ms: f64,
    /// After how many seconds of frames the same come again, so that nothing needs to be drawn any more; 0: never.
    pub(crate) repeat_s: f64,
    /// The room: people, sensors, where they stand.
    pub(crate) scenario: Scenario,
}

impl Default for Control {
    fn default() -> Self {
        Self {
            plugged: None,
            drift_ppm: 0.0,
            delay_ms: 0.0,
            jitter_ms: 0.0,
            repeat_s: 0.0,
            scenario: Scenario {
                sensors: 1,
                ..Scenario::default()
            },
        }
    }
}

/// Why a control file does not do.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{VARIABLE}={}: {why}", file.display())]
pub(crate) struct ControlError {
    pub(crate) file: PathBuf,
    pub(crate) why: String,
}

impl Control {
    /// What a file's text says.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let control: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        let within = |name: &str, value: f64, most: f64| {
            let fits = (0.0..=most).contains(&value);
            fits.then_some(())
                .ok_or_else(|| format!("`{name}` must be 0 to {most}, found {value}"))
        };
        within("delay_ms", control.delay_ms, 1000.0)?;
        within("jitter_ms", control.jitter_ms, 1000.0)?;
        within("repeat_s", control.repeat_s, 60.0)?;
        within("the size of `drift_ppm`", control.drift_ppm.abs(), 10_000.0)?;
        Ok(control)
    }

    /// Reads a file.
    pub(crate) fn read(file: &Path) -> Result<Self, ControlError> {
        let error = |why: String| ControlError {
            file: file.to_owned(),
            why,
        };
        let text = std::fs::read_to_string(file).map_err(|why| error(why.to_string()))?;
        Self::parse(&text).map_err(error)
    }

    /// Whether sensor `index` is plugged in.
    pub(crate) fn has(&self, index: usize) -> bool {
        let plugged = self.plugged.as_ref();
        plugged.is_none_or(|plugged| plugged.contains(&index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_file_says_what_is_there_and_nothing_it_does_not_know() {
        let control =
            Control::parse("plugged = [1]\ndelay_ms = 4.0\n[scenario]\nsensors = 2\npeople = 3\n")
                .unwrap();
        assert_eq!((control.has(0), control.has(1)), (false, true));
        assert_eq!((control.scenario.sensors, control.scenario.people), (2, 3));
        assert!(Control::parse("").unwrap().has(0));
        for (wrong, words) in [
            ("unplugged = [1]", "unplugged"),
            ("delay_ms = -1.0", "delay_ms"),
        ] {
            let error = Control::parse(wrong).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
