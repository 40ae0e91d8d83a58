//! People as lines and spheres, sensors and bones as frames. Room axes, metres.
//!
//! Joints are coloured by where they come from; a sphere's size is the joint's uncertainty (two standard deviations
//! either way, within bounds), its opacity the confidence. An entity lives shortly, so that people who left vanish.

use posefuse_skeleton::{
    BONES, Calibration, JOINT_COUNT, Joint, JointState, Provenance, Room, RoomFrame, Track, TrackId,
};
use prost::Message;
use prost_types::{Duration, Timestamp};

use super::messages::{
    Color, FrameTransform, FrameTransforms, LinePrimitive, Point3, Pose, Quaternion, SceneEntity,
    SceneEntityDeletion, SceneUpdate, SpherePrimitive, TextPrimitive, Vector3, line_primitive,
    scene_entity_deletion,
};

/// The frame that everything stands in.
pub const ROOM: &str = "room";
/// How long a person stays on display after the last frame, nanoseconds.
const LIFETIME_NS: i32 = 300_000_000;
/// Diameter of a joint's sphere, metres.
const DIAMETER_M: std::ops::RangeInclusive<f64> = 0.03..=0.15;
const BONE_THICKNESS_M: f64 = 0.02;
const LABEL_HEIGHT_M: f64 = 0.12;

/// A fused frame as `foxglove.SceneUpdate`; `unix_ns` is its time since 1970.
pub fn scene_of(frame: &RoomFrame, unix_ns: u64) -> Vec<u8> {
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

/// The removal of people from the scene as `foxglove.SceneUpdate`. Appended to another such message it is part of that one.
pub fn deletions_of(people: impl IntoIterator<Item = TrackId>, unix_ns: u64) -> Vec<u8> {
    let deletion = |id| SceneEntityDeletion {
        timestamp: Some(timestamp(unix_ns)),
        r#type: scene_entity_deletion::Type::MatchingId.into(),
        id: entity_id(id),
    };
    let update = SceneUpdate {
        deletions: people.into_iter().map(deletion).collect(),
        entities: Vec::new(),
    };
    update.encode_to_vec()
}

/// What a person is called in scenes.
pub fn entity_id(id: TrackId) -> String {
    format!("person-{id}")
}

/// A frame that stands in another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Child {
    /// Its name.
    pub name: String,
    /// The name of the frame it stands in, e.g. [`ROOM`].
    pub parent: String,
    /// Its origin there, metres.
    pub origin: nalgebra::Vector3<f64>,
    /// Its axes there: `parent_from_child`.
    pub rotation: nalgebra::UnitQuaternion<f64>,
}

/// Frames as `foxglove.FrameTransforms`.
pub fn transforms_of(children: impl IntoIterator<Item = Child>, unix_ns: u64) -> Vec<u8> {
    let transform = |child: Child| FrameTransform {
        timestamp: Some(timestamp(unix_ns)),
        parent_frame_id: child.parent,
        child_frame_id: child.name,
        translation: Some(Vector3 {
            x: child.origin.x,
            y: child.origin.y,
            z: child.origin.z,
        }),
        rotation: Some(Quaternion {
            x: child.rotation.i,
            y: child.rotation.j,
            z: child.rotation.k,
            w: child.rotation.w,
        }),
    };
    FrameTransforms {
        transforms: children.into_iter().map(transform).collect(),
    }
    .encode_to_vec()
}

/// The sensors' places as `foxglove.FrameTransforms`.
pub fn sensors_of(calibration: &Calibration, unix_ns: u64) -> Vec<u8> {
    let sensors = calibration.sensors.iter().map(|(name, pose)| Child {
        name: format!("sensor/{name}"),
        parent: ROOM.to_owned(),
        origin: pose.room_from_sensor.origin().vector(),
        rotation: pose.room_from_sensor.rotation(),
    });
    transforms_of(sensors, unix_ns)
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
        id: entity_id(track.id),
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
