//! Makes the scripts of several people together: they walk about one area, cross, meet, and keep off each other.
//!
//! People are planned piece by piece in order of time. Whoever is planned next sees what the others have planned
//! so far and takes them to stand still after that; each of them, when planned on, sees this one's piece in turn.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;

use super::Cast;
use super::action::Action;
use super::route::{Route, turn, ways};
use super::script::Plan;
use super::steps::Place;
use crate::random::{Purpose, Stream};

/// How close two bodies' middles may come on their ways, metres. A hug is the exception.
pub(crate) const CLEARANCE_M: f64 = 0.62;

/// Distance between the pelvises of two people who hug, metres.
const HUG_GAP_M: f64 = 0.36;

/// Distance from which they step up to each other, metres.
const MEETING_GAP_M: f64 = 1.0;

/// The plans of the cast over one round of roughly `seconds`, inside a square around the origin. All plans end at the
/// same time, each where it began.
pub(crate) fn choreograph(cast: &Cast, seconds: f64) -> Vec<Plan> {
    let people = cast.people;
    let mut stream = Stream::new(cast.seed, Purpose::Script, &[people as u64]);
    let turn = stream.between(0.0, TAU);
    let radius = if people == 1 { 0.2 } else { 0.36 } * cast.area_m;
    let home = |person: usize| {
        let angle = turn + TAU * person as f64 / people as f64;
        let inwards = angle + PI;
        Place {
            at: Vector2::new(angle.cos(), angle.sin()) * radius,
            heading: cast.situation.first_heading().unwrap_or(inwards),
        }
    };
    let mut stage = Stage {
        plans: (0..people)
            .map(|person| Plan::starting_at(home(person)))
            .collect(),
        decks: vec![Vec::new(); people],
        half: 0.5 * cast.area_m - 0.1,
        hugs: cast.hugs && people > 1,
        since_hug: 0.0,
        stream,
    };
    for plan in &mut stage.plans {
        plan.act(Action::Stand, 1.0);
    }
    while let Some(person) = stage.next_before(seconds - 12.0) {
        stage.play(cast, person);
    }
    stage.all_go_home();
    stage.plans
}

/// The plans in the making.
pub(super) struct Stage {
    pub(super) plans: Vec<Plan>,
    decks: Vec<Vec<Action>>,
    pub(super) half: f64,
    hugs: bool,
    since_hug: f64,
    pub(super) stream: Stream,
}

impl Stage {
    /// Whose plan ends first, if it ends before `time`.
    fn next_before(&self, time: f64) -> Option<usize> {
        (0..self.plans.len())
            .min_by(|&a, &b| self.plans[a].now().total_cmp(&self.plans[b].now()))
            .filter(|&first| self.plans[first].now() < time)
    }

    pub(super) fn plan_on(&mut self, person: usize) {
        let now = self.plans[person].now();
        if self.hugs && now - self.since_hug > 35.0 {
            self.since_hug = now;
            let other = (person + 1 + self.stream.below(self.plans.len() - 1)) % self.plans.len();
            if self.hug(person, other, HUG_GAP_M, 0.0) {
                return;
            }
        }
        if !self.walk_about(person) {
            self.plans[person].act(Action::Stand, 0.7);
        }
        if self.stream.chance(0.85) {
            self.do_something(person);
        }
    }

    /// The next action of the person's deck, which is shuffled anew when it is empty: everything comes up.
    pub(super) fn do_something(&mut self, person: usize) {
        if self.decks[person].is_empty() {
            let mut deck = Action::ON_THE_SPOT.to_vec();
            for last in (1..deck.len()).rev() {
                deck.swap(last, self.stream.below(last + 1));
            }
            self.decks[person] = deck;
        }
        let Some(action) = self.decks[person].pop() else {
            return;
        };
        let (shortest, longest) = action.durations();
        let duration = self.stream.between(shortest, longest);
        let plan = &self.plans[person];
        let middle = plan.here.shifted(action.reach_ahead(), 0.0).at;
        let at = |_: f64| middle;
        if self.clearance(person, &[], plan.now(), duration, &at) >= CLEARANCE_M {
            self.plans[person].act(action, duration);
        } else {
            self.decks[person].insert(0, action);
        }
    }

