//! Learns a person's measures from fused skeletons: a walk or a T-pose, some ten frames at least.
//!
//! Only measured joints count, each by its covariance. Lengths of the left and the right side are drawn together: people
//! differ between sides by about a hundredth, trackers by more. What was not seen follows from what was, by the
//! proportions of an average body.

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointState, Provenance, Room, Skeleton, local_axes};

use super::lengths::{Estimate, Samples};
use super::{Arm, Body, Leg};

/// How much the two sides of a body differ: share of the length, one standard deviation. Auerbach and Ruff, "Limb bone
/// bilateral asymmetry" (2006) find 0.2 to 1.5 % for the lengths of arms and legs.
const ASYMMETRY: f64 = 0.01;
/// An average person.
const AVERAGE_HEIGHT_M: f64 = 1.70;
/// Of the heights of the ankles in a walk: where feet stand flat.
const STANDING_SHARE: f64 = 0.25;
/// An ankle this far above that still stands.
const STANDING_M: f64 = 0.02;
/// The centre of the head leans within these, radians.
const HEAD_LEAN: (f64, f64) = (-0.2, 0.6);
const FOOT_PITCH: (f64, f64) = (0.0, 0.9);
const ANKLE_HEIGHT_M: (f64, f64) = (0.02, 0.20);

/// A pair of joints with a constant distance, and that of the other side where there is one.
type Pair = (Joint, Joint);

/// The lengths that are learned.
const PAIRS: [Pair; 28] = {
    use Joint::*;
    [
        (SpineBase, SpineMid),
        (SpineMid, SpineShoulder),
        (SpineShoulder, Neck),
        (Neck, Head),
        (HipLeft, HipRight),
        (SpineBase, HipLeft),
        (SpineBase, HipRight),
        (ShoulderLeft, ShoulderRight),
        (SpineShoulder, ShoulderLeft),
        (SpineShoulder, ShoulderRight),
        (ShoulderLeft, ElbowLeft),
        (ShoulderRight, ElbowRight),
        (ElbowLeft, WristLeft),
        (ElbowRight, WristRight),
        (WristLeft, HandLeft),
        (WristRight, HandRight),
        (HandLeft, HandTipLeft),
        (HandRight, HandTipRight),
        (WristLeft, ThumbLeft),
        (WristRight, ThumbRight),
        (HandLeft, ThumbLeft),
        (HandRight, ThumbRight),
        (HipLeft, KneeLeft),
        (HipRight, KneeRight),
        (KneeLeft, AnkleLeft),
        (KneeRight, AnkleRight),
        (AnkleLeft, FootLeft),
        (AnkleRight, FootRight),
    ]
};

/// Gathers what frames say of a person's measures; memory is bounded.
#[derive(Clone, Debug, Default)]
pub struct Learner {
    lengths: [Samples; PAIRS.len()],
    head_lean: Samples,
    ankle_height: Samples,
    /// Height of an ankle, and how far ankle to foot points down there.
    feet: Vec<(f64, f64)>,
}

/// Feet are kept from so many frames.
const MOST_FEET: usize = 8192;

impl Learner {
    /// Takes in one frame of the person.
    pub fn add(&mut self, skeleton: &Skeleton<Room>) {
        let at = |joint: Joint| {
            skeleton[joint].as_ref().filter(|state| {
                matches!(state.provenance, Provenance::Measured(_)) && state.position.is_finite()
            })
        };
        for ((a, b), samples) in PAIRS.into_iter().zip(&mut self.lengths) {
            if let (Some(a), Some(b)) = (at(a), at(b)) {
                samples.add_distance(a, b);
            }
        }
        if let (Some(neck), Some(head)) = (at(Joint::Neck), at(Joint::Head)) {
            self.add_head(skeleton, neck, head);
        }
        for (ankle, foot) in [
            (Joint::AnkleLeft, Joint::FootLeft),
            (Joint::AnkleRight, Joint::FootRight),
        ] {
            if let (Some(ankle), Some(foot)) = (at(ankle), at(foot)) {
                self.add_foot(ankle, foot);
            }
        }
    }

