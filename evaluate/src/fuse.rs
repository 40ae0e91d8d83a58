//! An engine fed with recorded or simulated inputs, as fast as it goes.

use std::time::{Duration, Instant};

use posefuse_fusion::{Engine, Input, OcclusionModel, Output, RepairModel};
use posefuse_skeleton::{RoomFrame, Timestamp};

use crate::methods::{Method, ModelBeside};

/// Smoothing goes back over so many frames at a time, and no frame but the last ones is smoothed by less: 3 s at 30 Hz.
const SMOOTH_FRAMES: usize = 90;

/// Lets a new engine have `inputs`, with ticks at its own deadlines between them; ticks among the inputs only tell the
/// time. `give` gets every frame, in order; of a method that smooths also those that wait for newer ones at the end.
/// Returns how long the engine worked.
pub fn fuse(
    method: &Method,
    inputs: impl IntoIterator<Item = (Timestamp, Input)>,
    give: &mut dyn FnMut(RoomFrame),
) -> Duration {
    let inputs = inputs.into_iter().map(|(time, input)| (time, Ok(input)));
    fuse_watched(method, inputs, |_, _| {}, give)
}

/// Like [`fuse`]; an input that is an `Err` is withheld from the engine, and `watch` sees every input just after the
/// engine had it or would have had it, with the engine.
pub(crate) fn fuse_watched(
    method: &Method,
    inputs: impl IntoIterator<Item = (Timestamp, Result<Input, Input>)>,
    mut watch: impl FnMut(&Engine, &Input),
    give: &mut dyn FnMut(RoomFrame),
) -> Duration {
    let mut busy = Duration::ZERO;
    let mut frames = Vec::new();
    let mut engine = Engine::new(method.config.clone());
    if method.smooth {
        engine.smooth_over(SMOOTH_FRAMES);
    }
    let mut model = method.model.as_ref().map(ModelBeside::make);
    if let Some(model) = &model {
        engine.handle(Input::RepairModel(Some(RepairModel {
            name: model.name().to_owned(),
            needs: model.needs(),
        })));
    }
    let mut drain = |engine: &mut Engine, frames: &mut Vec<RoomFrame>| {
        drain(engine, model.as_deref_mut(), frames)
    };
    let mut deadline = drain(&mut engine, &mut frames);
    for (time, input) in inputs {
        let (Ok(shown) | Err(shown)) = &input;
        let shown = shown.clone();
        let begun = Instant::now();
        let mut last = None;
        // A deadline that does not move on would never end.
        while let Some(due) = deadline.filter(|due| *due < time && last.is_none_or(|l| *due > l)) {
            engine.handle(Input::Tick(due));
            deadline = drain(&mut engine, &mut frames);
            last = Some(due);
        }
        if let Ok(input) = input
            && !matches!(input, Input::Tick(_))
        {
            engine.handle(input);
            deadline = drain(&mut engine, &mut frames);
        }
        busy += begun.elapsed();
        watch(&engine, &shown);
        frames.drain(..).for_each(&mut *give);
    }
    if method.smooth {
        let begun = Instant::now();
        engine.finish();
        drain(&mut engine, &mut frames);
        busy += begun.elapsed();
        frames.drain(..).for_each(give);
    }
    busy
}

/// Takes all outputs. A model beside the engine answers at once.
fn drain(
    engine: &mut Engine,
    mut model: Option<&mut (dyn OcclusionModel + 'static)>,
    frames: &mut Vec<RoomFrame>,
) -> Option<Timestamp> {
    loop {
        match engine.poll() {
            Output::Frame(frame) => frames.push(frame),
            Output::Rejected(_) => {}
            Output::Repair(request) => {
                let fills = model
                    .as_mut()
                    .map(|model| model.fill(&request.window, request.wanted.clone()));
                // A model that fails answers nothing, and the engine's own stands in for it.
                let fills = fills.and_then(Result::ok).unwrap_or_default();
                engine.handle(Input::Repaired(Box::new(request.answer(fills))));
            }
            Output::WakeAt(deadline) => return deadline,
        }
    }
}
