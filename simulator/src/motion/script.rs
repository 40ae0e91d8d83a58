//! Who does what when: the timed actions of each person over one round.

use serde::{Deserialize, Serialize};

use super::action::Action;
use super::route::Route;
use super::steps::Place;

/// An action of one person with its time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedAction {
    /// Seconds since the start of the round.
    pub start: f64,
    /// Seconds it lasts.
    pub duration: f64,
    /// What is done.
    pub action: Action,
}

/// What one person does, without gaps, over one round; then it begins again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Script {
    /// The actions in order of time.
    pub actions: Vec<TimedAction>,
}

impl Script {
    /// What is done at `time` seconds of the round, and since when.
    pub fn at(&self, time: f64) -> Option<&TimedAction> {
        let begun = self.actions.partition_point(|action| action.start <= time);
        begun.checked_sub(1).map(|last| &self.actions[last])
    }

    /// When it ends, seconds.
    pub fn end(&self) -> f64 {
        self.actions
            .last()
            .map_or(0.0, |last| last.start + last.duration)
    }
}

/// A script with the ways over the floor that belong to it.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) script: Script,
    /// Beside each action: the way, for the actions that have one.
    routes: Vec<Option<Route>>,
    /// When the person is out of the room, `(from, to)` seconds of the round, in order.
    pub(crate) absent: Vec<(f64, f64)>,
    home: Place,
    /// Where the person is when the last action ends.
    pub(crate) here: Place,
}

impl Plan {
    pub(crate) fn starting_at(home: Place) -> Self {
        Self {
            script: Script::default(),
            routes: Vec::new(),
            absent: Vec::new(),
            home,
            here: home,
        }
    }

    pub(crate) fn home(&self) -> Place {
        self.home
    }

    pub(crate) fn now(&self) -> f64 {
        self.script.end()
    }

    /// Adds an action on the spot.
    pub(crate) fn act(&mut self, action: Action, duration: f64) {
        self.push(action, duration, None);
    }

    /// Adds ways, one right after the other, and the moment it takes to bring the feet together after the last.
    pub(crate) fn go(&mut self, routes: Vec<Route>) {
        for route in routes {
            let action = match route {
                Route::Turn { .. } => Action::Turn,
                Route::Shuffle { .. } => Action::Shuffle,
                Route::Walk { .. } => Action::Walk,
            };
            self.here = route.end();
            self.push(action, route.duration(), Some(route));
        }
        self.act(Action::Stand, SETTLING);
    }

    /// Stands until `time`.
    pub(crate) fn wait_until(&mut self, time: f64) {
        let wait = time - self.now();
        if wait > 0.0 {
            self.act(Action::Stand, wait);
        }
    }

    fn push(&mut self, action: Action, duration: f64, route: Option<Route>) {
        self.script.actions.push(TimedAction {
            start: self.now(),
            duration,
            action,
        });
        self.routes.push(route);
    }

    /// Where the person stands and faces at `time`.
    pub(crate) fn place(&self, time: f64) -> Place {
        self.place_and_action(time).0
    }

    /// Where the middle of the body is at `time`.
    pub(crate) fn middle(&self, time: f64) -> nalgebra::Vector2<f64> {
        let (place, action) = self.place_and_action(time);
        place.shifted(action.reach_ahead(), 0.0).at
    }

    fn place_and_action(&self, time: f64) -> (Place, Action) {
        if time >= self.now() {
            return (self.here, Action::Stand);
        }
        let actions = &self.script.actions;
        let begun = actions.partition_point(|action| action.start <= time);
        let Some(current) = begun.checked_sub(1) else {
            return (self.home, Action::Stand);
        };
        if let Some(route) = &self.routes[current] {
            return (
                route.at(time - actions[current].start),
                actions[current].action,
            );
        }
        let before = self.routes[..current].iter().rev().flatten().next();
        (
            before.map_or(self.home, Route::end),
            actions[current].action,
        )
    }

    /// The intervals in which the person moves over the floor, seconds; at least [`SETTLING`] lies between them.
    pub(crate) fn moving(&self) -> Vec<(f64, f64)> {
        let mut intervals: Vec<(f64, f64)> = Vec::new();
        for (action, _) in self
            .script
            .actions
            .iter()
            .zip(&self.routes)
            .filter(|(_, route)| route.is_some())
        {
            let end = action.start + action.duration;
            match intervals.last_mut() {
                Some((_, last)) if action.start - *last < 1e-6 => *last = end,
                _ => intervals.push((action.start, end)),
            }
        }
        intervals
    }
}

/// Seconds a person stands after going somewhere; the feet need it to come together.
pub(crate) const SETTLING: f64 = 1.25;