    fn add_head(
        &mut self,
        skeleton: &Skeleton<Room>,
        neck: &JointState<Room>,
        head: &JointState<Room>,
    ) {
        let positions = skeleton.map(|_, state| state.position);
        let Some(trunk) = local_axes(Joint::Head, &positions) else {
            return;
        };
        let line: Vector3<f64> =
            trunk.transpose() * (head.position.vector() - neck.position.vector());
        let variance = (neck.covariance + head.covariance).trace() / 3.0;
        let squared = line.norm_squared().max(1e-4);
        self.head_lean
            .add(line.x.atan2(line.z), variance / squared + 0.01);
    }

    fn add_foot(&mut self, ankle: &JointState<Room>, foot: &JointState<Room>) {
        let height = ankle.position.vector().z;
        let variance = ankle.covariance[(2, 2)].max(1e-6);
        self.ankle_height.add(height, variance);
        let line = foot.position.vector() - ankle.position.vector();
        if self.feet.len() < MOST_FEET && line.norm() > 0.02 {
            self.feet.push((height, (-line.z).atan2(line.xy().norm())));
        }
    }

    /// The measures that follow from what was seen so far.
    pub fn body(&self) -> Body {
        let estimates: Vec<Option<Estimate>> = self.lengths.iter().map(Samples::estimate).collect();
        let height = height(&estimates);
        let average = Body::of_height(height);
        let known = Known {
            estimates: &estimates,
            average: &average,
        };
        let (hips, hip_drop) = known.triangle(
            (Joint::HipLeft, Joint::HipRight),
            Joint::SpineBase,
            (average.legs[0].hip, average.hip_drop),
        );
        let (shoulders, shoulder_drop) = known.triangle(
            (Joint::ShoulderLeft, Joint::ShoulderRight),
            Joint::SpineShoulder,
            (average.arms[0].shoulder, average.shoulder_drop),
        );
        let ankle_height = self
            .ankle_height
            .estimate()
            .and_then(|_| self.ankle_height.quantile(STANDING_SHARE))
            .map_or(average.ankle_height, |height| {
                height.clamp(ANKLE_HEIGHT_M.0, ANKLE_HEIGHT_M.1)
            });
        let foot_pitch = self
            .foot_pitch(ankle_height)
            .unwrap_or(average.legs[0].foot_pitch_rad);
        let head_lean = self.head_lean.estimate();
        Body {
            lower_spine: known.length(Joint::SpineBase, Joint::SpineMid, average.lower_spine),
            upper_spine: known.length(Joint::SpineMid, Joint::SpineShoulder, average.upper_spine),
            neck: known.length(Joint::SpineShoulder, Joint::Neck, average.neck),
            head: known.length(Joint::Neck, Joint::Head, average.head),
            head_lean_rad: head_lean.map_or(average.head_lean_rad, |lean| {
                lean.value.clamp(HEAD_LEAN.0, HEAD_LEAN.1)
            }),
            arms: [false, true].map(|mirrored| known.arm(mirrored, shoulders)),
            legs: [false, true].map(|mirrored| known.leg(mirrored, hips, foot_pitch)),
            shoulder_drop,
            hip_drop,
            ankle_height,
        }
    }

    /// Median of how far the feet point down where they stand.
    fn foot_pitch(&self, ankle_height: f64) -> Option<f64> {
        let standing = self
            .feet
            .iter()
            .filter(|(height, _)| *height < ankle_height + STANDING_M);
        let mut pitches: Vec<f64> = standing.map(|(_, pitch)| *pitch).collect();
        pitches.sort_by(f64::total_cmp);
        let median = *pitches.get(pitches.len() / 2)?;
        Some(median.clamp(FOOT_PITCH.0, FOOT_PITCH.1))
    }
}

/// The height of the average body whose lengths are most like those that were measured.
fn height(estimates: &[Option<Estimate>]) -> f64 {
    let unit = Body::of_height(1.0);
    let per_height = |(a, _): Pair| match a {
        Joint::SpineBase => unit.lower_spine,
        Joint::ShoulderLeft | Joint::ShoulderRight => unit.arms[0].upper,
        Joint::ElbowLeft | Joint::ElbowRight => unit.arms[0].lower,
        Joint::HipLeft | Joint::HipRight => unit.legs[0].upper,
        _ => unit.legs[0].lower,
    };
    let long = PAIRS.into_iter().zip(estimates).filter(|((a, b), _)| {
        use Joint::*;
        matches!(
            (a, b),
            (SpineBase, SpineMid)
                | (ShoulderLeft, ElbowLeft)
                | (ShoulderRight, ElbowRight)
                | (ElbowLeft, WristLeft)
                | (ElbowRight, WristRight)
                | (HipLeft, KneeLeft)
                | (HipRight, KneeRight)
                | (KneeLeft, AnkleLeft)
                | (KneeRight, AnkleRight)
        )
    });
    let (mut measured, mut units) = (0.0, 0.0);
    for (pair, estimate) in long {
        if let Some(estimate) = estimate {
            measured += estimate.value;
            units += per_height(pair);
        }
    }
    if units > 0.0 {
        (measured / units).clamp(0.8, 2.4)
    } else {
        AVERAGE_HEIGHT_M
    }
}

