//! People over time: who is expected where, who is lost, who is new, and what is a person at all.

use crate::claims::Group;
use crate::estimate::Estimate;
use crate::facing::Heading;
use crate::flesh::{Flesh, Joints};
use crate::floor::Level;
use crate::grip::Belief;
use crate::lens::{Lens, V3};

/// What a new person's surface may be, square metres, and how tall what is seen of it must be, metres.
const AREA_M2: [f32; 2] = [0.10, 2.0];
const TALL_M: f32 = 0.40;
/// How high its top may be above the floor, metres.
const TOP_M: [f32; 2] = [0.55, 2.4];
/// Root mean square of its width in plan, metres.
const WIDE_M: f32 = 0.42;
/// Of a person who was lost: the least of what may be them, square metres.
const AGAIN_M2: f32 = 0.05;
/// How far from where they are expected somebody comes back: at once, and more for each second; at most, metres.
const BACK_M: f32 = 0.45;
const BACK_M_PER_S: f32 = 0.9;
const BACK_MOST_M: f32 = 1.6;
/// Who was not seen for longer is gone, seconds; out of the image sooner; nobody sure yet at once.
const GONE_S: f32 = 3.0;
const GONE_OUTSIDE_S: f32 = 1.5;
const GONE_UNSURE_S: f32 = 0.3;
/// Motion is carried on for so long, seconds.
const COASTS_S: f32 = 0.4;
/// How much of a new speed is taken over per image.
const SPEED_SHARE: f32 = 0.35;
/// Nobody is quicker, m/s.
const MOST_SPEED: f32 = 4.0;
/// A thing is a person once this share of its patches moved in so many images.
const ALIVE_SHARE: f32 = 0.15;
const ALIVE_IMAGES: u32 = 6;
const FRESH_IMAGES: u32 = 6;
/// Or once it was convincing in so many images in a row.
const CONVINCING_IMAGES: u32 = 8;
/// A thing of which the network knows nothing is looked at again after so many images, or a few more.
const REST_IMAGES: u32 = 2;
/// Most things that are looked at, people with them.
const MOST_THINGS: usize = 24;
/// A thing of which nothing moved for so long is furniture, seconds.
const FURNITURE_S: f32 = 4.0;
/// Two who are this near each other for so many images are one, metres.
const SAME_M: f32 = 0.22;
const SAME_IMAGES: u32 = 5;

/// Somebody who is followed, or something that may be somebody.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    /// 0 until it is sure to be a person.
    pub(crate) id: u64,
    pub(crate) middle: V3,
    pub(crate) joints: Option<Joints>,
    pub(crate) heading: Heading,
    /// What is believed of the left and the right hand.
    pub(crate) hands: [Belief; 2],
    /// Where their surface is expected in this image.
    pub(crate) flesh: Flesh,
    /// When it was last seen, and first, ns.
    pub(crate) seen_ns: i64,
    born_ns: i64,
    speed: V3,
    /// How far it reaches below and above its middle, metres.
    reach: [f32; 2],
    images: u32,
    alive_images: u32,
    convincing_images: u32,
    /// Images for which it is not looked at.
    rest: u32,
    same_images: u32,
}

impl Track {
    /// From something that may be a person.
    fn new(group: &Group, level: &Level, at_ns: i64) -> Self {
        let heights = group
            .points
            .iter()
            .map(|point| level.up.dot(&(point - group.middle)));
        let reach = heights.fold([0.0f32; 2], |[low, high], h| [low.min(h), high.max(h)]);
        Self {
            id: 0,
            middle: group.middle,
            joints: None,
            heading: Heading::default(),
            hands: [Belief::default(); 2],
            flesh: Flesh::default(),
            seen_ns: at_ns,
            born_ns: at_ns,
            speed: V3::zeros(),
            reach,
            images: 0,
            alive_images: 0,
            convincing_images: 0,
            rest: 0,
            same_images: 0,
        }
    }

    /// Expects them at `at_ns`.
    pub(crate) fn expect(&mut self, level: &Level, at_ns: i64) {
        let by = self.speed * self.since_s(at_ns).min(COASTS_S);
        match &self.joints {
            Some(joints) => self.flesh.around(joints, &by),
            None => self.flesh.upright(level, self.middle + by, self.reach),
        }
    }

    /// Puts left and right of an estimate right, by what is known of this person.
    pub(crate) fn settle(&mut self, level: &Level, found: &mut Estimate, at_ns: i64) {
        self.heading.settle(level, found, &self.speed, at_ns);
    }

