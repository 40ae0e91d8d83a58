//! Whose is which surface: people who are followed take what is near where they are expected; what nobody takes is put
//! together into groups, each perhaps somebody new.

use crate::flesh::Flesh;
use crate::floor::Level;
use crate::lens::{Lens, V3};
use crate::segments::Segments;

/// Further from a person's expected surface than this is not theirs, metres.
const REACH_M: f32 = 0.30;
/// A surface is one person's as a whole if they take this share of it, and nobody else more than that.
const WHOLE: f32 = 0.8;
const NOBODY_ELSE: f32 = 0.08;
/// What is left of a shared surface counts if it is this large, square metres.
const LEFT_OVER_M2: f32 = 0.08;
/// Surfaces nearer to each other than this are of one thing, metres.
const NEAR_M: f32 = 0.15;
/// So are those that stand above each other this near in plan, metres (somebody behind a desk).
const STACKED_M: f32 = 0.25;

/// A part of a surface, or all of it, that nobody took.
#[derive(Clone, Debug)]
struct Piece {
    segment: usize,
    samples: Vec<usize>,
    low: V3,
    high: V3,
    area_m2: f32,
}

/// Surfaces that belong together and to nobody yet.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub(crate) segments: Vec<usize>,
    pub(crate) points: Vec<V3>,
    pub(crate) area_m2: f32,
    pub(crate) middle: V3,
}

/// What became of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Decision {
    /// All of it is this one's; 0: nobody's.
    whole: u8,
    /// Its pixels are whoever is nearest; the rest goes to `whole`.
    shared: bool,
}

/// Kept from image to image for its memory.
#[derive(Default)]
pub(crate) struct Claims {
    /// For each pixel the number of the person, from 1 on; 0: nobody.
    pub(crate) owners: Vec<u8>,
    /// For each sample.
    of_sample: Vec<u8>,
    decisions: Vec<Decision>,
}

impl Claims {
    /// Lets the people (their number and expected shape) take what is near; gives what is left.
    pub(crate) fn take(
        &mut self,
        level: &Level,
        segments: &Segments,
        people: &[(u8, &Flesh)],
    ) -> Vec<Group> {
        self.of_sample.clear();
        let nearest = segments
            .samples
            .iter()
            .map(|sample| nearest(people, &sample.at));
        self.of_sample.extend(nearest);
        self.decisions.clear();
        let mut pieces = Vec::new();
        for (number, segment) in segments.segments.iter().enumerate() {
            let taken = &self.of_sample[segment.samples.clone()];
            let decision = decide(taken);
            self.decisions.push(decision);
            if decision.whole > 0 {
                continue;
            }
            let left = segment
                .samples
                .clone()
                .filter(|&at| self.of_sample[at] == 0);
            let piece = Piece::of(number, segments, left.collect());
            if !decision.shared || piece.area_m2 > LEFT_OVER_M2 {
                pieces.push(piece);
            }
        }
        groups(level, segments, pieces)
    }

    /// Gives a group to somebody.
    pub(crate) fn give(&mut self, group: &Group, number: u8) {
        for &segment in &group.segments {
            self.decisions[segment].whole = number;
        }
    }

    /// Writes whose each pixel is. `people` as before.
    pub(crate) fn draw(
        &mut self,
        lens: &Lens,
        segments: &Segments,
        depth: &[u16],
        people: &[(u8, &Flesh)],
    ) {
        self.owners.clear();
        let of_label = |label: &u32| match label.checked_sub(1) {
            Some(segment) => self.decisions[segment as usize].whole,
            None => 0,
        };
        self.owners.extend(segments.labels.iter().map(of_label));
        for (number, decision) in self.decisions.iter().enumerate() {
            if !decision.shared {
                continue;
            }
            let segment = &segments.segments[number];
            let [first, last] = segment.rows.map(usize::from);
            let [left, right] = segment.columns.map(usize::from);
            // Two by two pixels at once: who is nearest hardly changes between them.
            for v in (first..=last).step_by(2) {
                for u in (left..=right).step_by(2) {
                    let block = block(lens, [u, v]);
                    let own = |&pixel: &usize| segments.labels[pixel] == number as u32 + 1;
                    let Some(pixel) = block.clone().find(own) else {
                        continue;
                    };
                    let owner = match nearest(people, &lens.point(pixel, depth[pixel])) {
                        0 => decision.whole,
                        owner => owner,
                    };
                    for pixel in block.filter(own) {
                        self.owners[pixel] = owner;
                    }
                }
            }
        }
    }

