//! Poses to draw from: recorded ones on bodies of any size, limbs of one recording on the trunk of another, and the
//! simulator's own.

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use posefuse_simulator::depth::retargeted;
use posefuse_simulator::load::{find, load};
use posefuse_simulator::motion::{BodyShape, Cast, Clip, Performance, Situation};
use posefuse_skeleton::{ARMS, Joint, JointMap, Position, Room};

use crate::chance::Chance;

type Pose = JointMap<Position<Room>>;

/// Share of the simulator's own poses, and of recorded ones that get other arms.
const MADE: f64 = 0.3;
const OTHER_ARMS: f64 = 0.25;
const FREE_ARMS: f64 = 0.2;

/// Which part of the split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subset {
    Train,
    HeldOut,
    Unseen,
}

impl FromStr for Subset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "train" => Ok(Self::Train),
            "held_out" => Ok(Self::HeldOut),
            "unseen" => Ok(Self::Unseen),
            _ => Err(format!("expected train, held_out or unseen, found {text}")),
        }
    }
}

pub(crate) struct Poses {
    subset: Subset,
    clips: Vec<Clip>,
    /// Up to each clip: the sum of the square roots of durations, so that long ones do not drown short ones.
    weights: Vec<f64>,
    made: Vec<Performance>,
}

impl Poses {
    pub(crate) fn read(
        motion: &Path,
        split: &Path,
        subset: Subset,
        seed: u64,
    ) -> Result<Self, Box<dyn Error>> {
        let patterns: toml::Table = std::fs::read_to_string(split)?.parse()?;
        let listed = |key: &str, path: &str| {
            let list = patterns.get(key).and_then(toml::Value::as_array);
            list.into_iter()
                .flatten()
                .filter_map(toml::Value::as_str)
                .any(|pattern| matches(pattern, path))
        };
        let mut clips = Vec::new();
        for file in find(motion)? {
            let path = file.strip_prefix(motion)?.to_string_lossy().into_owned();
            // Files at the top would miss patterns that begin with any folder.
            let path = format!("./{path}");
            let of = if listed("unseen", &path) {
                Subset::Unseen
            } else if listed("held_out", &path) {
                Subset::HeldOut
            } else {
                Subset::Train
            };
            if of != subset {
                continue;
            }
            match load(&file) {
                Ok(clip) if clip.duration_s() > 0.5 => clips.push(clip),
                Ok(_) => {}
                Err(problem) => eprintln!("left out: {problem}"),
            }
        }
        if clips.is_empty() {
            return Err(format!("expected motion of {subset:?}, found none").into());
        }
        let mut sum = 0.0;
        let weights = clips.iter().map(|clip| {
            sum += clip.duration_s().sqrt();
            sum
        });
        Ok(Self {
            subset,
            weights: weights.collect(),
            made: made(subset, seed),
            clips,
        })
    }

    /// A pose on a body of its own.
    pub(crate) fn draw(&self, chance: &mut Chance) -> Pose {
        loop {
            let shape = shape(chance);
            let pose = if chance.with(MADE) {
                self.made_pose(chance)
            } else {
                self.recorded(chance)
            };
            let altered = if self.subset == Subset::Train {
                self.altered(pose, chance)
            } else {
                Some(pose)
            };
            if let Some(pose) = altered.and_then(|pose| retargeted(&pose, &shape)) {
                return pose;
            }
        }
    }

    fn recorded(&self, chance: &mut Chance) -> Pose {
        let at = chance.unit() * self.weights.last().copied().unwrap_or(0.0);
        let index = self.weights.partition_point(|weight| *weight <= at);
        let clip = &self.clips[index.min(self.clips.len() - 1)];
        clip.pose(chance.unit() * clip.duration_s())
    }

    fn made_pose(&self, chance: &mut Chance) -> Pose {
        let performance = &self.made[chance.below(self.made.len())];
        let person = chance.below(performance.people());
        performance.pose(person, chance.between(0.0, 240.0))
    }

    fn altered(&self, pose: Pose, chance: &mut Chance) -> Option<Pose> {
        if chance.with(OTHER_ARMS) {
            let other = if chance.with(MADE) {
                self.made_pose(chance)
            } else {
                self.recorded(chance)
            };
            return with_arms_of(pose, &other);
        }
        if chance.with(FREE_ARMS) {
            return with_free_arms(pose, chance);
        }
        Some(pose)
    }
}

impl fmt::Display for Poses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let minutes = self.clips.iter().map(Clip::duration_s).sum::<f64>() / 60.0;
        let (clips, made) = (self.clips.len(), self.made.len());
        write!(
            f,
            "{:?}: {clips} recordings, {minutes:.1} minutes; {made} performances",
            self.subset
        )
    }
}

/// The simulator's own motion, other seeds for each subset.
fn made(subset: Subset, seed: u64) -> Vec<Performance> {
    let (each, from) = match subset {
        Subset::Train => (8, 1000 * (1 + seed)),
        Subset::HeldOut => (2, 700),
        Subset::Unseen => (3, 500),
    };
    let of = |situation: Situation| {
        (0..each).map(move |index| {
            Performance::procedural(Cast {
                seed: from + index,
                people: 2,
                area_m: 3.0,
                hugs: situation == Situation::Hugging,
                situation,
                away_s: 5.0,
            })
        })
    };
    // Everyday motion has the most kinds of action.
    let everyday = std::iter::repeat_n(Situation::Everyday, 3);
    Situation::ALL
        .into_iter()
        .chain(everyday)
        .flat_map(of)
        .collect()
}

