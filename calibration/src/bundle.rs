//! All sensors at once: robust Gauss-Newton over pose, time offset and clock drift of each and over the trackers' biases,
//! so that rings close.
//!
//! Every sensor that sees a joint of a person at an instant says where it is; the joint's true place is unknown and
//! eliminated. What is between a sensor's word and the truth, besides noise:
//!
//! - *Ray bias*: a depth sensor sees the skin, so its tracker reports a joint some way towards the sensor; one length per
//!   joint, the same for all sensors. The main systematic error between views: without it a ring of four with 15 mm of it is
//!   off by 20 mm.
//! - *Own offsets*: what one sensor adds to that, per joint, in its own axes.
//! - *Definitions*: trackers of different joint sets mean different points by the same name; one offset per set and joint,
//!   in the joint's local axes.
//!
//! The world here is the frame of the first sensor, or the room where sensors are held.

use nalgebra::{Isometry3, Matrix3, SMatrix, Translation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, local_axes_within, trunk_axes};

use crate::beliefs::{OWN_M, OWN_RANGE_M, beliefs};
use crate::graph::Placed;
use crate::noise;
use crate::normal::{JointSystem, Layout, PER_SENSOR, PER_SIGHT, Reduced, Sight, Step};
use crate::people::{Person, consensus, people};
use crate::stats::median;
use crate::tracks::{Pose, SensorTracks};

/// Most rounds, and the largest step (m, rad) below which it is settled.
const MAX_ROUNDS: usize = 24;
const SETTLED: f64 = 2e-5;
/// Rounds before which bodies and labels are matched anew.
const RELABELLED: [usize; 5] = [0, 1, 3, 6, 10];
/// Until this round every fourth instant has to do.
const SPARSE_UNTIL: usize = 10;
const SPARSE: usize = 4;
/// Robust scale squared, in variances: wide at first, then tighter, the last for good.
const SCALES: [f64; 6] = [36.0, 36.0, 36.0, 25.0, 16.0, 9.0];
/// Rounds of weighting and averaging one joint's sights.
const REWEIGHTED: usize = 3;
/// Median of the squared length of a 3D vector of unit normals.
const MEDIAN_SQUARE: f64 = 2.366;
/// Range of the squared scale of a sensor's or joint's noise against the model's.
const NOISE_RANGE: [f64; 2] = [0.1, 1e4];
/// Length of the stretches of time that are taken to be independent of each other, seconds: five times the 0.4 s that a
/// tracker's errors live.
const STRETCH_S: f64 = 2.0;
/// How many samples say as much as one independent one: to begin with.
const REPEATS: f64 = 5.0;
/// Least believable of [`Round::bend`].
const MIN_BEND: f64 = 0.3;
/// Round from which that and the size of own offsets are learnt.
const LEARNT_FROM: usize = 5;

/// What is estimated, and of whom.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// Sensors that do not move.
    pub(crate) held: Vec<bool>,
    /// For each sensor which of the `definitions` holds for it; `None`: its joints are the reference.
    pub(crate) definition_of: Vec<Option<usize>>,
    /// Which definitions are known and held.
    pub(crate) definition_held: Vec<bool>,
    pub(crate) time_offsets: bool,
    pub(crate) drift: bool,
    pub(crate) ray_bias: bool,
    /// Whether rays start where the sensor is, so that noise along and across them differs.
    pub(crate) directed: bool,
    /// The middle of the walk, seconds since its start.
    pub(crate) middle_s: f64,
}

/// What is not known.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    /// One per sensor.
    pub(crate) placed: Vec<Placed>,
    /// Metres away from the sensor, by joint.
    pub(crate) ray_bias: [f64; JOINT_COUNT],
    /// Metres, sensor axes, by sensor and joint.
    pub(crate) own: Vec<[Vector3<f64>; JOINT_COUNT]>,
    /// Metres, the joint's local axes, by set and joint.
    pub(crate) definitions: Vec<[Vector3<f64>; JOINT_COUNT]>,
}

