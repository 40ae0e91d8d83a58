//! What will be fused again: with which settings, from where.

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input, Output, parse_toml};
use posefuse_skeleton::Calibration;

use super::RefuseOptions;
use crate::{EngineState, Result, TakeError, TakeReader};

/// What will be fused, with what, from where.
pub(super) struct Plan {
    pub(super) config_toml: String,
    pub(super) calibration: Option<Calibration>,
    pub(super) other_calibration: bool,
    pub(super) own_ticks: bool,
    pub(super) snapshot: Option<EngineState>,
    pub(super) preamble: Vec<Input>,
    /// Messages of `/inputs` before the first live one.
    pub(super) recorded_beginning: usize,
}

impl Plan {
    pub(super) fn new(old: &TakeReader, options: &RefuseOptions) -> Result<(Self, Engine)> {
        let header = old.header();
        let wrong = |problem: String| TakeError::Config {
            name: header.name.clone(),
            problem,
        };
        let recorded = parse_toml::<Config>(&header.config_toml);
        let same_config = match (&options.config, &recorded) {
            (Some(config), Ok(recorded)) => config == recorded,
            (Some(_), Err(_)) => false,
            (None, _) => true,
        };
        let (config, config_toml) = match &options.config {
            Some(config) if !same_config => {
                let text =
                    toml::to_string_pretty(config).map_err(|error| wrong(error.to_string()))?;
                (config.clone(), text)
            }
            _ => {
                let config = recorded.map_err(|error| {
                    wrong(format!("{error}; this build does not know it, so give one"))
                })?;
                (config, header.config_toml.clone())
            }
        };
        config
            .validate()
            .map_err(|error| wrong(error.to_string()))?;
        let (state, mut preamble) = old.beginning()?;
        let exact = preamble.iter().rev().find_map(|input| match input {
            Input::Calibration(calibration) => Some((**calibration).clone()),
            _ => None,
        });
        // Either may be given back: what the engine had, or what the attachment holds of it.
        let recorded_calibrations = [&exact, &header.calibration];
        let other_calibration =
            options.calibration.is_some() && !recorded_calibrations.contains(&&options.calibration);
        let recorded_beginning = preamble.len() + usize::from(state.is_some());
        let usable =
            |state: &EngineState| same_config && !other_calibration && state.build == options.build;
        let restored = state
            .filter(usable)
            .and_then(|state| Some((Engine::restore(config.clone(), &state.state).ok()?, state)));
        let calibration = match &options.calibration {
            Some(calibration) if other_calibration => {
                preamble.retain(|input| !matches!(input, Input::Calibration(_)));
                preamble.push(Input::Calibration(Arc::new(calibration.clone())));
                Some(calibration.clone())
            }
            _ => exact.or_else(|| header.calibration.clone()),
        };
        let (engine, snapshot) = match restored {
            Some((engine, state)) => (engine, Some(state)),
            None => (cold(config, &preamble), None),
        };
        let plan = Self {
            config_toml,
            calibration,
            other_calibration,
            own_ticks: !same_config || other_calibration,
            snapshot,
            preamble,
            recorded_beginning,
        };
        Ok((plan, engine))
    }
}

fn cold(config: Config, preamble: &[Input]) -> Engine {
    let mut engine = Engine::new(config);
    for input in preamble {
        engine.handle(input.clone());
        while !matches!(engine.poll(), Output::WakeAt(_)) {}
    }
    engine
}