fn shape(chance: &mut Chance) -> BodyShape {
    let mut shape = BodyShape::of_height(chance.between(1.45, 2.0));
    let mut vary = |length: &mut f64, share: f64| {
        *length *= 1.0 + share * chance.normal().clamp(-2.0, 2.0);
    };
    for length in [
        &mut shape.lower_spine,
        &mut shape.upper_spine,
        &mut shape.neck,
        &mut shape.head,
        &mut shape.upper_arm,
        &mut shape.forearm,
        &mut shape.thigh,
        &mut shape.shin,
    ] {
        vary(length, 0.03);
    }
    vary(&mut shape.shoulder_half, 0.05);
    vary(&mut shape.hip_half, 0.05);
    shape
}

/// From the chest's axes (x forward, y left, z up) to the room's.
fn chest(pose: &Pose) -> Option<UnitQuaternion<f64>> {
    let at = |joint: Joint| pose[joint].map(|p| p.vector());
    let up = (at(Joint::SpineShoulder)? - at(Joint::SpineMid)?).try_normalize(1e-6)?;
    let left = at(Joint::ShoulderLeft)? - at(Joint::ShoulderRight)?;
    let left = (left - up * left.dot(&up)).try_normalize(1e-6)?;
    let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
    Some(UnitQuaternion::from_matrix(&axes))
}

fn with_arms_of(mut pose: Pose, other: &Pose) -> Option<Pose> {
    let turn = chest(&pose)? * chest(other)?.inverse();
    for arm in ARMS {
        let (here, there) = (pose[arm[0]]?.vector(), other[arm[0]]?.vector());
        for joint in arm {
            let way = turn * (other[joint]?.vector() - there);
            pose[joint] = Some(Position::from_vector(here + way));
        }
    }
    Some(pose)
}

/// Arms in any direction in which a shoulder lets them be, hands anyhow. Those that would go through the trunk stay as they were.
fn with_free_arms(mut pose: Pose, chance: &mut Chance) -> Option<Pose> {
    let chest = chest(&pose)?;
    let (mid, top) = (
        pose[Joint::SpineMid]?.vector(),
        pose[Joint::SpineShoulder]?.vector(),
    );
    for (side, arm) in [1.0, -1.0].into_iter().zip(ARMS) {
        let shoulder = pose[arm[0]]?.vector();
        let any = Vector3::new(
            chance.normal() + 0.4,
            chance.normal(),
            chance.normal() - 0.2,
        );
        let mut upper = chest.inverse() * (chest * any).try_normalize(1e-3)?;
        upper.y = side * (upper.y * side).max(-0.25);
        let upper = chest * upper.try_normalize(1e-3)?;
        // The forearm bends forwards and inwards.
        let bend = chance.between(0.05, 2.4);
        let towards = chest
            * Vector3::new(
                1.0 + 0.6 * chance.normal(),
                -0.6 * side * chance.unit(),
                0.7 * chance.normal(),
            );
        let across = (towards - upper * towards.dot(&upper)).try_normalize(1e-3)?;
        let fore = upper * bend.cos() + across * bend.sin();
        let palm = (fore + across * (0.4 * chance.normal())).try_normalize(1e-3)?;
        let thumb = palm.cross(&Vector3::new(
            chance.normal(),
            chance.normal(),
            chance.normal(),
        ));
        let thumb = (palm + thumb.try_normalize(1e-3)? * 0.8).try_normalize(1e-3)?;
        let elbow = shoulder + upper * 0.29;
        let wrist = elbow + fore * 0.25;
        let hand = wrist + palm * 0.09;
        let through = [elbow, wrist, hand].iter().any(|at| {
            let along = (at - mid).dot(&(top - mid)) / (top - mid).norm_squared();
            let off = chest.inverse() * (at - mid.lerp(&top, along));
            (-1.0..1.1).contains(&along) && (off.x / 0.14).hypot(off.y / 0.17) < 1.0
        });
        if through {
            continue;
        }
        let points = [
            shoulder,
            elbow,
            wrist,
            hand,
            hand + palm * 0.08,
            wrist + thumb * 0.07,
        ];
        for (joint, at) in arm.into_iter().zip(points) {
            pose[joint] = Some(Position::from_vector(at));
        }
    }
    Some(pose)
}

/// A shell's pattern in which `*` stands for anything, `/` too, and `[3-9]` for one of these.
fn matches(pattern: &str, text: &str) -> bool {
    let Some(first) = pattern.chars().next() else {
        return text.is_empty();
    };
    let rest = &pattern[first.len_utf8()..];
    match first {
        '*' => (0..=text.len())
            .filter(|at| text.is_char_boundary(*at))
            .any(|at| matches(rest, &text[at..])),
        '[' => {
            let Some((set, rest)) = rest.split_once(']') else {
                return false;
            };
            let Some(here) = text.chars().next() else {
                return false;
            };
            let set: Vec<char> = set.chars().collect();
            let within = match set.as_slice() {
                [low, '-', high] => (*low..=*high).contains(&here),
                _ => set.contains(&here),
            };
            within && matches(rest, &text[here.len_utf8()..])
        }
        _ => text
            .strip_prefix(first)
            .is_some_and(|text| matches(rest, text)),
    }
}
