//! Floor, up, origin and heading of the room, from the walk itself.
//!
//! - Up: from ankles to head on average says roughly, standing feet say exactly.
//! - Floor: standing (slow) ankles and feet lie in a plane. Kinect v2's ankle joint lies 8 cm above the floor and its
//!   foot joint 3 cm; both are brought down by as much before the plane is fitted.
//! - Origin: on the floor below the mean of where the person was.
//! - Heading: X points from there towards the root sensor, so that somebody who faces that sensor faces X.
//!
//! Each can be set by hand instead ([`HandFloor`]). Where feet are not seen, the root sensor is assumed level and the lowest joints to stand on the floor.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{FloorSource, Joint};

use crate::graph::Placed;
use crate::pair::robust_weight;
use crate::stats::{median, quantile};
use crate::tracks::Pose;
use crate::{FloorRow, HandFloor};

/// Speed below which a foot stands, m/s.
const STANDING_SPEED: f64 = 0.25;
/// Height of the joint above the sole, metres.
const ANKLE_HEIGHT_M: f64 = 0.08;
const FOOT_HEIGHT_M: f64 = 0.03;
/// Fewest bodies with head and ankle, and fewest standing feet.
const MIN_BODIES: usize = 20;
const MIN_FEET: usize = 40;
/// How far the mean of ankle to head may be off the vertical: weighs in where feet stood in one place only.
const LEAN_SIGMA: f64 = 0.05;
/// Standing feet of one step are one sample: a step lasts some 0.6 s, seen at 10 Hz.
const INDEPENDENT_SHARE: f64 = 0.15;
/// What a standing ankle's height may be, metres.
const BAND_M: (f64, f64) = (-0.05, 0.20);
/// Horizontal distance to the root sensor below which the heading is taken from where it looks, metres.
const MIN_HEADING_M: f64 = 0.3;

/// A room and what it rests on.
pub(crate) struct Floor {
    /// Takes the first sensor's frame to the room.
    pub(crate) room_from_world: Isometry3<f64>,
    /// For the report.
    pub(crate) row: FloorRow,
}

#[derive(Default)]
struct Seen {
    centres: Vec<Vector3<f64>>,
    /// Ankle to head.
    uprights: Vec<Vector3<f64>>,
    /// Standing feet with the height of the joint above the sole.
    feet: Vec<(Vector3<f64>, f64)>,
    joints: Vec<Vector3<f64>>,
}

/// The room as it is, the world being it already.
pub(crate) fn kept(names: &[&str], seen: &[Vec<Vec<Pose>>], placed: &[Placed]) -> Floor {
    let room_from_world = Isometry3::identity();
    let gathered = gather(seen, placed);
    Floor {
        row: check(
            names,
            &gathered,
            placed,
            &room_from_world,
            FloorSource::Manual,
        ),
        room_from_world,
    }
}

/// Lays the room on what `seen` (per sensor, per instant) shows and on what is known by hand; `root` is the index of the
/// root sensor.
pub(crate) fn find(
    names: &[&str],
    seen: &[Vec<Vec<Pose>>],
    placed: &[Placed],
    root: usize,
    by_hand: Option<&HandFloor>,
) -> Floor {
    let gathered = gather(seen, placed);
    let root_pose = placed[root].world_from_sensor;
    let hand = by_hand.and_then(|hand| {
        let sensor = names.iter().position(|name| *name == hand.sensor)?;
        Some(Hand {
            values: hand,
            world_from_sensor: placed[sensor].world_from_sensor,
        })
    });
    let (mut source, mut up, mut point) = match plane(&gathered) {
        Some((up, point)) => (FloorSource::Walk, up, point),
        None => {
            let up = -(root_pose.rotation * Vector3::y());
            let mut heights: Vec<f64> = gathered.joints.iter().map(|p| p.dot(&up)).collect();
            let lowest = quantile(&mut heights, 0.02).unwrap_or(0.0) - FOOT_HEIGHT_M;
            (FloorSource::Assumed, up, up * lowest)
        }
    };
    if let Some(hand) = &hand {
        if let Some(by_hand) = hand.up() {
            (up, point) = (by_hand, gathered.lowest(&by_hand).unwrap_or(point));
        }
        if let Some(height_m) = hand.values.height_m {
            point = hand.world_from_sensor.translation.vector - up * height_m;
            if hand.values.up.is_some() {
                source = FloorSource::Manual;
            }
        }
    }
    let mut room_from_world = lay(&gathered, &root_pose, up, point);
    if let Some(hand) = &hand {
        room_from_world = hand.heading_and_origin(&room_from_world) * room_from_world;
    }
    let row = check(names, &gathered, placed, &room_from_world, source);
    Floor {
        room_from_world,
        row,
    }
}

