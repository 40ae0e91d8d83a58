//! Collects the first thing that is wrong with a configuration.

use crate::toml_text::ConfigError;

/// Remembers the first failed check.
#[derive(Default)]
pub(crate) struct Checker {
    error: Option<ConfigError>,
}

impl Checker {
    /// `value` must lie in `low..=high`; NaN does not.
    pub(crate) fn within(&mut self, key: &str, value: f64, low: f64, high: f64) {
        self.that(key, (low..=high).contains(&value), || {
            format!("a number from {low} to {high}, found {value}")
        });
    }

    /// `holds` must be true; `expected` says what was expected and found.
    pub(crate) fn that(&mut self, key: &str, holds: bool, expected: impl FnOnce() -> String) {
        if !holds && self.error.is_none() {
            self.error = Some(ConfigError::Value {
                key: key.to_owned(),
                expected: expected(),
            });
        }
    }

    /// The first failure, if there was one.
    pub(crate) fn finish(self) -> Result<(), ConfigError> {
        self.error.map_or(Ok(()), Err)
    }
}
