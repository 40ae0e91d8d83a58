//! Which sensor it was: the one whose motion explains the most, then the next against the others as put right.

use std::collections::BTreeMap;

use posefuse_skeleton::SensorId;

use super::motion::{Estimate, Motion, Stats, estimate};
use super::rows::{Place, rows};
use super::{DriftMonitor, MIN_COMPARISONS};

/// Share of the wanted sensitivity at which a motion counts: an estimate of a motion just that large is as often below as
/// above.
const SHARE: f64 = 0.6;
/// Below this share of that it is nothing; nothing is learnt above.
const CALM_SHARE: f64 = 0.6;
/// A motion counts from so many standard deviations on (six degrees of freedom: the usual value is 2.4).
const SIGNIFICANT: f64 = 4.5;
/// From so many on nothing is learnt.
const DOUBTFUL: f64 = 3.0;
/// A sensor that explains at least this share of what the best explains may be the one, too.
const RIVAL_SHARE: f64 = 0.5;

/// From where on a sensor has moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thresholds {
    off_m: f64,
    turned_rad: f64,
}

/// One sensor against the others.
#[derive(Clone, Debug)]
pub(super) struct Finding {
    pub(super) estimate: Estimate,
    /// RMS over the joints of how far the motion moves them, metres.
    pub(super) off_m: f64,
    pub(super) residual_m: f64,
    pub(super) instead: Option<SensorId>,
}

impl Finding {
    pub(super) fn is_moved(&self, thresholds: &Thresholds) -> bool {
        self.is_beyond(1.0, thresholds) && self.estimate.chi2 >= SIGNIFICANT * SIGNIFICANT
    }

    pub(super) fn is_suspicious(&self, thresholds: &Thresholds) -> bool {
        !self.is_calm(thresholds) && self.estimate.chi2 >= DOUBTFUL * DOUBTFUL
    }

    pub(super) fn is_calm(&self, thresholds: &Thresholds) -> bool {
        !self.is_beyond(CALM_SHARE, thresholds)
    }

    fn is_beyond(&self, share: f64, thresholds: &Thresholds) -> bool {
        let turned = self.estimate.motion.turn().norm();
        self.off_m >= share * thresholds.off_m
            || turned >= share * thresholds.turned_rad && self.estimate.turned() >= SIGNIFICANT
    }
}

/// What a sensor saw in the window.
#[derive(Clone, Debug, Default)]
struct Seen {
    places: BTreeMap<Place, Stats>,
    distances: Vec<f64>,
    comparisons: usize,
}

impl DriftMonitor {
    pub(super) fn thresholds(&self) -> Thresholds {
        Thresholds {
            off_m: SHARE * self.options.alarm_m,
            turned_rad: SHARE * self.options.alarm_rad,
        }
    }

    /// Every sensor of the window.
    pub(super) fn blame(&self) -> BTreeMap<SensorId, Finding> {
        let thresholds = self.thresholds();
        let mut named = BTreeMap::new();
        let mut moved = BTreeMap::new();
        loop {
            let rest = self.findings(&moved);
            let best = rest
                .iter()
                .filter(|(_, finding)| finding.is_moved(&thresholds))
                .max_by(|(_, a), (_, b)| a.estimate.chi2.total_cmp(&b.estimate.chi2));
            let Some((best, finding)) = best else {
                named.extend(rest);
                return named;
            };
            let (best, mut finding) = (*best, finding.clone());
            finding.instead = self.rival(best, &rest, &moved, &thresholds);
            moved.insert(best, finding.estimate.motion);
            if let Some(rival) = finding.instead
                && let Some(other) = rest.get(&rival)
            {
                let other = Finding {
                    instead: Some(best),
                    ..other.clone()
                };
                moved.insert(rival, Motion::default());
                named.insert(rival, other);
            }
            named.insert(best, finding);
        }
    }

    /// A sensor whose motion would explain that of `best` as well.
    fn rival(
        &self,
        best: SensorId,
        all: &BTreeMap<SensorId, Finding>,
        moved: &BTreeMap<SensorId, Motion>,
        thresholds: &Thresholds,
    ) -> Option<SensorId> {
        let enough = RIVAL_SHARE * all.get(&best)?.estimate.chi2;
        let explains = |(sensor, finding): (&SensorId, &Finding)| {
            let mut moved = moved.clone();
            moved.insert(*sensor, finding.estimate.motion);
            let rest = self.findings(&moved);
            let is_left = rest.get(&best).is_some_and(|f| f.is_moved(thresholds));
            (!is_left).then_some((*sensor, finding.estimate.chi2))
        };
        all.iter()
            .filter(|(sensor, _)| **sensor != best)
            .filter(|(_, finding)| finding.is_moved(thresholds) && finding.estimate.chi2 >= enough)
            .filter_map(explains)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(sensor, _)| sensor)
    }

    /// Every sensor but those in `moved`, which are put right by what is there.
    fn findings(&self, moved: &BTreeMap<SensorId, Motion>) -> BTreeMap<SensorId, Finding> {
        let mut seen: BTreeMap<SensorId, Seen> = BTreeMap::new();
        for comparison in &self.window {
            let Some((place, rows)) = rows(comparison, &self.stands, moved) else {
                continue;
            };
            for rows in rows
                .into_iter()
                .filter(|rows| !moved.contains_key(&rows.sensor))
            {
                let seen = seen.entry(rows.sensor).or_default();
                seen.places.entry(place).or_default().join(&rows.stats, 1.0);
                seen.distances.extend(&rows.distances);
                seen.comparisons += 1;
            }
        }
        let finding = |(sensor, seen)| Some((sensor, self.finding(sensor, seen)?));
        seen.into_iter().filter_map(finding).collect()
    }

    fn finding(&self, sensor: SensorId, mut seen: Seen) -> Option<Finding> {
        if seen.comparisons < MIN_COMPARISONS {
            return None;
        }
        let unknown = Default::default();
        let baseline = self
            .watched
            .get(&sensor)
            .map_or(&unknown, |watched| &watched.baseline);
        let beyond = baseline.beyond(&seen.places);
        let estimate = estimate(&beyond, &baseline.covariance())?;
        let mut cloud = Stats::default();
        seen.places.values().for_each(|s| cloud.join(s, 1.0));
        let motion = estimate.motion.0;
        let off2 = motion.dot(&(cloud.h * motion)) / cloud.weight().max(f64::MIN_POSITIVE);
        Some(Finding {
            estimate,
            off_m: off2.max(0.0).sqrt(),
            residual_m: crate::stats::median(&mut seen.distances)?,
            instead: None,
        })
    }
}
