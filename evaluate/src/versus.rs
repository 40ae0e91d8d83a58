//! On how many takes one method is better than another.

use serde::Serialize;

use crate::metrics::Metrics;
use crate::report::Group;

/// A figure worse by no more than this share counts as equal.
const EQUAL: f64 = 0.01;

/// One method beside another, take by take.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Versus {
    /// Whether this one is better
    pub method: String,
    /// than that one.
    pub against: String,
    /// On how many takes both have figures.
    pub takes: usize,
    /// On how many no figure is worse (by more than 1 %) and one at least is better.
    pub better: usize,
    /// On how many each figure is not worse.
    pub by_figure: Vec<(&'static str, usize)>,
    /// The others, each with the figures that are worse.
    pub others: Vec<(String, Vec<&'static str>)>,
}

type Figure = (&'static str, fn(&Metrics) -> Option<f64>);

const WITH_TRUTH: [Figure; 4] = [
    ("error", |m| m.own_error.mean_mm),
    ("jitter", |m| m.jitter_mps2),
    ("bones", |m| m.bone_sigma_mm),
    ("spikes", |m| m.spikes_per_min),
];
const ALONE: [Figure; 4] = [
    ("left out", |m| m.left_out_median_mm),
    ("jitter", |m| m.jitter_mps2),
    ("bones", |m| m.bone_sigma_mm),
    ("spikes", |m| m.spikes_per_min),
];

/// Compares two methods over these takes.
pub fn versus(groups: &[Group], method: &str, against: &str, with_truth: bool) -> Versus {
    let figures = if with_truth { WITH_TRUTH } else { ALONE };
    let mut versus = Versus {
        method: method.to_owned(),
        against: against.to_owned(),
        by_figure: figures.iter().map(|(name, _)| (*name, 0)).collect(),
        ..Versus::default()
    };
    for group in groups {
        let (Some(own), Some(other)) = (group.of(method), group.of(against)) else {
            continue;
        };
        let (mut worse, mut better, mut known) = (Vec::new(), false, false);
        for ((name, figure), (_, count)) in figures.iter().zip(&mut versus.by_figure) {
            let (Some(own), Some(other)) = (figure(&own.all), figure(&other.all)) else {
                continue;
            };
            known = true;
            let slack = EQUAL * other.abs();
            if own > other + slack {
                worse.push(*name);
            } else {
                *count += 1;
            }
            better |= own < other - slack;
        }
        if !known {
            continue;
        }
        versus.takes += 1;
        if worse.is_empty() && better {
            versus.better += 1;
        } else {
            versus.others.push((group.name.clone(), worse));
        }
    }
    versus
}

impl Versus {
    /// In one line.
    pub fn told(&self) -> String {
        let figures = self.by_figure.iter();
        let figures = figures.map(|(name, count)| format!("{name} {count}"));
        format!(
            "{} is better than {} on {} of {} (not worse in {})",
            self.method,
            self.against,
            self.better,
            self.takes,
            figures.collect::<Vec<_>>().join(", ")
        )
    }
}
