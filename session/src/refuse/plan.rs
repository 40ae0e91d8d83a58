//! What will be fused again: with which settings, from where.

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input, Output, RepairModel, parse_toml};
use posefuse_skeleton::Calibration;

use super::RefuseOptions;
use crate::{EngineState, Result, TakeError, TakeReader};

/// What will be fused, with what, from where.
pub(super) struct Plan {
    pub(super) config_toml: String,
    pub(super) calibration: Option<Calibration>,
    pub(super) other_calibration: bool,
    pub(super) own_ticks: bool,
    /// Recorded answers of a model beside the engine cannot be used.
    pub(super) own_answers: bool,
    /// The model beside the engine from now on, where the snapshot may know another.
    pub(super) model_beside_snapshot: Option<Option<RepairModel>>,
    pub(super) snapshot: Option<EngineState>,
    pub(super) preamble: Vec<Input>,
    /// Messages of `/inputs` before the first live one.
    pub(super) recorded_beginning: usize,
}

impl Plan {
    /// `model`: what could answer in place of the recording.
    pub(super) fn new(
        old: &TakeReader,
        options: &RefuseOptions,
        model: Option<RepairModel>,
    ) -> Result<(Self, Engine)> {
        let header = old.header();
        let wrong = |problem: String| TakeError::Config {
            name: header.name.clone(),
            problem,
        };
        let recorded = parse_toml::<Config>(&header.config_toml);
        let mut config = match (&options.config, &recorded) {
            (Some(config), _) => config.clone(),
            (None, Ok(recorded)) => recorded.clone(),
            (None, Err(error)) => {
                return Err(wrong(format!(
                    "{error}; this build does not know it, so give one"
                )));
            }
        };
        if let Some(name) = &options.repair {
            config.repair.model = name.clone();
        }
        let same_config = recorded.is_ok_and(|recorded| recorded == config);
        let config_toml = match same_config {
            true => header.config_toml.clone(),
            false => toml::to_string_pretty(&config).map_err(|error| wrong(error.to_string()))?,
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
        let own_ticks = !same_config || other_calibration || options.repair.is_some();
        let own_answers = own_ticks || options.smooth;
        let is_model = |input: &Input| matches!(input, Input::RepairModel(_));
        let tells = own_answers && (model.is_some() || preamble.iter().any(is_model));
        if own_answers {
            preamble.retain(|input| !is_model(input));
            preamble.extend(model.clone().map(|model| Input::RepairModel(Some(model))));
        }
        let model_beside_snapshot = (tells && restored.is_some()).then_some(model);
        let (engine, snapshot) = match restored {
            Some((engine, state)) => (engine, Some(state)),
            None => (cold(config, &preamble), None),
        };
        let plan = Self {
            config_toml,
            calibration,
            other_calibration,
            own_ticks,
            own_answers,
            model_beside_snapshot,
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
