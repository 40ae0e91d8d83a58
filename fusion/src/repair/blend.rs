//! No joint jumps where what was made up gives way to what is measured, or the other way round.
//!
//! What differs at the seam is kept as an offset that a critically damped spring takes back to zero, as in Bollo's
//! inertialization (GDC 2018). Springs add up, so a joint that is seen only now and then needs no other rule.

use nalgebra::Vector3;
use posefuse_skeleton::Timestamp;
use serde::{Deserialize, Serialize};

/// An offset below this is none, metres.
const SETTLED_M: f64 = 1e-4;
/// So many time constants take 10 cm below [`SETTLED_M`]: (1 + x) e^-x = 1e-3.
const TIME_CONSTANTS: f64 = 9.3;
/// After a longer gap nobody expects a joint to go on where it was, seconds.
const MAX_GAP_S: f64 = 0.2;
/// What is further off than this has not moved there, metres.
const MAX_OFFSET_M: f64 = 0.8;
/// Share of a new velocity in the running one.
const VELOCITY_GAIN: f64 = 0.5;
/// No offset begins faster, m/s.
const MAX_SPEED_MPS: f64 = 3.0;

/// One joint's way out of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Blend {
    last: Option<Last>,
    offset: Vector3<f64>,
    /// Of the offset, m/s.
    drift: Vector3<f64>,
}

/// Where a joint's place comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Source {
    /// The sensors.
    Sensors,
    /// The simple model in the engine; `back`: beside sensors that have the joint again but are not yet believed.
    Simple { back: bool },
    /// The model outside.
    Outside { back: bool },
}

impl Source {
    /// The same, of a joint that sensors have again, or have not.
    pub(super) fn with(self, back: bool) -> Self {
        match self {
            Self::Sensors => self,
            Self::Simple { .. } => Self::Simple { back },
            Self::Outside { .. } => Self::Outside { back },
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Last {
    time: Timestamp,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    source: Source,
}

impl Default for Blend {
    fn default() -> Self {
        Self {
            last: None,
            offset: Vector3::zeros(),
            drift: Vector3::zeros(),
        }
    }
}

impl Blend {
    /// The joint is missing: nothing is known to go on from.
    pub(super) fn end(&mut self) {
        *self = Self::default();
    }

    /// What is to be added to `target`, the joint's place at `time`, so that it goes on from where it was; `None`
    /// where that is nothing. `blend_s` is how long 10 cm take.
    pub(super) fn step(
        &mut self,
        time: Timestamp,
        target: Vector3<f64>,
        source: Source,
        blend_s: f64,
    ) -> Option<Vector3<f64>> {
        let Some(last) = self.last else {
            self.note(time, target, source, None);
            return None;
        };
        let elapsed_s = time.since_seconds(last.time);
        if !(0.0..=MAX_GAP_S).contains(&elapsed_s) {
            self.end();
            self.note(time, target, source, None);
            return None;
        }
        if source != last.source && blend_s > 0.0 {
            let expected = last.position + last.velocity.cap_magnitude(MAX_SPEED_MPS) * elapsed_s;
            self.offset = expected - target;
            self.drift = Vector3::zeros();
            if self.offset.norm() > MAX_OFFSET_M {
                self.offset = Vector3::zeros();
            }
        } else if self.offset != Vector3::zeros() {
            self.relax(elapsed_s, blend_s);
        }
        let offset = (self.offset != Vector3::zeros()).then_some(self.offset);
        self.note(time, target + self.offset, source, Some((last, elapsed_s)));
        offset
    }

    fn relax(&mut self, elapsed_s: f64, blend_s: f64) {
        let pull = TIME_CONSTANTS / blend_s.max(1e-3);
        let left = (-pull * elapsed_s).exp();
        let rate = self.drift + self.offset * pull;
        self.offset = (self.offset + rate * elapsed_s) * left;
        self.drift = (self.drift - rate * (pull * elapsed_s)) * left;
        if self.offset.norm() < SETTLED_M {
            (self.offset, self.drift) = (Vector3::zeros(), Vector3::zeros());
        }
    }

    fn note(
        &mut self,
        time: Timestamp,
        position: Vector3<f64>,
        source: Source,
        before: Option<(Last, f64)>,
    ) {
        let velocity = match before {
            Some((last, elapsed_s)) if elapsed_s > 0.0 => {
                let new = (position - last.position) / elapsed_s;
                last.velocity.lerp(&new, VELOCITY_GAIN)
            }
            _ => Vector3::zeros(),
        };
        self.last = Some(Last {
            time,
            position,
            velocity,
            source,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: i64 = 33_333_333;

    fn at(frame: i64) -> Timestamp {
        Timestamp::from_ns(frame * STEP_NS)
    }

    fn source(made_up: bool) -> (bool, Source) {
        let source = if made_up {
            Source::Simple { back: false }
        } else {
            Source::Sensors
        };
        (made_up, source)
    }

    #[test]
    fn a_joint_seen_10_cm_off_comes_back_in_time_and_never_jumps() {
        let mut blend = Blend::default();
        let mut last = Vector3::zeros();
        for frame in 0..30 {
            let (made_up, source) = source(frame < 10);
            let target = Vector3::new(if made_up { 0.0 } else { 0.1 }, 0.0, 1.0);
            let offset = blend.step(at(frame), target, source, 0.4);
            let place = target + offset.unwrap_or_else(Vector3::zeros);
            if frame > 0 {
                assert!((place - last).norm() < 0.03, "frame {frame}");
            }
            // 0.4 s are 12 frames.
            assert_eq!(offset.is_some(), (10..22).contains(&frame), "frame {frame}");
            last = place;
        }
    }

    #[test]
    fn nothing_is_added_to_what_is_measured_throughout() {
        let mut blend = Blend::default();
        for frame in 0..20 {
            let target = Vector3::new((frame as f64 * 0.7).sin(), 0.0, 1.0);
            assert_eq!(blend.step(at(frame), target, Source::Sensors, 0.4), None);
        }
    }

    #[test]
    fn a_joint_seen_now_and_then_comes_back_all_the_same() {
        let mut blend = Blend::default();
        let mut offset = None;
        for frame in 0..60 {
            let (_, source) = source(frame < 10 || frame % 3 == 0);
            let target = Vector3::new(if frame < 10 { 0.0 } else { 0.1 }, 0.0, 1.0);
            offset = blend.step(at(frame), target, source, 0.4);
        }
        assert!(
            offset.is_none_or(|offset| offset.norm() < 0.01),
            "{offset:?}"
        );
    }
}
