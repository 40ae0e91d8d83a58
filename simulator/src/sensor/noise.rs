//! Errors of joint positions: white and slow noise, biases, guesses of hidden joints, spikes.

use nalgebra::Vector3;
use posefuse_skeleton::{
    BONES, Confidence, Frame, JOINT_COUNT, Joint, JointMap, Position, RawJoint, Sensor,
    local_axes_within, trunk_axes,
};

use super::errors::SensorErrors;
use super::occlusion::across;
use super::{Seen, Sight, confidence};
use crate::random::{Purpose, Stream};
use crate::scenario::Scenario;

/// Sensor, frame, person: what a random number of a frame belongs to.
pub(crate) type Address = [u64; 3];

/// Standard deviations of the white noise at depth `z` metres: across the ray (per axis) and along it, metres.
/// Nguyen, Izadi, Lovell (2012), for a depth image 640 wide.
pub(crate) fn white_sigma_m(z: f64) -> (f64, f64) {
    let z = z.max(0.4);
    (1.5 * 0.8 * z / 585.0, 0.0012 + 0.0019 * (z - 0.4).powi(2))
}

/// Constant errors, drawn once.
pub(crate) struct Biases {
    /// By person and joint, in the axes of the body (forwards, left, up).
    pub(super) body: Vec<[Vector3<f64>; JOINT_COUNT]>,
    /// By joint, towards the sensor.
    pub(super) ray: [f64; JOINT_COUNT],
    /// By joint, in the axes of the sensor.
    sensor: [Vector3<f64>; JOINT_COUNT],
}

/// Where trackers of another model take each joint to be, seen from where the usual ones do: local axes, metres.
pub(crate) fn definitions(scenario: &Scenario) -> [Vector3<f64>; JOINT_COUNT] {
    let mut stream = Stream::new(scenario.seed, Purpose::Definitions, &[]);
    std::array::from_fn(|_| stream.normal3() * (scenario.errors.definition_mm * 1e-3))
}

/// Whether this sensor is of another model.
pub(crate) fn is_other_model(scenario: &Scenario, sensor: usize) -> bool {
    sensor >= scenario.sensors.saturating_sub(scenario.other_models)
}

/// The joints as that sensor's model defines them.
fn defined(
    scenario: &Scenario,
    sensor: usize,
    truth: &JointMap<Position<Sensor>>,
) -> JointMap<Position<Sensor>> {
    if !is_other_model(scenario, sensor) {
        return truth.clone();
    }
    let offsets = definitions(scenario);
    let trunk = trunk_axes(truth);
    truth.map(|joint, position| {
        let axes = trunk.and_then(|trunk| local_axes_within(joint, truth, &trunk));
        let axes = axes.unwrap_or_else(nalgebra::Matrix3::identity);
        position.moved(axes * offsets[joint as usize])
    })
}

impl Biases {
    pub(crate) fn new(seed: u64, sensor: usize, people: usize, errors: &SensorErrors) -> Self {
        let vectors = |purpose: Purpose, tag: usize, sigma_mm: f64| {
            let mut stream = Stream::new(seed, purpose, &[tag as u64]);
            std::array::from_fn(|_| stream.normal3() * (sigma_mm * 1e-3))
        };
        let mut stream = Stream::new(seed, Purpose::RayBias, &[]);
        let mut ray = || errors.ray_bias_mm + errors.ray_bias_spread_mm * stream.normal();
        Self {
            body: (0..people)
                .map(|person| vectors(Purpose::BodyBias, person, errors.body_bias_mm))
                .collect(),
            ray: std::array::from_fn(|_| ray() * 1e-3),
            sensor: vectors(Purpose::SensorBias, sensor, errors.sensor_bias_mm),
        }
    }
}

/// Slow errors of one person's joints as one sensor sees them: first-order processes of unit variance.
pub(crate) struct Drift {
    correlated: [Vector3<f64>; JOINT_COUNT],
    hidden: [Vector3<f64>; JOINT_COUNT],
    begun: bool,
}

