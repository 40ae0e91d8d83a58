//! A room with people before a sensor.
#![allow(dead_code, reason = "each test uses some of it")]

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_bodytrack::{BackendChoice, BodyTracker, TrackerConfig};
use posefuse_simulator::depth::{Block, Build, DepthCamera, DepthView, Figure, Scene, Walls};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Joint, JointMap, Position, Room, Sensor, Transform};

/// Images a second: half of a sensor's, for the tests' sake.
pub(crate) const RATE_HZ: f64 = 15.0;

pub(crate) fn tracker(camera: &DepthCamera) -> BodyTracker {
    tracker_of(camera, TrackerConfig::default())
}

pub(crate) fn tracker_of(camera: &DepthCamera, mut config: TrackerConfig) -> BodyTracker {
    // The one that is always there and always gives the same.
    config.models.backend = BackendChoice::Rten;
    BodyTracker::new(config, camera.intrinsics).unwrap()
}

pub(crate) fn camera() -> DepthCamera {
    DepthCamera::structured_light(320, 240)
}

/// A sensor 1.2 m above the origin that looks along room x.
pub(crate) fn room_from_sensor() -> Transform<Room, Sensor> {
    let axes = nalgebra::Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    let level = UnitQuaternion::from_rotation_matrix(&rotation);
    Transform::from_parts(Vector3::new(0.0, 0.0, 1.2), level)
}

pub(crate) fn walls() -> Option<Walls> {
    Some(Walls {
        x_m: [-1.0, 5.0],
        y_m: [-3.0, 3.0],
        height_m: 2.6,
    })
}

pub(crate) fn chair() -> Block {
    Block {
        middle: Position::new(2.8, 0.6, 0.45),
        half_m: [0.22, 0.22, 0.45],
        heading: 0.4,
    }
}

/// Somebody as they stand in a simulated room at `seconds`, moved to (x, y), turned about.
pub(crate) fn somebody(number: u8, seconds: f64, [x, y]: [f64; 2], turn: f64) -> Figure {
    let world = World::new(&Scenario {
        seed: 40 + u64::from(number),
        ..Scenario::default()
    });
    let pose = world.unwrap().truth(seconds).remove(0).joints;
    let base = pose[Joint::SpineBase].unwrap().vector();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    let place = |at: &Position<Room>| {
        let off = at.vector() - Vector3::new(base.x, base.y, 0.0);
        Position::from_vector(turn * off + Vector3::new(x, y, 0.0))
    };
    let joints: JointMap<Position<Room>> = pose.map(|_, at| place(at));
    Figure {
        number,
        joints,
        build: Build::seeded(3, usize::from(number)),
        head_turn: 0.0,
        hands_closed: [false; 2],
    }
}

pub(crate) fn view(figures: Vec<Figure>, blocks: Vec<Block>, image: usize) -> DepthView {
    let scene = Scene {
        figures,
        walls: walls(),
        blocks,
    };
    scene.view(&room_from_sensor(), &camera(), image as u64)
}

pub(crate) fn at_ns(image: usize) -> i64 {
    (image as f64 / RATE_HZ * 1e9) as i64
}
