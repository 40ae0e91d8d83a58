//! One procedural person: a plan turned into smooth posture tracks and footsteps, evaluated at any time.

use posefuse_skeleton::{JointMap, Position, Room};

use super::action::{act, at_ease, seated};
use super::curve::{Track, ramp, smooth_floor};
use super::kinematics::{
    CHANNELS, FootPose, Posture, assemble, channel, highest_pelvis, standing_height,
};
use super::script::{Plan, Script};
use super::shape::BodyShape;
use super::steps::Steps;
use crate::random::{Purpose, Stream};

/// Time between the control values of the tracks, seconds. The splines' smoothing is a third of it.
pub(crate) const STEP_S: f64 = 0.05;

/// A person who moves by a plan, round after round.
#[derive(Clone, Debug)]
pub(crate) struct Person {
    shape: BodyShape,
    script: Script,
    absent: Vec<(f64, f64)>,
    round: f64,
    posture: Track<CHANNELS>,
    steps: Steps,
}

impl Person {
    /// Works out every posture of the plan's round. `idle` gives the small movements of standing.
    pub(crate) fn new(shape: BodyShape, plan: &Plan, mut idle: Stream) -> Self {
        let count = (plan.now() / STEP_S).round().max(1.0) as usize;
        let round = count as f64 * STEP_S;
        let time = |index: usize| index as f64 * STEP_S;
        let turned = plan.here.heading - plan.home().heading;
        let turned = (turned / std::f64::consts::TAU).round() * std::f64::consts::TAU;
        let places: Vec<[f64; 3]> = (0..count)
            .map(|i| {
                let place = plan.place(time(i));
                [place.at.x, place.at.y, place.heading]
            })
            .collect();
        let body = Track::new(STEP_S, places.clone(), [0.0, 0.0, turned]);
        let steps = Steps::plan(&shape, &body, &plan.moving());
        let sway = Sway::new(&mut idle, round);
        let mut postures: Vec<Posture> = (0..count)
            .map(|i| {
                let mut posture = at_ease();
                posture[..3].copy_from_slice(&places[i]);
                sway.apply(time(i), &mut posture);
                swing_with_steps(&mut posture, &steps, time(i));
                if let Some(doing) = plan.script.at(time(i)) {
                    act(
                        doing.action,
                        time(i) - doing.start,
                        doing.duration,
                        &shape,
                        &mut posture,
                    );
                }
                posture
            })
            .collect();
        set_heights(&shape, &steps, &mut postures);
        let mut turn = [0.0; CHANNELS];
        turn[channel::HEADING] = turned;
        Self {
            shape,
            script: plan.script.clone(),
            absent: plan.absent.clone(),
            round,
            posture: Track::new(STEP_S, postures, turn),
            steps,
        }
    }

    pub(crate) fn shape(&self) -> &BodyShape {
        &self.shape
    }

    pub(crate) fn script(&self) -> &Script {
        &self.script
    }

    pub(crate) fn round(&self) -> f64 {
        self.round
    }

    /// Whether the left and the right foot stand on the floor.
    pub(crate) fn standing(&self, time: f64) -> [bool; 2] {
        self.steps.standing(time.rem_euclid(self.round))
    }

    /// Whether the person is in the room.
    pub(crate) fn present(&self, time: f64) -> bool {
        let time = time.rem_euclid(self.round);
        let away = |(from, to): &(f64, f64)| (*from..*to).contains(&time);
        !self.absent.iter().any(away)
    }

    pub(crate) fn pose(&self, time: f64) -> JointMap<Position<Room>> {
        let time = time.rem_euclid(self.round);
        assemble(&self.shape, &self.posture.at(time), &self.steps.at(time))
    }
}

/// Somebody who sits and does not move: what a chair looks like to a tracker that takes it for a person.
pub(crate) fn sitting_still(shape: &BodyShape, place: [f64; 3]) -> JointMap<Position<Room>> {
    let [x, y, heading] = place;
    let (sin, cos) = heading.sin_cos();
    let foot = |left: f64| FootPose {
        ankle: nalgebra::Vector3::new(
            x - sin * left * shape.hip_half,
            y + cos * left * shape.hip_half,
            shape.ankle_height,
        ),
        yaw: heading,
        pitch: 0.0,
    };
    assemble(shape, &seated(shape, place), &[foot(1.0), foot(-1.0)])
}

