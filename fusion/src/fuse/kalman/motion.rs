//! How joints move: acceleration comes and goes (Singer, "Estimating optimal tracking filter performance for manned
//! maneuvering targets", IEEE T-AES 6, 1970), velocity dies away slowly.

use posefuse_skeleton::Joint;
use serde::{Deserialize, Serialize};

use super::state::Blocks;

/// Acceleration forgets itself with this time constant, seconds.
const ACCELERATION_S: f64 = 0.12;
/// So does the velocity of a joint that is seen, and of one that is not.
const SEEN_S: f64 = 2.0;
const UNSEEN_S: f64 = 0.3;
/// How the velocity of an unseen joint wanders, m^2/s^3.
const WANDER: f64 = 14.0;
/// Longest step that the process noise's short forms hold for, seconds.
const STEP_S: f64 = 0.02;

/// What one step in time does to the belief of a joint; the same for every axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Motion {
    pub(super) pv: f64,
    pub(super) pa: f64,
    pub(super) vv: f64,
    pub(super) va: f64,
    pub(super) aa: f64,
    /// Added to pp, pv, pa, vv, va, aa.
    pub(super) noise: [f64; 6],
}

/// How strongly a joint is accelerated while the belief learns of it, m/s^2 (RMS per axis).
pub(super) fn liveliness(joint: Joint) -> f64 {
    use Joint::*;
    match joint {
        SpineBase | SpineMid | SpineShoulder | Neck | Head | ShoulderLeft | ShoulderRight
        | HipLeft | HipRight => 2.5,
        ElbowLeft | ElbowRight | KneeLeft | KneeRight => 5.0,
        AnkleLeft | AnkleRight | FootLeft | FootRight => 7.8,
        WristLeft | HandLeft | HandTipLeft | ThumbLeft | WristRight | HandRight | HandTipRight
        | ThumbRight => 6.4,
    }
}

impl Motion {
    /// A step of `elapsed_s` for a joint whose acceleration has this `variance`, and which is being `seen`.
    pub(super) fn new(elapsed_s: f64, variance: f64, seen: bool) -> Self {
        let steps = (elapsed_s / STEP_S).ceil().clamp(1.0, 20.0);
        let one = Self::short(elapsed_s / steps, variance, seen);
        (1..steps as usize).fold(one, |all, _| all.then(&one))
    }

    fn short(t: f64, variance: f64, seen: bool) -> Self {
        let velocity_s = if seen { SEEN_S } else { UNSEEN_S };
        let (vv, aa) = ((-t / velocity_s).exp(), (-t / ACCELERATION_S).exp());
        let pv = velocity_s * (1.0 - vv);
        // What acceleration adds to velocity, and velocity to the place, both dying away on the way.
        let va = ACCELERATION_S * (1.0 - aa) * (1.0 + vv) * 0.5;
        let pa = t * va * 0.5;
        let jerk = 2.0 * variance / ACCELERATION_S;
        let power = |n: i32, over: f64| jerk * t.powi(n) / over;
        let wander = if seen { 0.0 } else { WANDER };
        Self {
            pv,
            pa,
            vv,
            va,
            aa,
            noise: [
                power(5, 20.0) + wander * t * t * t / 3.0,
                power(4, 8.0) + wander * t * t / 2.0,
                power(3, 6.0),
                power(3, 3.0) + wander * t,
                power(2, 2.0),
                power(1, 1.0),
            ],
        }
    }

    /// This step, and then `next`.
    pub(super) fn then(&self, next: &Self) -> Self {
        let [pp, pv, pa, vv, va, aa] = self.noise;
        let n = next;
        let row = [
            pp + n.pv * pv + n.pa * pa,
            pv + n.pv * vv + n.pa * va,
            pa + n.pv * va + n.pa * aa,
        ];
        let second = [n.vv * vv + n.va * va, n.vv * va + n.va * aa];
        Self {
            pv: self.pv + n.pv * self.vv,
            pa: self.pa + n.pv * self.va + n.pa * self.aa,
            vv: n.vv * self.vv,
            va: n.vv * self.va + n.va * self.aa,
            aa: n.aa * self.aa,
            noise: [
                n.noise[0] + row[0] + row[1] * n.pv + row[2] * n.pa,
                n.noise[1] + row[1] * n.vv + row[2] * n.va,
                n.noise[2] + row[2] * n.aa,
                n.noise[3] + second[0] * n.vv + second[1] * n.va,
                n.noise[4] + second[1] * n.aa,
                n.noise[5] + n.aa * n.aa * aa,
            ],
        }
    }

    /// `F m F'`.
    pub(super) fn carry(&self, m: &Blocks) -> Blocks {
        let (vp, ap, av) = (m.pv.transpose(), m.pa.transpose(), m.va.transpose());
        let p = [
            m.pp + vp * self.pv + ap * self.pa,
            m.pv + m.vv * self.pv + av * self.pa,
            m.pa + m.va * self.pv + m.aa * self.pa,
        ];
        let v = [
            m.vv * self.vv + av * self.va,
            m.va * self.vv + m.aa * self.va,
        ];
        Blocks {
            pp: p[0] + p[1] * self.pv + p[2] * self.pa,
            pv: p[1] * self.vv + p[2] * self.va,
            pa: p[2] * self.aa,
            vv: v[0] * self.vv + v[1] * self.va,
            va: v[1] * self.aa,
            aa: m.aa * (self.aa * self.aa),
        }
    }

    /// `F' m F`.
    pub(super) fn carry_back(&self, m: &Blocks) -> Blocks {
        let (vp, av) = (m.pv.transpose(), m.va.transpose());
        // Rows of m F for place, velocity and acceleration; columns likewise.
        let p = [
            m.pp * self.pv + m.pv * self.vv,
            m.pp * self.pa + m.pv * self.va + m.pa * self.aa,
        ];
        let v = [
            vp * self.pv + m.vv * self.vv,
            vp * self.pa + m.vv * self.va + m.va * self.aa,
        ];
        let a = m.pa.transpose() * self.pa + av * self.va + m.aa * self.aa;
        Blocks {
            pp: m.pp,
            pv: p[0],
            pa: p[1],
            vv: p[0] * self.pv + v[0] * self.vv,
            va: p[1] * self.pv + v[1] * self.vv,
            aa: p[1] * self.pa + v[1] * self.va + a * self.aa,
        }
    }

    /// `F' x`.
    pub(super) fn apply_back(
        &self,
        x: &[nalgebra::Vector3<f64>; 3],
    ) -> [nalgebra::Vector3<f64>; 3] {
        let [p, v, a] = x;
        [
            *p,
            p * self.pv + v * self.vv,
            p * self.pa + v * self.va + a * self.aa,
        ]
    }
}
