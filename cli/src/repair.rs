//! What fills in joints that no sensor saw when a recording is fused again: one of the engine's own models, or a network
//! beside it.

use posefuse_fusion::{RepairConfig, SimpleModel};
use posefuse_models::{Config, Kind, Library, ModelFile, NeuralModel, Refused, is_path};

/// The help of `--repair`.
pub(crate) const HELP: &str = "What fills in joints that no sensor saw: `auto`, `none`, a simple model (hold, damped, \
    gaussian, linear, gaussian-two-sided), a network's name (`posefuse doctor` lists them) or its manifest (path/NAME.toml)";

/// What was asked for, found.
pub(crate) struct Repair {
    /// As the engine's configuration calls it.
    pub(crate) name: String,
    /// The network beside the engine, if it is one.
    pub(crate) model: Option<NeuralModel>,
}

impl Repair {
    /// Finds and opens what `name` means; `kind` is what `auto` may be.
    ///
    /// # Errors
    /// There is no such model, or it cannot be used; with the remedy.
    pub(crate) fn find(name: &str, kind: Kind, config: &Config) -> Result<Self, Refused> {
        let library = Library::new(config);
        let Some(file) = file(name, kind, &library)? else {
            return Ok(Self {
                name: name.to_owned(),
                model: None,
            });
        };
        let called = match is_path(name) {
            true => &file.manifest.name,
            false => name,
        };
        Ok(Self {
            name: called.to_owned(),
            model: Some(NeuralModel::open(&file, config)?),
        })
    }
}

/// The network's files; `None`: it is none.
fn file(name: &str, kind: Kind, library: &Library) -> Result<Option<ModelFile>, Refused> {
    let name = match name {
        RepairConfig::NONE => return Ok(None),
        RepairConfig::AUTO => {
            let live = || library.default_model(Kind::Live);
            match library.default_model(kind).or_else(live) {
                Some(name) => name,
                None => return Ok(None),
            }
        }
        name if SimpleModel::named(name).is_some() => return Ok(None),
        name => name.to_owned(),
    };
    library.read(&name).map(Some)
}