/// SpineBase as high as standing, less what the action takes off, and never higher than the legs allow.
fn set_heights(shape: &BodyShape, steps: &Steps, postures: &mut [Posture]) {
    let standing = standing_height(shape);
    let limits: Vec<f64> = postures
        .iter()
        .enumerate()
        .map(|(i, posture)| {
            let wanted = standing - posture[channel::HEIGHT];
            let mut at_wanted = *posture;
            at_wanted[channel::HEIGHT] = wanted;
            wanted.min(highest_pelvis(
                shape,
                &at_wanted,
                &steps.at(i as f64 * STEP_S),
            ))
        })
        .collect();
    for (posture, height) in postures.iter_mut().zip(smooth_floor(&limits, 2)) {
        posture[channel::HEIGHT] = height;
    }
}

/// Arms and pelvis go with the feet: opposite arm forwards, weight over the standing foot.
fn swing_with_steps(posture: &mut Posture, steps: &Steps, time: f64) {
    use channel::*;
    let [left, right] = steps.at(time);
    let (sin, cos) = posture[HEADING].sin_cos();
    let ahead = |foot: &FootPose| foot.ankle.x * cos + foot.ankle.y * sin;
    let lead = (ahead(&left) - ahead(&right)).clamp(-0.7, 0.7);
    let [left_arm, right_arm] = ARMS;
    posture[left_arm + FLEX] -= 0.75 * lead;
    posture[right_arm + FLEX] += 0.75 * lead;
    posture[left_arm + ELBOW] += 0.25 * ramp(-1.5 * lead);
    posture[right_arm + ELBOW] += 0.25 * ramp(1.5 * lead);
    posture[PELVIS_YAW] -= 0.16 * lead;
    posture[TWIST] += 0.12 * lead;
    posture[BEND] += 0.05 * ramp(2.0 * lead.abs());
    let lifted = |foot: &FootPose, other: &FootPose| (foot.ankle.z - other.ankle.z) / 0.09;
    posture[SIDE] += 0.022 * (lifted(&right, &left) - lifted(&left, &right)).clamp(-1.0, 1.0);
    posture[LEAN] += 0.02 * (lifted(&right, &left)).clamp(-1.0, 1.0);
}

/// The small movements of somebody who stands: slow waves that close with the round.
struct Sway {
    waves: Vec<(usize, f64, f64, f64)>,
}

impl Sway {
    fn new(idle: &mut Stream, round: f64) -> Self {
        use channel::*;
        let mut waves = Vec::new();
        let mut add = |channel: usize, amplitude: f64, period: f64| {
            for _ in 0..3 {
                let wanted = period * idle.between(0.6, 1.6);
                let turns = (round / wanted).round().max(1.0);
                let rate = std::f64::consts::TAU * turns / round;
                let phase = idle.between(0.0, std::f64::consts::TAU);
                waves.push((channel, amplitude * idle.between(0.4, 1.0), rate, phase));
            }
        };
        add(SIDE, 0.006, 5.0);
        add(FORWARD, 0.004, 4.0);
        add(BEND, 0.012, 6.0);
        add(LEAN, 0.010, 7.0);
        add(TWIST, 0.02, 8.0);
        add(HEAD_YAW, 0.10, 6.0);
        add(HEAD_PITCH, 0.04, 5.0);
        for arm in ARMS {
            add(arm + FLEX, 0.02, 5.0);
            add(arm + ABDUCT, 0.01, 5.0);
            add(arm + ELBOW, 0.03, 4.0);
        }
        Self { waves }
    }

    fn apply(&self, time: f64, posture: &mut Posture) {
        for &(channel, amplitude, rate, phase) in &self.waves {
            posture[channel] += amplitude * (rate * time + phase).sin();
        }
    }
}

/// The stream behind the small movements of person `person`.
pub(crate) fn idle_stream(seed: u64, person: usize) -> Stream {
    Stream::new(seed, Purpose::Idle, &[person as u64])
}
