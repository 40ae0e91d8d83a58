//! An engine fed with recorded or simulated inputs, as fast as it goes.

use std::time::{Duration, Instant};

use posefuse_fusion::{Engine, Fill, Input, Output, RepairModel, RepairRequest};
use posefuse_skeleton::{JointMap, RoomFrame, Timestamp};

use crate::methods::{Method, ModelBeside};

/// Smoothing goes back over so many frames at a time, and no frame but the last ones is smoothed by less: 3 s at 30 Hz.
const SMOOTH_FRAMES: usize = 90;

/// What a model outside the engine says to a request; nothing where it fails.
pub(crate) type Answer<'a> = dyn FnMut(&RepairRequest) -> Vec<JointMap<Fill>> + 'a;

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
    watch: impl FnMut(&Engine, &Input),
    give: &mut dyn FnMut(RoomFrame),
) -> Duration {
    let Some(mut model) = method.model.as_ref().map(ModelBeside::make) else {
        return fuse_beside(method, None, &mut |_| Vec::new(), inputs, watch, give);
    };
    let offered = RepairModel {
        name: model.name().to_owned(),
        needs: model.needs(),
    };
    // A model that fails answers nothing, and the engine's own stands in for it.
    let mut answer = |request: &RepairRequest| {
        let fills = model.fill(&request.window, request.wanted.clone());
        fills.unwrap_or_default()
    };
    fuse_beside(method, Some(offered), &mut answer, inputs, watch, give)
}

/// Like [`fuse_watched`]; what the engine asks of the model `offered` is answered at once by `answer`.
pub(crate) fn fuse_beside(
    method: &Method,
    offered: Option<RepairModel>,
    answer: &mut Answer,
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
    if offered.is_some() {
        engine.handle(Input::RepairModel(offered));
    }
    let mut drain =
        |engine: &mut Engine, frames: &mut Vec<RoomFrame>| drain(engine, answer, frames);
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

/// Takes all outputs, and answers what is asked.
fn drain(
    engine: &mut Engine,
    answer: &mut Answer,
    frames: &mut Vec<RoomFrame>,
) -> Option<Timestamp> {
    loop {
        match engine.poll() {
            Output::Frame(frame) => frames.push(frame),
            Output::Rejected(_) => {}
            Output::Repair(request) => {
                let answered = request.answer(answer(&request));
                engine.handle(Input::Repaired(Box::new(answered)));
            }
            Output::WakeAt(deadline) => return deadline,
        }
    }
}
