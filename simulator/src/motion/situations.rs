//! The scripts of situations other than everyday.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector2;

use super::action::Action;
use super::choreography::{CLEARANCE_M, Stage};
use super::route::{Route, turn};
use super::script::SETTLING;
use super::steps::Place;
use super::{Cast, Situation};

/// Until when people face away, seconds of the round.
const AWAY_UNTIL_S: f64 = 20.0;
/// How far outside of the area a door is, metres.
const DOOR_M: f64 = 0.35;
/// Who leaves is out of sight this long before they stand behind the door, seconds.
const THROUGH_DOOR_S: f64 = 0.4;

impl Stage {
    /// Plans what `person` does next.
    pub(super) fn play(&mut self, cast: &Cast, person: usize) {
        let others = self.plans.len() - 1;
        match cast.situation {
            Situation::Crossing if others > 0 => self.cross(person),
            Situation::Hugging if others > 0 => self.embrace_somebody(person),
            Situation::Leaving => self.come_and_go(person, cast.away_s),
            Situation::Sitting => self.stay(person, Action::Sit, (15.0, 25.0)),
            Situation::Lying => self.stay(person, Action::Lie, Action::Lie.durations()),
            Situation::Turning => self.turn_about(person),
            Situation::Away if self.plans[person].now() < AWAY_UNTIL_S => self.face_away(person),
            _ => self.plan_on(person),
        }
    }

    /// Somebody other than `person`.
    fn partner(&mut self, person: usize) -> usize {
        (person + 1 + self.stream.below(self.plans.len() - 1)) % self.plans.len()
    }

    fn all_wait(&mut self) {
        let latest = self.plans.iter().map(|p| p.now()).fold(0.0, f64::max);
        self.plans.iter_mut().for_each(|p| p.wait_until(latest));
    }

    /// `person` and another exchange places, past each other on the right.
    fn cross(&mut self, person: usize) {
        let other = self.partner(person);
        self.all_wait();
        let places = [person, other].map(|who| self.plans[who].here);
        let middle = (places[0].at + places[1].at) * 0.5;
        let apart = self.stream.between(0.42, 0.6);
        let speed = self.stream.between(0.75, 1.05);
        for (who, (from, to)) in [
            (person, (places[0], places[1])),
            (other, (places[1], places[0])),
        ] {
            let way = to.at - from.at;
            let right = Vector2::new(way.y, -way.x).normalize();
            // A spline goes two thirds of the way out to its corner.
            let corner = middle + right * (0.75 * apart);
            let aim = corner - from.at;
            let mut routes: Vec<Route> = turn(from, aim.y.atan2(aim.x)).into_iter().collect();
            let facing = routes.last().map_or(from, Route::end);
            let walk = [1.0, 0.7, 0.5, 0.3]
                .into_iter()
                .find_map(|slower| Route::walk(facing, &[corner, to.at], slower * speed));
            let Some(walk) = walk else {
                return self.plan_on(person);
            };
            routes.push(walk);
            self.plans[who].go(routes);
        }
        if self.stream.chance(0.4) {
            self.do_something(person);
        }
        self.all_wait();
    }

    /// A real embrace, then something else.
    fn embrace_somebody(&mut self, person: usize) {
        let other = self.partner(person);
        let gap = self.stream.between(0.18, 0.26);
        if !self.hug(person, other, gap, 0.06) {
            self.plan_on(person);
        }
        for who in [person, other] {
            if self.stream.chance(0.5) {
                self.do_something(who);
            }
        }
    }

    /// Out by the person's door, away for a while, and back in.
    fn come_and_go(&mut self, person: usize, away_s: f64) {
        let angle = 0.5 * FRAC_PI_2 + FRAC_PI_2 * (1 + person) as f64;
        let door = Place {
            at: Vector2::new(angle.cos(), angle.sin()) * (self.half + 0.1 + DOOR_M),
            heading: angle,
        };
        if !(self.go_to(person, door, CLEARANCE_M) || self.go_round_to(person, door, CLEARANCE_M)) {
            return self.plan_on(person);
        }
        let away_s = away_s * self.stream.between(0.5, 1.0);
        let plan = &mut self.plans[person];
        let from = plan.now() - SETTLING - THROUGH_DOOR_S;
        plan.absent.push((from, from + away_s));
        let round = turn(plan.here, angle + PI).into_iter().collect();
        plan.go(round);
        plan.wait_until(from + away_s);
        if !self.walk_about(person) {
            self.plans[person].act(Action::Stand, 1.0);
        }
        if self.stream.chance(0.5) {
            self.do_something(person);
        }
    }

    /// A walk, then `action` for so many seconds.
    fn stay(&mut self, person: usize, action: Action, (shortest, longest): (f64, f64)) {
        if !self.walk_about(person) {
            self.plans[person].act(Action::Stand, 0.7);
        }
        let duration = self.stream.between(shortest, longest);
        self.plans[person].act(action, duration);
    }

    fn turn_about(&mut self, person: usize) {
        let by = self.stream.between(PI, 2.0 * TAU);
        let by = if self.stream.chance(0.5) { by } else { -by };
        let plan = &mut self.plans[person];
        plan.go(vec![Route::Turn {
            from: plan.here,
            by,
        }]);
        if self.stream.chance(0.3) {
            self.plan_on(person);
        }
    }

    /// Things done on the spot, and steps ahead and back.
    fn face_away(&mut self, person: usize) {
        if self.stream.chance(0.5) {
            return self.do_something(person);
        }
        let plan = &mut self.plans[person];
        for by in [0.5, -0.5] {
            plan.go(vec![Route::Shuffle {
                from: plan.here,
                by,
            }]);
        }
    }
}
