//! Methods with repair: the engine's own models and networks, by name.

use posefuse_evaluate::{Method, ModelBeside};
use posefuse_fusion::{RepairConfig, SimpleModel};
use posefuse_models::{Config, Kind};

use crate::failure::usage;
use crate::output;
use crate::repair::Repair;

/// `methods`, and each of them with each of `repairs`.
///
/// # Errors
/// There is no such model, or it cannot be used.
pub(super) fn with_repairs(
    methods: Vec<Method>,
    repairs: &[String],
) -> anyhow::Result<Vec<Method>> {
    let mut all = Vec::new();
    for method in methods {
        let names = repairs.iter().filter(|name| *name != RepairConfig::NONE);
        let repaired: anyhow::Result<Vec<Method>> =
            names.map(|name| repaired_by(&method, name)).collect();
        all.push(method);
        all.extend(repaired?);
    }
    Ok(all)
}

fn repaired_by(method: &Method, name: &str) -> anyhow::Result<Method> {
    let kind = match method.smooth {
        true => Kind::Offline,
        false => Kind::Live,
    };
    // Refused here and now rather than while methods are compared.
    let found = Repair::find(name, kind, &Config::default())
        .map_err(|refused| usage(format!("--repair: {refused}")))?;
    let model = found.model.map(|_| beside(name.to_owned(), kind));
    Ok(method.with_repair(&found.name, model))
}

/// The network beside the engine, opened anew for each run.
fn beside(name: String, kind: Kind) -> ModelBeside {
    ModelBeside::new(move || {
        match Repair::find(&name, kind, &Config::default()).map(|found| found.model) {
            Ok(Some(model)) => Box::new(model),
            other => {
                let problem = other
                    .err()
                    .map_or_else(String::new, |error| error.to_string());
                output::warn(&format!("`{name}`: {problem}; `hold` stands in for it"));
                Box::new(SimpleModel::Hold)
            }
        }
    })
}
