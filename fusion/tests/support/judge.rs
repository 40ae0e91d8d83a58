//! Who is who: what a run made of people, left and right, and ghosts, against the truth.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_evaluate::compare;
use posefuse_fusion::{Config, Engine, Input, RejectionReason};
use posefuse_simulator::{BodyTruth, Scenario, World};
use posefuse_skeleton::{
    Calibration, Observation, RoomFrame, SensorId, Timestamp, TrackId, Transform,
};

use super::{Dice, Outcome, drain, inputs_and_truth, scenario_seconds};

/// A person is to be followed when a sensor has held them for this long, and for so long after it lost them.
const SETTLED_S: f64 = 0.4;
const HELD_S: f64 = 0.2;
/// A track that follows nobody for so many frames is a ghost.
const GHOST_FRAMES: usize = 5;

/// What a run made of people.
#[derive(Clone, Debug, Default)]
pub(crate) struct Verdict {
    pub(crate) seconds: f64,
    /// Person-frames in which a sensor held the person, and those without a track.
    pub(crate) person_frames: usize,
    pub(crate) missed: usize,
    /// Track-frames of nobody who is there.
    pub(crate) extra: usize,
    /// How often the id of somebody who was not away changed.
    pub(crate) switches: usize,
    /// How often somebody came back within 2 s of leaving, and kept the id.
    pub(crate) returns: usize,
    pub(crate) kept: usize,
    /// Distinct tracks that followed nobody.
    pub(crate) ghosts: usize,
    /// Sensor-frames of people, and those in which arms, legs were taken rightly.
    pub(crate) labelled: usize,
    pub(crate) right: [usize; 2],
    /// The same over the first two seconds.
    pub(crate) labelled_early: usize,
    pub(crate) right_early: usize,
    /// Refused frames by reason.
    pub(crate) repeated: u64,
    pub(crate) out_of_order: u64,
    /// Seconds at which something of the above went wrong.
    pub(crate) log: Vec<String>,
}

impl Verdict {
    pub(crate) fn add(&mut self, other: &Self) {
        self.seconds += other.seconds;
        self.person_frames += other.person_frames;
        self.missed += other.missed;
        self.extra += other.extra;
        self.switches += other.switches;
        self.returns += other.returns;
        self.kept += other.kept;
        self.ghosts += other.ghosts;
        self.labelled += other.labelled;
        self.labelled_early += other.labelled_early;
        self.right_early += other.right_early;
        self.repeated += other.repeated;
        self.out_of_order += other.out_of_order;
        for half in 0..2 {
            self.right[half] += other.right[half];
        }
        self.log.extend(other.log.iter().cloned());
    }

    /// Share of sensor-frames in which arms, legs were taken rightly.
    pub(crate) fn swaps_right(&self) -> [f64; 2] {
        self.right.map(|right| share(right, self.labelled))
    }
}

pub(crate) fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        return 1.0;
    }
    part as f64 / whole as f64
}

/// `calibration` with every sensor off by about `off_m` at the middle of the room, in place and in direction.
pub(crate) fn disturbed(calibration: &Calibration, off_m: f64, seed: u64) -> Calibration {
    let mut dice = Dice(seed ^ 0xd157);
    let mut normal = || (0..12).map(|_| dice.roll()).sum::<f64>() - 6.0;
    let mut calibration = calibration.clone();
    for pose in calibration.sensors.values_mut() {
        let mut vector = |size: f64| Vector3::new(normal(), normal(), normal()) * size;
        // Half of the variance from the place, half from turning 2.8 m away.
        let moved = vector(off_m / 6f64.sqrt());
        let turned = UnitQuaternion::from_scaled_axis(vector(off_m / 2.0 / 2.8));
        let sensor = pose.room_from_sensor;
        pose.room_from_sensor = sensor.then(&Transform::from_parts(
            sensor.inverse().rotate(moved),
            turned,
        ));
    }
    calibration
}

