//! How well people are found in rendered depth, and what each step of the work costs.
//!
//! `cargo run --release -p posefuse-bodytrack --example follow -- [people] [seconds] [seed] [sensor]`
//!
//! Prints, for one sensor of a simulated room: who should have been seen (at least 600 pixels) and was, bodies of nobody, how
//! much of each body's pixels is theirs and how much of theirs it has, ids for each person, and ms per image.
#![allow(clippy::unwrap_used, reason = "a tool for developers")]

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use posefuse_bodytrack::{BodyTracker, Step, TrackerConfig};
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{Scenario, World};

const SEEN_PIXELS: usize = 600;

fn main() {
    let number = |at: usize, usual: f64| {
        let given = std::env::args().nth(at);
        given.map_or(usual, |text| text.parse().unwrap())
    };
    let (people, seconds) = (number(1, 2.0) as usize, number(2, 10.0));
    let scenario = Scenario {
        people,
        seed: number(3, 1.0) as u64,
        ..Scenario::default()
    };
    let sensor = number(4, 0.0) as usize;
    let world = World::new(&scenario).unwrap();
    let camera = DepthCamera::structured_light(320, 240);
    let mut tracker = BodyTracker::new(TrackerConfig::default(), camera.intrinsics).unwrap();
    println!("network on {}", tracker.runtime());
    let mut tally = Tally::default();
    let images = (seconds * 30.0) as usize;
    for image in 0..images {
        let at = image as f64 / 30.0;
        let view = world.depth_with_owners(sensor, at, &camera);
        let began = Instant::now();
        let bodies = tracker.track(&view.image, (at * 1e9) as i64).unwrap();
        tally.total.push(began.elapsed().as_secs_f64() * 1e3);
        for (step, times) in Step::ALL.into_iter().zip(&mut tally.steps) {
            times.push(tracker.steps().took(step).as_secs_f64() * 1e3);
        }
        let owners: Vec<u64> = tracker.owners().collect();
        tally.compare(&view.image.millimetres, &view.owners, &owners, people);
        if image % 90 == 0 {
            let ids: Vec<u64> = bodies.iter().map(|body| body.id).collect();
            println!("{at:5.1} s: {ids:?}");
        }
    }
    tally.print();
}

#[derive(Default)]
struct Tally {
    total: Vec<f64>,
    steps: [Vec<f64>; Step::ALL.len()],
    images: usize,
    should: usize,
    found: usize,
    of_nobody: usize,
    pure: [usize; 2],
    whole: [usize; 2],
    ids: BTreeMap<u8, BTreeSet<u64>>,
    changes: usize,
    last: BTreeMap<u8, u64>,
    strangers: BTreeSet<u64>,
}

impl Tally {
    fn compare(&mut self, depth: &[u16], truth: &[u8], owners: &[u64], people: usize) {
        let mut pairs: BTreeMap<(u64, u8), usize> = BTreeMap::new();
        for ((mm, truth), owner) in depth.iter().zip(truth).zip(owners) {
            if *mm > 0 {
                *pairs.entry((*owner, *truth)).or_default() += 1;
            }
        }
        let count = |owner: Option<u64>, person: Option<u8>| -> usize {
            let fits = |(o, p): &(u64, u8)| {
                owner.is_none_or(|owner| owner == *o) && person.is_none_or(|person| person == *p)
            };
            pairs
                .iter()
                .filter(|(key, _)| fits(key))
                .map(|(_, n)| n)
                .sum()
        };
        self.images += 1;
        let mut taken = BTreeSet::new();
        for person in 1..=people as u8 {
            let pixels = count(None, Some(person));
            let best = pairs.iter().filter(|((o, p), _)| *o > 0 && *p == person);
            let best = best
                .max_by_key(|(_, n)| **n)
                .map(|((owner, _), n)| (*owner, *n));
            if let Some((owner, n)) = best.filter(|(_, n)| *n > pixels / 3 && pixels > 0) {
                taken.insert(owner);
                self.whole[0] += n;
                self.whole[1] += pixels;
                self.pure[0] += n;
                self.pure[1] += count(Some(owner), None);
                self.ids.entry(person).or_default().insert(owner);
                if !self.last.contains_key(&person) {
                    println!("person {person} found after {} images", self.images);
                }
                let before = self.last.insert(person, owner);
                self.changes += usize::from(before.is_some_and(|before| before != owner));
                self.found += usize::from(pixels >= SEEN_PIXELS);
            }
            self.should += usize::from(pixels >= SEEN_PIXELS);
        }
        let all: BTreeSet<u64> = pairs.keys().map(|(owner, _)| *owner).collect();
        for id in all.into_iter().filter(|id| *id > 0 && !taken.contains(id)) {
            self.of_nobody += 1;
            if self.strangers.insert(id) {
                let pixels: Vec<usize> = (0..owners.len()).filter(|at| owners[*at] == id).collect();
                let mean = |of: &dyn Fn(usize) -> usize| {
                    pixels.iter().map(|at| of(*at)).sum::<usize>() / pixels.len()
                };
                let at = [
                    mean(&|at| at % 320),
                    mean(&|at| at / 320),
                    mean(&|at| depth[at].into()),
                ];
                println!("body {id} of nobody: {} pixels around {at:?}", pixels.len());
            }
        }
    }

    fn print(&mut self) {
        let share = |[part, all]: [usize; 2]| 100.0 * part as f64 / all.max(1) as f64;
        println!(
            "found {:.2} % of {}",
            share([self.found, self.should]),
            self.should
        );
        println!("bodies of nobody: {}", self.of_nobody);
        println!("body's pixels that are theirs {:.2} %", share(self.pure));
        println!("their pixels that the body has {:.2} %", share(self.whole));
        println!("ids {:?}, changes {}", self.ids, self.changes);
        let line = |name: &str, times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
            println!(
                "{name:<10} median {:.2} ms, p95 {:.2} ms",
                at(0.5),
                at(0.95)
            );
        };
        for (step, times) in Step::ALL.into_iter().zip(&mut self.steps) {
            line(&format!("{step:?}"), times);
        }
        line("together", &mut self.total);
    }
}
