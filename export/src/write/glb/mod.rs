//! GLB: glTF 2.0 in one binary file. Metres, Y up, a person of the rest pose faces +Z.
//!
//! Each person is a node with the bones below it, a skin and a plain figure. All people move in one animation, because
//! readers play the first only. While a person is not there, their node's scale is 0: that is how glTF hides a figure
//! (section 3.5.3). Keys are interpolated linearly, rotations along the shortest way. Held in memory until the end: 4 bytes
//! a number, some 0.5 kB a person and frame.

mod container;

use std::io;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_kinematics::{Rig, RigPose};
use serde_json::{Value, json};

use self::container::{Container, Data, Kind};
use super::figure::Mesh;
use super::tree::{Tree, rest_origins};
use super::{Moment, Out, Sheet, Sink};

/// The figures' colours, in turn: red, green, blue shares of linear light.
const COLOURS: [[f64; 3]; 6] = [
    [0.80, 0.25, 0.10],
    [0.10, 0.35, 0.75],
    [0.15, 0.55, 0.20],
    [0.75, 0.55, 0.05],
    [0.45, 0.15, 0.60],
    [0.10, 0.55, 0.55],
];

pub(super) struct Glb<'a> {
    sheet: Sheet<'a>,
    people: Vec<Option<Moved>>,
    out: Out,
}

/// What one person does.
struct Moved {
    tree: Tree,
    times: Vec<f32>,
    roots: Vec<f32>,
    /// For each bone that turns, x y z w in turn; empty for ends.
    turns: Vec<Vec<f32>>,
    /// When the person comes (true) and goes.
    shown: Vec<(f32, bool)>,
}

impl<'a> Glb<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, out: Out) -> io::Result<Self> {
        let moved = |index| {
            let rig: &Rig = sheet.rig(index).ok()?;
            Some(Moved {
                tree: Tree::of(rig),
                times: Vec::new(),
                roots: Vec::new(),
                turns: vec![Vec::new(); rig.bones.len()],
                shown: Vec::new(),
            })
        };
        let people = (0..sheet.people.len()).map(moved).collect();
        Ok(Self { sheet, people, out })
    }

    fn vector(&self, room: Vector3<f64>) -> [f32; 3] {
        self.sheet
            .space
            .vector(room)
            .map(|value| value as f32)
            .into()
    }
}

impl Moved {
    fn take_in(
        &mut self,
        time: f32,
        root: [f32; 3],
        turns: impl Iterator<Item = UnitQuaternion<f64>>,
    ) {
        self.times.push(time);
        self.roots.extend(root);
        for (bone, turn) in turns.enumerate() {
            if self.tree.is_end(bone) {
                continue;
            }
            let keys = &mut self.turns[bone];
            let mut turn = [turn.i, turn.j, turn.k, turn.w].map(|value| value as f32);
            // A quaternion and its negative are one rotation; the nearer one makes the shorter way.
            if let Some(last) = keys.last_chunk::<4>()
                && last.iter().zip(turn).map(|(a, b)| a * b).sum::<f32>() < 0.0
            {
                turn = turn.map(|value| -value);
            }
            keys.extend(turn);
        }
    }

    fn show(&mut self, time: f32, there: bool) {
        if self.shown.last().is_none_or(|(_, was)| *was != there) {
            self.shown.push((time, there));
        }
    }
}

impl Sink for Glb<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        let Sheet {
            plan, first, space, ..
        } = &self.sheet;
        let time = ((moment.frame - first) as f64 / plan.grid.rate_hz) as f32;
        for index in 0..self.people.len() {
            let pose: Option<&RigPose> = moment.pose_of(self.sheet.people[index]);
            let root = pose.map(|pose| self.vector(pose.root.vector()));
            let Some(moved) = &mut self.people[index] else {
                continue;
            };
            moved.show(time, pose.is_some());
            if let (Some(pose), Some(root)) = (pose, root) {
                let turns = pose.rotations.iter().map(|turn| space.axes.rotation(turn));
                moved.take_in(time, root, turns);
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        let mut scene = Scene::default();
        for index in 0..self.people.len() {
            let moved = self.people[index]
                .take()
                .filter(|moved| !moved.times.is_empty());
            if let Some(moved) = moved {
                self.person(&mut scene, index, moved)?;
            }
        }
        if scene.roots.is_empty() {
            return Err(super::never_seen());
        }
        let plan = self.sheet.plan;
        let [timecode, timecode_rate] = plan.timecode(self.sheet.first);
        let head = json!({
            "asset": {
                "version": "2.0",
                "generator": concat!("posefuse export ", env!("CARGO_PKG_VERSION")),
                "extras": {
                    "take": plan.header.name,
                    "startUtc": plan.civil(self.sheet.first),
                    "startTimecode": timecode,
                    "timecodeRate": timecode_rate,
                    "startSeconds": plan.seconds(self.sheet.first),
                    "framesPerSecond": plan.grid.rate_hz,
                },
            },
            "scene": 0,
            "scenes": [{ "name": plan.header.name, "nodes": scene.roots }],
            "nodes": scene.nodes,
            "materials": scene.materials,
            "meshes": scene.meshes,
            "skins": scene.skins,
            "animations": [{
                "name": plan.header.name,
                "channels": scene.channels,
                "samplers": scene.samplers,
            }],
        });
        scene.container.write(head, &mut self.out)
    }
}

