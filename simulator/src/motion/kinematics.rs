//! From a few posture numbers and two feet to the 25 joints, with bone lengths exact by construction.
//!
//! Axes of the body: x forward, y left, z up. Spine, head and arms are forward kinematics; the legs are two-link
//! inverse kinematics between a hip that the pelvis carries and an ankle that the footstep holds.

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use super::shape::BodyShape;

/// How many numbers describe a posture.
pub(crate) const CHANNELS: usize = 21;

/// One posture: what each number means is said by [`channel`].
pub(crate) type Posture = [f64; CHANNELS];

/// Indices into a [`Posture`]. Metres and radians.
pub(crate) mod channel {
    /// Where the person stands, room x and y.
    pub(crate) const X: usize = 0;
    pub(crate) const Y: usize = 1;
    /// Where the person faces, counter-clockwise from room x.
    pub(crate) const HEADING: usize = 2;
    /// Pelvis in front of, and to the left of, that place.
    pub(crate) const FORWARD: usize = 3;
    pub(crate) const SIDE: usize = 4;
    /// SpineBase over the floor. While a posture is being planned: how far below standing.
    pub(crate) const HEIGHT: usize = 5;
    /// Pelvis turned left against the heading.
    pub(crate) const PELVIS_YAW: usize = 6;
    /// Chest bent forwards, leaning left, twisted left.
    pub(crate) const BEND: usize = 7;
    pub(crate) const LEAN: usize = 8;
    pub(crate) const TWIST: usize = 9;
    /// Head against chest, left and downwards.
    pub(crate) const HEAD_YAW: usize = 10;
    pub(crate) const HEAD_PITCH: usize = 11;
    /// Knees pointing outwards, tangent of the angle.
    pub(crate) const KNEES_OUT: usize = 12;
    /// Arms, left then right: flexion (forwards), abduction (outwards), twist about the upper arm, elbow.
    pub(crate) const ARMS: [usize; 2] = [13, 17];
    pub(crate) const FLEX: usize = 0;
    pub(crate) const ABDUCT: usize = 1;
    pub(crate) const ARM_TWIST: usize = 2;
    pub(crate) const ELBOW: usize = 3;
}

/// How far a leg may be stretched: beyond this share of its length the knee would have to move infinitely fast.
pub(crate) const LONGEST_REACH: f64 = 0.985;

/// Where a foot is: its ankle, where its toes point, and how far they point down. Metres, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FootPose {
    pub(crate) ankle: Vector3<f64>,
    pub(crate) yaw: f64,
    pub(crate) pitch: f64,
}

const SIDES: [f64; 2] = [1.0, -1.0];

fn about_x(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
}