    /// A walk by a few random corners; half of the time the one that passes closest to somebody.
    pub(super) fn walk_about(&mut self, person: usize) -> bool {
        let (here, now) = (self.plans[person].here, self.plans[person].now());
        let mut found: Vec<(f64, Vec<Route>)> = Vec::new();
        for _ in 0..120 {
            let corners: Vec<Vector2<f64>> = (0..2 + self.stream.below(4))
                .map(|_| self.somewhere())
                .collect();
            let speed = self.stream.between(0.65, 1.0);
            if let Some(routes) = ways(here, &corners, speed) {
                let clearance = self.clearance_of(person, &[], now, &routes);
                if clearance >= CLEARANCE_M {
                    found.push((clearance, routes));
                }
            }
            if found.len() == 8 {
                break;
            }
        }
        if self.stream.chance(0.5) {
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let Some((_, routes)) = found.into_iter().next() else {
            return false;
        };
        self.plans[person].go(routes);
        true
    }

    fn somewhere(&mut self) -> Vector2<f64> {
        let half = self.half;
        Vector2::new(
            self.stream.between(-half, half),
            self.stream.between(-half, half),
        )
    }

    /// The two walk up to each other, hug with `gap` metres between their pelvises, each `aside` metres to their left
    /// of the line between them, and step back.
    pub(super) fn hug(&mut self, a: usize, b: usize, gap: f64, aside: f64) -> bool {
        for _ in 0..30 {
            let centre = self.somewhere() * 0.55;
            let axis = self.stream.between(0.0, TAU);
            let towards = |heading: f64| {
                Place {
                    at: centre,
                    heading,
                }
                .shifted(-0.5 * MEETING_GAP_M, aside)
            };
            let before = [self.plans[a].clone(), self.plans[b].clone()];
            let start = before[0].now().max(before[1].now());
            if self.go_to(a, towards(axis), CLEARANCE_M)
                && self.go_to(b, towards(axis + PI), CLEARANCE_M)
            {
                let meet = self.plans[a].now().max(self.plans[b].now()).max(start);
                let (shortest, longest) = Action::Hug(0).durations();
                let duration = self.stream.between(shortest, longest);
                if self.clearance(a, &[b], meet, duration + 7.0, &|_| centre) >= 1.1 {
                    self.embrace([(a, b), (b, a)], gap, meet, duration);
                    return true;
                }
            }
            [self.plans[a], self.plans[b]] = before;
        }
        false
    }

    fn embrace(&mut self, pairs: [(usize, usize); 2], gap: f64, meet: f64, duration: f64) {
        let step = 0.5 * (MEETING_GAP_M - gap);
        for (person, other) in pairs {
            let plan = &mut self.plans[person];
            plan.wait_until(meet);
            plan.go(vec![Route::Shuffle {
                from: plan.here,
                by: step,
            }]);
            plan.act(Action::Hug(other), duration);
            plan.go(vec![Route::Shuffle {
                from: plan.here,
                by: -step,
            }]);
        }
    }

    /// Straight to `goal`, in its heading at the end, if nobody comes closer than `clearance`.
    pub(super) fn go_to(&mut self, person: usize, goal: Place, clearance: f64) -> bool {
        self.go_by(person, &[goal.at], goal.heading, clearance)
    }

    /// The same by one random detour after another.
    pub(super) fn go_round_to(&mut self, person: usize, goal: Place, clearance: f64) -> bool {
        (0..25).any(|_| {
            let corners = [self.somewhere(), goal.at];
            self.go_by(person, &corners, goal.heading, clearance)
        })
    }

    fn go_by(
        &mut self,
        person: usize,
        corners: &[Vector2<f64>],
        heading: f64,
        clearance: f64,
    ) -> bool {
        let mut from = self.plans[person].here;
        let mut routes = Vec::new();
        for corner in corners {
            let way = corner - from.at;
            if way.norm() > 1e-3 {
                routes.extend(turn(from, way.y.atan2(way.x)));
                let facing = routes.last().map_or(from, Route::end);
                let Some(walk) = Route::walk(facing, &[*corner], 0.85) else {
                    return false;
                };
                from = walk.end();
                routes.push(walk);
            }
        }
        routes.extend(turn(from, heading));
        let now = self.plans[person].now();
        let free = self.clearance_of(person, &[], now, &routes) >= clearance;
        if free {
            self.plans[person].go(routes);
        }
        free
    }

    /// Everybody goes back to where they began; who is in the way is waited for or moved on.
    fn all_go_home(&mut self) {
        const PATIENCE: usize = 16;
        for round in 0..=PATIENCE {
            // People squeeze past each other in the end; in the last round nobody minds anybody.
            let clearance = match round {
                0..10 => CLEARANCE_M,
                PATIENCE => 0.0,
                _ => 0.75 * CLEARANCE_M,
            };
            let mut away = 0;
            for person in 0..self.plans.len() {
                let home = self.plans[person].home();
                let here = self.plans[person].here;
                let there = home.at == here.at && turn(here, home.heading).is_none();
                if there
                    || self.go_to(person, home, clearance)
                    || self.go_round_to(person, home, clearance)
                {
                    continue;
                }
                away += 1;
                if round % 2 == 0 || !self.walk_about(person) {
                    self.plans[person].act(Action::Stand, 1.4);
                }
            }
            if away == 0 {
                break;
            }
        }
        // A whole number of samples, so that the round closes.
        let end = self.plans.iter().map(Plan::now).fold(0.0, f64::max) + 1.0;
        let end = (end / super::person::STEP_S).ceil() * super::person::STEP_S;
        self.plans.iter_mut().for_each(|plan| plan.wait_until(end));
    }

    fn clearance_of(&self, person: usize, exempt: &[usize], start: f64, routes: &[Route]) -> f64 {
        let mut closest = f64::INFINITY;
        let mut time = start;
        for route in routes {
            if closest < CLEARANCE_M * 0.5 {
                return closest;
            }
            let duration = route.duration();
            let at = |after: f64| route.at(after.min(route.duration())).at;
            closest = closest.min(self.clearance(person, exempt, time, duration, &at));
            time += duration;
        }
        // Where it ends is where the person will be for a while.
        let end = routes.last().map_or(self.plans[person].here, Route::end).at;
        closest.min(self.clearance(person, exempt, time, 30.0, &|_| end))
    }

    /// The least distance between somebody at `at(seconds since start)` and anybody else.
    fn clearance(
        &self,
        person: usize,
        exempt: &[usize],
        start: f64,
        duration: f64,
        at: &dyn Fn(f64) -> Vector2<f64>,
    ) -> f64 {
        // Closer than this is refused everywhere, so that nobody needs to know how much closer.
        let enough_said = 0.5 * CLEARANCE_M;
        let mut closest = f64::INFINITY;
        let others = self.plans.iter().enumerate();
        for (_, plan) in others.filter(|(i, _)| *i != person && !exempt.contains(i)) {
            // Nobody moves after the end of their plan, so that one look is enough there.
            let last = duration.min((plan.now() - start).max(0.0));
            let mut after = 0.0;
            while after < last && closest > enough_said {
                closest = closest.min((at(after) - plan.middle(start + after)).norm());
                after += 0.15;
            }
            let mut after = last;
            while after <= duration && closest > enough_said {
                closest = closest.min((at(after) - plan.here.at).norm());
                after += 0.3;
            }
        }
        closest
    }
}
