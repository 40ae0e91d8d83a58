//! The measures of a body: bone lengths from a height and proportions.
//!
//! Proportions follow the segment tables of Drillis and Contini (1966), moved to the points that depth trackers
//! report (narrower hips, shoulders below the acromion), and varied a little from person to person.

use crate::random::{Purpose, Stream};

/// Lengths of one person's bones, metres. They never change during a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyShape {
    /// Standing height.
    pub height: f64,
    /// SpineBase to SpineMid.
    pub lower_spine: f64,
    /// SpineMid to SpineShoulder.
    pub upper_spine: f64,
    /// SpineShoulder to Neck.
    pub neck: f64,
    /// Neck to Head.
    pub head: f64,
    /// Half the distance between the shoulders.
    pub shoulder_half: f64,
    /// Shoulder to elbow.
    pub upper_arm: f64,
    /// Elbow to wrist.
    pub forearm: f64,
    /// Wrist to hand.
    pub hand: f64,
    /// Hand to hand tip.
    pub hand_tip: f64,
    /// Wrist to thumb.
    pub thumb: f64,
    /// Half the distance between the hips.
    pub hip_half: f64,
    /// How far the hips lie below SpineBase.
    pub hip_drop: f64,
    /// Hip to knee.
    pub thigh: f64,
    /// Knee to ankle.
    pub shin: f64,
    /// Ankle to foot, forwards.
    pub foot_forward: f64,
    /// Ankle to foot, downwards.
    pub foot_down: f64,
    /// Height of the ankle over the floor when the foot is flat.
    pub ankle_height: f64,
}

impl BodyShape {
    /// An average body of this height (metres).
    pub fn of_height(height: f64) -> Self {
        Self {
            height,
            lower_spine: 0.135 * height,
            upper_spine: 0.130 * height,
            neck: 0.045 * height,
            head: 0.085 * height,
            shoulder_half: 0.108 * height,
            upper_arm: 0.165 * height,
            forearm: 0.145 * height,
            hand: 0.050 * height,
            hand_tip: 0.045 * height,
            thumb: 0.040 * height,
            hip_half: 0.050 * height,
            hip_drop: 0.020 * height,
            thigh: 0.245 * height,
            shin: 0.240 * height,
            foot_forward: 0.080 * height,
            foot_down: 0.030 * height,
            ankle_height: 0.045 * height,
        }
    }

    /// Person number `person` of `seed`: 1.56 to 1.92 m tall, each length varied by about 3 %.
    pub fn seeded(seed: u64, person: usize) -> Self {
        let mut stream = Stream::new(seed, Purpose::Shape, &[person as u64]);
        let mut shape = Self::of_height(stream.between(1.56, 1.92));
        for length in [
            &mut shape.lower_spine,
            &mut shape.upper_spine,
            &mut shape.neck,
            &mut shape.head,
            &mut shape.shoulder_half,
            &mut shape.upper_arm,
            &mut shape.forearm,
            &mut shape.hand,
            &mut shape.hand_tip,
            &mut shape.thumb,
            &mut shape.hip_half,
            &mut shape.thigh,
            &mut shape.shin,
            &mut shape.foot_forward,
        ] {
            *length *= 1.0 + 0.03 * stream.normal().clamp(-2.0, 2.0);
        }
        shape
    }

    /// Hip to ankle with a straight knee.
    pub(crate) fn leg(&self) -> f64 {
        self.thigh + self.shin
    }
}
