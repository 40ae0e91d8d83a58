//! The room behind the people: floor, walls, ceiling, and things that stand about. Room axes, metres.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Position, Room, Sensor, Transform};

use super::canvas::Canvas;
use super::shape::V3;
use crate::random::{Purpose, Stream};
use crate::world::World;

/// A thing that stands in the room: a box with level top, turned about the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Its middle, metres.
    pub middle: Position<Room>,
    /// Half its length, depth and height.
    pub half_m: [f64; 3],
    /// Where its length points, counter-clockwise from room x, radians.
    pub heading: f64,
}

/// A rectangular room with its floor at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Walls {
    /// Least and greatest x.
    pub x_m: [f64; 2],
    /// Least and greatest y.
    pub y_m: [f64; 2],
    /// Height of the ceiling.
    pub height_m: f64,
}

/// The desk that [`crate::Scenario::desks`] puts before a sensor.
const DESK_HALF_M: [f64; 3] = [0.8, 0.12, 0.45];
const DESK_OUTSIDE_M: f64 = 0.1;

/// Kinds of furniture: half of length, depth and height.
const FURNITURE_M: [[f64; 3]; 5] = [
    [0.4, 0.18, 0.9],
    [0.7, 0.35, 0.37],
    [0.25, 0.25, 0.22],
    [0.9, 0.42, 0.35],
    [0.15, 0.15, 0.6],
];

/// The room of a world: its walls a little behind the sensors, its furniture along them where no sensor's view of the
/// middle is in its way.
pub(super) fn of_world(world: &World) -> (Walls, Vec<Block>) {
    let scenario = world.scenario();
    let mut stream = Stream::new(scenario.seed, Purpose::DepthRoom, &[]);
    let places: Vec<Vector3<f64>> = (0..world.sensor_count())
        .map(|index| world.room_from_sensor(index).origin().vector())
        .collect();
    let inside = places
        .iter()
        .flat_map(|at| [at.x.abs(), at.y.abs()])
        .fold(0.5 * scenario.area_m, f64::max);
    let mut side = || inside + stream.between(0.3, 1.2);
    let walls = Walls {
        x_m: [-side(), side()],
        y_m: [-side(), side()],
        height_m: 2.2 + 0.6 * (inside - inside.floor()) + 0.2,
    };
    let mut blocks = Vec::new();
    for _ in 0..12 {
        let block = along_a_wall(&walls, &mut stream);
        let at = block.middle.vector().xy();
        let clear = places.iter().all(|place| {
            let way = place.xy();
            let share = (at.dot(&way) / way.norm_squared().max(1e-9)).clamp(0.0, 1.1);
            (at - way * share).norm() > 1.1
        });
        if clear && at.amax() > 0.5 * scenario.area_m + 0.5 {
            blocks.push(block);
        }
    }
    blocks.extend((0..scenario.desks).filter_map(|index| desk(places[index], scenario.area_m)));
    (walls, blocks)
}

fn along_a_wall(walls: &Walls, stream: &mut Stream) -> Block {
    let half_m = FURNITURE_M[stream.below(FURNITURE_M.len())];
    let along_x = stream.chance(0.5);
    let end = stream.below(2);
    let towards = if end == 0 { 1.0 } else { -1.0 };
    let (run, wall) = if along_x {
        (walls.x_m, walls.y_m[end])
    } else {
        (walls.y_m, walls.x_m[end])
    };
    let off = wall + towards * (half_m[1] + 0.02);
    let place = stream.between(run[0] + half_m[0], run[1] - half_m[0]);
    let (x, y) = if along_x { (place, off) } else { (off, place) };
    Block {
        middle: Position::new(x, y, half_m[2]),
        half_m,
        heading: if along_x {
            0.0
        } else {
            std::f64::consts::FRAC_PI_2
        },
    }
}

fn desk(sensor: Vector3<f64>, area_m: f64) -> Option<Block> {
    let towards = Vector3::new(sensor.x, sensor.y, 0.0).try_normalize(1e-9)?;
    let foot = towards * (0.5 * area_m + DESK_OUTSIDE_M);
    Some(Block {
        middle: Position::new(foot.x, foot.y, DESK_HALF_M[2]),
        half_m: DESK_HALF_M,
        heading: towards.y.atan2(towards.x) + std::f64::consts::FRAC_PI_2,
    })
}

/// Floor, walls and ceiling from within, behind everything. The canvas must be empty: 1 / distance is linear over the
/// image for a plane, and from within the nearest of the planes is the one that is seen.
pub(super) fn draw_walls(
    canvas: &mut Canvas,
    walls: &Walls,
    room_from_sensor: &Transform<Room, Sensor>,
) {
    let at = room_from_sensor.origin().vector();
    let to_sensor = room_from_sensor.inverse();
    let planes = [
        (Vector3::x(), walls.x_m[1] - at.x),
        (-Vector3::x(), at.x - walls.x_m[0]),
        (Vector3::y(), walls.y_m[1] - at.y),
        (-Vector3::y(), at.y - walls.y_m[0]),
        (Vector3::z(), walls.height_m - at.z),
        (-Vector3::z(), at.z),
    ];
    // A sensor outside of a wall sees through it.
    let planes: Vec<V3> = planes
        .into_iter()
        .filter(|(_, away)| *away > 0.0)
        .map(|(normal, away)| (to_sensor.rotate(normal) / away).cast::<f32>())
        .collect();
    for v in 0..canvas.height {
        let (first, second) = (canvas.ray(0, v), canvas.ray(1, v));
        let row = &mut canvas.depth[v * canvas.width..(v + 1) * canvas.width];
        row.fill(0.0);
        for plane in &planes {
            let (start, step) = (plane.dot(&first), plane.dot(&(second - first)));
            for (u, nearness) in row.iter_mut().enumerate() {
                *nearness = nearness.max(start + step * u as f32);
            }
        }
        for nearness in row {
            *nearness = if *nearness > 1e-4 {
                1.0 / *nearness
            } else {
                f32::INFINITY
            };
        }
    }
}

pub(super) fn draw_block(
    canvas: &mut Canvas,
    block: &Block,
    sensor_from_room: &Transform<Sensor, Room>,
) {
    let (sin, cos) = block.heading.sin_cos();
    let axes = [
        Vector3::new(cos, sin, 0.0),
        Vector3::new(-sin, cos, 0.0),
        Vector3::z(),
    ];
    let half = Vector3::from(block.half_m).map(|half| half.max(1e-3));
    let middle = sensor_from_room.apply(block.middle).vector();
    let rows = [0, 1, 2].map(|i| (sensor_from_room.rotate(axes[i]) / half[i]).transpose());
    let unit_from_sensor: Matrix3<f32> = Matrix3::from_rows(&rows).cast();
    let from = unit_from_sensor * middle.cast::<f32>();
    let corner = |index: usize| {
        let sign = |axis: usize| if index >> axis & 1 == 0 { -1.0 } else { 1.0 };
        let offset = (0..3).map(|axis| axes[axis] * (sign(axis) * half[axis]));
        let at = middle + sensor_from_room.rotate(offset.sum::<Vector3<f64>>());
        (at.cast::<f32>(), 0.0)
    };
    let corners: [(V3, f32); 8] = std::array::from_fn(corner);
    let Some(extent) = canvas.extent(&corners) else {
        return;
    };
    canvas.draw_where(extent, 0, |ray| {
        let d = unit_from_sensor * ray;
        let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let (a, b) = ((from[axis] - 1.0) / d[axis], (from[axis] + 1.0) / d[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    });
}