fn about_y(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// SpineBase and the rotation of the pelvis (room from body).
fn pelvis(posture: &Posture) -> (Vector3<f64>, UnitQuaternion<f64>) {
    use channel::*;
    let heading = about_z(posture[HEADING]);
    let place = Vector3::new(posture[X], posture[Y], posture[HEIGHT]);
    let base = place + heading * Vector3::new(posture[FORWARD], posture[SIDE], 0.0);
    let rotation = heading * about_z(posture[PELVIS_YAW]) * about_y(0.35 * posture[BEND]);
    (base, rotation)
}

fn hip_offset(shape: &BodyShape, side: usize) -> Vector3<f64> {
    Vector3::new(0.0, SIDES[side] * shape.hip_half, -shape.hip_drop)
}

/// SpineBase over the floor when standing upright with the feet below the hips, metres.
pub(crate) fn standing_height(shape: &BodyShape) -> f64 {
    shape.ankle_height + shape.leg() * (LONGEST_REACH - 0.003) + shape.hip_drop
}

/// The highest SpineBase that lets both legs reach their ankles, metres.
pub(crate) fn highest_pelvis(shape: &BodyShape, posture: &Posture, feet: &[FootPose; 2]) -> f64 {
    let (base, rotation) = pelvis(posture);
    let reach = LONGEST_REACH * shape.leg();
    let limit = |side: usize| {
        let hip = base + rotation * hip_offset(shape, side);
        let flat = (hip - feet[side].ankle).xy().norm();
        let below_hip = (reach * reach - flat * flat)
            .max(0.04 * reach * reach)
            .sqrt();
        feet[side].ankle.z + below_hip + (base.z - hip.z)
    };
    limit(0).min(limit(1))
}

/// The joints of a body with these bones in this posture on these feet.
pub(crate) fn assemble(
    shape: &BodyShape,
    posture: &Posture,
    feet: &[FootPose; 2],
) -> JointMap<Position<Room>> {
    use channel::*;
    let mut joints = JointMap::empty();
    let mut put = |joint: Joint, at: Vector3<f64>| joints[joint] = Some(Position::from_vector(at));
    let (base, pelvis_rotation) = pelvis(posture);
    let lower = pelvis_rotation
        * about_z(0.4 * (posture[TWIST] - posture[PELVIS_YAW]))
        * about_y(0.25 * posture[BEND])
        * about_x(-0.4 * posture[LEAN]);
    let chest = about_z(posture[HEADING] + posture[TWIST])
        * about_y(posture[BEND])
        * about_x(-posture[LEAN]);
    let mid = base + lower * Vector3::new(0.0, 0.0, shape.lower_spine);
    let top = mid + chest * Vector3::new(0.0, 0.0, shape.upper_spine);
    let head_rotation = chest * about_z(posture[HEAD_YAW]) * about_y(posture[HEAD_PITCH]);
    let neck =
        top + chest * about_y(0.5 * posture[HEAD_PITCH]) * Vector3::new(0.0, 0.0, shape.neck);
    put(Joint::SpineBase, base);
    put(Joint::SpineMid, mid);
    put(Joint::SpineShoulder, top);
    put(Joint::Neck, neck);
    put(
        Joint::Head,
        neck + head_rotation * about_y(0.15) * Vector3::new(0.0, 0.0, shape.head),
    );
    for (side, foot) in feet.iter().enumerate() {
        arm(shape, posture, side, top, chest, &mut put);
        leg(
            shape,
            posture,
            side,
            (base, pelvis_rotation),
            foot,
            &mut put,
        );
    }
    joints
}

const ARM_JOINTS: [[Joint; 6]; 2] = [
    [
        Joint::ShoulderLeft,
        Joint::ElbowLeft,
        Joint::WristLeft,
        Joint::HandLeft,
        Joint::HandTipLeft,
        Joint::ThumbLeft,
    ],
    [
        Joint::ShoulderRight,
        Joint::ElbowRight,
        Joint::WristRight,
        Joint::HandRight,
        Joint::HandTipRight,
        Joint::ThumbRight,
    ],
];

const LEG_JOINTS: [[Joint; 4]; 2] = [
    [
        Joint::HipLeft,
        Joint::KneeLeft,
        Joint::AnkleLeft,
        Joint::FootLeft,
    ],
    [
        Joint::HipRight,
        Joint::KneeRight,
        Joint::AnkleRight,
        Joint::FootRight,
    ],
];

fn arm(
    shape: &BodyShape,
    posture: &Posture,
    side: usize,
    top: Vector3<f64>,
    chest: UnitQuaternion<f64>,
    put: &mut impl FnMut(Joint, Vector3<f64>),
) {
    use channel::{ABDUCT, ARM_TWIST, ARMS, ELBOW, FLEX};
    let angle = |which: usize| posture[ARMS[side] + which];
    let sign = SIDES[side];
    let upper = chest
        * about_y(-angle(FLEX))
        * about_x(sign * angle(ABDUCT))
        * about_z(sign * angle(ARM_TWIST));
    let fore = upper * about_y(-angle(ELBOW));
    let palm = fore * about_y(-0.1);
    let down = |length: f64| Vector3::new(0.0, 0.0, -length);
    let shoulder =
        top + chest * Vector3::new(0.0, sign * shape.shoulder_half, -0.015 * shape.height);
    let elbow = shoulder + upper * down(shape.upper_arm);
    let wrist = elbow + fore * down(shape.forearm);
    let hand = wrist + palm * down(shape.hand);
    // The thumb leaves the wrist forwards and down, at 40 degrees from the palm's axis.
    let (across, along) = 40f64.to_radians().sin_cos();
    let points = [
        shoulder,
        elbow,
        wrist,
        hand,
        hand + palm * down(shape.hand_tip),
        wrist + palm * Vector3::new(across * shape.thumb, 0.0, -along * shape.thumb),
    ];
    for (joint, point) in ARM_JOINTS[side].into_iter().zip(points) {
        put(joint, point);
    }
}

fn leg(
    shape: &BodyShape,
    posture: &Posture,
    side: usize,
    (base, pelvis_rotation): (Vector3<f64>, UnitQuaternion<f64>),
    foot: &FootPose,
    put: &mut impl FnMut(Joint, Vector3<f64>),
) {
    let hip = base + pelvis_rotation * hip_offset(shape, side);
    let heading = posture[channel::HEADING];
    let foot_yaw = super::curve::unwrapped(foot.yaw, heading);
    let forwards = about_z(0.5 * (heading + foot_yaw))
        * Vector3::new(1.0, SIDES[side] * posture[channel::KNEES_OUT], 0.0);
    let (knee, ankle) = two_links(hip, foot.ankle, forwards, shape.thigh, shape.shin);
    let toes = about_z(foot.yaw)
        * about_y(foot.pitch)
        * Vector3::new(shape.foot_forward, 0.0, -shape.foot_down);
    let points = [hip, knee, ankle, ankle + toes];
    for (joint, point) in LEG_JOINTS[side].into_iter().zip(points) {
        put(joint, point);
    }
}

/// Knee and ankle of a leg from `hip` towards `target`, the knee on the side of `pole`. Where the target is out of
/// reach the ankle stops short of it (or keeps off it): lengths are kept.
fn two_links(
    hip: Vector3<f64>,
    target: Vector3<f64>,
    pole: Vector3<f64>,
    upper: f64,
    lower: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let way = target - hip;
    let distance = way.norm().clamp(
        (upper - lower).abs() + 0.05 * upper,
        0.9995 * (upper + lower),
    );
    let along = way.try_normalize(1e-9).unwrap_or(-Vector3::z());
    let across = (pole - along * pole.dot(&along))
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::x);
    let cosine = (upper * upper + distance * distance - lower * lower) / (2.0 * upper * distance);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let knee = hip + along * (upper * cosine) + across * (upper * sine);
    (knee, hip + along * distance)
}
