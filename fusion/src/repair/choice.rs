//! Which model is in effect.

use super::simple::SimpleModel;
use super::{Needs, RepairConfig, RepairModel};

/// What answers, and what stands in for it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Choice {
    /// The windows of the model outside, if that is asked.
    pub(super) outside: Option<Needs>,
    /// Answers, or stands in.
    pub(super) simple: SimpleModel,
    pub(super) name: String,
}

impl Choice {
    /// `None`: nothing is made up. `offline`: frames may wait for later ones.
    pub(super) fn of(
        config: &RepairConfig,
        outside: Option<&RepairModel>,
        offline: bool,
    ) -> Option<Self> {
        let best = match offline {
            true => SimpleModel::BEST_TWO_SIDED,
            false => SimpleModel::BEST,
        };
        let outside = match config.model.as_str() {
            RepairConfig::NONE => return None,
            RepairConfig::AUTO => outside.filter(|model| offline || model.needs.after == 0),
            name => match SimpleModel::named(name) {
                Some(simple) => {
                    return Some(Self {
                        outside: None,
                        simple,
                        name: name.to_owned(),
                    });
                }
                None => outside.filter(|model| model.name == name),
            },
        };
        let two_sided = outside.is_some_and(|model| model.needs.after > 0);
        let simple = if two_sided {
            SimpleModel::BEST_TWO_SIDED
        } else {
            best
        };
        Some(Self {
            outside: outside.map(|model| model.needs),
            simple,
            name: outside.map_or_else(|| simple.label().to_owned(), |model| model.name.clone()),
        })
    }

    /// How much later a frame's answer can be asked for, seconds.
    pub(super) fn after_s(&self) -> f64 {
        let needs = self.outside.unwrap_or_else(|| self.simple.needs_of());
        needs.after_s()
    }

    /// How far the windows that may be asked for look back, seconds.
    pub(super) fn before_s(&self) -> f64 {
        let simple_s = self.simple.needs_of().before_s();
        self.outside
            .map_or(simple_s, |needs| simple_s.max(needs.before_s()))
    }
}
