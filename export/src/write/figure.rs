//! A plain figure that a rig moves, so that viewers have something to show and skins something to hold on to: a slim
//! octahedron along each bone, pointed where the next one begins.

use nalgebra::Vector3;
use posefuse_kinematics::Rig;

use super::tree::{Tree, rest_origins};

/// How wide the thick end is, share of the length.
const WIDTH: f64 = 0.12;
/// Within these, metres.
const WIDTH_M: (f64, f64) = (0.008, 0.04);
/// How far along the bone it is thickest.
const WAIST: f64 = 0.18;
/// Bones shorter than this are not drawn, metres.
const SHORTEST_M: f64 = 0.005;

/// Triangles in the rest pose, metres, room axes: every three vertices are one, counter-clockwise from outside.
#[derive(Default)]
pub(super) struct Mesh {
    pub(super) places: Vec<Vector3<f64>>,
    pub(super) normals: Vec<Vector3<f64>>,
    /// For each vertex the bone that moves it.
    pub(super) bones: Vec<usize>,
}

impl Mesh {
    pub(super) fn of(rig: &Rig, tree: &Tree) -> Self {
        let origins = rest_origins(rig);
        let mut mesh = Self::default();
        for (bone, children) in tree.children.iter().enumerate() {
            for &child in children {
                mesh.stick(origins[bone], origins[child], bone);
            }
        }
        mesh
    }

    fn stick(&mut self, from: Vector3<f64>, to: Vector3<f64>, bone: usize) {
        let length = (to - from).norm();
        if length < SHORTEST_M {
            return;
        }
        let along = (to - from) / length;
        let aside = match along.x.abs() < 0.8 {
            true => Vector3::x(),
            false => Vector3::y(),
        };
        let across = along.cross(&aside).normalize();
        let other = along.cross(&across);
        let half = (0.5 * WIDTH * length).clamp(WIDTH_M.0, WIDTH_M.1);
        let waist = from + along * (WAIST * length);
        let ring = [across, other, -across, -other].map(|way| waist + way * half);
        for n in 0..4 {
            let (a, b) = (ring[n], ring[(n + 1) % 4]);
            self.triangle([from, b, a], bone);
            self.triangle([to, a, b], bone);
        }
    }

    fn triangle(&mut self, corners: [Vector3<f64>; 3], bone: usize) {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a)).normalize();
        for corner in corners {
            self.places.push(corner);
            self.normals.push(normal);
            self.bones.push(bone);
        }
    }
}

#[cfg(test)]
mod tests {
    use posefuse_kinematics::Body;

    use super::*;

    #[test]
    fn every_triangle_looks_outwards_and_the_figure_is_as_tall_as_the_body() {
        let rig = Body::of_height(1.7).rig();
        let mesh = Mesh::of(&rig, &Tree::of(&rig));
        assert_eq!(mesh.places.len() % 24, 0);
        for (corners, normals) in mesh.places.chunks(24).zip(mesh.normals.chunks(24)) {
            let middle = corners.iter().sum::<Vector3<f64>>() / 24.0;
            for (corner, normal) in corners.iter().zip(normals) {
                assert!((corner - middle).dot(normal) > 0.0);
            }
        }
        let heights = mesh.places.iter().map(|place| place.z);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(z), h.max(z)));
        assert!(
            low > -0.05 && low < 0.1 && (1.4..1.75).contains(&high),
            "{low} to {high}"
        );
    }
}
