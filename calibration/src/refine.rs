//! What the bundle is to find of this walk: which sensors are held, whose joints are the reference, whether the ray bias
//! is believable; and what it found, in the forms that others need.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{
    JOINT_COUNT, Joint, JointMap, JointSet, Position, Sensor, local_axes_within, trunk_axes,
};

use crate::bundle::{Bundled, Setting, Unknowns, bundle};
use crate::graph::Placed;
use crate::tracks::{Pose, SensorTracks};
use crate::{Options, Reason, SensorWalk, Verdict};

/// What lies between a body's skin and its joints, metres, with room for error. Beyond, the rays do not start at the
/// sensor: the two-Kinect recordings, which their logger turned and moved, give -80 to -340 mm.
const PLAUSIBLE_BIAS_M: std::ops::RangeInclusive<f64> = -0.015..=0.06;
/// Fewest sights of a joint for its definition to be told.
const MIN_SIGHTS: u64 = 60;

/// All sensors placed together.
pub(crate) struct Refined {
    /// What was found.
    pub(crate) bundled: Bundled,
    /// What was asked for.
    pub(crate) setting: Setting,
    /// The joint sets whose definitions are the bundle's, in its order.
    sets: Vec<JointSet>,
    /// The joint set of the reference, where one is known.
    reference: Option<JointSet>,
    /// Whether the ray bias means something.
    biased: bool,
}

/// Places the sensors, with the ray bias where that is wanted and what it finds can be skin; without it otherwise.
pub(crate) fn refine(
    walks: &[&SensorWalk],
    sensors: &[SensorTracks],
    times: &[f64],
    placed: Vec<Placed>,
    span_s: f64,
    options: &Options,
) -> Refined {
    let (reference, sets) = joint_sets(walks);
    let held_bias = !options.held_ray_bias_m.is_empty();
    let setting = Setting {
        held: walks
            .iter()
            .map(|w| options.fixed.contains_key(&w.name))
            .collect(),
        definition_of: walks
            .iter()
            .map(|w| sets.iter().position(|set| Some(*set) == w.joint_set))
            .collect(),
        definition_held: sets
            .iter()
            .map(|set| options.held_joint_offsets_m.contains_key(set))
            .collect(),
        time_offsets: options.time_offsets,
        drift: options.clock_drift && span_s >= Options::DRIFT_FROM_S,
        ray_bias: options.ray_bias && !held_bias && sensors.len() > 1,
        directed: true,
        middle_s: span_s / 2.0,
    };
    let unknowns = Unknowns {
        placed,
        ray_bias: Joint::ALL.map(|joint| options.held_ray_bias_m[joint].unwrap_or(0.0)),
        own: vec![[Vector3::zeros(); JOINT_COUNT]; sensors.len()],
        definitions: sets
            .iter()
            .map(|set| held_definition(*set, options))
            .collect(),
    };
    let found = |setting: Setting, believable: fn(&Unknowns) -> bool| Refined {
        bundled: bundle(sensors, times, unknowns.clone(), &setting, believable),
        biased: setting.ray_bias || held_bias,
        setting,
        sets: sets.clone(),
        reference,
    };
    if !setting.ray_bias {
        return found(setting, |_| true);
    }
    let can_be_skin = |unknowns: &Unknowns| PLAUSIBLE_BIAS_M.contains(&mean(&unknowns.ray_bias));
    let first = found(setting.clone(), can_be_skin);
    if first.bundled.believed {
        return first;
    }
    let without = Setting {
        ray_bias: false,
        directed: false,
        ..setting
    };
    found(without, |_| true)
}

fn mean(values: &[f64; JOINT_COUNT]) -> f64 {
    values.iter().sum::<f64>() / JOINT_COUNT as f64
}

/// The set most sensors have (of equals the first, which Kinect v2 is), and the others.
fn joint_sets(walks: &[&SensorWalk]) -> (Option<JointSet>, Vec<JointSet>) {
    let mut counts: BTreeMap<JointSet, usize> = BTreeMap::new();
    for set in walks.iter().filter_map(|walk| walk.joint_set) {
        *counts.entry(set).or_default() += 1;
    }
    let most = counts.values().copied().max();
    let reference = counts.iter().find(|(_, count)| Some(**count) == most);
    let reference = reference.map(|(set, _)| *set);
    let others = counts.into_keys().filter(|set| Some(*set) != reference);
    (reference, others.collect())
}

