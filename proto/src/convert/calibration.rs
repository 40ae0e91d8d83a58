//! Calibrations and poses to and from the wire; a pose that is no rigid motion is refused.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use posefuse_skeleton::{
    Calibration, FloorSource, Frame, Joint, JointSet, PoseSigma, SensorPose, Transform,
};

use super::{WireError, check_sensor_name};
use crate::v1;

/// No tracker's joint is further from where it should be, metres.
const MAX_JOINT_OFFSET_M: f64 = 0.5;

/// A rigid motion as the wire says it.
pub fn pose_to_wire<To: Frame, From: Frame>(to_from_from: &Transform<To, From>) -> v1::Pose {
    let (t, q) = (to_from_from.origin().vector(), to_from_from.rotation());
    v1::Pose {
        translation: Some(v1::Vector3 {
            x: t.x,
            y: t.y,
            z: t.z,
        }),
        rotation: Some(v1::Quaternion {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        }),
    }
}

/// A rigid motion from the wire, checked; `sensor` names it in errors.
pub fn pose_from_wire<To: Frame, From: Frame>(
    sensor: &str,
    pose: &v1::Pose,
) -> Result<Transform<To, From>, WireError> {
    let t = pose
        .translation
        .as_ref()
        .ok_or(WireError::Missing("translation"))?;
    let q = pose
        .rotation
        .as_ref()
        .ok_or(WireError::Missing("rotation"))?;
    let problem = |problem: String| WireError::Pose {
        sensor: sensor.to_owned(),
        problem,
    };
    let quaternion = Quaternion::new(q.w, q.x, q.y, q.z);
    let off = (quaternion.norm() - 1.0).abs();
    let translation = Vector3::new(t.x, t.y, t.z);
    if !translation.iter().all(|v| v.is_finite()) || !off.is_finite() {
        return Err(problem("a number is not finite".into()));
    }
    if off > 1e-3 {
        return Err(problem(format!(
            "the quaternion's length is {:.4}, it must be 1",
            quaternion.norm()
        )));
    }
    // A quaternion that is already as exact as f64 allows is kept bit for bit: takes are fused again to the same bytes.
    let rotation = if off < 1e-12 {
        UnitQuaternion::new_unchecked(quaternion)
    } else {
        UnitQuaternion::new_normalize(quaternion)
    };
    Ok(Transform::from_parts(translation, rotation))
}

/// A calibration as the wire says it.
pub fn calibration_to_wire(calibration: &Calibration) -> v1::Calibration {
    let floor = match calibration.floor {
        FloorSource::Walk => "walk",
        FloorSource::Manual => "manual",
        FloorSource::Assumed => "assumed",
    };
    let pose = |(name, pose): (&String, &SensorPose)| v1::SensorPose {
        sensor: name.clone(),
        room_from_sensor: Some(pose_to_wire(&pose.room_from_sensor)),
        time_offset_ns: pose.time_offset_ns,
        residual_median_m: pose.residual_median_m,
        residual_p95_m: pose.residual_p95_m,
        samples: pose.samples,
        sigma: pose.sigma.map(|sigma| v1::PoseSigma {
            position_m: sigma.position_m,
            rotation_deg: sigma.rotation_rad.to_degrees(),
            time_ms: sigma.time_s * 1e3,
        }),
    };
    v1::Calibration {
        created: calibration.created.clone(),
        method: calibration.method.clone(),
        floor: floor.to_owned(),
        sensors: calibration.sensors.iter().map(pose).collect(),
        verdict: calibration.verdict.clone(),
        ray_bias: calibration
            .ray_bias_m
            .iter()
            .map(|(joint, metres)| v1::RayBias {
                joint: joint.name().to_owned(),
                metres: *metres,
            })
            .collect(),
        joint_offsets: joint_offsets_to_wire(calibration),
    }
}

fn joint_offsets_to_wire(calibration: &Calibration) -> Vec<v1::JointOffset> {
    let sets = calibration.joint_offsets_m.iter();
    sets.flat_map(|(set, offsets)| {
        offsets.iter().map(|(joint, offset)| v1::JointOffset {
            joint_set: set.name().to_owned(),
            joint: joint.name().to_owned(),
            offset: Some(v1::Vector3 {
                x: offset.x,
                y: offset.y,
                z: offset.z,
            }),
        })
    })
    .collect()
}

