//! What people do, and what each action does to a posture.

use serde::{Deserialize, Serialize};

use super::curve::ramp;
use super::kinematics::{CHANNELS, Posture, channel};
use super::shape::BodyShape;

/// Left or right, the person's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left.
    Left,
    /// The right.
    Right,
}

/// Something a person does for a while. Before and after it they stand upright.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Stand about.
    Stand,
    /// Walk to another place.
    Walk,
    /// Turn on the spot.
    Turn,
    /// Step straight forwards or backwards.
    Shuffle,
    /// Wave a hand.
    Wave(Side),
    /// Stretch one arm out forwards.
    ReachForward(Side),
    /// Stretch one arm up.
    ReachUp(Side),
    /// Bend down as if to pick something up.
    PickUp(Side),
    /// Go down on bent knees and come up again.
    Crouch,
    /// Sit down on a stool, stay, stand up.
    Sit,
    /// Look left and right.
    LookAround,
    /// Hold both arms out sideways.
    TPose,
    /// Hug this person (index).
    Hug(usize),
    /// Lie down on the back with bent knees, stay, get up.
    Lie,
}

impl Action {
    /// The actions that one person does on the spot.
    pub const ON_THE_SPOT: [Self; 12] = [
        Self::Wave(Side::Left),
        Self::Wave(Side::Right),
        Self::ReachForward(Side::Left),
        Self::ReachForward(Side::Right),
        Self::ReachUp(Side::Left),
        Self::ReachUp(Side::Right),
        Self::PickUp(Side::Left),
        Self::PickUp(Side::Right),
        Self::Crouch,
        Self::Sit,
        Self::LookAround,
        Self::TPose,
    ];

    /// Shortest and longest duration, seconds.
    pub(crate) fn durations(self) -> (f64, f64) {
        match self {
            Self::Stand => (0.8, 2.5),
            Self::Sit => (6.0, 10.0),
            Self::Lie => (12.0, 20.0),
            Self::Crouch => (3.6, 5.5),
            Self::Hug(_) => (3.5, 6.0),
            Self::Wave(_) | Self::LookAround | Self::TPose => (3.2, 5.5),
            _ => (2.8, 4.5),
        }
    }

    /// Seconds to go into it, and out of it.
    fn rise(self) -> f64 {
        match self {
            Self::Sit => 1.7,
            Self::Lie => 4.0,
            Self::Crouch => 1.3,
            Self::Hug(_) => 1.3,
            Self::PickUp(_) => 1.2,
            Self::TPose | Self::ReachUp(_) | Self::Wave(_) => 1.1,
            _ => 1.0,
        }
    }

    /// How far the middle of the body is from where the feet stand, metres ahead.
    pub(crate) fn reach_ahead(self) -> f64 {
        match self {
            Self::Sit => -0.2,
            Self::Lie => -0.6,
            Self::PickUp(_) => 0.15,
            _ => 0.0,
        }
    }
}

/// Arms hanging at ease, everything else zero.
pub(crate) fn at_ease() -> Posture {
    let mut posture = [0.0; CHANNELS];
    for arm in channel::ARMS {
        posture[arm + channel::FLEX] = 0.04;
        posture[arm + channel::ABDUCT] = 0.13;
        posture[arm + channel::ELBOW] = 0.22;
    }
    posture
}

