//! People before a sensor, and what it makes of them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_bodytrack::crop::Cropper;
use posefuse_simulator::depth::{Block, Build, DepthCamera, DepthView, Figure, Scene};
use posefuse_skeleton::{Joint, JointMap, Position, Room, Sensor, Transform};

use crate::chance::Chance;
use crate::mask;
use crate::poses::Poses;
use crate::record::{Truth, Writer};

/// Fewer measured pixels and fewer joints in view than this are nobody to track.
const LEAST_PIXELS: usize = 60;
const LEAST_JOINTS: usize = 6;
/// People's spines keep this apart, metres.
const APART_M: f64 = 0.32;

/// A scene before its camera.
pub(crate) struct Staged {
    pub(crate) scene: Scene,
    pub(crate) room_from_sensor: Transform<Room, Sensor>,
    pub(crate) camera: DepthCamera,
    seed: u64,
}

/// Draws a scene for a camera.
pub(crate) fn stage(poses: &Poses, camera: DepthCamera, chance: &mut Chance) -> Staged {
    let half_view = 0.5 * camera.intrinsics.view()[0];
    let first = {
        let distance = chance.between(0.6, 4.6);
        let aside = chance.between(-1.0, 1.0) * half_view;
        Vector3::new(distance * aside.cos(), distance * aside.sin(), 0.0)
    };
    let people = [1, 1, 2, 2, 3, 3, 4, 4][chance.below(8)];
    let mut places = vec![first];
    while places.len() < people {
        let spread = chance.between(0.33, 1.6);
        let angle = chance.between(0.0, TAU);
        let place = first + Vector3::new(spread * angle.cos(), spread * angle.sin(), 0.0);
        let clear = places.iter().all(|other| (other - place).norm() > APART_M);
        if clear && place.x > 0.55 {
            places.push(place);
        }
    }
    let figures = places.iter().zip(1..).map(|(place, number)| Figure {
        number,
        joints: placed(&poses.draw(chance), place, chance.between(0.0, TAU)),
        build: Build::seeded(chance.bits(), 0),
        head_turn: (0.35 * chance.normal()).clamp(-1.2, 1.2),
        hands_closed: [chance.with(0.5), chance.with(0.5)],
    });
    let scene = Scene {
        figures: figures.collect(),
        walls: None,
        blocks: blocks(&first, chance),
    };
    let height = chance.between(0.5, 2.2);
    let at = 0.9 - height + 0.25 * chance.normal();
    let tilt = (at / first.norm().max(1.2)).atan().clamp(-0.7, 0.4);
    Staged {
        scene,
        room_from_sensor: looking(height, tilt, 0.03 * chance.normal()),
        camera,
        seed: chance.bits(),
    }
}

/// A camera of any kind.
pub(crate) fn camera(chance: &mut Chance) -> DepthCamera {
    let mut camera = match chance.below(8) {
        0..=3 => DepthCamera::structured_light(320, 240),
        4 => DepthCamera::structured_light(160, 120),
        5..=6 => DepthCamera::time_of_flight(256, 212),
        _ => DepthCamera::time_of_flight(320, 288),
    };
    camera.noise.along *= chance.between(0.5, 1.6);
    camera.noise.across_px *= chance.between(0.5, 1.5);
    camera.noise.holes *= chance.between(0.2, 1.6);
    if chance.with(0.5) {
        camera.noise.baseline_m = -camera.noise.baseline_m;
    }
    camera.noise.range_m[0] = 0.4;
    camera
}

/// A sensor over the origin that looks along room x, up by `tilt`.
fn looking(height: f64, tilt: f64, roll: f64) -> Transform<Room, Sensor> {
    let axes = Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    Transform::from_parts(Vector3::new(0.0, 0.0, height), level * up * roll)
}

fn placed(
    pose: &JointMap<Position<Room>>,
    place: &Vector3<f64>,
    heading: f64,
) -> JointMap<Position<Room>> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let base = pose[Joint::SpineBase].map_or_else(Vector3::zeros, |p| p.vector());
    let foot = Vector3::new(base.x, base.y, 0.0);
    pose.map(|_, p| Position::from_vector(turn * (p.vector() - foot) + place))
}

/// The floor about the first person, and sometimes a desk before them or a seat.
fn blocks(first: &Vector3<f64>, chance: &mut Chance) -> Vec<Block> {
    let mut blocks = Vec::new();
    if chance.with(0.45) {
        blocks.push(Block {
            middle: Position::new(first.x, first.y, -0.02),
            half_m: [1.1, 1.1, 0.02],
            heading: chance.between(0.0, TAU),
        });
    }
    if chance.with(0.15) {
        let half = chance.between(0.2, 0.5);
        let at = first * chance.between(0.45, 0.85);
        let aside = Vector3::new(-first.y, first.x, 0.0).normalize() * chance.between(-0.6, 0.6);
        blocks.push(Block {
            middle: Position::new(at.x + aside.x, at.y + aside.y, half),
            half_m: [chance.between(0.2, 0.9), 0.12, half],
            heading: first.y.atan2(first.x) + FRAC_PI_2 + chance.between(-0.3, 0.3),
        });
    }
    if chance.with(0.1) {
        blocks.push(Block {
            middle: Position::new(first.x, first.y, 0.2),
            half_m: [0.22, 0.22, 0.2],
            heading: chance.between(-PI, PI),
        });
    }
    blocks
}

impl Staged {
    /// What the camera sees.
    pub(crate) fn view(&self) -> DepthView {
        self.scene
            .view(&self.room_from_sensor, &self.camera, self.seed)
    }

    /// Somebody's joints as the sensor has them.
    pub(crate) fn here(&self, figure: &Figure) -> JointMap<Position<Sensor>> {
        let sensor_from_room = self.room_from_sensor.inverse();
        figure.joints.map(|_, p| sensor_from_room.apply(*p))
    }

    /// Renders and writes everybody of whom enough is seen.
    pub(crate) fn write(&self, chance: &mut Chance, writer: &mut Writer) -> io::Result<()> {
        let view = self.view();
        let mut cropper = Cropper::default();
        let mut numbers = Vec::new();
        for figure in &self.scene.figures {
            let joints = self.here(figure);
            let visible = Joint::ALL.map(|joint| self.sees(&view, figure.number, joint, &joints));
            if visible.iter().filter(|seen| **seen).count() < LEAST_JOINTS {
                continue;
            }
            let truth_mask = mask::Mask::of(&view, figure.number);
            if truth_mask.measured(&view.image) < LEAST_PIXELS {
                continue;
            }
            let mask = truth_mask.spoiled(&view, &self.camera, &self.room_from_sensor, chance);
            numbers.clear();
            let frame = cropper.cut(
                &view.image,
                &self.camera.intrinsics,
                mask.extent(),
                |at| mask.holds(at),
                &mut numbers,
            );
            if let Some(frame) = frame {
                let truth = Truth {
                    frame,
                    joints: &joints,
                    visible,
                    hands_closed: figure.hands_closed,
                    people: self.scene.figures.len(),
                };
                writer.put(&numbers, &truth)?;
            }
        }
        Ok(())
    }

    fn sees(
        &self,
        view: &DepthView,
        number: u8,
        joint: Joint,
        joints: &JointMap<Position<Sensor>>,
    ) -> bool {
        let at = joints[joint];
        at.and_then(|at| view.sees(&self.camera.intrinsics, number, joint, &at))
            .unwrap_or(false)
    }
}
