//! What trackers are known to report otherwise than meant, put right in a sensor's own frame: the skin for the joint
//! (a shift along the ray), and joints that another joint set defines elsewhere in the body.

use nalgebra::Vector3;
use posefuse_skeleton::{
    Calibration, JOINT_COUNT, Joint, JointMap, JointSet, Position, Sensor, Skeleton,
    local_axes_within, trunk_axes,
};
use serde::{Deserialize, Serialize};

/// How far a joint is taken to be reported nearer to the sensor than it is where no calibration says, metres.
const USUAL_RAY_BIAS_M: f64 = 0.015;

/// How the joints of one sensor are put right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Corrections {
    /// Added along the ray, away from the sensor, metres.
    ray_m: [f64; JOINT_COUNT],
    /// Added in the joint's local axes, metres.
    offset_m: [Vector3<f64>; JOINT_COUNT],
    /// Whether any offset is not zero.
    offsets: bool,
}

impl Corrections {
    /// What `calibration` knows of sensors that report `joint_set`. Numbers that are none are left out.
    pub(crate) fn of(calibration: &Calibration, joint_set: JointSet) -> Self {
        let ray = |joint: Joint| calibration.ray_bias_m[joint].filter(|bias| bias.abs() < 1.0);
        let known = calibration.joint_offsets_m.get(&joint_set);
        let offset = |joint: Joint| {
            let offset: Option<Vector3<f64>> = known.and_then(|known| known[joint]);
            offset.filter(|offset| offset.norm() < 1.0)
        };
        let offset_m = Joint::ALL.map(|joint| offset(joint).unwrap_or_default());
        Self {
            ray_m: Joint::ALL.map(|joint| ray(joint).unwrap_or(USUAL_RAY_BIAS_M)),
            offset_m,
            offsets: offset_m.iter().any(|offset| *offset != Vector3::zeros()),
        }
    }

    /// Moves every joint of `skeleton`; along the ray only where `rays` says so.
    pub(crate) fn apply(&self, skeleton: &mut Skeleton<Sensor>, rays: bool) {
        if self.offsets {
            self.shift(skeleton);
        }
        if !rays {
            return;
        }
        for (joint, state) in skeleton.iter_mut() {
            let ray = state.position.vector().try_normalize(1e-6);
            let shift = ray.unwrap_or_default() * self.ray_m[joint as usize];
            state.position = state.position.moved(shift);
        }
    }

    fn shift(&self, skeleton: &mut Skeleton<Sensor>) {
        let joints: JointMap<Position<Sensor>> = skeleton.map(|_, state| state.position);
        let Some(trunk) = trunk_axes(&joints) else {
            return;
        };
        for (joint, state) in skeleton.iter_mut() {
            let offset = self.offset_m[joint as usize];
            if let Some(axes) = local_axes_within(joint, &joints, &trunk) {
                state.position = state.position.moved(axes * offset);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::{Confidence, JointState, SensorId};

    use super::*;

    fn upright() -> Skeleton<Sensor> {
        let sensor = SensorId::new(0).unwrap();
        let at = |x: f64, y: f64| {
            JointState::measured(Position::new(x, y, 3.0), 0.01, Confidence::FULL, sensor)
        };
        // Seen from the front: the person's left is the picture's right, up is -y.
        [
            (Joint::HipLeft, at(0.1, 0.0)),
            (Joint::HipRight, at(-0.1, 0.0)),
            (Joint::SpineShoulder, at(0.0, -0.5)),
            (Joint::Head, at(0.0, -0.8)),
        ]
        .into_iter()
        .collect()
    }

    #[test]
    fn joints_move_away_from_the_sensor_and_along_the_body() {
        let mut calibration = Calibration::default();
        calibration.ray_bias_m[Joint::Head] = Some(0.0);
        let mut offsets = JointMap::empty();
        offsets[Joint::Head] = Some(Vector3::new(0.03, 0.0, 0.05));
        let set = JointSet::ALL[0];
        calibration.joint_offsets_m.insert(set, offsets);
        let corrections = Corrections::of(&calibration, set);

        let (before, mut after) = (upright(), upright());
        corrections.apply(&mut after, true);
        let moved = |joint: Joint| {
            let at = |s: &Skeleton<Sensor>| s.position(joint).unwrap().vector();
            at(&after) - at(&before)
        };
        let head = Vector3::new(0.0, -0.05, -0.03);
        assert!(
            (moved(Joint::Head) - head).norm() < 1e-9,
            "forward is towards the sensor"
        );
        let hip = before.position(Joint::HipLeft).unwrap().vector();
        assert!((moved(Joint::HipLeft) - hip.normalize() * 0.015).norm() < 1e-12);

        let mut plain = upright();
        corrections.apply(&mut plain, false);
        assert_eq!(
            plain.position(Joint::HipLeft),
            before.position(Joint::HipLeft)
        );
    }
}