/// Changes `posture` by what `action` does `time` seconds after its start; it ends at `duration`.
pub(crate) fn act(
    action: Action,
    time: f64,
    duration: f64,
    shape: &BodyShape,
    posture: &mut Posture,
) {
    use channel::*;
    let rise = action.rise();
    let held = ramp(time / rise) * ramp((duration - time) / rise);
    // Swings that begin and end with the hold, one every `period` seconds.
    let swing = |period: f64| held * (std::f64::consts::TAU * (time - rise) / period).sin();
    match action {
        Action::Stand | Action::Walk | Action::Turn | Action::Shuffle => {}
        Action::Wave(side) => {
            blend_arm(
                posture,
                side,
                [0.25, 1.35, 1.35, 1.65 + 0.38 * swing(0.9)],
                held,
            );
            posture[LEAN] -= signed(side) * 0.04 * held;
        }
        Action::ReachForward(side) => {
            blend_arm(posture, side, [1.5, 0.05, 0.0, 0.12], held);
            posture[BEND] += 0.22 * held;
            posture[TWIST] -= signed(side) * 0.35 * held;
        }
        Action::ReachUp(side) => {
            blend_arm(posture, side, [2.75, 0.1, 0.0, 0.15], held);
            posture[LEAN] -= signed(side) * 0.12 * held;
            posture[HEAD_PITCH] -= 0.4 * held;
        }
        Action::PickUp(side) => {
            blend_arm(posture, side, [1.25, 0.0, 0.0, 0.1], held);
            posture[BEND] += 1.15 * held;
            posture[HEIGHT] += 0.1 * shape.height * held;
            posture[FORWARD] -= 0.09 * held;
            posture[TWIST] -= signed(side) * 0.2 * held;
        }
        Action::Crouch => {
            posture[HEIGHT] += 0.235 * shape.height * held;
            posture[FORWARD] -= 0.10 * held;
            posture[BEND] += 0.62 * held;
            posture[KNEES_OUT] += 0.35 * held;
            posture[HEAD_PITCH] -= 0.3 * held;
            both_arms(posture, [0.95, 0.15, -0.2, 0.75], held);
        }
        Action::Sit => sit(posture, shape, held),
        Action::Lie => lie(
            posture,
            shape,
            held_for(time, duration, 0.0, 0.55 * rise),
            held_for(time, duration, 0.45 * rise, 0.55 * rise),
        ),
        Action::LookAround => {
            posture[HEAD_YAW] += 0.85 * swing(2.6);
            posture[TWIST] += 0.3 * swing(2.6);
        }
        Action::TPose => both_arms(posture, [0.0, 1.53, 0.0, 0.06], held),
        Action::Hug(_) => {
            posture[BEND] += 0.14 * held;
            posture[HEAD_YAW] += 0.35 * held;
            blend_arm(posture, Side::Left, [1.35, 0.35, -1.25, 1.05], held);
            blend_arm(posture, Side::Right, [0.95, 0.35, -1.25, 1.05], held);
        }
    }
}

fn sit(posture: &mut Posture, shape: &BodyShape, held: f64) {
    use channel::*;
    let seat = 0.30 * shape.height;
    let stand = super::kinematics::standing_height(shape);
    posture[HEIGHT] += (stand - seat) * held;
    posture[FORWARD] -= 0.85 * shape.thigh * held;
    // The chest leans forwards on the way down and on the way up, and is nearly upright on the seat.
    posture[BEND] += 0.1 * held + 2.2 * held * (1.0 - held);
    posture[KNEES_OUT] += 0.12 * held;
    both_arms(posture, [0.55, 0.1, -0.25, 0.95], held);
}

/// Down on the floor (`down`), then back on it (`flat`), the feet where they stood.
fn lie(posture: &mut Posture, shape: &BodyShape, down: f64, flat: f64) {
    use channel::*;
    let stand = super::kinematics::standing_height(shape);
    posture[HEIGHT] += (stand - 0.16) * down;
    posture[FORWARD] -= 0.75 * shape.leg() * down;
    // Leans forwards while going down, then rolls back.
    posture[BEND] += 2.4 * down * (1.0 - down) + 0.35 * down * (1.0 - flat) - 1.5 * flat;
    posture[KNEES_OUT] += 0.15 * down;
    posture[HEAD_PITCH] += 0.25 * flat;
    both_arms(posture, [1.1 - 0.7 * flat, 0.35, 0.0, 0.4], down);
}

/// 0 before `from` seconds after the start, 1 after `rise` more, and the same backwards at the end.
fn held_for(time: f64, duration: f64, from: f64, rise: f64) -> f64 {
    ramp((time - from) / rise) * ramp((duration - time - from) / rise)
}

/// The posture of somebody sitting still at (x, y) with this heading (radians).
pub(crate) fn seated(shape: &BodyShape, [x, y, heading]: [f64; 3]) -> Posture {
    let mut posture = at_ease();
    posture[..3].copy_from_slice(&[x, y, heading]);
    sit(&mut posture, shape, 1.0);
    posture[channel::HEIGHT] = super::kinematics::standing_height(shape) - posture[channel::HEIGHT];
    posture
}

fn signed(side: Side) -> f64 {
    match side {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

fn blend_arm(posture: &mut Posture, side: Side, angles: [f64; 4], share: f64) {
    let arm = channel::ARMS[usize::from(side == Side::Right)];
    for (channel, angle) in (arm..).zip(angles) {
        posture[channel] += (angle - posture[channel]) * share;
    }
}

fn both_arms(posture: &mut Posture, angles: [f64; 4], share: f64) {
    blend_arm(posture, Side::Left, angles, share);
    blend_arm(posture, Side::Right, angles, share);
}
