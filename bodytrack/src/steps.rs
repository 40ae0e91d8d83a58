//! What an image costs, step by step.

use std::time::{Duration, Instant};

/// A step of the work on an image, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Thinning, the floor, surfaces before the background.
    Surfaces,
    /// Whose each surface is.
    People,
    /// Cutting people out for the network.
    Crops,
    /// Running it.
    Network,
    /// Taking in what it said, and looking at the hands.
    Hands,
    /// Learning the background.
    Learning,
}

impl Step {
    /// All of them, in order.
    pub const ALL: [Self; 6] = [
        Self::Surfaces,
        Self::People,
        Self::Crops,
        Self::Network,
        Self::Hands,
        Self::Learning,
    ];
}

/// How long each step of the last image took.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    last: Option<Instant>,
    took: [Duration; Step::ALL.len()],
}

impl Steps {
    /// How long it took.
    pub fn took(&self, step: Step) -> Duration {
        self.took[step as usize]
    }

    pub(crate) fn begin(&mut self) {
        self.took = [Duration::ZERO; Step::ALL.len()];
        self.last = Some(Instant::now());
    }

    pub(crate) fn end(&mut self, step: Step) {
        let now = Instant::now();
        let since = self.last.replace(now);
        self.took[step as usize] = since.map_or(Duration::ZERO, |since| now - since);
    }
}
