//! Poses to draw from: recorded ones on bodies of any size, altered ones, and the simulator's own.

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use posefuse_simulator::depth::retargeted;
use posefuse_simulator::load::{find, load};
use posefuse_simulator::motion::{BodyShape, Cast, Clip, Performance, Situation};
use posefuse_skeleton::{JointMap, Position, Room};

use crate::alter;
use crate::chance::Chance;

pub(crate) type Pose = JointMap<Position<Room>>;

/// Share of the simulator's own poses, and of those that are altered in each way.
const MADE: f64 = 0.3;
const OTHER_ARMS: f64 = 0.25;
const FREE_ARMS: f64 = 0.2;
const OTHER_LEGS: f64 = 0.2;
const BENT: f64 = 0.15;
const TILTED: f64 = 0.08;

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
            let pose = self.any(chance);
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

    /// As nobody stood in any recording: limbs of another pose or anyhow, bent, tilted.
    fn altered(&self, mut pose: Pose, chance: &mut Chance) -> Option<Pose> {
        if chance.with(OTHER_ARMS) {
            pose = alter::with_arms_of(pose, &self.any(chance))?;
        } else if chance.with(FREE_ARMS) {
            pose = alter::with_free_arms(pose, chance)?;
        }
        if chance.with(OTHER_LEGS) {
            pose = alter::with_legs_of(pose, &self.any(chance))?;
        }
        if chance.with(BENT) {
            pose = alter::bent(pose, chance)?;
        }
        if chance.with(TILTED) {
            pose = alter::tilted(pose, chance)?;
        }
        Some(pose)
    }

    fn any(&self, chance: &mut Chance) -> Pose {
        if chance.with(MADE) {
            self.made_pose(chance)
        } else {
            self.recorded(chance)
        }
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
