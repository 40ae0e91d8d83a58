//! The result of a comparison: what scripts get as JSON and what people get as tables or as a page.

mod bodies;
mod page;
mod plots;
mod repair;
mod svg;

pub(crate) use bodies::html as bodies_html;
pub(crate) use repair::html as repair_html;

use serde::Serialize;

use crate::aims::Aim;
use crate::judge::Judged;
use crate::methods::Method;
use crate::metrics::Metrics;
use crate::table::{ALONE, Column, WITH_TRUTH};
use crate::versus::Versus;

/// Steps of the share in [`Run::cdf`].
const CDF_STEPS: usize = 60;

/// A comparison of methods on one or more groups of runs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// What it is about.
    pub title: String,
    /// What was done, in sentences.
    pub about: Vec<String>,
    /// Whether the truth was known.
    pub with_truth: bool,
    /// Rooms, takes or recordings.
    pub groups: Vec<Group>,
    /// The aims that were checked.
    pub aims: Vec<Aim>,
    /// Methods side by side over all groups.
    pub versus: Vec<Versus>,
}

/// A room, a take or a recording, fused by each method.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// What is to be known of it; may be empty.
    pub note: String,
    /// One per method, the same in each group.
    pub runs: Vec<Run>,
}

/// One method on one group.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Run {
    /// The method's name.
    pub method: String,
    /// What it is.
    pub about: String,
    /// Figures of all runs pooled.
    pub all: Metrics,
    /// Figures of each run, where there are several.
    pub parts: Vec<Metrics>,
    /// Distances (the error, or without truth that of left-out sensors), mm, and the share that is not further.
    pub cdf: Vec<(f64, f64)>,
    /// Seconds and the mean error then, mm, of the first run.
    pub over_time: Vec<(f64, f64)>,
}

impl Report {
    /// The columns that its tables have.
    pub fn columns(&self) -> &'static [Column] {
        match self.with_truth {
            true => &WITH_TRUTH,
            false => &ALONE,
        }
    }

    /// A page that stands by itself: no script, no font, no picture from anywhere else.
    pub fn html(&self) -> String {
        page::html(self)
    }
}

impl Group {
    /// The figures of a method; `None` if it was not among them.
    pub fn of(&self, method: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.method == method)
    }
}

impl Run {
    /// Pools runs of one method on one group.
    pub fn new<'a>(method: &Method, runs: impl IntoIterator<Item = &'a Judged>) -> Self {
        let mut all = crate::Tally::default();
        let (mut parts, mut over_time) = (Vec::new(), Vec::new());
        for run in runs {
            all.merge(&run.tally);
            if parts.is_empty() {
                over_time = run.over_time.iter().map(|(s, m)| (*s, m * 1e3)).collect();
            }
            parts.push(Metrics::from(&run.tally));
        }
        let mut distances = all.own_visible.clone();
        distances.merge(&all.own_occluded);
        if distances.count() == 0 {
            distances = all.left_out.clone();
        }
        let step = |step: usize| {
            let share = step as f64 / CDF_STEPS as f64;
            Some((distances.quantile_m(share)? * 1e3, share))
        };
        if parts.len() == 1 {
            parts.clear();
        }
        Self {
            method: method.name.clone(),
            about: method.about.clone(),
            all: Metrics::from(&all),
            parts,
            cdf: (0..=CDF_STEPS).filter_map(step).collect(),
            over_time,
        }
    }
}
