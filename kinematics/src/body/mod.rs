//! The measures of one person: what stays the same in all frames, and the rig that follows from it.

mod learn;
mod lengths;

use nalgebra::Vector3;
use posefuse_skeleton::Track;
use serde::{Deserialize, Serialize};

pub use learn::Learner;

use crate::bones::{ARMS, BONES, CHEST, HEAD, HEAD_END, HIPS, LEGS, NECK, SIDES, SPINE};
use crate::rig::{Bone, Rig};

/// The measures of one person, metres and radians. Sides: left, right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// `SpineBase` to `SpineMid`.
    pub lower_spine: f64,
    /// `SpineMid` to `SpineShoulder`.
    pub upper_spine: f64,
    /// `SpineShoulder` to `Neck`.
    pub neck: f64,
    /// `Neck` to `Head`.
    pub head: f64,
    /// How far forwards that direction leans when the person looks ahead, radians.
    pub head_lean_rad: f64,
    /// The arms.
    pub arms: [Arm; 2],
    /// The legs.
    pub legs: [Leg; 2],
    /// How far the shoulders lie below `SpineShoulder`.
    pub shoulder_drop: f64,
    /// How far the hips lie below `SpineBase`.
    pub hip_drop: f64,
    /// Height of the ankles over the floor where the feet stand flat.
    pub ankle_height: f64,
}

/// The measures of one arm, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// From `SpineShoulder` outwards to the shoulder.
    pub shoulder: f64,
    /// Shoulder to elbow.
    pub upper: f64,
    /// Elbow to wrist.
    pub lower: f64,
    /// Wrist to hand.
    pub hand: f64,
    /// Hand to hand tip.
    pub fingers: f64,
    /// Wrist to thumb.
    pub thumb: f64,
    /// Between that and wrist to hand.
    pub thumb_angle_rad: f64,
}

/// The measures of one leg, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// From the middle of the pelvis outwards to the hip.
    pub hip: f64,
    /// Hip to knee.
    pub upper: f64,
    /// Knee to ankle.
    pub lower: f64,
    /// Ankle to foot (the root of the toes).
    pub foot: f64,
    /// How far that points below the horizontal where the foot stands flat.
    pub foot_pitch_rad: f64,
}

/// Toes go on from the foot joint by this share of ankle to foot. No tracker of this class says where they end.
const TOES_SHARE: f64 = 0.35;
/// The thumb's bone begins at this share of the way from the wrist to the thumb.
const THUMB_ROOT_SHARE: f64 = 0.35;
/// The root lies between the hips, and so far below `SpineBase` at least, metres.
const LEAST_ROOT_DROP_M: f64 = 0.02;

impl Body {
    /// An average body of this height, metres: segment lengths after Drillis and Contini, "Body Segment Parameters" (1966),
    /// moved to the points that depth trackers report (hips narrower, shoulders below the acromion).
    pub fn of_height(height: f64) -> Self {
        let arm = Arm {
            shoulder: 0.108 * height,
            upper: 0.165 * height,
            lower: 0.145 * height,
            hand: 0.050 * height,
            fingers: 0.045 * height,
            thumb: 0.040 * height,
            thumb_angle_rad: 0.70,
        };
        let leg = Leg {
            hip: 0.050 * height,
            upper: 0.245 * height,
            lower: 0.240 * height,
            foot: 0.085 * height,
            foot_pitch_rad: 0.36,
        };
        Self {
            lower_spine: 0.135 * height,
            upper_spine: 0.130 * height,
            neck: 0.045 * height,
            head: 0.085 * height,
            head_lean_rad: 0.12,
            arms: [arm; 2],
            legs: [leg; 2],
            shoulder_drop: 0.015 * height,
            hip_drop: 0.020 * height,
            ankle_height: 0.045 * height,
        }
    }