/// What was measured, and what stands in for the rest.
struct Known<'a> {
    estimates: &'a [Option<Estimate>],
    average: &'a Body,
}

impl Known<'_> {
    fn estimate(&self, a: Joint, b: Joint) -> Option<Estimate> {
        let index = PAIRS
            .iter()
            .position(|pair| *pair == (a, b) || *pair == (b, a))?;
        self.estimates[index]
    }

    /// The distance of two joints, drawn towards that of the other side: the best estimate of both where the sides of
    /// people differ by [`ASYMMETRY`].
    fn length(&self, a: Joint, b: Joint, average: f64) -> f64 {
        let own = self.estimate(a, b);
        let other = (a.mirrored() != a || b.mirrored() != b)
            .then(|| self.estimate(a.mirrored(), b.mirrored()))
            .flatten();
        let (Some(own), Some(other)) = (own, other) else {
            return own.or(other).map_or(average, |estimate| estimate.value);
        };
        let sides = 2.0 * (ASYMMETRY * own.value).powi(2);
        // Errors of a tracker that do not average out differ between the sides too.
        let floor = (0.01 * own.value).powi(2);
        let of_own = 1.0 / (own.sigma * own.sigma + floor);
        let of_other = 1.0 / (other.sigma * other.sigma + floor + sides);
        (own.value * of_own + other.value * of_other) / (of_own + of_other)
    }

    /// Half the distance of two joints of a pair, and how far it lies below `apex`, from the three distances.
    fn triangle(&self, (left, right): Pair, apex: Joint, (half, drop): (f64, f64)) -> (f64, f64) {
        let across = self.length(left, right, 2.0 * half) / 2.0;
        let average = half.hypot(drop);
        let edge = (self.length(apex, left, average) + self.length(apex, right, average)) / 2.0;
        (across, (edge * edge - across * across).max(0.0).sqrt())
    }

    fn arm(&self, mirrored: bool, shoulder: f64) -> Arm {
        use Joint::*;
        let of = |joint: Joint| if mirrored { joint.mirrored() } else { joint };
        let average = &self.average.arms[0];
        let length = |a: Joint, b: Joint, average: f64| self.length(of(a), of(b), average);
        let hand = length(WristLeft, HandLeft, average.hand);
        let thumb = length(WristLeft, ThumbLeft, average.thumb);
        let (sin, cos) = average.thumb_angle_rad.sin_cos();
        let between = (average.hand - average.thumb * cos).hypot(average.thumb * sin);
        let between = length(HandLeft, ThumbLeft, between);
        let cosine = (hand * hand + thumb * thumb - between * between) / (2.0 * hand * thumb);
        Arm {
            shoulder,
            upper: length(ShoulderLeft, ElbowLeft, average.upper),
            lower: length(ElbowLeft, WristLeft, average.lower),
            hand,
            fingers: length(HandLeft, HandTipLeft, average.fingers),
            thumb,
            thumb_angle_rad: cosine.clamp(-1.0, 1.0).acos().clamp(0.1, 1.6),
        }
    }

    fn leg(&self, mirrored: bool, hip: f64, foot_pitch_rad: f64) -> Leg {
        use Joint::*;
        let of = |joint: Joint| if mirrored { joint.mirrored() } else { joint };
        let average = &self.average.legs[0];
        let length = |a: Joint, b: Joint, average: f64| self.length(of(a), of(b), average);
        Leg {
            hip,
            upper: length(HipLeft, KneeLeft, average.upper),
            lower: length(KneeLeft, AnkleLeft, average.lower),
            foot: length(AnkleLeft, FootLeft, average.foot),
            foot_pitch_rad,
        }
    }
}
