//! `[repair]`: what is made up, by which model, and for how long.

use serde::{Deserialize, Serialize};

use crate::config::{ms_to_ns, seconds_to_ns};
use crate::config_check::Checker;

/// `[repair]`: joints that no sensor sees are filled in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RepairConfig {
    /// `auto` (the model that the program around the engine offers, else the best simple one), `none`, a simple one
    /// (`hold`, `damped`, `gaussian`; for takes also `linear`, `gaussian-two-sided`, which hold frames back) or the name of a
    /// model outside the engine. While such a one is not there the best simple one stands in.
    pub model: String,
    /// How long a frame waits for a model outside the engine before the simple one answers.
    pub deadline_ms: f64,
    /// A joint that is seen again where it was not expected, 10 cm off, is back within this time.
    pub blend_ms: f64,
    /// How long a joint is made up before it goes missing; for one that was never seen, counted from the person's first
    /// frame.
    pub max_s: f64,
}

impl Default for RepairConfig {
    fn default() -> Self {
        Self {
            model: Self::AUTO.to_owned(),
            deadline_ms: 20.0,
            blend_ms: 400.0,
            max_s: 60.0,
        }
    }
}

impl RepairConfig {
    /// The best model there is.
    pub const AUTO: &'static str = "auto";
    /// Nothing is made up.
    pub const NONE: &'static str = "none";

    /// Nothing is made up.
    pub fn off() -> Self {
        Self {
            model: Self::NONE.to_owned(),
            ..Self::default()
        }
    }

    pub(crate) fn check(&self, check: &mut Checker) {
        let found = &self.model;
        check.that("repair.model", is_name(found), || {
            format!(
                "`auto`, `none` or a model's name (1 to 64 of a-z, 0-9, `-`, `_`, `.`), found `{found}`"
            )
        });
        check.within("repair.deadline_ms", self.deadline_ms, 1.0, 1000.0);
        check.within("repair.blend_ms", self.blend_ms, 0.0, 5000.0);
        check.within("repair.max_s", self.max_s, 0.0, 3600.0);
    }

    pub(crate) fn deadline_ns(&self) -> i64 {
        ms_to_ns(self.deadline_ms)
    }

    pub(crate) fn max_ns(&self) -> i64 {
        seconds_to_ns(self.max_s)
    }
}

fn is_name(name: &str) -> bool {
    let may = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_.".contains(c);
    (1..=64).contains(&name.len()) && name.chars().all(may)
}
