//! The engine and the take of a simulation: what a server's fusion thread and recorder do, without threads.

use std::sync::Arc;

use anyhow::Context;
use posefuse_fusion::{Config, Engine, Input, Output};
use posefuse_session::{Storage, TakeHeader, TakeInfo, TakeOptions, TakeWriter};
use posefuse_simulator::Scenario;
use posefuse_skeleton::{Calibration, TimecodeZone, Timestamp};

use super::error::Errors;
use crate::offline::now_rfc3339;

/// The take can be made again, so a crash may cost more of it.
const FLUSH_EVERY_NS: i64 = 10_000_000_000;

/// Feeds the engine and writes down everything.
pub(super) struct Recorder {
    engine: Engine,
    writer: TakeWriter,
    wake: Option<Timestamp>,
}

impl Recorder {
    /// Begins the take; the calibration is in force from the start.
    pub(super) fn new(
        storage: Arc<dyn Storage>,
        name: &str,
        config: Config,
        calibration: Calibration,
        scenario: &Scenario,
    ) -> anyhow::Result<Self> {
        let header = TakeHeader {
            name: name.to_owned(),
            slate: "simulated".to_owned(),
            notes: format!(
                "{}, seed {}",
                crate::output::sensors(scenario.sensors),
                scenario.seed
            ),
            started: now_rfc3339(),
            start: Some(Timestamp::ZERO),
            unix_offset_ns: i64::try_from(jiff::Timestamp::now().as_nanosecond()).unwrap_or(0),
            timecode: Some(TimecodeZone::default()),
            config_toml: toml::to_string_pretty(&config).context("the configuration")?,
            calibration: Some(calibration.clone()),
            build: posefuse_server::BUILD.to_owned(),
        };
        let preamble = [Input::Calibration(Arc::new(calibration))];
        let options = TakeOptions {
            flush_every_ns: FLUSH_EVERY_NS,
            ..TakeOptions::default()
        };
        let writer = TakeWriter::create_with(&storage, header, &preamble, None, options)?;
        let mut engine = Engine::new(config);
        for input in preamble {
            engine.handle(input);
        }
        Ok(Self {
            engine,
            writer,
            wake: None,
        })
    }

    /// Lets the engine have its deadlines up to `time`, then the input.
    pub(super) fn feed(
        &mut self,
        time: Timestamp,
        input: Input,
        errors: &mut Errors,
    ) -> anyhow::Result<()> {
        while let Some(wake) = self.wake.filter(|wake| *wake <= time) {
            self.handle(Input::Tick(wake), errors)?;
            // A deadline that does not move on would never end.
            if self.wake.is_some_and(|next| next <= wake) {
                break;
            }
        }
        self.handle(input, errors)?;
        let flushed = self.writer.flush(time)?;
        match flushed.ended {
            Some(why) => anyhow::bail!("the take ended by itself: {why}"),
            None => Ok(()),
        }
    }

    fn handle(&mut self, input: Input, errors: &mut Errors) -> anyhow::Result<()> {
        self.writer.input(&input)?;
        self.engine.handle(input);
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => {
                    self.writer.frame(&frame)?;
                    self.writer.truth(&errors.add(&frame))?;
                }
                Output::Rejected(rejection) => self.writer.rejection(&rejection)?,
                // Nobody offered a model.
                Output::Repair(_) => {}
                Output::WakeAt(wake) => {
                    self.wake = wake;
                    return Ok(());
                }
            }
        }
    }

    /// Ends the take.
    pub(super) fn finish(self) -> anyhow::Result<TakeInfo> {
        Ok(self.writer.finish()?)
    }
}
