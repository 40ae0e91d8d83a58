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

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_skeleton::JOINT_COUNT;

use crate::beliefs::{OWN_M, OWN_RANGE_M, beliefs};
use crate::graph::Placed;
use crate::honest;
use crate::linear::{Linear, Noise, Round};
use crate::normal::{Layout, PER_SENSOR, Reduced, Step};
use crate::people::{Person, people};
use crate::tracks::{Pose, SensorTracks};

/// Rounds at every fourth instant, and those before which bodies and labels are matched anew.
const SPARSE_ROUNDS: usize = 10;
const SPARSE: usize = 4;
const RELABELLED: [usize; 4] = [0, 1, 3, 6];
/// Most rounds at all instants, and the largest step (m, rad) below which it is settled.
const MAX_ROUNDS: usize = 10;
const SETTLED: f64 = 1e-4;
/// Robust scale squared, in variances: wide at first, then tighter, the last for good.
const SCALES: [f64; 6] = [36.0, 36.0, 36.0, 25.0, 16.0, 9.0];
/// How many samples say as much as one independent one: to begin with.
const REPEATS: f64 = 5.0;
/// Least believable of [`Round::bend`].
const MIN_BEND: f64 = 0.3;
/// Round from which that and the size of own offsets are learnt.
const LEARNT_FROM: usize = 5;
/// What a clock may be off by until bodies are looked up anew, seconds: 0.02 mm of an arm that swings at 10 m/s^2.
const STALE_S: f64 = 0.002;

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
    /// Whether what was found can be.
    pub(crate) believed: bool,
    pub(crate) unknowns: Unknowns,
    /// Sights of joints that each sensor took part with.
    pub(crate) samples: Vec<u64>,
    /// By joint set other than the reference and joint: how many sights there were.
    pub(crate) definition_samples: Vec<[u64; JOINT_COUNT]>,
    /// Covariance of turn, shift, offset and drift of all sensors, in the order of the sensors; 0 for those held.
    pub(crate) covariance: Option<nalgebra::DMatrix<f64>>,
}

/// Improves `unknowns` at these instants; stops after the sparse rounds where what they find is not `believable`.
pub(crate) fn bundle(
    sensors: &[SensorTracks],
    times: &[f64],
    unknowns: Unknowns,
    setting: &Setting,
    believable: impl Fn(&Unknowns) -> bool,
) -> Bundled {
    let sparse: Vec<f64> = times.iter().copied().step_by(SPARSE).collect();
    let mut bundle = Bundle::new(sensors, unknowns, setting);
    let mut view = bundle.look(&sparse);
    for round in 0..SPARSE_ROUNDS {
        if RELABELLED.contains(&round) {
            view = bundle.look(&sparse);
        }
        let scale = SCALES[round.min(SCALES.len() - 1)];
        if round == 0 {
            // Who is noisy, before anybody is moved by it.
            let mut noise = bundle.noise.clone();
            bundle.linear(&view).round(&mut noise, scale, false);
            bundle.noise = noise;
        }
        if bundle
            .round(&mut view, scale, round >= LEARNT_FROM, false)
            .is_none()
        {
            break;
        }
    }
    if !believable(&bundle.unknowns) {
        return bundle.result(false);
    }
    let mut view = bundle.look(times);
    let scale = SCALES[SCALES.len() - 1];
    // Settled: one more round, which keeps what the covariance is made from.
    let mut settled = false;
    for round in 1..=MAX_ROUNDS {
        let last = settled || round == MAX_ROUNDS;
        match bundle.round(&mut view, scale, true, last) {
            Some(size) if !last => settled = size < SETTLED,
            _ => break,
        }
    }
    let believed = believable(&bundle.unknowns);
    bundle.result(believed)
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

/// A bundle on its way.
struct Bundle<'b> {
    sensors: &'b [SensorTracks],
    setting: &'b Setting,
    layout: Layout,
    held: Vec<bool>,
    unknowns: Unknowns,
    noise: Noise,
    repeats: f64,
    own_m: f64,
    samples: Vec<u64>,
    definition_samples: Vec<[u64; JOINT_COUNT]>,
    covariance: Option<nalgebra::DMatrix<f64>>,
}