    /// The samples of a person.
    pub(crate) fn samples<'a>(
        &'a self,
        segments: &'a Segments,
        number: u8,
    ) -> impl Iterator<Item = &'a crate::segments::Sample> {
        let whose = |(at, sample): (usize, &crate::segments::Sample)| {
            let decision = self.decisions[sample.segment as usize];
            match (decision.shared, self.of_sample[at]) {
                (true, owner @ 1..) => owner,
                _ => decision.whole,
            }
        };
        let samples = segments.samples.iter().enumerate();
        samples
            .filter(move |(at, sample)| whose((*at, sample)) == number)
            .map(|(_, sample)| sample)
    }
}

fn block(lens: &Lens, [u, v]: [usize; 2]) -> impl Iterator<Item = usize> + Clone {
    let (wide, high) = (lens.width, lens.height);
    let rows = v..(v + 2).min(high);
    rows.flat_map(move |row| (u..(u + 2).min(wide)).map(move |column| row * wide + column))
}

/// Who is nearest; 0: nobody is near.
fn nearest(people: &[(u8, &Flesh)], point: &V3) -> u8 {
    let mut best = (REACH_M, 0);
    for (number, flesh) in people {
        let distance = flesh.distance(point);
        if distance < best.0 {
            best = (distance, *number);
        }
    }
    best.1
}

fn decide(taken: &[u8]) -> Decision {
    let mut tally = [0u32; 256];
    for &owner in taken {
        tally[usize::from(owner)] += 1;
    }
    let (nobody, all) = (tally[0], taken.len() as f32);
    tally[0] = 0;
    let most = (1..=u8::MAX)
        .max_by_key(|&owner| tally[usize::from(owner)])
        .unwrap_or(0);
    let count = std::mem::take(&mut tally[usize::from(most)]);
    if count == 0 {
        return Decision::default();
    }
    let others: u32 = tally.iter().sum();
    let alone = others as f32 <= (NOBODY_ELSE * all).max(1.0);
    let whole = count as f32 >= WHOLE * all || (count as f32 >= 0.5 * all && nobody <= 2);
    match alone && whole {
        true => Decision {
            whole: most,
            shared: false,
        },
        false => Decision {
            whole: 0,
            shared: true,
        },
    }
}

impl Piece {
    fn of(segment: usize, segments: &Segments, samples: Vec<usize>) -> Self {
        let points = || samples.iter().map(|&at| &segments.samples[at]);
        let all = |value| V3::from_element(value);
        Self {
            segment,
            low: points().fold(all(f32::INFINITY), |low, sample| low.inf(&sample.at)),
            high: points().fold(all(f32::NEG_INFINITY), |high, sample| high.sup(&sample.at)),
            area_m2: points().map(|sample| sample.area_m2).sum(),
            samples,
        }
    }

    fn is_near(&self, other: &Self, segments: &Segments, level: &Level) -> bool {
        let gap = (self.low - other.high).sup(&(other.low - self.high));
        if gap.max() < NEAR_M {
            let far = |a: usize, b: usize| {
                (segments.samples[a].at - segments.samples[b].at).norm_squared()
            };
            let mut pairs = self
                .samples
                .iter()
                .flat_map(|&a| other.samples.iter().map(move |&b| (a, b)));
            if pairs.any(|(a, b)| far(a, b) < NEAR_M * NEAR_M) {
                return true;
            }
        }
        let [a, b] = [self, other].map(|piece| level.plan(&((piece.low + piece.high) / 2.0)));
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
        // The image's rows run along gravity well enough to say what is above what.
        apart < STACKED_M && gap.y > 0.0 && gap.y < 0.8
    }
}

/// Puts pieces that are near each other together.
fn groups(level: &Level, segments: &Segments, pieces: Vec<Piece>) -> Vec<Group> {
    let mut group_of: Vec<usize> = (0..pieces.len()).collect();
    for a in 0..pieces.len() {
        for b in 0..a {
            let (old, new) = (group_of[a], group_of[b]);
            if old != new && pieces[a].is_near(&pieces[b], segments, level) {
                group_of
                    .iter_mut()
                    .filter(|group| **group == old)
                    .for_each(|group| *group = new);
            }
        }
    }
    let mut groups = Vec::new();
    for number in 0..pieces.len() {
        let members: Vec<&Piece> = pieces
            .iter()
            .zip(&group_of)
            .filter(|(_, group)| **group == number)
            .map(|(piece, _)| piece)
            .collect();
        let samples = members.iter().flat_map(|piece| &piece.samples);
        let points: Vec<V3> = samples.map(|&at| segments.samples[at].at).collect();
        if points.is_empty() {
            continue;
        }
        groups.push(Group {
            segments: members.iter().map(|piece| piece.segment).collect(),
            area_m2: members.iter().map(|piece| piece.area_m2).sum(),
            middle: points.iter().sum::<V3>() / points.len() as f32,
            points,
        });
    }
    groups
}