    /// They were seen here.
    pub(crate) fn see(&mut self, middle: V3, joints: Option<Joints>, at_ns: i64) {
        let since_s = self.since_s(at_ns).max(1e-3);
        if self.images > 0 && since_s < COASTS_S {
            let speed = (middle - self.middle) / since_s;
            let speed = speed * (MOST_SPEED / speed.norm().max(MOST_SPEED));
            self.speed += SPEED_SHARE * (speed - self.speed);
        } else {
            self.speed = V3::zeros();
        }
        self.images += 1;
        (self.middle, self.joints, self.seen_ns) = (middle, joints, at_ns);
    }

    /// Counts what speaks for a person: `patches` of them and how many of these moved, and whether what the network says of them is
    /// convincing by itself.
    pub(crate) fn judge(&mut self, [patches, moved]: [u32; 2], convincing: bool) {
        self.convincing_images = match convincing {
            true => self.convincing_images + 1,
            false => 0,
        };
        // Everything is fresh at first.
        if self.images < FRESH_IMAGES {
            return;
        }
        let share = moved as f32 / patches.max(8) as f32;
        self.alive_images += u32::from(share > ALIVE_SHARE);
    }

    /// It looks like nothing: `number` spreads the next look at it and at others like it over the images.
    pub(crate) fn rest(&mut self, number: usize) {
        if self.id == 0 {
            self.rest = REST_IMAGES + number as u32 % 3;
        }
    }

    /// Whether it is left out in this image.
    pub(crate) fn rests(&mut self) -> bool {
        let rests = self.rest > 0;
        self.rest = self.rest.saturating_sub(1);
        rests
    }

    pub(crate) fn is_person(&self) -> bool {
        self.alive_images >= ALIVE_IMAGES || self.convincing_images >= CONVINCING_IMAGES
    }

    pub(crate) fn is_furniture(&self, at_ns: i64) -> bool {
        self.id == 0 && !self.is_person() && seconds(at_ns - self.born_ns) > FURNITURE_S
    }

    fn since_s(&self, at_ns: i64) -> f32 {
        seconds(at_ns.saturating_sub(self.seen_ns)).max(0.0)
    }

    fn is_gone(&self, lens: &Lens, at_ns: i64) -> bool {
        let since_s = self.since_s(at_ns);
        if self.id == 0 {
            return since_s > GONE_UNSURE_S;
        }
        let expected = self.middle + self.speed * COASTS_S;
        let inside = lens.pixel(&expected).is_some_and(|[u, v]| {
            (0.0..lens.width as f32).contains(&u) && (0.0..lens.height as f32).contains(&v)
        });
        since_s > if inside { GONE_S } else { GONE_OUTSIDE_S }
    }
}

fn seconds(ns: i64) -> f32 {
    (ns as f64 * 1e-9) as f32
}

/// Everybody.
#[derive(Default)]
pub(crate) struct People {
    pub(crate) tracks: Vec<Track>,
    last_id: u64,
}

impl People {
    /// Forgets everybody who has been away for too long, and what turned out to be somebody else.
    pub(crate) fn forget(&mut self, lens: &Lens, at_ns: i64) {
        self.tracks.retain(|track| !track.is_gone(lens, at_ns));
        for later in (1..self.tracks.len()).rev() {
            let (before, after) = self.tracks.split_at_mut(later);
            let track = &mut after[0];
            let same = before.iter_mut().find(|other| {
                other.seen_ns == track.seen_ns && (other.middle - track.middle).norm() < SAME_M
            });
            track.same_images = same.as_ref().map_or(0, |_| track.same_images + 1);
            if let Some(other) = same.filter(|_| track.same_images >= SAME_IMAGES) {
                // Whoever has had a number for longest keeps it.
                let newer = |id: u64| id.wrapping_sub(1);
                if newer(track.id) < newer(other.id) {
                    std::mem::swap(track, other);
                }
                self.tracks.remove(later);
            }
        }
    }