    /// The measures of the person of these tracks, from a walk or a T-pose: see [`Learner`].
    ///
    /// ```
    /// use posefuse_kinematics::Body;
    ///
    /// let nobody = Body::learn([]);
    /// let average = Body::of_height(1.70);
    /// assert!((nobody.rest_height() - average.rest_height()).abs() < 1e-9, "what nobody showed is average");
    /// ```
    pub fn learn<'a>(tracks: impl IntoIterator<Item = &'a Track>) -> Self {
        let mut learner = Learner::default();
        for track in tracks {
            learner.add(&track.skeleton);
        }
        learner.body()
    }

    /// `Hips` over the floor in the rest pose, metres.
    pub fn rest_height(&self) -> f64 {
        let leg = |leg: &Leg| leg.upper + leg.lower;
        let hips = self.ankle_height + (leg(&self.legs[0]) + leg(&self.legs[1])) / 2.0;
        hips + self.hip_drop - self.root_drop()
    }

    /// From `SpineBase` down to `Hips`, metres.
    fn root_drop(&self) -> f64 {
        self.hip_drop.max(LEAST_ROOT_DROP_M)
    }

    /// The bones of this person in the T-pose.
    pub fn rig(&self) -> Rig {
        let mut offsets = [Vector3::zeros(); BONES.len()];
        offsets[HIPS] = Vector3::new(0.0, 0.0, self.rest_height());
        offsets[SPINE] = Vector3::new(0.0, 0.0, self.root_drop());
        offsets[CHEST] = Vector3::new(0.0, 0.0, self.lower_spine);
        offsets[NECK] = Vector3::new(0.0, 0.0, self.upper_spine);
        offsets[HEAD] = Vector3::new(0.0, 0.0, self.neck);
        let (sin, cos) = self.head_lean_rad.sin_cos();
        offsets[HEAD_END] = Vector3::new(sin, 0.0, cos) * self.head;
        for side in 0..2 {
            self.hang_arm(side, &mut offsets);
            self.hang_leg(side, &mut offsets);
        }
        let bone = |(index, named): (usize, &crate::bones::Named)| Bone {
            name: named.name.to_owned(),
            parent: (index != HIPS).then_some(named.parent),
            offset: offsets[index],
            joint: named.joint,
        };
        Rig {
            bones: BONES.iter().enumerate().map(bone).collect(),
        }
    }

    fn hang_arm(&self, side: usize, offsets: &mut [Vector3<f64>]) {
        let (bones, arm, out) = (ARMS[side], &self.arms[side], SIDES[side]);
        offsets[bones.clavicle] = offsets[NECK];
        offsets[bones.upper] = Vector3::new(0.0, out * arm.shoulder, -self.shoulder_drop);
        offsets[bones.lower] = Vector3::new(0.0, out * arm.upper, 0.0);
        offsets[bones.hand] = Vector3::new(0.0, out * arm.lower, 0.0);
        offsets[bones.fingers] = Vector3::new(0.0, out * arm.hand, 0.0);
        offsets[bones.fingers_end] = Vector3::new(0.0, out * arm.fingers, 0.0);
        let (sin, cos) = arm.thumb_angle_rad.sin_cos();
        let thumb = Vector3::new(sin, out * cos, 0.0) * arm.thumb;
        offsets[bones.thumb] = thumb * THUMB_ROOT_SHARE;
        offsets[bones.thumb_end] = thumb * (1.0 - THUMB_ROOT_SHARE);
    }

    fn hang_leg(&self, side: usize, offsets: &mut [Vector3<f64>]) {
        let (bones, leg, out) = (LEGS[side], &self.legs[side], SIDES[side]);
        offsets[bones.upper] = Vector3::new(0.0, out * leg.hip, self.root_drop() - self.hip_drop);
        offsets[bones.lower] = Vector3::new(0.0, 0.0, -leg.upper);
        offsets[bones.foot] = Vector3::new(0.0, 0.0, -leg.lower);
        let (sin, cos) = leg.foot_pitch_rad.sin_cos();
        offsets[bones.toes] = Vector3::new(cos, 0.0, -sin) * leg.foot;
        offsets[bones.toes_end] = Vector3::new(TOES_SHARE * leg.foot, 0.0, 0.0);
    }
}
