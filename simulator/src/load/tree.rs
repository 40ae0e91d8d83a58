//! A skeleton as files have it, and the way from its frames to a clip.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use super::Flaw;
use super::names::{Found, find_joints};
use crate::motion::Clip;

/// A joint of a file's skeleton. Parents come before children; the first is the root.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) parent: Option<usize>,
    /// From the parent's origin to this one's when nothing is rotated, file units.
    pub(crate) offset: Vector3<f64>,
}

/// A skeleton in a file's axes and units.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
}

/// One frame: the root's position (file units) and each node's rotation against its parent.
pub(crate) struct Frame {
    pub(crate) root: Vector3<f64>,
    pub(crate) rotations: Vec<UnitQuaternion<f64>>,
}

/// From a file's space to the room, the floor apart.
pub(crate) struct Axes {
    pub(crate) room_from_file: Matrix3<f64>,
    pub(crate) metres_per_unit: f64,
}

/// Height of a toe joint of somebody who stands, metres.
const TOE_HEIGHT_M: f64 = 0.02;

/// How much lower a toe joint is than an ankle, at least, metres.
const ANKLE_OVER_TOE_M: f64 = 0.05;

impl Tree {
    pub(crate) fn add(&mut self, name: &str, parent: Option<usize>, offset: Vector3<f64>) -> usize {
        self.nodes.push(Node {
            name: name.to_owned(),
            parent,
            offset,
        });
        self.nodes.len() - 1
    }

    /// The canonical joints of this skeleton, by the names of its nodes. `line` is named if some are missing.
    pub(crate) fn joints(&self, line: usize) -> Result<Found, Flaw> {
        find_joints(&self.nodes).map_err(|reason| Flaw { line, reason })
    }

    /// Where every node is in this frame, file units.
    pub(crate) fn place(&self, frame: &Frame) -> Vec<Vector3<f64>> {
        let mut placed: Vec<(Vector3<f64>, UnitQuaternion<f64>)> =
            Vec::with_capacity(self.nodes.len());
        for (node, rotation) in self.nodes.iter().zip(&frame.rotations) {
            let pose = match node.parent.map(|parent| placed[parent]) {
                None => (frame.root, *rotation),
                Some((at, turned)) => (at + turned * node.offset, turned * rotation),
            };
            placed.push(pose);
        }
        placed.into_iter().map(|(at, _)| at).collect()
    }

    /// Where every node is when nothing is rotated, from the root, file units.
    pub(crate) fn rest(&self) -> Vec<Vector3<f64>> {
        self.place(&Frame {
            root: Vector3::zeros(),
            rotations: vec![UnitQuaternion::identity(); self.nodes.len()],
        })
    }

    /// Axes and unit guessed from the rest pose: up from hips to head, left from right to left hip, and the unit in
    /// which the leg has a person's length. `None` if no answer fits.
    pub(crate) fn guess_axes(&self, found: &Found) -> Option<Axes> {
        let rest = joints_of(found, &self.rest());
        let way = |from: Joint, to: Joint| Some(rest[to]? - rest[from]?);
        let up = dominant(way(Joint::SpineBase, Joint::Head)?);
        let left = dominant(way(Joint::HipRight, Joint::HipLeft)?);
        if up.dot(&left).abs() > 0.5 {
            return None;
        }
        let leg = way(Joint::HipLeft, Joint::KneeLeft)?.norm()
            + way(Joint::KneeLeft, Joint::AnkleLeft)?.norm();
        const CMU_UNIT: f64 = 0.0254 / 0.45;
        let units = [1.0, CMU_UNIT, 0.0254, 0.01, 0.001];
        let fits = |unit: &f64| (0.55..=1.15).contains(&(leg * unit));
        Some(Axes {
            room_from_file: Matrix3::from_rows(&[
                left.cross(&up).transpose(),
                left.transpose(),
                up.transpose(),
            ]),
            metres_per_unit: units.into_iter().find(fits)?,
        })
    }
}

impl Axes {
    /// Y up, z forwards, x left: Acclaim and CMU.
    pub(crate) fn y_up(metres_per_unit: f64) -> Self {
        Self {
            room_from_file: Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
            metres_per_unit,
        }
    }

    /// The clip of these frames (each the places of all nodes), its feet on the floor. `line` is named if the clip
    /// cannot be.
    pub(crate) fn clip(
        &self,
        name: &str,
        rate_hz: f64,
        found: &Found,
        frames: &[Vec<Vector3<f64>>],
        line: usize,
    ) -> Result<Clip, Flaw> {
        let to_room = self.room_from_file * self.metres_per_unit;
        let mut poses: Vec<JointMap<Position<Room>>> = frames
            .iter()
            .map(|places| joints_of(found, places).map(|_, at| Position::from_vector(to_room * at)))
            .collect();
        let lift = Vector3::new(0.0, 0.0, TOE_HEIGHT_M - floor(&poses));
        for (_, position) in poses.iter_mut().flat_map(JointMap::iter_mut) {
            *position = position.moved(lift);
        }
        Clip::new(name, rate_hz, poses).map_err(|error| Flaw {
            line,
            reason: error.to_string(),
        })
    }
}

/// The height that the lowest toe is at in the lowest twentieth of the frames.
fn floor(poses: &[JointMap<Position<Room>>]) -> f64 {
    let lowest = |pose: &JointMap<Position<Room>>| {
        let height = |joint: Joint, less: f64| {
            pose[joint].map_or(f64::INFINITY, |position| position.vector().z - less)
        };
        height(Joint::FootLeft, 0.0)
            .min(height(Joint::FootRight, 0.0))
            .min(height(Joint::AnkleLeft, ANKLE_OVER_TOE_M))
            .min(height(Joint::AnkleRight, ANKLE_OVER_TOE_M))
    };
    let mut heights: Vec<f64> = poses.iter().map(lowest).filter(|z| z.is_finite()).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 20).copied().unwrap_or(0.0)
}

fn joints_of(found: &Found, places: &[Vector3<f64>]) -> JointMap<Vector3<f64>> {
    found.map(|_, nodes| {
        nodes.iter().map(|&node| places[node]).sum::<Vector3<f64>>() / nodes.len() as f64
    })
}

/// The signed axis that `vector` mostly points along.
fn dominant(vector: Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    let along = vector.iamax();
    axis[along] = vector[along].signum();
    axis
}

/// A rotation by `degrees` about axis x, y or z (0, 1, 2).
pub(crate) fn about(axis: usize, degrees: f64) -> UnitQuaternion<f64> {
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(
        &axes[axis],
        degrees.to_radians(),
    ))
}
