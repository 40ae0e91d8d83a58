//! The take as a viewer draws it: people as lines and spheres, sensors as frames. Room axes, metres.
//!
//! Joints are coloured by where they come from; a sphere's size is the joint's uncertainty (two standard deviations
//! either way, within bounds), its opacity the confidence. An entity lives shortly, so that people who left vanish.

use posefuse_skeleton::{
    BONES, Calibration, JOINT_COUNT, Joint, JointState, Provenance, Room, RoomFrame, Track,
};
use prost::Message;
use prost_types::{Duration, Timestamp};

use crate::foxglove::{
    Color, FrameTransform, FrameTransforms, LinePrimitive, Point3, Pose, Quaternion, SceneEntity,
    SceneUpdate, SpherePrimitive, TextPrimitive, Vector3, line_primitive,
};

/// The frame that everything stands in.
const ROOM: &str = "room";
/// How long a person stays on display after the last frame, nanoseconds.
const LIFETIME_NS: i32 = 300_000_000;
/// Diameter of a joint's sphere, metres.
const DIAMETER_M: std::ops::RangeInclusive<f64> = 0.03..=0.15;
const BONE_THICKNESS_M: f64 = 0.02;
const LABEL_HEIGHT_M: f64 = 0.12;

/// A fused frame as `foxglove.SceneUpdate`; `unix_ns` is its time since 1970.
pub(crate) fn scene_of(frame: &RoomFrame, unix_ns: u64) -> Vec<u8> {
    let update = SceneUpdate {
        deletions: Vec::new(),
        entities: frame
            .tracks
            .iter()
            .map(|track| person(track, unix_ns))
            .collect(),
    };
    update.encode_to_vec()
}

/// The sensors' places as `foxglove.FrameTransforms`.
pub(crate) fn transforms_of(calibration: &Calibration, unix_ns: u64) -> Vec<u8> {
    let transform = |(name, pose): (&String, &posefuse_skeleton::SensorPose)| {
        let (at, turn) = (
            pose.room_from_sensor.origin().vector(),
            pose.room_from_sensor.rotation(),
        );
        FrameTransform {
            timestamp: Some(timestamp(unix_ns)),
            parent_frame_id: ROOM.to_owned(),
            child_frame_id: format!("sensor/{name}"),
            translation: Some(Vector3 {
                x: at.x,
                y: at.y,
                z: at.z,
            }),
            rotation: Some(Quaternion {
                x: turn.i,
                y: turn.j,
                z: turn.k,
                w: turn.w,
            }),
        }
    };
    FrameTransforms {
        transforms: calibration.sensors.iter().map(transform).collect(),
    }
    .encode_to_vec()
}

fn timestamp(unix_ns: u64) -> Timestamp {
    Timestamp {
        seconds: (unix_ns / 1_000_000_000) as i64,
        nanos: (unix_ns % 1_000_000_000) as i32,
    }
}

fn person(track: &Track, unix_ns: u64) -> SceneEntity {
    SceneEntity {
        timestamp: Some(timestamp(unix_ns)),
        frame_id: ROOM.to_owned(),
        id: format!("person-{}", track.id),
        lifetime: Some(Duration {
            seconds: 0,
            nanos: LIFETIME_NS,
        }),
        spheres: track
            .skeleton
            .iter()
            .map(|(_, state)| sphere(state))
            .collect(),
        lines: vec![bones(track)],
        texts: label(track).into_iter().collect(),
        ..Default::default()
    }
}

fn colour(state: &JointState<Room>) -> Color {
    let (r, g, b) = match state.provenance {
        Provenance::Measured(_) => (0.16, 0.65, 0.35),
        Provenance::Predicted(_) => (0.93, 0.62, 0.12),
        Provenance::Repaired => (0.62, 0.35, 0.85),
    };
    let a = 0.4 + 0.6 * f64::from(state.confidence.get());
    Color { r, g, b, a }
}

fn pose_at(x: f64, y: f64, z: f64) -> Option<Pose> {
    let upright = Quaternion {
        w: 1.0,
        ..Default::default()
    };
    Some(Pose {
        position: Some(Vector3 { x, y, z }),
        orientation: Some(upright),
    })
}

fn sphere(state: &JointState<Room>) -> SpherePrimitive {
    let at = state.position.vector();
    let diameter = (4.0 * state.sigma_m()).clamp(*DIAMETER_M.start(), *DIAMETER_M.end());
    SpherePrimitive {
        pose: pose_at(at.x, at.y, at.z),
        size: Some(Vector3 {
            x: diameter,
            y: diameter,
            z: diameter,
        }),
        color: Some(colour(state)),
    }
}

/// All bones in one primitive: the joints once, and two indices a bone.
fn bones(track: &Track) -> LinePrimitive {
    let mut index_of = [None; JOINT_COUNT];
    let (mut points, mut colors) = (Vec::new(), Vec::new());
    for (joint, state) in track.skeleton.iter() {
        let at = state.position.vector();
        index_of[joint as usize] = Some(points.len() as u32);
        points.push(Point3 {
            x: at.x,
            y: at.y,
            z: at.z,
        });
        colors.push(colour(state));
    }
    let ends =
        |parent: Joint, child: Joint| Some([index_of[parent as usize]?, index_of[child as usize]?]);
    LinePrimitive {
        r#type: line_primitive::Type::LineList.into(),
        pose: pose_at(0.0, 0.0, 0.0),
        thickness: BONE_THICKNESS_M,
        points,
        colors,
        indices: BONES
            .iter()
            .filter_map(|bone| ends(bone.parent, bone.child))
            .flatten()
            .collect(),
        ..Default::default()
    }
}

fn label(track: &Track) -> Option<TextPrimitive> {
    let at = track.skeleton.position(Joint::Head)?.vector();
    Some(TextPrimitive {
        pose: pose_at(at.x, at.y, at.z + 0.25),
        billboard: true,
        font_size: LABEL_HEIGHT_M,
        color: Some(Color {
            r: 0.5,
            g: 0.5,
            b: 0.5,
            a: 1.0,
        }),
        text: format!("person {}", track.id),
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_skeleton::{Confidence, Position, SensorSet, Skeleton, TrackId};

    #[test]
    fn a_person_with_missing_joints_has_only_whole_bones() {
        let mut skeleton = Skeleton::empty();
        for joint in [Joint::Head, Joint::Neck, Joint::FootLeft] {
            skeleton[joint] = Some(JointState {
                position: Position::new(1.0, 2.0, joint as u8 as f64),
                covariance: nalgebra::Matrix3::from_diagonal_element(4e-4),
                confidence: Confidence::FULL,
                provenance: Provenance::Repaired,
            });
        }
        let track = Track {
            id: TrackId(4),
            since: posefuse_skeleton::Timestamp::ZERO,
            sensors: SensorSet::EMPTY,
            skeleton,
            hands: [None; 2],
        };
        let entity = person(&track, 1_500_000_000);
        assert_eq!(entity.spheres.len(), 3);
        // Neck (canonical 2) comes before Head (3): the one whole bone joins the first two points.
        assert_eq!(entity.lines[0].indices, [0, 1]);
        assert_eq!(entity.lines[0].points.len(), entity.lines[0].colors.len());
        assert_eq!(
            entity.timestamp,
            Some(Timestamp {
                seconds: 1,
                nanos: 500_000_000
            })
        );
        assert!((entity.spheres[0].size.unwrap().x - 0.08).abs() < 1e-12);
    }
}
