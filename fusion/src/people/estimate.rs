//! A track's filter and its sensors' samples: what is new goes in, the pose comes out.

use posefuse_skeleton::{Provenance, SensorSet, Timestamp};

use super::track::{JointEstimate, Source};
use super::{Origins, Scratch, TrackState};
use crate::Config;
use crate::body::Halves;
use crate::fuse::kalman::{Moment, Reading};

/// A tracker that exchanges left and right guesses where they are, besides: standard deviation, metres.
const MIRRORED_M: f64 = 0.04;

impl Source {
    /// Gives the samples not yet taken up to `time`, oldest first, and the newest one in any case, unless they are
    /// older than `max_age_ns`.
    fn readings<'a>(
        &'a self,
        origin: nalgebra::Vector3<f64>,
        time: Timestamp,
        max_age_ns: i64,
        give: &mut Vec<Reading<'a>>,
    ) {
        let doubt: Halves<f64> = self.mirrored.map(|mirrored| {
            let sigma_m = if mirrored { MIRRORED_M } else { 0.0 };
            sigma_m * sigma_m
        });
        let up_to = self.samples.iter().rposition(|s| s.time <= time);
        let Some(newest) = up_to else {
            return;
        };
        for (index, sample) in self.samples.range(..=newest).enumerate() {
            let fresh = self.taken.is_none_or(|taken| sample.time > taken);
            let age_ns = time.since_ns(sample.time);
            if (fresh || index == newest) && age_ns <= max_age_ns {
                give.push(Reading {
                    sensor: self.sensor,
                    origin,
                    body: &sample.body,
                    age_s: age_ns as f64 * 1e-9,
                    fresh,
                    doubt,
                });
            }
        }
    }
}

impl TrackState {
    /// Moves filter and pose to `time`, with every sample that has come since the last frame.
    pub(super) fn filter_to(
        &mut self,
        time: Timestamp,
        origins: &Origins,
        config: &Config,
        scratch: &mut Scratch,
    ) {
        let max_age_ns = config.intake.max_age_ns();
        let mut readings = Vec::with_capacity(2 * self.sources.len());
        for source in &self.sources {
            if let Some(origin) = origins[source.sensor.index()] {
                source.readings(origin, time, max_age_ns, &mut readings);
            }
        }
        leave_out_copies(&mut readings);
        let moment = Moment {
            time,
            elapsed_s: time.since_seconds(self.pose_time).max(0.0),
            trusted: config.fuse.min_confidence,
            keep: config.fuse.look_ahead.max(scratch.remembered),
        };
        let Scratch { filter, parts, .. } = scratch;
        let show_ns = config.associate.show_ns();
        let mut used = SensorSet::EMPTY;
        let pose = &mut self.pose;
        let mut known = 0_u32;
        self.filter.advance(
            &moment,
            &readings,
            filter,
            |index, estimate| {
                known |= 1 << index;
                let unseen = time.since_ns(estimate.seen) > show_ns;
                if estimate.seen == time {
                    used = used.union(estimate.fused.provenance.sensors());
                }
                // Not shown any more, but the person is known again by where it was.
                if unseen && pose[index].is_some() {
                    return;
                }
                let provenance = if estimate.seen == time {
                    estimate.fused.provenance
                } else {
                    Provenance::Predicted(SensorSet::EMPTY)
                };
                pose[index] = Some(JointEstimate {
                    position: estimate.fused.position,
                    velocity: estimate.velocity,
                    covariance: estimate.fused.covariance,
                    confidence: estimate.fused.confidence,
                    provenance,
                    seen: estimate.seen,
                });
            },
            &mut |part| parts.push(part),
        );
        self.sensors = used;
        self.pose_time = time;
        for source in &mut self.sources {
            let newest = source.samples.iter().rev().find(|s| s.time <= time);
            source.taken = source.taken.max(newest.map(|s| s.time));
        }
    }
}

/// One stream that comes under two names is one sensor: of readings from the same place that agree in every bit, only
/// the first is taken.
fn leave_out_copies(readings: &mut Vec<Reading>) {
    let mut index = 1;
    while index < readings.len() {
        let (before, this) = (&readings[..index], &readings[index]);
        let copied = before.iter().any(|other| {
            other.sensor != this.sensor && other.origin == this.origin && other.body == this.body
        });
        if copied {
            readings.remove(index);
        } else {
            index += 1;
        }
    }
}