/// What the bundle found.
#[derive(Clone, Debug)]
pub(crate) struct Bundled {
    pub(crate) unknowns: Unknowns,
    /// Sights of joints that each sensor took part with.
    pub(crate) samples: Vec<u64>,
    /// By joint set other than the reference and joint: how many sights there were.
    pub(crate) definition_samples: Vec<[u64; JOINT_COUNT]>,
    /// Covariance of turn, shift, offset and drift of all sensors, in the order of the sensors; 0 for those held.
    pub(crate) covariance: Option<nalgebra::DMatrix<f64>>,
}

/// What one sensor says of one joint at one instant.
#[derive(Clone, Copy)]
struct Said {
    sensor: usize,
    /// Where it puts the joint, biases removed, world.
    at: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Where the sensor is, world.
    lens: Vector3<f64>,
    /// Factor of its information, from confidence and noise.
    trust: f64,
    information: Matrix3<f64>,
    /// Robust weight.
    weight: f64,
    /// Squared length of its distance to the joint, in variances.
    square: f64,
}

/// How noisy sensors and joints are against the model: factors of the variance.
struct Noise {
    sensors: Vec<f64>,
    joints: [f64; JOINT_COUNT],
}

/// Sights of a round.
struct Round {
    systems: Vec<JointSystem>,
    samples: Vec<u64>,
    definition_samples: Vec<[u64; JOINT_COUNT]>,
    /// How much less the robust cost bends than its weights say: a distance that grows loses weight.
    bend: f64,
}

/// Improves `placed` at these instants.
pub(crate) fn bundle(
    sensors: &[SensorTracks],
    times: &[f64],
    mut unknowns: Unknowns,
    setting: &Setting,
) -> Bundled {
    let layout = Layout {
        sensors: sensors.len(),
        definitions: unknowns.definitions.len(),
    };
    let mut noise = Noise {
        sensors: vec![1.0; sensors.len()],
        joints: [1.0; JOINT_COUNT],
    };
    let sparse: Vec<f64> = times.iter().copied().step_by(SPARSE).collect();
    let mut who: Vec<Person> = Vec::new();
    let mut repeats = REPEATS;
    let mut own_m = OWN_M;
    let mut result = Bundled {
        unknowns: unknowns.clone(),
        samples: vec![0; sensors.len()],
        definition_samples: Vec::new(),
        covariance: None,
    };
    for round in 0..MAX_ROUNDS {
        let times = if round < SPARSE_UNTIL { &sparse } else { times };
        let seen = sample(sensors, times, &unknowns.placed, setting.middle_s);
        if RELABELLED.contains(&round) {
            who = people(&seen, &unknowns.placed);
        }
        let scale = SCALES[round.min(SCALES.len() - 1)];
        let linear = Linear {
            seen: &seen,
            times,
            people: &who,
            unknowns: &unknowns,
            setting,
            layout,
        };
        if round == 0 {
            linear.round(&mut noise, scale);
        }
        let made = linear.round(&mut noise, scale);
        let beliefs = beliefs(layout, &unknowns, setting, own_m);
        let held = held(layout, setting);
        let Some(reduced) = Reduced::new(&made.systems, &beliefs, layout, repeats, held) else {
            break;
        };
        let Some(step) = reduced.step() else { break };
        let size = apply(&step, &mut unknowns, layout);
        result.samples = made.samples;
        result.definition_samples = made.definition_samples;
        let settled = round > RELABELLED[4] && size < SETTLED;
        if round >= LEARNT_FROM {
            // Where the cost bends less than its weights say, less is known by its square.
            let bend = made.bend.clamp(MIN_BEND, 1.0);
            let found = reduced.repeats(&made.systems).map(|r| r / (bend * bend));
            repeats = found.map_or(repeats, |r| r.clamp(1.0, 100.0));
            let [least, most] = OWN_RANGE_M;
            own_m = reduced
                .own_variance(&unknowns.own)
                .sqrt()
                .clamp(least, most);
        }
        if settled || round + 1 == MAX_ROUNDS {
            result.covariance = reduced.covariance();
            break;
        }
    }
    result.unknowns = unknowns;
    result
}

