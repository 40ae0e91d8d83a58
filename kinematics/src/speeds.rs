//! Where a body would be if it went on as it did.

use nalgebra::UnitQuaternion;

use crate::bones::BONE_COUNT;
use crate::posture::Posture;

/// Speeds die away with this time constant, seconds: what is not seen does not go on for ever.
const DECAY_S: f64 = 0.25;

/// The posture `elapsed` seconds after `last`, which came `before` seconds after `previous`.
pub(crate) fn expected(previous: &Posture, last: &Posture, before: f64, elapsed: f64) -> Posture {
    let share = DECAY_S * (1.0 - (-elapsed / DECAY_S).exp()) / before;
    let mut expected = last.clone();
    expected.root += (last.root - previous.root) * share;
    for bone in 0..BONE_COUNT {
        let turned = (previous.balls[bone].inverse() * last.balls[bone]).scaled_axis();
        expected.balls[bone] *= UnitQuaternion::from_scaled_axis(turned * share);
        for (index, angle) in expected.angles[bone].iter_mut().enumerate() {
            *angle += (last.angles[bone][index] - previous.angles[bone][index]) * share;
        }
    }
    expected
}
