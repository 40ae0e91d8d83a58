//! Fusing a take again: with other settings to improve it, or with the same ones to show that nothing is lost.
//!
//! With the recorded configuration and calibration the recorded ticks are replayed as they are. With others the
//! engine asks for its own: ticks are made wherever its deadline lies before the next input. The same with what a model
//! beside the engine made up: recorded answers are replayed, or another model answers, at once.

mod compare;
mod plan;

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input, OcclusionModel, Output, RepairModel, RepairRequest};
use posefuse_skeleton::{Calibration, Timestamp};

use compare::Comparison;
use plan::Plan;

use crate::storage::Storage;
use crate::writer::TakeOptions;
use crate::{
    Catalogue, Event, Recorded, Result, TakeError, TakeHeader, TakeInfo, TakeReader, TakeWriter,
    Topic,
};

/// Between two flushes of the new take, nanoseconds of take time: it can be made again, so a crash may cost more.
const FLUSH_EVERY_NS: i64 = 30_000_000_000;
/// Inputs between two reports of progress.
const PROGRESS_EVERY: u64 = 512;
/// Smoothing goes back over so many frames at a time, and no frame is smoothed by less: 3 s at 30 Hz.
const SMOOTH_FRAMES: usize = 90;

/// How to fuse again.
#[derive(Clone, Debug, Default)]
pub struct RefuseOptions {
    /// Another configuration than the recorded one.
    pub config: Option<Config>,
    /// Another calibration, in place of every recorded one.
    pub calibration: Option<Calibration>,
    /// What fills in joints that no sensor saw, as in `repair.model`; recorded answers are not used.
    pub repair: Option<String>,
    /// This build; the take's snapshot is used only if the same build made it.
    pub build: String,
    /// Every frame is smoothed by what came after it, as far as the filter of `kalman` reaches; other methods have
    /// nothing to smooth with.
    pub smooth: bool,
    /// The new take's name; default: the old one's with `-refused`, numbered if that exists.
    pub name: Option<String>,
}

/// How far fusing again has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefuseProgress {
    /// Inputs done.
    pub done: u64,
    /// Inputs there are.
    pub total: u64,
}

/// What fusing again gave.
#[derive(Clone, Debug, PartialEq)]
pub struct RefuseReport {
    /// The new take.
    pub take: TakeInfo,
    /// Live inputs that were fused.
    pub inputs: u64,
    /// Frames the old take holds.
    pub recorded_frames: u64,
    /// Frames there are now.
    pub frames: u64,
    /// Every recorded frame came again, in order and byte for byte, and no other came but those that the recording
    /// lacks: from the last input of a take that was cut off, and those counted in `lacking`.
    pub identical: bool,
    /// Frames that came now and that were dropped when the old take was recorded.
    pub lacking: u64,
    /// The first frame that differs.
    pub first_difference: Option<FrameDifference>,
    /// It went on from the recorded snapshot; else it began cold.
    pub from_snapshot: bool,
}

/// The first frame that is not the recorded one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameDifference {
    /// How many frames before it were the same.
    pub after: u64,
    /// Time and number of the recorded frame there, if there is one.
    pub recorded: Option<(Timestamp, u64)>,
    /// Time and number of the new frame there, if there is one.
    pub found: Option<(Timestamp, u64)>,
}

/// Fuses the take `name` again, into a new take. Where the recorded answers of a model beside the engine cannot be used,
/// the engine's own simple models fill in.
pub fn refuse(
    storage: &Arc<dyn Storage>,
    name: &str,
    options: &RefuseOptions,
    progress: &mut dyn FnMut(RefuseProgress),
) -> Result<RefuseReport> {
    refuse_with(storage, name, options, None, progress)
}

/// The same with a model beside the engine. It is asked wherever the recorded answers cannot be used: with another
/// configuration, calibration or repair, and when smoothing. It answers at once, so none of its answers is late.
pub fn refuse_with(
    storage: &Arc<dyn Storage>,
    name: &str,
    options: &RefuseOptions,
    model: Option<&mut dyn OcclusionModel>,
    progress: &mut dyn FnMut(RefuseProgress),
) -> Result<RefuseReport> {
    let old = TakeReader::open(&**storage, name)?;
    let offered = model.as_ref().map(|model| RepairModel {
        name: model.name().to_owned(),
        needs: model.needs(),
    });
    let (plan, mut engine) = Plan::new(&old, options, offered)?;
    if options.smooth {
        engine.smooth_over(SMOOTH_FRAMES);
    }
    let new_name = match &options.name {
        Some(name) => name.clone(),
        None => Catalogue::unused_name(&**storage, &format!("{name}-refused"))?,
    };
    let header = TakeHeader {
        name: new_name,
        config_toml: plan.config_toml.clone(),
        calibration: plan.calibration.clone(),
        build: options.build.clone(),
        ..old.header().clone()
    };
    let writer_options = TakeOptions {
        flush_every_ns: FLUSH_EVERY_NS,
        ..TakeOptions::default()
    };
    let snapshot = plan.snapshot.as_ref();
    let not_made = {
        let name = header.name.clone();
        |error| match error {
            TakeError::Ended(trouble) => TakeError::NotMade { name, trouble },
            error => error,
        }
    };
    let writer = TakeWriter::draft(storage, header, &plan.preamble, snapshot, writer_options)?;
    // With other settings other frames are expected, and none is missed.
    let may_lack = match plan.own_ticks || options.smooth {
        true => 0,
        false => old.info().dropped_outputs,
    };
    let run = Run {
        engine,
        writer,
        comparison: Comparison::with(old.entries(&[Topic::Frames], None), may_lack),
        smooth: options.smooth,
        model: model.filter(|_| plan.own_answers),
        inputs: 0,
    };
    run.all(&old, &plan, progress).map_err(not_made)
}

