//! A walk made here: a body with planted feet, seen by noisy sensors whose places are known.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each test binary and the bench use a part"
)]

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{SensorWalk, Walk, WalkBody, WalkFrame, WalkJoint};
use posefuse_skeleton::{Calibration, Confidence, Joint, JointMap, Position, Timestamp};

/// A small generator (SplitMix64), so that every run sees the same walk.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }

    pub fn normals(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}

/// What the sensors do to the truth.
#[derive(Clone, Debug)]
pub struct Errors {
    pub white_m: f64,
    pub correlated_m: f64,
    pub towards_sensor_m: f64,
    pub swap_from_behind: f64,
    pub spikes_per_s: f64,
    pub drop: f64,
    pub clock_offsets_s: f64,
}

impl Errors {
    pub const NONE: Self = Self {
        white_m: 0.0,
        correlated_m: 0.0,
        towards_sensor_m: 0.0,
        swap_from_behind: 0.0,
        spikes_per_s: 0.0,
        drop: 0.0,
        clock_offsets_s: 0.0,
    };
    pub const USUAL: Self = Self {
        white_m: 0.006,
        correlated_m: 0.012,
        towards_sensor_m: 0.015,
        swap_from_behind: 0.7,
        spikes_per_s: 0.15,
        drop: 0.02,
        clock_offsets_s: 0.04,
    };
}

/// How somebody moves: metres on the floor at a time, and where the body faces.
pub type Path = fn(f64) -> Vector3<f64>;

pub fn eight(t: f64) -> Vector3<f64> {
    Vector3::new(1.3 * (0.45 * t).sin(), 1.1 * (0.9 * t + 0.4).sin(), 0.0)
}

pub fn other_eight(t: f64) -> Vector3<f64> {
    Vector3::new(
        1.2 * (0.5 * t + 2.0).sin(),
        1.2 * (0.31 * t + 0.9).cos(),
        0.0,
    )
}

pub fn standing(_: f64) -> Vector3<f64> {
    Vector3::new(0.2, 0.1, 0.0)
}

pub fn line(t: f64) -> Vector3<f64> {
    Vector3::new(1.5 * (0.6 * t).sin(), 0.0, 0.0)
}

/// The truth: joint positions in the room.
pub fn body(path: Path, t: f64) -> (JointMap<Vector3<f64>>, Vector3<f64>) {
    let at = path(t);
    let ahead = path(t + 0.05) - path(t - 0.05);
    let forward = ahead.try_normalize(1e-3).unwrap_or_else(Vector3::x);
    let left = Vector3::z().cross(&forward);
    let swing = (std::f64::consts::TAU * t / 1.1).sin() * f64::from(u8::from(ahead.norm() > 1e-3));
    let mut joints = JointMap::empty();
    let mut put = |joint: Joint, f: f64, l: f64, z: f64| {
        joints[joint] = Some(at + forward * f + left * l + Vector3::z() * z);
    };
    use Joint::*;
    put(SpineBase, 0.0, 0.0, 0.95);
    put(SpineMid, 0.02, 0.0, 1.2);
    put(SpineShoulder, 0.0, 0.0, 1.42);
    put(Neck, 0.01, 0.0, 1.5);
    put(Head, 0.05, 0.0, 1.66);
    for (side, sign, joints) in [
        (
            1.0,
            1.0,
            [
                ShoulderLeft,
                ElbowLeft,
                WristLeft,
                HandLeft,
                HandTipLeft,
                ThumbLeft,
                HipLeft,
            ],
        ),
        (
            -1.0,
            -1.0,
            [
                ShoulderRight,
                ElbowRight,
                WristRight,
                HandRight,
                HandTipRight,
                ThumbRight,
                HipRight,
            ],
        ),
    ] {
        let reach = -0.35 * swing * sign;
        let [shoulder, elbow, wrist, hand, tip, thumb, hip] = joints;
        put(shoulder, 0.0, 0.18 * side, 1.38);
        put(elbow, reach * 0.5, 0.24 * side, 1.10);
        put(wrist, reach + 0.1, 0.25 * side, 0.88);
        put(hand, reach + 0.14, 0.25 * side, 0.80);
        put(tip, reach + 0.17, 0.25 * side, 0.72);
        put(thumb, reach + 0.18, 0.21 * side, 0.79);
        put(hip, 0.0, 0.09 * side, 0.90);
    }
    for (phase, side, [hip, knee, ankle, foot]) in [
        (0.0, 1.0, [HipLeft, KneeLeft, AnkleLeft, FootLeft]),
        (0.5, -1.0, [HipRight, KneeRight, AnkleRight, FootRight]),
    ] {
        let sole = planted(path, t, phase, side);
        let forward_of_foot = forward;
        joints[ankle] = Some(sole + Vector3::z() * 0.08);
        joints[foot] = Some(sole + forward_of_foot * 0.12 + Vector3::z() * 0.03);
        let middle = (joints[hip].unwrap() + joints[ankle].unwrap()) / 2.0;
        joints[knee] = Some(middle + forward * 0.05);
    }
    (joints, forward)
}