fn held_definition(set: JointSet, options: &Options) -> [Vector3<f64>; JOINT_COUNT] {
    let held = options.held_joint_offsets_m.get(&set);
    Joint::ALL.map(|joint| held.and_then(|offsets| offsets[joint]).unwrap_or_default())
}

impl Refined {
    /// One per sensor.
    pub(crate) fn placed(&self) -> &[Placed] {
        &self.bundled.unknowns.placed
    }

    /// The ray bias by joint, metres; empty where none is used.
    pub(crate) fn ray_bias_m(&self) -> JointMap<f64> {
        if !self.biased {
            return JointMap::empty();
        }
        let bias = &self.bundled.unknowns.ray_bias;
        Joint::ALL
            .into_iter()
            .map(|joint| (joint, bias[joint as usize]))
            .collect()
    }

    /// Its mean over the joints, mm; `None` where none is used.
    pub(crate) fn ray_bias_mm(&self) -> Option<f64> {
        self.biased
            .then(|| mean(&self.bundled.unknowns.ray_bias) * 1e3)
    }

    /// Offsets of the joints of every set but the reference, metres, local axes.
    pub(crate) fn joint_offsets_m(&self) -> BTreeMap<JointSet, JointMap<Vector3<f64>>> {
        let of = |index: usize| {
            let samples = self.bundled.definition_samples.get(index);
            let offsets = &self.bundled.unknowns.definitions[index];
            let held = self.setting.definition_held[index];
            let known =
                |joint: Joint| held || samples.is_some_and(|s| s[joint as usize] >= MIN_SIGHTS);
            let known = Joint::ALL.into_iter().filter(|joint| known(*joint));
            known
                .map(|joint| (joint, offsets[joint as usize]))
                .collect()
        };
        let sets = self.sets.iter().enumerate();
        sets.map(|(index, set)| (*set, of(index))).collect()
    }

    /// What to say of joint sets: how far each that is not the reference is off it, in the median over the joints and at
    /// most.
    pub(crate) fn notes(&self) -> Vec<Reason> {
        let Some(reference) = self.reference else {
            return Vec::new();
        };
        let of = |(set, offsets): (JointSet, JointMap<Vector3<f64>>)| {
            let sizes = offsets
                .iter()
                .map(|(joint, offset)| (offset.norm() * 1e3, joint));
            let mut sizes: Vec<(f64, Joint)> = sizes.collect();
            sizes.sort_by(|x, y| x.0.total_cmp(&y.0));
            let ((middle, _), (most, joint)) = (sizes.get(sizes.len() / 2)?, sizes.last()?);
            Some(Reason {
                severity: Verdict::Passed,
                what: format!(
                    "trackers of {} and {} mean different points by the same joint names: {middle:.0} mm apart in the \
                     median, {most:.0} mm at most (`{joint}`)",
                    set.name(),
                    reference.name()
                ),
                remedy: "nothing: the difference was estimated and is taken out".to_owned(),
                sensors: Vec::new(),
            })
        };
        self.joint_offsets_m().into_iter().filter_map(of).collect()
    }

    /// The bodies with ray bias and definitions taken out, as the engine will take them out.
    pub(crate) fn corrected(&self, seen: &[Vec<Vec<Pose>>]) -> Vec<Vec<Vec<Pose>>> {
        let mut seen = seen.to_vec();
        for (sensor, instants) in seen.iter_mut().enumerate() {
            let definition = self.setting.definition_of[sensor];
            for pose in instants.iter_mut().flatten() {
                let bias = &self.bundled.unknowns.ray_bias;
                for (point, bias) in pose.joints.iter_mut().zip(bias) {
                    if let Some(point) = point {
                        point.at += point.at.normalize() * *bias;
                    }
                }
                if let Some(set) = definition {
                    define(pose, &self.bundled.unknowns.definitions[set]);
                }
            }
        }
        seen
    }
}

/// Moves a body's joints by the offsets of their definitions.
fn define(pose: &mut Pose, offsets: &[Vector3<f64>; JOINT_COUNT]) {
    let joints: JointMap<Position<Sensor>> = Joint::ALL
        .into_iter()
        .filter_map(|joint| {
            let point = pose.joints[joint as usize]?;
            Some((joint, Position::from_vector(point.at)))
        })
        .collect();
    let Some(trunk) = trunk_axes(&joints) else {
        return;
    };
    for joint in Joint::ALL {
        if let (Some(point), Some(axes)) = (
            &mut pose.joints[joint as usize],
            local_axes_within(joint, &joints, &trunk),
        ) {
            point.at += axes * offsets[joint as usize];
        }
    }
}
