//! The model beside the engine that fills in what no sensor sees: chosen when the server starts, run on a thread of its
//! own behind a bounded queue.
//!
//! The engine never waits for it: a window whose answer has not come by its deadline is filled by the engine's own
//! simple model, and counted here. Whatever goes wrong with the model, the room goes on with the simple one and the
//! status says why.

mod meter;
mod worker;

use posefuse_fusion::{Needs, OcclusionModel, RepairConfig, RepairModel, SimpleModel};
use posefuse_models::{Kind, Library, NeuralModel, Refused};

pub(crate) use meter::Meter;
pub(crate) use worker::{Requests, start};

/// What a server repairs with.
pub(crate) struct Repair {
    model: Option<NeuralModel>,
    /// What is known of it from the start.
    about: About,
}

/// What does not change while the server runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct About {
    /// The name of what fills in.
    pub(crate) model: String,
    /// What runs it; empty: the engine itself.
    pub(crate) runtime: String,
    /// Why it is not the one that was asked for.
    pub(crate) trouble: String,
}

impl Repair {
    /// Opens the model that the configuration asks for.
    pub(crate) fn open(config: &crate::Config) -> Self {
        match wished(config) {
            Ok(Some(model)) => {
                let about = About {
                    model: model.name().to_owned(),
                    runtime: model.runtime().to_string(),
                    trouble: String::new(),
                };
                tracing::info!(
                    model = about.model,
                    runtime = about.runtime,
                    why = model.why(),
                    ms = 1e3 * model.latency().as_secs_f64(),
                    "repair"
                );
                Self {
                    model: Some(model),
                    about,
                }
            }
            Ok(None) => Self::simple(&config.fusion.repair, String::new()),
            Err(refused) => {
                tracing::warn!(%refused, "the room goes on with a simple repair model");
                Self::simple(&config.fusion.repair, refused)
            }
        }
    }

    fn simple(config: &RepairConfig, trouble: String) -> Self {
        let model = match config.model.as_str() {
            RepairConfig::NONE => RepairConfig::NONE,
            name => SimpleModel::named(name)
                .unwrap_or(SimpleModel::BEST)
                .label(),
        };
        let about = About {
            model: model.to_owned(),
            trouble,
            ..About::default()
        };
        Self { model: None, about }
    }

    /// What the engine is told of it.
    pub(crate) fn for_engine(&self) -> Option<RepairModel> {
        let model = self.model.as_ref()?;
        Some(RepairModel {
            name: model.name().to_owned(),
            needs: model.needs(),
        })
    }
}

/// The model beside the engine that is asked for; `None`: one of the engine's own, or none at all.
fn wished(config: &crate::Config) -> Result<Option<NeuralModel>, String> {
    let library = Library::new(&config.models);
    let name = match config.fusion.repair.model.as_str() {
        RepairConfig::NONE => return Ok(None),
        RepairConfig::AUTO => match library.default_model(Kind::Live) {
            Some(name) => name,
            None => return Ok(None),
        },
        name if SimpleModel::named(name).is_some() => return Ok(None),
        name => name.to_owned(),
    };
    let open = || -> Result<NeuralModel, Refused> {
        NeuralModel::open(&library.read(&name)?, &config.models)
    };
    let model = open().map_err(|refused| format!("repair.model: {refused}"))?;
    let Needs { after, rate_hz, .. } = model.needs();
    if after > 0 {
        return Err(format!(
            "repair.model: `{name}` looks {:.1} s ahead, so it is for recordings only (`posefuse refuse --repair {name}`); \
             live, use another one",
            after as f64 / rate_hz
        ));
    }
    Ok(Some(model))
}