/// A sole that stands for 60 % of each 1.1 s stride and then swings to its next place.
fn planted(path: Path, t: f64, phase: f64, side: f64) -> Vector3<f64> {
    let stride = t / 1.1 + phase;
    let (index, part) = (stride.floor(), stride.fract());
    let place = |index: f64| {
        let middle = (index - phase + 0.3) * 1.1;
        let ahead = path(middle + 0.05) - path(middle - 0.05);
        let forward = ahead.try_normalize(1e-3).unwrap_or_else(Vector3::x);
        path(middle) + Vector3::z().cross(&forward) * (0.1 * side)
    };
    let (here, next) = (place(index), place(index + 1.0));
    let moved = ((part - 0.6) / 0.4).max(0.0);
    let smooth = moved * moved * (3.0 - 2.0 * moved);
    let lift = 0.12
        * (std::f64::consts::PI * moved).sin()
        * f64::from(u8::from((next - here).norm() > 1e-6));
    here + (next - here) * smooth + Vector3::z() * lift
}

/// A sensor at `from` that looks at `at`, upright.
pub fn looking(from: [f64; 3], at: [f64; 3]) -> Isometry3<f64> {
    let (from, at) = (Vector3::from(from), Vector3::from(at));
    let z = (at - from).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(
        Translation3::from(from),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// `count` sensors around the room's centre, over `arc_deg` degrees (360 is a ring).
pub fn ring(count: usize, arc_deg: f64) -> BTreeMap<String, Isometry3<f64>> {
    let step = if arc_deg >= 360.0 {
        arc_deg / count as f64
    } else {
        arc_deg / (count - 1) as f64
    };
    (0..count)
        .map(|i| {
            let (sin, cos) = (step * i as f64 + 10.0).to_radians().sin_cos();
            let (radius, height) = (3.0 + 0.1 * (i % 3) as f64, 0.8 + 0.25 * (i % 4) as f64);
            (
                format!("s{i}"),
                looking([radius * cos, radius * sin, height], [0.0, 0.0, 0.9]),
            )
        })
        .collect()
}

/// A whole recording.
pub struct Scene {
    pub sensors: BTreeMap<String, Isometry3<f64>>,
    pub people: Vec<Path>,
    pub seconds: f64,
    pub errors: Errors,
    pub seed: u64,
}

impl Scene {
    pub fn ring(count: usize, seconds: f64, errors: Errors, seed: u64) -> Self {
        Self {
            sensors: ring(count, 360.0),
            people: vec![eight],
            seconds,
            errors,
            seed,
        }
    }

    /// The walk, and what each sensor's clock is late by (what must be added to its stamps).
    pub fn record(&self) -> (Walk, BTreeMap<String, f64>) {
        let mut random = Random(self.seed);
        let mut offsets = BTreeMap::new();
        let mut walk = Walk::default();
        for (index, (name, room_from_sensor)) in self.sensors.iter().enumerate() {
            let offset = self.errors.clock_offsets_s * (2.0 * random.unit() - 1.0);
            offsets.insert(name.clone(), offset);
            let mut states = vec![State::default(); self.people.len()];
            let mut frames = Vec::new();
            let mut t = 0.03 * random.unit();
            while t < self.seconds {
                if random.unit() >= self.errors.drop {
                    let bodies = self.people.iter().zip(&mut states).enumerate().map(
                        |(person, (path, state))| {
                            let joints = self.see(*path, t, room_from_sensor, state, &mut random);
                            WalkBody {
                                tracking_id: (person * 7 + index) as u64,
                                joints,
                            }
                        },
                    );
                    frames.push(WalkFrame {
                        time: Timestamp::from_seconds(1000.0 + t - offset),
                        bodies: bodies.collect(),
                    });
                }
                t += 1.0 / 30.0 + 0.002 * (random.unit() - 0.5);
            }
            walk.sensors.push(SensorWalk {
                name: name.clone(),
                frames,
                ..SensorWalk::default()
            });
        }
        (walk, offsets)
    }

    fn see(
        &self,
        path: Path,
        t: f64,
        room_from_sensor: &Isometry3<f64>,
        state: &mut State,
        random: &mut Random,
    ) -> JointMap<WalkJoint> {
        let errors = &self.errors;
        let (truth, forward) = body(path, t);
        let to_sensor = room_from_sensor.translation.vector - path(t);
        let behind = forward.dot(&to_sensor) < -0.3 * to_sensor.norm();
        if behind != state.behind {
            state.behind = behind;
            state.swapped = behind && random.unit() < errors.swap_from_behind;
        }
        if random.unit() < errors.spikes_per_s / 30.0 {
            state.spike = (
                Some(Joint::ALL[(random.unit() * 25.0) as usize]),
                random.normals(0.12),
                8,
            );
        }
        state.spike.2 = state.spike.2.saturating_sub(1);
        let mut seen = JointMap::empty();
        for (joint, at) in truth.iter() {
            let correlated = &mut state.correlated[joint as usize];
            let keep = (-1.0 / 30.0 / 0.4_f64).exp();
            *correlated = *correlated * keep
                + random.normals(errors.correlated_m * (1.0 - keep * keep).sqrt());
            let mut p = room_from_sensor
                .inverse_transform_point(&Point3::from(*at))
                .coords;
            p -= p.normalize() * errors.towards_sensor_m;
            p += *correlated + random.normals(errors.white_m);
            if state.spike.0 == Some(joint) && state.spike.2 > 0 {
                p += state.spike.1;
            }
            let label = if state.swapped {
                joint.mirrored()
            } else {
                joint
            };
            seen[label] = Some(WalkJoint {
                position: Position::from_vector(p),
                confidence: Confidence::FULL,
            });
        }
        seen
    }
}

#[derive(Clone, Default)]
struct State {
    correlated: [Vector3<f64>; 25],
    behind: bool,
    swapped: bool,
    spike: (Option<Joint>, Vector3<f64>, u32),
}

/// For every pair of sensors: RMS over the volume of how far the relation is off the truth, metres.
pub fn pair_errors(found: &Calibration, truth: &BTreeMap<String, Isometry3<f64>>) -> Vec<f64> {
    let names: Vec<&String> = truth.keys().collect();
    let mut errors = Vec::new();
    for (i, a) in names.iter().enumerate() {
        for b in &names[i + 1..] {
            let of = |name: &str| *found.sensors[name].room_from_sensor.isometry();
            let a_from_b = of(a).inverse() * of(b);
            let (mut squares, mut count) = (0.0, 0.0);
            for point in volume() {
                let q = a_from_b * truth[*b].inverse_transform_point(&point);
                squares += (q - truth[*a].inverse_transform_point(&point)).norm_squared();
                count += 1.0;
            }
            errors.push(f64::sqrt(squares / count));
        }
    }
    errors
}

fn volume() -> impl Iterator<Item = Point3<f64>> {
    (0..125).map(|i| {
        let [x, y, z] = [i % 5, i / 5 % 5, i / 25].map(f64::from);
        Point3::new(x * 0.75 - 1.5, y * 0.75 - 1.5, z * 0.5)
    })
}

pub fn middle(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