/// What is known by hand, and where that sensor stands.
struct Hand<'h> {
    values: &'h HandFloor,
    world_from_sensor: Isometry3<f64>,
}

impl Hand<'_> {
    fn up(&self) -> Option<Vector3<f64>> {
        let up = Vector3::from(self.values.up?).try_normalize(1e-9)?;
        Some(self.world_from_sensor.rotation * up)
    }

    /// Turns the room about its Z and shifts it along the floor, so that the sensor looks and stands as was said.
    fn heading_and_origin(&self, room_from_world: &Isometry3<f64>) -> Isometry3<f64> {
        let room_from_sensor = room_from_world * self.world_from_sensor;
        let looks = room_from_sensor.rotation * Vector3::z();
        let turn = match self.values.looks_deg {
            Some(wanted) => wanted.to_radians() - looks.y.atan2(looks.x),
            None => 0.0,
        };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let stands = turn * room_from_sensor.translation.vector;
        let shift = match self.values.at_m {
            Some([x, y]) => Vector3::new(x - stands.x, y - stands.y, 0.0),
            None => Vector3::zeros(),
        };
        Isometry3::from_parts(Translation3::from(shift), turn)
    }
}

impl Seen {
    /// A point of the floor whose normal is `up`, from standing feet.
    fn lowest(&self, up: &Vector3<f64>) -> Option<Vector3<f64>> {
        let height = |(at, above_sole): &(Vector3<f64>, f64)| at.dot(up) - above_sole;
        let mut heights: Vec<f64> = self.feet.iter().map(height).collect();
        (heights.len() >= MIN_FEET).then(|| median(&mut heights).map(|height| up * height))?
    }
}

fn gather(seen: &[Vec<Vec<Pose>>], placed: &[Placed]) -> Seen {
    let mut gathered = Seen::default();
    for (instants, placed) in seen.iter().zip(placed) {
        let world = |at: Vector3<f64>| placed.world_from_sensor.transform_point(&at.into()).coords;
        for pose in instants.iter().flatten() {
            let joint = |joint: Joint| pose.joints[joint as usize];
            gathered.centres.push(world(pose.centre));
            gathered
                .joints
                .extend(pose.joints.iter().flatten().map(|p| world(p.at)));
            for (ankle, foot) in [
                (Joint::AnkleLeft, Joint::FootLeft),
                (Joint::AnkleRight, Joint::FootRight),
            ] {
                if let (Some(ankle), Some(head)) = (joint(ankle), joint(Joint::Head)) {
                    gathered.uprights.push(world(head.at) - world(ankle.at));
                }
                for (joint, height) in
                    [(joint(ankle), ANKLE_HEIGHT_M), (joint(foot), FOOT_HEIGHT_M)]
                {
                    // An unknown velocity is stored as exactly zero and does not count as standing.
                    if let Some(p) = joint.filter(|p| {
                        p.velocity.norm() < STANDING_SPEED && p.velocity != Vector3::zeros()
                    }) {
                        gathered.feet.push((world(p.at), height));
                    }
                }
            }
        }
    }
    gathered
}

