//! The engine's whole state as bytes, and the inputs a cold engine needs.

use posefuse_skeleton::Timestamp;
use thiserror::Error;

use crate::engine::State;
use crate::{ClockSample, Config, Engine, Input};

/// Which code this engine is: the version, and a fingerprint of the sources of the engine, the vocabulary and the
/// filters. Only the same code goes on from a snapshot to the same bytes.
pub const BUILD: &str = env!("POSEFUSE_FUSION_BUILD");

/// First bytes of a snapshot; the number goes up when its layout changes.
const MAGIC: &[u8; 8] = b"PFENG\x004\n";

/// Why a snapshot could not be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// Not a snapshot of this version of the engine.
    #[error(
        "these {0} bytes are no engine snapshot of this version; fuse from the take's beginning instead"
    )]
    Foreign(usize),
    /// Made by other code, whose engine may go on otherwise.
    #[error(
        "the snapshot was made by `{0}`, this is `{BUILD}`; fuse from the take's beginning instead"
    )]
    OtherBuild(String),
    /// Made by an engine with other settings.
    #[error(
        "the snapshot was made with another configuration; restore it with that one, or begin cold with the preamble"
    )]
    OtherConfig,
    /// The content contradicts itself.
    #[error("the engine snapshot is damaged: {0}; fuse from the take's beginning instead")]
    Damaged(#[from] postcard::Error),
    /// The configuration could not be noted down.
    #[error("the configuration cannot be written as TOML: {0}")]
    Config(#[from] toml::ser::Error),
}

impl Engine {
    /// Everything it remembers, bit by bit, outputs not yet polled included.
    ///
    /// # Errors
    /// [`SnapshotError::Config`] for a configuration with numbers TOML does not have.
    pub fn state(&self) -> Result<Vec<u8>, SnapshotError> {
        let config = toml::to_string(&self.config)?;
        let bytes = postcard::to_extend(BUILD, MAGIC.to_vec())?;
        let bytes = postcard::to_extend(&config, bytes)?;
        Ok(postcard::to_extend(&self.state, bytes)?)
    }

    /// An engine that goes on exactly where the one that gave `bytes` was.
    ///
    /// # Errors
    /// [`SnapshotError`] unless `bytes` come from an engine of this version with the same `config`.
    pub fn restore(config: Config, bytes: &[u8]) -> Result<Self, SnapshotError> {
        let content = bytes
            .strip_prefix(MAGIC)
            .ok_or(SnapshotError::Foreign(bytes.len()))?;
        let (made_by, content): (String, _) = postcard::take_from_bytes(content)?;
        if made_by != BUILD {
            return Err(SnapshotError::OtherBuild(made_by));
        }
        let (made_with, content): (String, _) = postcard::take_from_bytes(content)?;
        if made_with != toml::to_string(&config)? {
            return Err(SnapshotError::OtherConfig);
        }
        let state: State = postcard::from_bytes(content)?;
        Ok(Self::from_state(config, state))
    }

    /// Inputs that give a cold engine what this one knows of the room, but not of the people: every sensor, the
    /// calibration in force, the model outside that fills in what is missing, and the clock probes still remembered (at most 128 per sensor), in order of time.
    pub fn preamble(&self) -> Vec<Input> {
        let known = || self.state.sensors.iter().flatten();
        let mut inputs: Vec<Input> = known()
            .map(|sensor| Input::Sensor(sensor.info.clone()))
            .collect();
        inputs.extend(self.state.calibration.clone().map(Input::Calibration));
        inputs.extend(
            known()
                .filter(|sensor| sensor.muted)
                .map(|sensor| Input::Mute {
                    sensor: sensor.info.id,
                    muted: true,
                }),
        );
        inputs.extend(
            (self.state.repair.outside().cloned()).map(|model| Input::RepairModel(Some(model))),
        );
        let mut probes: Vec<ClockSample> = known()
            .flat_map(|sensor| sensor.clock.samples().copied())
            .collect();
        probes.sort_by_key(|sample: &ClockSample| -> (Timestamp, u8) {
            (sample.returned, sample.sensor.into())
        });
        inputs.extend(probes.into_iter().map(Input::ClockSample));
        inputs
    }
}