impl Default for Drift {
    fn default() -> Self {
        Self {
            correlated: [Vector3::zeros(); JOINT_COUNT],
            hidden: [Vector3::zeros(); JOINT_COUNT],
            begun: false,
        }
    }
}

impl Drift {
    /// On to the frame of `address`, one frame after the last.
    pub(crate) fn step(&mut self, scenario: &Scenario, address: Address) {
        let errors = &scenario.errors;
        let period = 1.0 / scenario.rate_hz;
        let kept = |tau_s: f64| {
            if self.begun {
                (-period / tau_s).exp()
            } else {
                0.0
            }
        };
        let processes = [
            (
                &mut self.correlated,
                Purpose::CorrelatedNoise,
                kept(errors.correlated_tau_s),
            ),
            (&mut self.hidden, Purpose::Hidden, kept(errors.hidden_tau_s)),
        ];
        for (values, purpose, kept) in processes {
            let mut stream = Stream::new(scenario.seed, purpose, &address);
            let fresh = (1.0 - kept * kept).sqrt();
            for value in values {
                *value = *value * kept + stream.normal3() * fresh;
            }
        }
        self.begun = true;
    }
}

/// The joints as the sensor reports them, before labels are swapped and spikes added.
pub(crate) fn noisy(
    scenario: &Scenario,
    address: Address,
    truth: &JointMap<Position<Sensor>>,
    sight: &Sight,
    biases: &Biases,
    drift: &Drift,
) -> JointMap<RawJoint> {
    let errors = &scenario.errors;
    let seed = scenario.seed;
    let mut white = Stream::new(seed, Purpose::WhiteNoise, &address);
    let mut lost = Stream::new(seed, Purpose::Interference, &address);
    let interference = interference(scenario, address[0]);
    let body_axes = body_axes(truth);
    let defined = defined(scenario, address[0] as usize, truth);
    let guesses = guess_errors(truth, sight, drift, errors);
    let overconfident = overconfident(scenario, address);
    let person = address[2] as usize;
    let mut raw = JointMap::empty();
    for joint in Joint::ALL {
        // Drawn for every joint, so that a missing joint does not move the others' numbers.
        let (noise, gone) = (white.normal3(), lost.chance(0.05 * interference));
        let index = joint as usize;
        let (Some(position), Some(seen)) = (defined[joint], sight.0[joint]) else {
            continue;
        };
        if seen == Seen::OutOfView || gone {
            continue;
        }
        let at = position.vector();
        let ahead = at.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        let (right, down) = across(ahead);
        let along_ray = |v: Vector3<f64>, lateral: f64, axial: f64| {
            (right * v.x + down * v.y) * lateral + ahead * (v.z * axial)
        };
        let (lateral, axial) = white_sigma_m(at.z);
        let white_scale = errors.white_noise * (1.0 + interference);
        let moved = along_ray(noise, lateral * white_scale, axial * white_scale)
            + along_ray(
                drift.correlated[index],
                errors.correlated_lateral_mm * 1e-3,
                errors.correlated_axial_mm * 1e-3 * at.z / 3.0,
            )
            + body_axes * biases.body[person][index]
            - ahead * biases.ray[index]
            + biases.sensor[index]
            + guesses[index];
        raw[joint] = Some(RawJoint {
            position: position.moved(moved),
            confidence: confidence(seen, overconfident[index]),
        });
    }
    raw
}

/// By how much the white noise of this sensor grows because others light the same scene, as a share.
pub(super) fn interference(scenario: &Scenario, sensor: u64) -> f64 {
    let lit = scenario.structured_light;
    if (sensor as usize) < lit {
        scenario.errors.interference * (lit - 1) as f64
    } else {
        0.0
    }
}