/// The bodies that every sensor sees at these instants, with its time offset and drift.
pub(crate) fn sample(
    sensors: &[SensorTracks],
    times: &[f64],
    placed: &[Placed],
    middle_s: f64,
) -> Vec<Vec<Vec<Pose>>> {
    let of = |(sensor, placed): (&SensorTracks, &Placed)| {
        let at = |time: &f64| sensor.at(*time, placed.offset_at(time - middle_s));
        times.iter().map(at).collect()
    };
    sensors.iter().zip(placed).map(of).collect()
}

/// Everything that the equations of one round are made from.
struct Linear<'l> {
    seen: &'l [Vec<Vec<Pose>>],
    times: &'l [f64],
    people: &'l [Person],
    unknowns: &'l Unknowns,
    setting: &'l Setting,
    layout: Layout,
}

impl Linear<'_> {
    /// The equations, and how noisy sensors and joints turned out to be.
    fn round(&self, noise: &mut Noise, scale: f64) -> Round {
        let first_s = self.times.first().copied().unwrap_or(0.0);
        let last_s = self.times.last().copied().unwrap_or(0.0);
        let stretches = ((last_s - first_s) / STRETCH_S).ceil().max(1.0) as usize;
        let length_s = (last_s - first_s).max(1e-9) / stretches as f64;
        let mut systems: Vec<_> = (0..JOINT_COUNT)
            .map(|_| JointSystem::new(self.layout, stretches))
            .collect();
        let mut samples = vec![0; self.layout.sensors];
        let mut definition_samples = vec![[0; JOINT_COUNT]; self.layout.definitions];
        let mut squares: Vec<(usize, usize, f64)> = Vec::new();
        let (mut bend, mut weight) = (0.0, 0.0);
        let (mut said, mut sights) = (Vec::new(), Vec::new());
        for person in self.people {
            let time = self.times[person.instant];
            let stretch = (((time - first_s) / length_s) as usize).min(stretches - 1);
            let axes = self.axes(person);
            for joint in 0..JOINT_COUNT {
                self.said(person, joint, axes[joint].as_ref(), noise, &mut said);
                if said.len() < 2 {
                    continue;
                }
                let at = agree(&mut said, scale);
                said.iter_mut()
                    .for_each(|s| s.inform(&at, self.setting.directed));
                let at = agree(&mut said, scale);
                let velocity =
                    said.iter().map(|s| s.velocity).sum::<Vector3<f64>>() / said.len() as f64;
                sights.clear();
                for one in &said {
                    samples[one.sensor] += 1;
                    if let Some(set) = self.setting.definition_of[one.sensor] {
                        definition_samples[set][joint] += 1;
                    }
                    squares.push((one.sensor, joint, one.square));
                    weight += one.weight;
                    bend += bend_of(one.square, scale);
                    sights.push(self.sight(one, at, velocity, time, axes[joint].as_ref()));
                }
                systems[joint].add(stretch, &sights);
            }
        }
        systems.iter_mut().for_each(JointSystem::complete);
        noise.learn(&mut squares);
        Round {
            systems,
            samples,
            definition_samples,
            bend: if weight > 0.0 { bend / weight } else { 1.0 },
        }
    }

    /// Local axes of a person's joints, world; none where one joint set is alone.
    fn axes(&self, person: &Person) -> [Option<Matrix3<f64>>; JOINT_COUNT] {
        let mut axes = [None; JOINT_COUNT];
        if self.layout.definitions > 0 {
            let joints = consensus(person, self.seen, &self.unknowns.placed);
            if let Some(trunk) = trunk_axes(&joints) {
                for joint in Joint::ALL {
                    axes[joint as usize] = local_axes_within(joint, &joints, &trunk);
                }
            }
        }
        axes
    }

    /// What each sensor says of a person's joint.
    fn said(
        &self,
        person: &Person,
        joint: usize,
        axes: Option<&Matrix3<f64>>,
        noise: &Noise,
        said: &mut Vec<Said>,
    ) {
        said.clear();
        for member in &person.members {
            let bodies = &self.seen[member.sensor][person.instant];
            let Some(point) = member.joint(joint, bodies) else {
                continue;
            };
            let ray = point.at.normalize();
            let mut at = point.at
                + ray * self.unknowns.ray_bias[joint]
                + self.unknowns.own[member.sensor][joint];
            let world_from_sensor = &self.unknowns.placed[member.sensor].world_from_sensor;
            at = world_from_sensor.rotation * at + world_from_sensor.translation.vector;
            if let Some(set) = self.setting.definition_of[member.sensor] {
                let Some(axes) = axes else { continue };
                at += axes * self.unknowns.definitions[set][joint];
            }
            let mut one = Said {
                sensor: member.sensor,
                at,
                velocity: world_from_sensor.rotation * point.velocity,
                lens: world_from_sensor.translation.vector,
                trust: point.weight / (noise.sensors[member.sensor] * noise.joints[joint]),
                information: Matrix3::zeros(),
                weight: 1.0,
                square: 0.0,
            };
            one.inform(&at, self.setting.directed);
            said.push(one);
        }
    }

    fn sight(
        &self,
        said: &Said,
        at: Vector3<f64>,
        velocity: Vector3<f64>,
        time: f64,
        axes: Option<&Matrix3<f64>>,
    ) -> Sight {
        let layout = self.layout;
        let mut derivatives = SMatrix::<f64, 3, PER_SIGHT>::zeros();
        // By the joint's place as all agree on it: what a sensor is off must not weigh in its own derivatives, or noise
        // pulls at the ray bias (by 3 mm of 15).
        derivatives
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&-at.cross_matrix());
        derivatives
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&Matrix3::identity());
        derivatives.set_column(6, &-velocity);
        derivatives.set_column(7, &(-velocity * (time - self.setting.middle_s)));
        derivatives.set_column(PER_SENSOR, &(at - said.lens).normalize());
        let rotation = self.unknowns.placed[said.sensor].world_from_sensor.rotation;
        derivatives
            .fixed_view_mut::<3, 3>(0, PER_SENSOR + 1)
            .copy_from(rotation.to_rotation_matrix().matrix());
        let mut used = PER_SENSOR + 4;
        let set = self.setting.definition_of[said.sensor];
        if let (Some(_), Some(axes)) = (set, axes) {
            derivatives.fixed_view_mut::<3, 3>(0, used).copy_from(axes);
            used += 3;
        }
        let index = std::array::from_fn(|k| match k {
            0..PER_SENSOR => PER_SENSOR * said.sensor + k,
            PER_SENSOR => layout.poses(),
            _ if k < PER_SENSOR + 4 => layout.own(said.sensor) + k - PER_SENSOR - 1,
            _ => layout.definition(set.unwrap_or(0)) + k - PER_SENSOR - 4,
        });
        Sight {
            information: said.information * said.weight,
            off: said.at - at,
            derivatives,
            index,
            used,
        }
    }
}

