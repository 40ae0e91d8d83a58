//! The ways of fusing that are compared: configurations of the engine with a name. None of them makes anything up where no
//! sensor sees a joint: what a repair adds is compared by itself.

use std::fmt;
use std::sync::Arc;

use posefuse_fusion::{Config, FuseMethod, OcclusionModel, RepairConfig};

/// A configuration with a name.
#[derive(Clone, Debug)]
pub struct Method {
    /// Short, unique in a comparison.
    pub name: String,
    /// What it is, in one line.
    pub about: String,
    /// The engine's settings.
    pub config: Config,
    /// Whether it knows only where the sensors stand, and not what else a calibration finds.
    pub poses_only: bool,
    /// Whether every frame is smoothed by what came after it, as takes are that are fused again: not for live use.
    pub smooth: bool,
    /// The method that this one is but for what it makes up, by name.
    pub repairs: Option<String>,
    /// The model beside the engine, where what is made up comes from one.
    pub model: Option<ModelBeside>,
}

/// A model beside the engine, which answers at once. Every run has its own.
#[derive(Clone)]
pub struct ModelBeside(Arc<dyn Fn() -> Box<dyn OcclusionModel> + Send + Sync>);

impl ModelBeside {
    /// The model that `make` makes.
    pub fn new(make: impl Fn() -> Box<dyn OcclusionModel> + Send + Sync + 'static) -> Self {
        Self(Arc::new(make))
    }

    /// A new one.
    pub(crate) fn make(&self) -> Box<dyn OcclusionModel> {
        (self.0)()
    }
}

impl fmt::Debug for ModelBeside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ModelBeside")
    }
}

impl Method {
    /// The same method, and what no sensor sees is made up by `repair` (a name as in `repair.model`): by the engine itself
    /// or by `model`.
    #[must_use]
    pub fn with_repair(&self, repair: &str, model: Option<ModelBeside>) -> Self {
        let mut config = self.config.clone();
        config.repair = RepairConfig {
            model: repair.to_owned(),
            ..RepairConfig::default()
        };
        Self {
            name: format!("{}+{repair}", self.name),
            about: format!("{}; hidden joints by `{repair}`", self.about),
            config,
            repairs: Some(self.name.clone()),
            model,
            ..self.clone()
        }
    }
}

/// The name of reference A: Menard's mean, left and right put right.
pub const REFERENCE: &str = "menard";

/// The names that [`preset`] knows, and what they are.
pub const PRESETS: [(&str, &str); 8] = [
    (
        "mean",
        "the mean of all joints of trusted confidence (Menard 2014), labelled as the sensors label them",
    ),
    (
        REFERENCE,
        "the same with left and right put right: reference A",
    ),
    (
        "weighted",
        "weighted by each sensor's noise, then bones and smoothing",
    ),
    ("kalman-0", "the filter, each frame at once"),
    ("kalman", "what ships"),
    ("kalman-1", "the filter, one frame of look-ahead"),
    (
        "offline",
        "the filter, each frame smoothed by all that came after it: takes that are fused again",
    ),
    ("kalman-3", "the filter, three frames of look-ahead"),
];

/// The method of this name; `None` if there is none.
pub fn preset(name: &str) -> Option<Method> {
    let (name, about) = PRESETS.iter().find(|(known, _)| *known == name)?;
    let mut config = Config {
        repair: RepairConfig::off(),
        ..Config::default()
    };
    match *name {
        "mean" | REFERENCE => {
            config.fuse.method = FuseMethod::Average;
            config.fuse.swaps = *name == REFERENCE;
            config.stages.clear();
        }
        "weighted" => {
            config.fuse.method = FuseMethod::Weighted;
            config
                .stages
                .iter_mut()
                .for_each(|stage| stage.set_enabled(true));
        }
        other => {
            config.fuse.method = FuseMethod::Kalman;
            let ahead = other.strip_prefix("kalman-").and_then(|n| n.parse().ok());
            if let Some(ahead) = ahead {
                config.fuse.look_ahead = ahead;
            }
            if ahead.is_some() || other == "offline" {
                // Waiting is the filter's alone.
                config
                    .stages
                    .iter_mut()
                    .filter(|stage| stage.look_ahead_frames() > 0)
                    .for_each(|stage| stage.set_enabled(false));
            }
        }
    }
    Some(Method {
        name: (*name).to_owned(),
        about: (*about).to_owned(),
        config,
        poses_only: matches!(*name, "mean" | REFERENCE),
        smooth: *name == "offline",
        repairs: None,
        model: None,
    })
}
