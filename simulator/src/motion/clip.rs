//! A recorded motion of one person: canonical joints at a fixed rate.

use posefuse_skeleton::{JointMap, Position, Room};
use thiserror::Error;

/// Frames of one person at a fixed rate, in room axes, metres, feet on the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    name: String,
    rate_hz: f64,
    frames: Vec<JointMap<Position<Room>>>,
}

/// A clip cannot be made of this.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ClipError {
    /// No frames.
    #[error("{name}: a clip needs at least one frame, found none")]
    Empty {
        /// The clip.
        name: String,
    },
    /// A rate that no recording has.
    #[error("{name}: the frame rate must be above 0 and at most 10000 Hz, found {rate_hz}")]
    Rate {
        /// The clip.
        name: String,
        /// What was found.
        rate_hz: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("{name}: frame {frame} has a coordinate that is not finite")]
    NotFinite {
        /// The clip.
        name: String,
        /// Index of the frame, from 0.
        frame: usize,
    },
}

/// Over how many seconds a clip that plays there and back slows down before it turns.
const TURNING_S: f64 = 0.4;

impl Clip {
    /// Checks that there are frames, that their rate (per second) makes sense and that all coordinates are finite.
    pub fn new(
        name: impl Into<String>,
        rate_hz: f64,
        frames: Vec<JointMap<Position<Room>>>,
    ) -> Result<Self, ClipError> {
        let name = name.into();
        if frames.is_empty() {
            return Err(ClipError::Empty { name });
        }
        if !(rate_hz > 0.0 && rate_hz <= 10_000.0) {
            return Err(ClipError::Rate { name, rate_hz });
        }
        let broken = |joints: &JointMap<Position<Room>>| joints.iter().any(|(_, p)| !p.is_finite());
        if let Some(frame) = frames.iter().position(broken) {
            return Err(ClipError::NotFinite { name, frame });
        }
        Ok(Self {
            name,
            rate_hz,
            frames,
        })
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The same frames, each twice as long.
    pub(crate) fn at_half_rate(mut self) -> Self {
        self.rate_hz /= 2.0;
        self
    }

    /// The frames.
    pub fn frames(&self) -> &[JointMap<Position<Room>>] {
        &self.frames
    }

    /// From the first frame to the last, seconds.
    pub fn duration_s(&self) -> f64 {
        (self.frames.len() - 1) as f64 / self.rate_hz
    }

    /// The joints at `seconds` after the first frame, by a cubic through four frames (Catmull-Rom); the first or
    /// last frame outside of the clip. A joint that one of the frames lacks is missing.
    pub fn pose(&self, seconds: f64) -> JointMap<Position<Room>> {
        let last = self.frames.len() - 1;
        let position = (seconds * self.rate_hz).clamp(0.0, last as f64);
        let index = (position.floor() as usize).min(last);
        let u = position - index as f64;
        if u == 0.0 {
            return self.frames[index].clone();
        }
        let frame = |offset: usize| &self.frames[(index + offset).saturating_sub(1).min(last)];
        let weights = [
            u * (-0.5 + u * (1.0 - 0.5 * u)),
            1.0 + u * u * (-2.5 + 1.5 * u),
            u * (0.5 + u * (2.0 - 1.5 * u)),
            u * u * (-0.5 + 0.5 * u),
        ];
        frame(1).filter_map(|joint, _| {
            let mut sum = nalgebra::Vector3::zeros();
            for (offset, weight) in weights.into_iter().enumerate() {
                sum += frame(offset)[joint]?.vector() * weight;
            }
            Some(Position::from_vector(sum))
        })
    }

    /// Which time of the clip is shown at `seconds` when it plays to the end, back, and so on, slowing down before
    /// it turns.
    pub fn there_and_back(&self, seconds: f64) -> f64 {
        let duration = self.duration_s();
        if duration <= 0.0 {
            return 0.0;
        }
        let turning = TURNING_S.min(0.4 * duration);
        // Constant speed in the middle; at either end the speed falls to 0 evenly over `turning` seconds.
        let way = duration + turning;
        let phase = seconds.rem_euclid(2.0 * way);
        let time = if phase <= way {
            phase
        } else {
            2.0 * way - phase
        };
        if time < turning {
            0.5 * time * time / turning
        } else if time > way - turning {
            duration - 0.5 * (way - time).powi(2) / turning
        } else {
            time - 0.5 * turning
        }
    }

    /// Least and greatest x and y of all joints, metres.
    pub(crate) fn extent(&self) -> ([f64; 2], [f64; 2]) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (_, position) in self.frames.iter().flat_map(|joints| joints.iter()) {
            let point = position.point();
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        (low, high)
    }
}