impl Said {
    /// Sets what its word is worth for a joint at `at`.
    fn inform(&mut self, at: &Vector3<f64>, directed: bool) {
        let ray = at - self.lens;
        let [across, along] = if directed {
            noise::information(&ray)
        } else {
            noise::without_direction()
        };
        let ray = ray.normalize();
        self.information = (Matrix3::from_diagonal_element(across)
            + ray * ray.transpose() * (along - across))
            * self.trust;
    }
}

/// Where the joint is by all that is said of it, those that do not fit counting less; sets weights and squares.
fn agree(said: &mut [Said], scale: f64) -> Vector3<f64> {
    for i in 0..said.len() {
        let one = said[i];
        let near = |other: &Said| {
            let apart = other.at - one.at;
            let information = (one.information + other.information) * 0.25;
            robust(apart.dot(&(information * apart)), scale)
        };
        let others = said.iter().enumerate().filter(|(k, _)| *k != i);
        said[i].weight = others.map(|(_, other)| near(other)).sum::<f64>().max(1e-9);
    }
    let mut at = Vector3::zeros();
    for _ in 0..REWEIGHTED {
        let total: Matrix3<f64> = said.iter().map(|s| s.information * s.weight).sum();
        let sum: Vector3<f64> = said.iter().map(|s| s.information * s.at * s.weight).sum();
        let Some(covariance) = total.try_inverse() else {
            break;
        };
        at = covariance * sum;
        for one in said.iter_mut() {
            // What it says itself draws the mean along.
            let share = (covariance * one.information).trace() / 3.0 * one.weight;
            let off = one.at - at;
            one.square = off.dot(&(one.information * off)) / (1.0 - share).max(0.3);
        }
        for one in said.iter_mut() {
            one.weight = robust(one.square, scale);
        }
    }
    let total: Matrix3<f64> = said.iter().map(|s| s.information * s.weight).sum();
    let sum: Vector3<f64> = said.iter().map(|s| s.information * s.at * s.weight).sum();
    total
        .try_inverse()
        .map_or(at, |covariance| covariance * sum)
}