/// Up and a point of the floor; `None` where too little was seen.
fn plane(seen: &Seen) -> Option<(Vector3<f64>, Vector3<f64>)> {
    if seen.uprights.len() < MIN_BODIES || seen.feet.len() < MIN_FEET {
        return None;
    }
    let mut rough = Vector3::zeros();
    for axis in 0..3 {
        let mut values: Vec<f64> = seen.uprights.iter().map(|u| u[axis] / u.norm()).collect();
        rough[axis] = median(&mut values)?;
    }
    let rough = rough.try_normalize(1e-3)?;
    let (e1, e2) = across(&rough);
    let count = seen.feet.len() as f64;
    let centre = seen.feet.iter().map(|(at, _)| at).sum::<Vector3<f64>>() / count;
    let samples: Vec<Vector3<f64>> = seen
        .feet
        .iter()
        .map(|(at, height)| {
            let d = at - centre;
            Vector3::new(d.dot(&e1), d.dot(&e2), d.dot(&rough) - height)
        })
        .collect();
    // height = slope.x * x + slope.y * y + slope.z
    let mut slope = Vector3::zeros();
    for round in 0..10 {
        let off = |s: &Vector3<f64>| s.z - slope.x * s.x - slope.y * s.y - slope.z;
        if round == 0 {
            let mut heights: Vec<f64> = samples.iter().map(off).collect();
            slope.z = median(&mut heights)?;
            continue;
        }
        let mut sizes: Vec<f64> = samples.iter().map(|s| off(s).abs()).collect();
        let sigma = (1.4826 * median(&mut sizes)?).max(0.005);
        let lean = LEAN_SIGMA.powi(-2);
        let mut normal = Matrix3::from_diagonal(&Vector3::new(lean, lean, 0.0));
        let mut right = Vector3::zeros();
        for sample in &samples {
            let weight = robust_weight(off(sample).powi(2), 3.0 * sigma) * INDEPENDENT_SHARE;
            let row = Vector3::new(sample.x, sample.y, 1.0);
            normal += row * row.transpose() * (weight / (sigma * sigma));
            right += row * (sample.z * weight / (sigma * sigma));
        }
        slope = normal.cholesky()?.solve(&right);
    }
    let up = (rough - e1 * slope.x - e2 * slope.y).normalize();
    Some((up, centre + rough * slope.z))
}

/// Two unit vectors that span the plane across `up`.
fn across(up: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let axis = Vector3::ith(up.iamin(), 1.0);
    let e1 = (axis - up * axis.dot(up)).normalize();
    (e1, up.cross(&e1))
}

/// The room whose floor goes through `point` with normal `up`.
fn lay(
    seen: &Seen,
    root: &Isometry3<f64>,
    up: Vector3<f64>,
    point: Vector3<f64>,
) -> Isometry3<f64> {
    let level = |v: Vector3<f64>| v - up * v.dot(&up);
    let count = seen.centres.len().max(1) as f64;
    let centre = seen.centres.iter().sum::<Vector3<f64>>() / count;
    let origin = centre - up * (centre - point).dot(&up);
    let towards = level(root.translation.vector - origin);
    let forward = if towards.norm() >= MIN_HEADING_M {
        towards
    } else {
        // The root hangs above: people who look up to its picture's top edge face X.
        level(-(root.rotation * (Vector3::z() - Vector3::y())))
    };
    let x = forward.try_normalize(1e-6).unwrap_or_else(|| across(&up).0);
    let world_from_room =
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, up.cross(&x), up]));
    let rotation = UnitQuaternion::from_rotation_matrix(&world_from_room);
    Isometry3::from_parts(Translation3::from(origin), rotation).inverse()
}

fn check(
    names: &[&str],
    seen: &Seen,
    placed: &[Placed],
    room_from_world: &Isometry3<f64>,
    source: FloorSource,
) -> FloorRow {
    let height = |at: &Vector3<f64>| room_from_world.transform_point(&(*at).into()).z;
    let share = |hits: usize, of: usize| hits as f64 / of.max(1) as f64;
    let ankles: Vec<f64> = seen
        .feet
        .iter()
        .filter(|(_, above_sole)| *above_sole == ANKLE_HEIGHT_M)
        .map(|(at, _)| height(at))
        .collect();
    let in_band = |h: &&f64| (BAND_M.0..=BAND_M.1).contains(*h);
    let mut off: Vec<f64> = seen
        .feet
        .iter()
        .map(|(at, above_sole)| (height(at) - above_sole).abs())
        .collect();
    let heads_up = |u: &&Vector3<f64>| (room_from_world.rotation * **u).z > 0.0;
    FloorRow {
        source,
        samples: seen.feet.len() as u64,
        sigma_mm: median(&mut off).unwrap_or(0.0) * 1482.6,
        share_in_band: share(ankles.iter().filter(in_band).count(), ankles.len()),
        heads_up_share: share(
            seen.uprights.iter().filter(heads_up).count(),
            seen.uprights.len(),
        ),
        sensors_below: names
            .iter()
            .zip(placed)
            .filter(|(_, placed)| height(&placed.world_from_sensor.translation.vector) < 0.0)
            .map(|(name, _)| (*name).to_owned())
            .collect(),
    }
}
