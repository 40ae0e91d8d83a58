//! ROS static transforms: one `tf2_msgs/TFMessage` in YAML, as `ros2 topic echo /tf_static` prints it and
//! `ros2 topic pub /tf_static tf2_msgs/msg/TFMessage` takes it.
//!
//! The room is `posefuse_room` (x forward, y left, z up, as REP 103 has it), each sensor a child `<sensor>_optical` in
//! optical axes. What is read may be a tree: a sensor is a frame without children, its pose the chain up to the one root.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use posefuse_skeleton::Calibration;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::{Foreign, FormatError, foreign, number};

const ROOM: &str = "posefuse_room";
const SUFFIX: &str = "_optical";
/// How far the length of a quaternion may be from 1.
const UNIT_TOLERANCE: f64 = 2e-3;

pub(super) fn write(calibration: &Calibration) -> String {
    let mut text = format!(
        "# Posefuse: where each sensor stands; {ROOM} is x forward, y left, z up, the sensors' axes are optical.\n\
         # Time offsets and verdict are not in this form. Publish all of it:\n\
         #   ros2 topic pub --qos-durability transient_local /tf_static tf2_msgs/msg/TFMessage \"$(cat THIS_FILE)\"\n\
         # or one sensor each:\n"
    );
    // Writing to a String cannot fail.
    for (sensor, pose) in &calibration.sensors {
        let (t, q) = (
            pose.room_from_sensor.origin().vector(),
            pose.room_from_sensor.rotation(),
        );
        let _ = writeln!(
            text,
            "#   ros2 run tf2_ros static_transform_publisher --x {} --y {} --z {} --qx {} --qy {} --qz {} --qw {} \
             --frame-id {ROOM} --child-frame-id {sensor}{SUFFIX}",
            number(t.x),
            number(t.y),
            number(t.z),
            number(q.i),
            number(q.j),
            number(q.k),
            number(q.w)
        );
    }
    text += "transforms:\n";
    for (sensor, pose) in &calibration.sensors {
        let (t, q) = (
            pose.room_from_sensor.origin().vector(),
            pose.room_from_sensor.rotation(),
        );
        let _ = write!(
            text,
            "- header:\n    stamp:\n      sec: 0\n      nanosec: 0\n    frame_id: {ROOM}\n  child_frame_id: {child}\n  \
             transform:\n    translation:\n      x: {}\n      y: {}\n      z: {}\n    rotation:\n      x: {}\n      y: {}\n      \
             z: {}\n      w: {}\n",
            number(t.x),
            number(t.y),
            number(t.z),
            number(q.i),
            number(q.j),
            number(q.k),
            number(q.w),
            child = super::quoted(&format!("{sensor}{SUFFIX}")),
        );
    }
    text
}

#[derive(Deserialize)]
struct Message {
    transforms: Vec<Stamped>,
}

/// `geometry_msgs/TransformStamped`; what else is in it does not matter for a static one.
#[derive(Deserialize)]
struct Stamped {
    header: Header,
    child_frame_id: String,
    transform: Pose,
}

#[derive(Deserialize)]
struct Header {
    frame_id: String,
}

#[derive(Deserialize)]
struct Pose {
    translation: Xyz,
    rotation: Xyzw,
}

#[derive(Deserialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Xyzw {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// Frames by name, each with its parent.
type Tree = BTreeMap<String, (String, Isometry3<f64>)>;

pub(super) fn read(text: &str) -> Result<Calibration, FormatError> {
    let entries: Vec<Stamped> = if is_list(text) {
        documents::<Vec<Stamped>>(text)?
            .into_iter()
            .flatten()
            .collect()
    } else if text.contains("transforms") {
        let messages = documents::<Message>(text)?;
        messages.into_iter().flat_map(|m| m.transforms).collect()
    } else {
        documents(text)?
    };
    let mut tree = Tree::new();
    for entry in &entries {
        let (parent, child) = (frame(&entry.header.frame_id), frame(&entry.child_frame_id));
        let found = (parent.to_owned(), motion(child, &entry.transform)?);
        let known = tree.insert(child.to_owned(), found.clone());
        if known.is_some_and(|known| known != found) {
            return Err(FormatError::Frames(format!(
                "`{child}` stands there twice with different places; delete one of the two"
            )));
        }
    }
    let poses = leaves(&tree)?.into_iter().map(|leaf| {
        let pose = Foreign {
            room_from_sensor: to_root(&tree, leaf)?,
            time_offset_ms: 0.0,
        };
        Ok((sensor(leaf).to_owned(), pose))
    });
    foreign(poses.collect::<Result<_, FormatError>>()?)
}

/// Whether the first document is a list rather than a message.
fn is_list(text: &str) -> bool {
    let lines = text.lines().map(str::trim);
    let mut content = lines.filter(|line| !line.is_empty() && !line.starts_with(['#', '%']));
    let first = content.find(|line| *line != "---").unwrap_or_default();
    first.starts_with("- ") || first == "-" || first.starts_with('[')
}

fn documents<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, FormatError> {
    serde_saphyr::from_multiple(text).map_err(|error| FormatError::Syntax {
        form: "ROS static transforms",
        problem: error.to_string(),
    })
}

/// Old tf wrote a slash ahead of names.
fn frame(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// The sensor whose frame is called so.
fn sensor(frame: &str) -> &str {
    let name = frame.strip_suffix("_frame").unwrap_or(frame);
    name.strip_suffix(SUFFIX).unwrap_or(frame)
}

fn motion(child: &str, pose: &Pose) -> Result<Isometry3<f64>, FormatError> {
    let (t, q) = (&pose.translation, &pose.rotation);
    let quaternion = Quaternion::new(q.w, q.x, q.y, q.z);
    let length = quaternion.norm();
    if (length - 1.0).abs() > UNIT_TOLERANCE || !length.is_finite() {
        return Err(FormatError::Frames(format!(
            "the rotation of `{child}` is no unit quaternion, its length is {length:.4}; mend it, or calibrate again"
        )));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(Isometry3::from_parts(
        Vector3::new(t.x, t.y, t.z).into(),
        rotation,
    ))
}

/// The frames without children, when all of them hang on one root.
fn leaves(tree: &Tree) -> Result<Vec<&str>, FormatError> {
    let parents: BTreeSet<&str> = tree.values().map(|(parent, _)| parent.as_str()).collect();
    let roots: Vec<&str> = parents
        .iter()
        .filter(|parent| !tree.contains_key(**parent))
        .copied()
        .collect();
    if roots.len() > 1 {
        return Err(FormatError::Frames(format!(
            "they hang on several roots: {}; give them one parent frame, the room",
            roots.join(", ")
        )));
    }
    let leaves = tree.keys().map(String::as_str);
    Ok(leaves.filter(|frame| !parents.contains(frame)).collect())
}

fn to_root(tree: &Tree, leaf: &str) -> Result<Isometry3<f64>, FormatError> {
    let mut root_from_leaf = Isometry3::identity();
    let mut at = leaf;
    for _ in 0..=tree.len() {
        let Some((parent, parent_from_child)) = tree.get(at) else {
            return Ok(root_from_leaf);
        };
        root_from_leaf = parent_from_child * root_from_leaf;
        at = parent;
    }
    Err(FormatError::Frames(format!(
        "`{leaf}` is its own ancestor; a tree of frames has no loops"
    )))
}