/// Geman-McClure: 1 at no distance, a quarter at the scale.
fn robust(square: f64, scale: f64) -> f64 {
    let ratio = 1.0 + square / scale;
    1.0 / (ratio * ratio)
}

/// How the pull of a distance grows with it, averaged over directions; 1 without robustness.
fn bend_of(square: f64, scale: f64) -> f64 {
    let ratio = 1.0 + square / scale;
    ratio.powi(-2) - 4.0 / 3.0 * square / scale * ratio.powi(-3)
}

impl Noise {
    /// Scales the noise so that half of each sensor's and joint's distances are as the model has them.
    fn learn(&mut self, squares: &mut [(usize, usize, f64)]) {
        let factor = |values: &mut Vec<f64>| median(values).map(|m| m / MEDIAN_SQUARE);
        let [least, most] = NOISE_RANGE;
        let mut of_sensor = vec![Vec::new(); self.sensors.len()];
        for (sensor, _, square) in squares.iter() {
            of_sensor[*sensor].push(*square);
        }
        let factors: Vec<f64> = of_sensor
            .iter_mut()
            .map(|values| factor(values).unwrap_or(1.0).max(1e-3))
            .collect();
        let mut of_joint = vec![Vec::new(); JOINT_COUNT];
        for (sensor, joint, square) in squares.iter() {
            of_joint[*joint].push(square / factors[*sensor]);
        }
        for (noise, factor) in self.sensors.iter_mut().zip(&factors) {
            *noise = (*noise * factor).clamp(least, most);
        }
        for (noise, values) in self.joints.iter_mut().zip(&mut of_joint) {
            *noise = (*noise * factor(values).unwrap_or(1.0)).clamp(least, most);
        }
    }
}

/// Which of the shared unknowns do not move.
fn held(layout: Layout, setting: &Setting) -> Vec<bool> {
    let none_held = !setting.held.iter().any(|held| *held);
    (0..layout.shared())
        .map(|index| {
            if index >= layout.poses() {
                return !setting.ray_bias;
            }
            let (sensor, unknown) = (index / PER_SENSOR, index % PER_SENSOR);
            setting.held[sensor]
                || (none_held && sensor == 0)
                || (unknown == 6 && !setting.time_offsets)
                || (unknown == 7 && !(setting.time_offsets && setting.drift))
        })
        .collect()
}

/// Takes the step; its largest part in metres or radians.
fn apply(step: &Step, unknowns: &mut Unknowns, layout: Layout) -> f64 {
    let mut largest: f64 = 0.0;
    for (sensor, placed) in unknowns.placed.iter_mut().enumerate() {
        let first = PER_SENSOR * sensor;
        let turn: Vector3<f64> = step.shared.fixed_rows::<3>(first).into_owned();
        let shift: Vector3<f64> = step.shared.fixed_rows::<3>(first + 3).into_owned();
        let motion = Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_scaled_axis(turn),
        );
        placed.world_from_sensor = motion * placed.world_from_sensor;
        placed.offset_s += step.shared[first + 6];
        placed.drift += step.shared[first + 7];
        largest = largest.max(turn.norm()).max(shift.norm());
    }
    for joint in 0..JOINT_COUNT {
        unknowns.ray_bias[joint] += step.shared[layout.poses() + joint];
        let own = &step.own[joint];
        for (sensor, offsets) in unknowns.own.iter_mut().enumerate() {
            offsets[joint] += own.fixed_rows::<3>(3 * sensor).into_owned();
        }
        for (set, offsets) in unknowns.definitions.iter_mut().enumerate() {
            offsets[joint] += own.fixed_rows::<3>(3 * (layout.sensors + set)).into_owned();
        }
    }
    largest
}