/// What the calibration says of joints, checked.
fn read_joints(wire: &v1::Calibration, calibration: &mut Calibration) -> Result<(), WireError> {
    let length = |metres: f64| {
        if metres.abs() <= MAX_JOINT_OFFSET_M {
            Ok(metres)
        } else {
            Err(WireError::Joint(format!(
                "an offset within 0.5 m of 0 is needed, found {metres}"
            )))
        }
    };
    let joint = |name: &str| name.parse::<Joint>().map_err(WireError::Joint);
    for bias in &wire.ray_bias {
        calibration.ray_bias_m[joint(&bias.joint)?] = Some(length(bias.metres)?);
    }
    for entry in &wire.joint_offsets {
        let set: JointSet = entry.joint_set.parse().map_err(WireError::JointSet)?;
        let offset = entry.offset.ok_or(WireError::Missing("offset"))?;
        let offset = Vector3::new(length(offset.x)?, length(offset.y)?, length(offset.z)?);
        let offsets = calibration.joint_offsets_m.entry(set).or_default();
        offsets[joint(&entry.joint)?] = Some(offset);
    }
    Ok(())
}

/// A calibration from the wire, checked.
pub fn calibration_from_wire(wire: &v1::Calibration) -> Result<Calibration, WireError> {
    let mut calibration = Calibration {
        created: wire.created.clone(),
        method: wire.method.clone(),
        floor: match wire.floor.as_str() {
            "manual" => FloorSource::Manual,
            "assumed" => FloorSource::Assumed,
            _ => FloorSource::Walk,
        },
        verdict: wire.verdict.clone(),
        ..Default::default()
    };
    read_joints(wire, &mut calibration)?;
    for pose in &wire.sensors {
        check_sensor_name(&pose.sensor)?;
        let wire_pose = pose
            .room_from_sensor
            .as_ref()
            .ok_or(WireError::Missing("room_from_sensor"))?;
        let place = SensorPose {
            room_from_sensor: pose_from_wire(&pose.sensor, wire_pose)?,
            time_offset_ns: pose.time_offset_ns,
            residual_median_m: pose.residual_median_m,
            residual_p95_m: pose.residual_p95_m,
            samples: pose.samples,
            sigma: pose.sigma.map(|sigma| PoseSigma {
                position_m: sigma.position_m,
                rotation_rad: sigma.rotation_deg.to_radians(),
                time_s: sigma.time_ms * 1e-3,
            }),
        };
        if calibration
            .sensors
            .insert(pose.sensor.clone(), place)
            .is_some()
        {
            let problem = "it is there twice".to_owned();
            return Err(WireError::Pose {
                sensor: pose.sensor.clone(),
                problem,
            });
        }
    }
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Calibration {
        let pose = SensorPose {
            room_from_sensor: Transform::from_parts(
                Vector3::new(1.0, 2.0, 0.1 + 0.2),
                UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
            ),
            time_offset_ns: -7,
            residual_median_m: 0.02,
            residual_p95_m: 0.05,
            samples: 100,
            sigma: Some(PoseSigma {
                position_m: 0.004,
                rotation_rad: 0.25_f64.to_radians(),
                time_s: 0.5 * 1e-3,
            }),
        };
        Calibration {
            created: "2026-01-01T00:00:00Z".into(),
            method: "svd".into(),
            floor: FloorSource::Assumed,
            verdict: "weak".into(),
            sensors: [("left".to_owned(), pose)].into(),
            ray_bias_m: [(Joint::Head, 0.02)].into_iter().collect(),
            joint_offsets_m: [(
                JointSet::AzureKinect,
                [(Joint::Neck, Vector3::new(0.0, 0.01, -0.03))]
                    .into_iter()
                    .collect(),
            )]
            .into(),
        }
    }

    #[test]
    fn comes_back_bit_for_bit() {
        let calibration = example();
        assert_eq!(
            calibration_from_wire(&calibration_to_wire(&calibration)).unwrap(),
            calibration
        );
    }

    #[test]
    fn what_is_no_rigid_motion_is_refused_by_name() {
        let mut wire = calibration_to_wire(&example());
        let pose = wire.sensors[0].room_from_sensor.as_mut().unwrap();
        pose.rotation.as_mut().unwrap().w += 0.5;
        let error = calibration_from_wire(&wire).unwrap_err().to_string();
        assert!(
            error.contains("left") && error.contains("length"),
            "{error}"
        );
        wire.sensors[0]
            .room_from_sensor
            .as_mut()
            .unwrap()
            .translation
            .as_mut()
            .unwrap()
            .x = f64::NAN;
        assert!(calibration_from_wire(&wire).is_err());
        let mut twice = calibration_to_wire(&example());
        twice.sensors.push(twice.sensors[0].clone());
        assert!(calibration_from_wire(&twice).is_err());
    }
}