struct Run<'a> {
    engine: Engine,
    writer: TakeWriter,
    comparison: Comparison,
    smooth: bool,
    /// Answers the engine's requests.
    model: Option<&'a mut dyn OcclusionModel>,
    inputs: u64,
}

impl Run<'_> {
    fn all(
        mut self,
        old: &TakeReader,
        plan: &Plan,
        progress: &mut dyn FnMut(RefuseProgress),
    ) -> Result<RefuseReport> {
        // A snapshot may hold frames that had not been taken yet.
        self.drain()?;
        if let Some(model) = &plan.model_beside_snapshot {
            self.input(Input::RepairModel(model.clone()))?;
        }
        let total = old.count(Topic::Inputs);
        let mut skip = plan.recorded_beginning;
        for entry in old.entries(&[Topic::Inputs, Topic::Events, Topic::Truth], None) {
            match entry?.decode()? {
                Recorded::Input(_) | Recorded::State(_) if skip > 0 => skip -= 1,
                Recorded::Input(Input::Calibration(_)) if plan.other_calibration => {}
                // With other frames the engine asks other things.
                Recorded::Input(Input::RepairModel(_) | Input::Repaired(_)) if plan.own_answers => {
                }
                Recorded::Input(input) if plan.own_ticks => self.input_with_own_ticks(input)?,
                Recorded::Input(input) => self.input(input)?,
                // The new take has all of its outputs.
                Recorded::Event(event) if event.kind == Event::OUTPUTS_DROPPED => {}
                Recorded::Event(event) => self.writer.event(&event)?,
                Recorded::Truth(truth) => self.writer.truth(&truth)?,
                _ => {}
            }
            if self.inputs.is_multiple_of(PROGRESS_EVERY) {
                let done = self.inputs.min(total);
                progress(RefuseProgress { done, total });
            }
        }
        progress(RefuseProgress { done: total, total });
        if self.smooth {
            self.engine.finish();
            self.drain()?;
        }
        // What the old take's events do not tell of.
        let told = self.writer.info().dropped;
        self.writer.dropped(old.info().dropped.saturating_sub(told));
        self.finish(plan.snapshot.is_some())
    }

    fn input(&mut self, input: Input) -> Result<()> {
        self.writer.input(&input)?;
        self.inputs += 1;
        let time = input.time();
        self.engine.handle(input);
        self.drain()?;
        if let Some(time) = time {
            self.writer.flush(time)?;
            self.writer.check_going_on()?;
        }
        Ok(())
    }

    /// Before the input, lets the engine have the ticks that it asks for; recorded ticks only tell the time.
    fn input_with_own_ticks(&mut self, input: Input) -> Result<()> {
        if let Some(now) = input.time() {
            let mut last = None;
            while let Output::WakeAt(Some(wake)) = self.engine.poll() {
                // A deadline that does not move on would never end.
                if wake > now || last.is_some_and(|last| wake <= last) {
                    break;
                }
                last = Some(wake);
                self.input(Input::Tick(wake))?;
            }
        }
        match input {
            Input::Tick(_) => Ok(()),
            input => self.input(input),
        }
    }

    fn drain(&mut self) -> Result<()> {
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => {
                    self.writer.frame(&frame)?;
                    self.comparison.frame(&frame, self.inputs)?;
                }
                Output::Rejected(rejection) => self.writer.rejection(&rejection)?,
                Output::Repair(request) => self.answer(&request)?,
                Output::WakeAt(_) => return Ok(()),
            }
        }
    }

    /// Recorded answers come by themselves; a model that fails leaves the frame to the engine's own.
    fn answer(&mut self, request: &RepairRequest) -> Result<()> {
        let Some(model) = &mut self.model else {
            return Ok(());
        };
        let fills = model.fill(&request.window, request.wanted.clone());
        let answer = Input::Repaired(Box::new(request.answer(fills.unwrap_or_default())));
        self.writer.input(&answer)?;
        self.inputs += 1;
        self.engine.handle(answer);
        Ok(())
    }

    fn finish(self, from_snapshot: bool) -> Result<RefuseReport> {
        let compared = self.comparison.finish(self.inputs)?;
        Ok(RefuseReport {
            take: self.writer.publish()?,
            inputs: self.inputs,
            recorded_frames: compared.recorded_frames,
            frames: compared.frames,
            identical: compared.first_difference.is_none(),
            lacking: compared.lacking,
            first_difference: compared.first_difference,
            from_snapshot,
        })
    }
}