/// What was seen at some instants.
struct View<'v> {
    times: &'v [f64],
    /// The clocks by which it was seen.
    clocks: Vec<Placed>,
    seen: Vec<Vec<Vec<Pose>>>,
    people: Vec<Person>,
}

impl<'b> Bundle<'b> {
    fn new(sensors: &'b [SensorTracks], unknowns: Unknowns, setting: &'b Setting) -> Self {
        let layout = Layout {
            sensors: sensors.len(),
            definitions: unknowns.definitions.len(),
        };
        Self {
            sensors,
            setting,
            layout,
            held: held(layout, setting),
            unknowns,
            noise: Noise {
                sensors: vec![1.0; sensors.len()],
                joints: [1.0; JOINT_COUNT],
            },
            repeats: REPEATS,
            own_m: OWN_M,
            samples: vec![0; sensors.len()],
            definition_samples: Vec::new(),
            covariance: None,
        }
    }

    /// Who is seen at these instants, as sensors stand now.
    fn look<'v>(&self, times: &'v [f64]) -> View<'v> {
        let clocks = self.unknowns.placed.clone();
        let seen = sample(self.sensors, times, &clocks, self.setting.middle_s);
        let people = people(&seen, &clocks);
        View {
            times,
            clocks,
            seen,
            people,
        }
    }

    fn linear<'l>(&'l self, view: &'l View<'_>) -> Linear<'l> {
        Linear {
            seen: &view.seen,
            clocks: &view.clocks,
            times: view.times,
            people: &view.people,
            unknowns: &self.unknowns,
            setting: self.setting,
            layout: self.layout,
        }
    }

    /// One round: equations, step, and what is learnt of the noise. `last`: with the covariance. The size of the step,
    /// metres or radians; `None` where the equations are singular.
    fn round(&mut self, view: &mut View<'_>, scale: f64, learns: bool, last: bool) -> Option<f64> {
        self.freshen(view);
        let mut noise = self.noise.clone();
        let made = self.linear(view).round(&mut noise, scale, last);
        self.noise = noise;
        let beliefs = beliefs(self.layout, &self.unknowns, self.setting, self.own_m);
        let held = self.held.clone();
        let reduced = Reduced::new(&made.systems, &beliefs, self.layout, self.repeats, held)?;
        let size = apply(&reduced.step()?, &mut self.unknowns, self.layout);
        if learns {
            self.learn(&reduced, &made);
        }
        if last {
            let bend = made.bend.clamp(MIN_BEND, 1.0);
            self.covariance = honest::covariance(&reduced, &made.systems, made.stretch_s, bend)
                .or_else(|| reduced.covariance());
        }
        self.samples = made.samples;
        self.definition_samples = made.definition_samples;
        Some(size)
    }

    /// Looks up the bodies anew where clocks have moved too far to follow along the velocities.
    fn freshen(&self, view: &mut View<'_>) {
        let ends_s = [view.times.first(), view.times.last()].map(|end| end.copied().unwrap_or(0.0));
        let placed = &self.unknowns.placed;
        let stale = placed.iter().zip(&view.clocks).any(|(now, then)| {
            let off = |end_s: &f64| {
                let since_middle_s = end_s - self.setting.middle_s;
                now.offset_at(since_middle_s) - then.offset_at(since_middle_s)
            };
            ends_s.iter().any(|end_s| off(end_s).abs() > STALE_S)
        });
        if stale {
            view.clocks.clone_from(placed);
            view.seen = sample(self.sensors, view.times, placed, self.setting.middle_s);
        }
    }

    fn learn(&mut self, reduced: &Reduced, made: &Round) {
        // Where the cost bends less than its weights say, less is known by its square.
        let bend = made.bend.clamp(MIN_BEND, 1.0);
        let found = reduced.repeats(&made.systems).map(|r| r / (bend * bend));
        self.repeats = found.map_or(self.repeats, |r| r.clamp(1.0, 100.0));
        let [least, most] = OWN_RANGE_M;
        let own_m = reduced.own_variance(&self.unknowns.own).sqrt();
        self.own_m = own_m.clamp(least, most);
    }

    fn result(self, believed: bool) -> Bundled {
        Bundled {
            believed,
            unknowns: self.unknowns,
            samples: self.samples,
            definition_samples: self.definition_samples,
            covariance: self.covariance,
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