    /// Who of those that were lost each group is, nearest first.
    pub(crate) fn find_again(
        &self,
        groups: &[Group],
        at_ns: i64,
        is_lost: &[bool],
    ) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for (number, track) in self
            .tracks
            .iter()
            .enumerate()
            .filter(|(at, _)| is_lost[*at])
        {
            let since_s = track.since_s(at_ns);
            let expected = track.middle + track.speed * since_s.min(COASTS_S);
            let most = (BACK_M + BACK_M_PER_S * since_s).min(BACK_MOST_M);
            for (at, group) in groups.iter().enumerate() {
                let far = (group.middle - expected).norm();
                if far < most && group.area_m2 > AGAIN_M2 {
                    pairs.push((far, number, at));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found: Vec<(usize, usize)> = Vec::new();
        for (_, number, at) in pairs {
            if found
                .iter()
                .all(|(track, group)| *track != number && *group != at)
            {
                found.push((number, at));
            }
        }
        found
    }

    /// Begins to follow what may be a person.
    pub(crate) fn begin(&mut self, group: &Group, level: &Level, most: usize, at_ns: i64) {
        if self.named() < most && self.tracks.len() < MOST_THINGS {
            self.tracks.push(Track::new(group, level, at_ns));
        }
    }

    /// Gives ids to those who are sure to be people, until `most` have one.
    pub(crate) fn name(&mut self, most: usize) {
        let mut named = self.named();
        for track in &mut self.tracks {
            if named < most && track.id == 0 && track.is_person() {
                named += 1;
                self.last_id += 1;
                track.id = self.last_id;
            }
        }
    }

    fn named(&self) -> usize {
        self.tracks.iter().filter(|track| track.id > 0).count()
    }

    /// Forgets everybody; ids go on.
    pub(crate) fn clear(&mut self) {
        self.tracks.clear();
    }
}

/// The groups that may be people; one that may be two is taken apart.
pub(crate) fn candidates(level: &Level, group: Group) -> Vec<Group> {
    if may_be_person(level, &group) {
        return vec![group];
    }
    let halves = halves(level, &group);
    match halves.iter().all(|half| may_be_person(level, half)) {
        true => halves.into(),
        false => Vec::new(),
    }
}

fn may_be_person(level: &Level, group: &Group) -> bool {
    let heights = group.points.iter().map(|point| level.up.dot(point));
    let (low, high) = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), height| {
        (low.min(height), high.max(height))
    });
    let top = level
        .above_m
        .is_none_or(|above| (TOP_M[0]..TOP_M[1]).contains(&(high + above)));
    let area = (AREA_M2[0]..AREA_M2[1]).contains(&group.area_m2);
    area && top && high - low > TALL_M && spread_m(level, group) < WIDE_M
}

/// Root mean square distance in plan from the middle.
fn spread_m(level: &Level, group: &Group) -> f32 {
    let middle = level.plan(&group.middle);
    let square = |point: &V3| {
        let at = level.plan(point);
        (at[0] - middle[0]).powi(2) + (at[1] - middle[1]).powi(2)
    };
    let sum: f32 = group.points.iter().map(square).sum();
    (sum / group.points.len() as f32).sqrt()
}

/// Two groups of points, each nearer to its own middle in plan than to the other's (Lloyd 1982).
fn halves(level: &Level, group: &Group) -> [Group; 2] {
    let plan: Vec<[f32; 2]> = group.points.iter().map(|point| level.plan(point)).collect();
    let far = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let furthest = |from: [f32; 2]| {
        let points = plan.iter().copied();
        points
            .max_by(|a, b| far(*a, from).total_cmp(&far(*b, from)))
            .unwrap_or(from)
    };
    let first = furthest(level.plan(&group.middle));
    let mut middles = [first, furthest(first)];
    let side = |middles: &[[f32; 2]; 2], at: [f32; 2]| {
        usize::from(far(at, middles[1]) < far(at, middles[0]))
    };
    for _ in 0..6 {
        let mut sums = [[0.0f32; 3]; 2];
        for &at in &plan {
            let sum = &mut sums[side(&middles, at)];
            *sum = [sum[0] + at[0], sum[1] + at[1], sum[2] + 1.0];
        }
        middles = sums.map(|[x, y, n]| [x / n.max(1.0), y / n.max(1.0)]);
    }
    [0, 1].map(|half| {
        let points = group.points.iter().zip(&plan);
        let points = points.filter(|(_, at)| side(&middles, **at) == half);
        let points: Vec<V3> = points.map(|(point, _)| *point).collect();
        let count = points.len().max(1) as f32;
        Group {
            segments: group.segments.clone(),
            area_m2: group.area_m2 * count / group.points.len() as f32,
            middle: points.iter().sum::<V3>() / count,
            points,
        }
    })
}