/// A run of `scenario` with sensors known to within about `off_m`.
pub(crate) fn judge(scenario: &Scenario, config: &Config, seconds: f64, off_m: f64) -> Verdict {
    let world = Arc::new(World::new(scenario).unwrap());
    let mut truths: BTreeMap<(usize, u64), Vec<BodyTruth>> = BTreeMap::new();
    let events = inputs_and_truth(&world, seconds, &mut |sensor, frame, truth| {
        truths.insert((sensor, frame.number), truth.to_vec());
    });
    let mut engine = Engine::new(config.clone());
    let mut judge = Judge::new(&world);
    let mut outcome = Outcome::default();
    let mut deadline = None;
    for (time, input) in events {
        while let Some(due) = deadline.filter(|due| *due < time) {
            engine.handle(Input::Tick(due));
            deadline = drain(&mut engine, &mut outcome);
        }
        let seen = match &input {
            Input::Observation(o) => Some((o.clone(), &truths[&(o.sensor.index(), o.sequence)])),
            _ => None,
        };
        let input = match input {
            Input::Calibration(c) => {
                Input::Calibration(Arc::new(disturbed(&c, off_m, scenario.seed)))
            }
            other => other,
        };
        engine.handle(input);
        deadline = drain(&mut engine, &mut outcome);
        if let Some((observation, truth)) = seen {
            judge.labels(&engine, &observation, truth, time);
        }
    }
    judge.frames(&outcome.frames);
    judge.verdict.seconds = seconds;
    let refused = |reason| {
        let of = outcome.rejections.iter().filter(|r| r.reason == reason);
        of.count() as u64
    };
    judge.verdict.repeated = refused(RejectionReason::Repeated);
    judge.verdict.out_of_order = refused(RejectionReason::OutOfOrder);
    judge.verdict
}

struct Judge<'a> {
    world: &'a World,
    verdict: Verdict,
    /// For each person the stretches in which a sensor held them, seconds.
    held: BTreeMap<u64, Vec<(f64, f64)>>,
    wrong: BTreeMap<(SensorId, u64), f64>,
    /// Whether it was the legs that were last taken wrongly.
    half: bool,
}

impl<'a> Judge<'a> {
    fn new(world: &'a World) -> Self {
        Self {
            world,
            verdict: Verdict::default(),
            held: BTreeMap::new(),
            wrong: BTreeMap::new(),
            half: false,
        }
    }

    /// After the engine took `observation`: are its bodies' sides taken rightly?
    fn labels(
        &mut self,
        engine: &Engine,
        observation: &Observation,
        truth: &[BodyTruth],
        now: Timestamp,
    ) {
        let seconds = scenario_seconds(now);
        let labels = engine.labels();
        for body in truth {
            let Some(person) = body.person else { continue };
            let stretches = self.held.entry(person).or_default();
            match stretches.last_mut() {
                Some((_, end)) if seconds - *end < HELD_S => *end = seconds,
                _ => stretches.push((seconds, seconds)),
            }
            let taken = labels
                .iter()
                .find(|l| (l.sensor, l.tracking_id) == (observation.sensor, body.tracking_id));
            let Some(taken) = taken else { continue };
            self.verdict.labelled += 1;
            let right = [0, 1].map(|half| taken.mirrored[half] == body.swapped[half]);
            for (total, right) in self.verdict.right.iter_mut().zip(right) {
                *total += usize::from(right);
            }
            if seconds < 2.0 {
                self.verdict.labelled_early += 1;
                self.verdict.right_early += usize::from(right == [true; 2]);
            }
            let key = (observation.sensor, body.tracking_id);
            if right == [true; 2] {
                if let Some(since) = self.wrong.remove(&key) {
                    let half = ["arms", "legs"][usize::from(self.half)];
                    self.verdict.log.push(format!(
                        "{}: person {person} {half} wrong from {since:.2} to {seconds:.2} s",
                        key.0
                    ));
                }
            } else {
                self.half = right[0];
                self.wrong.entry(key).or_insert(seconds);
            }
        }
    }