/// The parts of the file under construction.
#[derive(Default)]
struct Scene {
    roots: Vec<usize>,
    nodes: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    skins: Vec<Value>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
    container: Container,
}

impl Scene {
    fn node(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn animate(&mut self, node: usize, path: &str, times: usize, values: usize, how: &str) {
        let sampler = self.samplers.len();
        self.samplers
            .push(json!({ "input": times, "output": values, "interpolation": how }));
        self.channels
            .push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }
}

impl Glb<'_> {
    fn person(&self, scene: &mut Scene, index: usize, moved: Moved) -> io::Result<()> {
        let rig = self.sheet.rig(index)?;
        let who = self.sheet.plan.people[self.sheet.people[index]]
            .who
            .to_string();
        let first_bone = scene.nodes.len() + 1;
        let person = scene.node(json!({ "name": who, "children": [first_bone + moved.tree.root] }));
        for (bone, children) in rig.bones.iter().zip(&moved.tree.children) {
            let mut node = json!({
                "name": self.sheet.names.of_bone(&bone.name),
                "translation": self.vector(bone.offset),
            });
            if !children.is_empty() {
                let children = children.iter().map(|child| first_bone + child);
                node["children"] = children.collect();
            }
            scene.node(node);
        }
        let skin = self.skin(scene, rig, first_bone);
        let mesh = self.mesh(scene, rig, &moved.tree, index, &who);
        let figure =
            scene.node(json!({ "name": format!("{who}-figure"), "mesh": mesh, "skin": skin }));
        scene.roots.extend([person, figure]);
        let times = scene.container.add(Kind::Time, Data::Floats(moved.times));
        let roots = scene.container.add(Kind::Vec3, Data::Floats(moved.roots));
        scene.animate(
            first_bone + moved.tree.root,
            "translation",
            times,
            roots,
            "LINEAR",
        );
        for (bone, turns) in moved.turns.into_iter().enumerate() {
            if !turns.is_empty() {
                let turns = scene.container.add(Kind::Vec4, Data::Floats(turns));
                scene.animate(first_bone + bone, "rotation", times, turns, "LINEAR");
            }
        }
        if moved.shown.iter().any(|(_, there)| !there) {
            let times = moved.shown.iter().map(|(time, _)| *time).collect();
            let scales = moved
                .shown
                .iter()
                .flat_map(|(_, there)| [f32::from(u8::from(*there)); 3]);
            let scales = scales.collect();
            let times = scene.container.add(Kind::Time, Data::Floats(times));
            let scales = scene.container.add(Kind::Vec3, Data::Floats(scales));
            scene.animate(person, "scale", times, scales, "STEP");
        }
        Ok(())
    }

    fn skin(&self, scene: &mut Scene, rig: &Rig, first_bone: usize) -> usize {
        let mut matrices = Vec::with_capacity(16 * rig.bones.len());
        for origin in rest_origins(rig) {
            let [x, y, z] = self.vector(-origin);
            // Columns in turn; in the rest pose no bone is turned.
            matrices.extend([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
            matrices.extend([0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]);
        }
        let matrices = scene.container.add(Kind::Mat4, Data::Floats(matrices));
        let joints: Vec<usize> = (0..rig.bones.len()).map(|bone| first_bone + bone).collect();
        scene.skins.push(json!({
            "skeleton": first_bone,
            "joints": joints,
            "inverseBindMatrices": matrices,
        }));
        scene.skins.len() - 1
    }

    fn mesh(&self, scene: &mut Scene, rig: &Rig, tree: &Tree, index: usize, who: &str) -> usize {
        let mesh = Mesh::of(rig, tree);
        let places = mesh
            .places
            .iter()
            .flat_map(|place| self.vector(*place))
            .collect();
        let unit = self.sheet.space.unit.per_metre();
        let normals = mesh
            .normals
            .iter()
            .flat_map(|normal| self.vector(normal / unit))
            .collect();
        let bones = mesh
            .bones
            .iter()
            .flat_map(|bone| [*bone as u8, 0, 0, 0])
            .collect();
        let weights = mesh
            .bones
            .iter()
            .flat_map(|_| [1.0, 0.0, 0.0, 0.0])
            .collect();
        let colour = COLOURS[index % COLOURS.len()];
        scene.materials.push(json!({
            "name": who,
            "pbrMetallicRoughness": {
                "baseColorFactor": [colour[0], colour[1], colour[2], 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.7,
            },
        }));
        let container = &mut scene.container;
        scene.meshes.push(json!({
            "name": format!("{who}-figure"),
            "primitives": [{
                "attributes": {
                    "POSITION": container.add(Kind::Place, Data::Floats(places)),
                    "NORMAL": container.add(Kind::Vertex(3), Data::Floats(normals)),
                    "JOINTS_0": container.add(Kind::Vertex(4), Data::Bytes(bones)),
                    "WEIGHTS_0": container.add(Kind::Vertex(4), Data::Floats(weights)),
                },
                "material": scene.materials.len() - 1,
            }],
        }));
        scene.meshes.len() - 1
    }
}
