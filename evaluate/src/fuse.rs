//! An engine fed with recorded or simulated inputs, as fast as it goes.

use std::borrow::Borrow;
use std::time::{Duration, Instant};

use posefuse_fusion::{Config, Engine, Input, Output};
use posefuse_skeleton::{RoomFrame, Timestamp};

/// What came out of an engine.
#[derive(Clone, Debug, Default)]
pub struct Fused {
    /// The frames, in order.
    pub frames: Vec<RoomFrame>,
    /// How long the engine worked for them.
    pub busy: Duration,
}

/// Lets a new engine have `inputs`, with ticks at its own deadlines between them. Ticks among the inputs only tell
/// the time.
pub fn fuse<I: Borrow<Input>>(
    config: &Config,
    inputs: impl IntoIterator<Item = (Timestamp, I)>,
) -> Fused {
    fuse_watched(config, inputs, |_, _| {})
}

/// Like [`fuse`]; `watch` sees every input just before the engine does, with the engine.
pub(crate) fn fuse_watched<I: Borrow<Input>>(
    config: &Config,
    inputs: impl IntoIterator<Item = (Timestamp, I)>,
    mut watch: impl FnMut(&Engine, &Input),
) -> Fused {
    let mut fused = Fused::default();
    let mut engine = Engine::new(config.clone());
    let mut deadline = drain(&mut engine, &mut fused.frames);
    for (time, input) in inputs {
        watch(&engine, input.borrow());
        let input = input.borrow().clone();
        let begun = Instant::now();
        let mut last = None;
        // A deadline that does not move on would never end.
        while let Some(due) = deadline.filter(|due| *due < time && last.is_none_or(|l| *due > l)) {
            engine.handle(Input::Tick(due));
            deadline = drain(&mut engine, &mut fused.frames);
            last = Some(due);
        }
        if !matches!(input, Input::Tick(_)) {
            engine.handle(input);
            deadline = drain(&mut engine, &mut fused.frames);
        }
        fused.busy += begun.elapsed();
    }
    fused
}

fn drain(engine: &mut Engine, frames: &mut Vec<RoomFrame>) -> Option<Timestamp> {
    loop {
        match engine.poll() {
            Output::Frame(frame) => frames.push(frame),
            Output::Rejected(_) => {}
            Output::WakeAt(deadline) => return deadline,
        }
    }
}