    fn held_at(&self, person: u64, seconds: f64) -> bool {
        let within =
            |(from, to): &(f64, f64)| (*from + SETTLED_S..=*to + HELD_S).contains(&seconds);
        self.held
            .get(&person)
            .is_some_and(|held| held.iter().any(within))
    }

    fn seen_at(&self, person: u64, seconds: f64) -> bool {
        let within = |(from, to): &(f64, f64)| (*from..=*to + HELD_S).contains(&seconds);
        self.held
            .get(&person)
            .is_some_and(|held| held.iter().any(within))
    }

    fn frames(&mut self, frames: &[RoomFrame]) {
        let mut last: BTreeMap<u64, (f64, TrackId)> = BTreeMap::new();
        let mut left: BTreeMap<u64, f64> = BTreeMap::new();
        let mut nobody: BTreeMap<TrackId, usize> = BTreeMap::new();
        let everybody: BTreeSet<u64> = (1..=self.world.performance().people() as u64).collect();
        for frame in frames {
            let seconds = scenario_seconds(frame.time);
            let truth = self.world.truth(seconds);
            let here: BTreeSet<u64> = truth.iter().map(|p| p.id).collect();
            // Away, or out of all sensors' sight.
            for person in &everybody {
                if let Some((seen, _)) = last.get(person)
                    && !(here.contains(person) && self.seen_at(*person, seconds))
                {
                    left.entry(*person).or_insert(*seen);
                }
            }
            let comparison = compare(frame, &truth);
            for pair in &comparison.pairs {
                let errors = pair.errors.iter().map(|(_, error)| *error);
                let mean_m = errors.sum::<f64>() / pair.errors.len().max(1) as f64;
                if mean_m > 0.25 {
                    self.verdict.log.push(format!(
                        "person {} is {mean_m:.2} m off at {seconds:.2} s",
                        pair.person
                    ));
                }
                let before = last.insert(pair.person, (seconds, pair.track));
                let away = if self.seen_at(pair.person, seconds) {
                    left.remove(&pair.person)
                } else {
                    left.get(&pair.person).copied()
                };
                let Some((_, before)) = before else { continue };
                let same = before == pair.track;
                match away {
                    Some(since) if seconds - since <= 2.0 => {
                        self.verdict.returns += 1;
                        self.verdict.kept += usize::from(same);
                        if !same {
                            let what = format!(
                                "person {} came back as another at {seconds:.2} s",
                                pair.person
                            );
                            self.verdict.log.push(what);
                        }
                    }
                    Some(_) => {}
                    None if !same => {
                        self.verdict.switches += 1;
                        let what = format!(
                            "person {} changed from {before} to {} at {seconds:.2} s",
                            pair.person, pair.track
                        );
                        self.verdict.log.push(what);
                    }
                    None => {}
                }
            }
            for person in &here {
                if self.held_at(*person, seconds) {
                    self.verdict.person_frames += 1;
                    self.verdict.missed += usize::from(comparison.missed.contains(person));
                }
            }
            // Somebody who just left is still shown for a while.
            let lingering = |track: &TrackId| {
                let of = last.iter().find(|(_, (_, followed))| followed == track);
                of.is_some_and(|(person, (seen, _))| !here.contains(person) && seconds - seen < 0.7)
            };
            for track in comparison.extra.iter().filter(|track| !lingering(track)) {
                self.verdict.extra += 1;
                *nobody.entry(*track).or_default() += 1;
            }
        }
        for (track, frames) in nobody {
            if frames >= GHOST_FRAMES {
                self.verdict.ghosts += 1;
                self.verdict
                    .log
                    .push(format!("track {track} follows nobody for {frames} frames"));
            }
        }
    }
}