/// Error of each hidden joint: its own, in proportion to its bone up to a full share at 25 cm, on top of that of
/// the joint it hangs on. Metres.
fn guess_errors(
    truth: &JointMap<Position<Sensor>>,
    sight: &Sight,
    drift: &Drift,
    errors: &SensorErrors,
) -> [Vector3<f64>; JOINT_COUNT] {
    let mut guesses = [Vector3::zeros(); JOINT_COUNT];
    if !errors.occlusion || errors.hidden_error_mm == 0.0 {
        return guesses;
    }
    let hidden = |joint: Joint| sight.0[joint] == Some(Seen::Hidden);
    let own = |joint: Joint| drift.hidden[joint as usize] * (errors.hidden_error_mm * 1e-3);
    if hidden(Joint::SpineBase) {
        guesses[Joint::SpineBase as usize] = own(Joint::SpineBase);
    }
    for bone in BONES.iter().filter(|bone| hidden(bone.child)) {
        let ends = truth[bone.parent].zip(truth[bone.child]);
        let length = ends.map_or(0.25, |(a, b)| a.distance(b));
        guesses[bone.child as usize] =
            guesses[bone.parent as usize] + own(bone.child) * (length / 0.25).min(1.0);
    }
    guesses
}

/// Which joints the tracker would be too sure of, drawn anew every half second.
fn overconfident(scenario: &Scenario, [sensor, frame, person]: Address) -> [bool; JOINT_COUNT] {
    let frames = (0.5 * scenario.rate_hz).round().max(1.0) as u64;
    let mut stream = Stream::new(
        scenario.seed,
        Purpose::Overconfident,
        &[sensor, frame / frames, person],
    );
    std::array::from_fn(|_| stream.chance(scenario.errors.overconfident))
}

/// Directions of the body's forwards, left and up in frame `F`, as columns; identity without hips and spine.
pub(crate) fn body_axes<F: Frame>(joints: &JointMap<Position<F>>) -> nalgebra::Matrix3<f64> {
    let at = |joint: Joint| joints[joint].map(Position::vector);
    let axes = || {
        let left = (at(Joint::ShoulderLeft)? - at(Joint::ShoulderRight)?).try_normalize(1e-9)?;
        let spine = at(Joint::SpineShoulder)? - at(Joint::SpineBase)?;
        let up = (spine - left * left.dot(&spine)).try_normalize(1e-9)?;
        Some(nalgebra::Matrix3::from_columns(&[
            left.cross(&up),
            left,
            up,
        ]))
    };
    axes().unwrap_or_else(nalgebra::Matrix3::identity)
}

/// Joints that have jumped away for a few frames.
#[derive(Default)]
pub(crate) struct Spikes(Vec<Spike>);

struct Spike {
    person: usize,
    joint: Joint,
    offset: Vector3<f64>,
    last_frame: u64,
}

impl Spikes {
    pub(crate) fn step(&mut self, sensor: usize, frame: u64, people: usize, scenario: &Scenario) {
        self.0.retain(|spike| spike.last_frame >= frame);
        let mut stream = Stream::new(scenario.seed, Purpose::Spike, &[sensor as u64, frame]);
        if people > 0 && stream.chance(scenario.errors.spikes_per_s / scenario.rate_hz) {
            self.0.push(Spike {
                person: stream.below(people),
                joint: Joint::ALL[stream.below(JOINT_COUNT)],
                offset: stream.direction() * stream.between(0.1, 0.3),
                last_frame: frame + 2 + stream.below(13) as u64,
            });
        }
    }

    pub(crate) fn apply(&self, person: usize, raw: &mut JointMap<RawJoint>) {
        for spike in self.0.iter().filter(|spike| spike.person == person) {
            if let Some(joint) = &mut raw[spike.joint] {
                joint.position = joint.position.moved(spike.offset);
                joint.confidence = Confidence::FULL;
            }
        }
    }
}
