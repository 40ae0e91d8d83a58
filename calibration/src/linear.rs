//! One round of the bundle as linear equations: what each sensor says of each joint, how much that counts, and how it
//! changes with the unknowns.

use nalgebra::{Matrix3, SMatrix, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, local_axes_within, trunk_axes};

use crate::bundle::{Setting, Unknowns};
use crate::graph::Placed;
use crate::noise;
use crate::normal::{JointSystem, Layout, PER_SENSOR, PER_SIGHT, Sight};
use crate::people::{Person, consensus};
use crate::stats::median;
use crate::tracks::Pose;

/// Rounds of weighting and averaging one joint's sights: to learn which way the rays run, and for good.
const ROUGHLY: usize = 1;
const REWEIGHTED: usize = 3;
/// Median of the squared length of a 3D vector of unit normals.
const MEDIAN_SQUARE: f64 = 2.366;
/// Range of the squared scale of a sensor's or joint's noise against the model's.
const NOISE_RANGE: [f64; 2] = [0.1, 1e4];
/// Length of the stretches of time that are taken to be independent of each other, seconds: five times the 0.4 s that a
/// tracker's errors live.
const STRETCH_S: f64 = 2.0;
/// Most of them: longer ones are independent, too.
const MAX_STRETCHES: usize = 100;

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
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    pub(crate) sensors: Vec<f64>,
    pub(crate) joints: [f64; JOINT_COUNT],
}

/// Sights of a round.
pub(crate) struct Round {
    pub(crate) systems: Vec<JointSystem>,
    pub(crate) samples: Vec<u64>,
    pub(crate) definition_samples: Vec<[u64; JOINT_COUNT]>,
    /// How much less the robust cost bends than its weights say: a distance that grows loses weight.
    pub(crate) bend: f64,
    /// Length of a stretch of time, seconds.
    pub(crate) stretch_s: f64,
}

/// Everything that the equations of one round are made from.
pub(crate) struct Linear<'l> {
    pub(crate) seen: &'l [Vec<Vec<Pose>>],
    /// The clocks by which that was seen; what they are off by now is made up for along the velocities.
    pub(crate) clocks: &'l [Placed],
    pub(crate) times: &'l [f64],
    pub(crate) people: &'l [Person],
    pub(crate) unknowns: &'l Unknowns,
    pub(crate) setting: &'l Setting,
    pub(crate) layout: Layout,
}

impl Linear<'_> {
    /// The equations, and how noisy sensors and joints turned out to be.
    /// `parted`: whether to keep what each stretch of time says.
    pub(crate) fn round(&self, noise: &mut Noise, scale: f64, parted: bool) -> Round {
        let (first_s, length_s, stretches) = self.stretches();
        let mut systems: Vec<_> = (0..JOINT_COUNT)
            .map(|_| JointSystem::new(self.layout, stretches, parted))
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
                let at = agree(&mut said, scale, ROUGHLY);
                said.iter_mut()
                    .for_each(|s| s.inform(&at, self.setting.directed));
                let at = agree(&mut said, scale, REWEIGHTED);
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
            stretch_s: length_s,
        }
    }

    /// When the first stretch of time begins, how long each is, how many there are.
    fn stretches(&self) -> (f64, f64, usize) {
        let first_s = self.times.first().copied().unwrap_or(0.0);
        let last_s = self.times.last().copied().unwrap_or(0.0);
        let stretches = ((last_s - first_s) / STRETCH_S).ceil() as usize;
        let stretches = stretches.clamp(1, MAX_STRETCHES);
        (
            first_s,
            (last_s - first_s).max(1e-9) / stretches as f64,
            stretches,
        )
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
        let since_middle_s = self.times[person.instant] - self.setting.middle_s;
        for member in &person.members {
            let bodies = &self.seen[member.sensor][person.instant];
            let Some(point) = member.joint(joint, bodies) else {
                continue;
            };
            let [now, then] = [&self.unknowns.placed[..], self.clocks]
                .map(|placed| placed[member.sensor].offset_at(since_middle_s));
            let seen = point.at - point.velocity * (now - then);
            let ray = seen.normalize();
            let mut at = seen
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
            sensor: said.sensor,
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
fn agree(said: &mut [Said], scale: f64, rounds: usize) -> Vector3<f64> {
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
    for _ in 0..rounds {
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
