//! Are a person's own left and right right? Evidence for it, gathered from all sensors over time.

use posefuse_skeleton::{Joint, Timestamp};

use super::swap::{ENDS, forward};
use super::{People, TrackState};
use crate::body::Halves;
use crate::diagnostics::BodyLabels;

/// Facing evidence dies away with this time constant and counts up to this much, seconds.
const FACING_MEMORY_S: f64 = 5.0;
const FACING_LIMIT_S: f64 = 0.4;
/// Evidence against the track's left and right that turns it, seconds: of a settled person, of a new one.
const FACING_TURN_S: f64 = -0.2;
const FACING_TURN_YOUNG_S: f64 = -0.08;
/// Evidence from which on a half is sure, seconds, and what it then says of the other: the hips of the shoulders, the
/// shoulders of the hips.
const SURE_S: f64 = 0.2;
const TWIST: Halves<f64> = [0.5, 1.0];
/// Until this age a person is new, ns.
const YOUNG_NS: i64 = 1_000_000_000;

impl People {
    /// How every sensor's bodies are taken.
    pub(crate) fn labels(&self) -> impl Iterator<Item = BodyLabels> {
        let of_track = |track: &TrackState| {
            let id = track.id;
            let of_source = move |source: &super::track::Source| BodyLabels {
                sensor: source.sensor,
                tracking_id: source.tracking_id,
                track: id,
                mirrored: source.mirrored,
            };
            track.sources.iter().map(of_source).collect::<Vec<_>>()
        };
        self.tracks.iter().flat_map(of_track)
    }
}

impl TrackState {
    /// Adds what the samples since the last frame say of the track's left and right; whether they said anything.
    pub(super) fn weigh_facing(&mut self, elapsed_s: f64) -> bool {
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for source in &self.sources {
            if source
                .newest()
                .is_some_and(|newest| newest >= self.pose_time)
            {
                for (half, sum) in sum.iter_mut().enumerate() {
                    let cue = source.facing_cue[half];
                    *sum += if source.mirrored[half] { -cue } else { cue };
                }
                count += 1.0;
            }
        }
        if count == 0.0 {
            return false;
        }
        let elapsed_s = elapsed_s.clamp(0.01, 0.1);
        let twisted = self.twisted();
        for ((facing, sum), twisted) in self.facing.iter_mut().zip(sum).zip(twisted) {
            let sum = sum + count * twisted;
            let kept = *facing * (1.0 - elapsed_s / FACING_MEMORY_S);
            *facing = (kept + elapsed_s * sum / count).clamp(-FACING_LIMIT_S, FACING_LIMIT_S);
        }
        true
    }

    /// What each half says of the other: hips and shoulders face the same way, within what a spine can twist. A half
    /// speaks only when it is itself sure to be right.
    fn twisted(&self) -> Halves<f64> {
        let at = |joint: Joint| self.pose[joint as usize].as_ref().map(|j| j.position);
        let forward = |(left, right): (Joint, Joint)| forward(at(left)?, at(right)?);
        let [shoulders, hips] = ENDS.map(forward);
        let together = shoulders.zip(hips).map_or(0.0, |(s, h)| s.dot(&h));
        let [upper, lower] = self.facing.map(|facing| facing > SURE_S);
        [
            f64::from(u8::from(lower)) * TWIST[0] * together,
            f64::from(u8::from(upper)) * TWIST[1] * together,
        ]
    }

    /// Exchanges left and right where the evidence is against them; whether it did.
    pub(super) fn settle_facing(&mut self, time: Timestamp) -> bool {
        let young = time.since_ns(self.since) < YOUNG_NS;
        let limit = if young {
            FACING_TURN_YOUNG_S
        } else {
            FACING_TURN_S
        };
        let turn = self.facing.map(|facing| facing < limit);
        self.mirror(turn);
        turn.contains(&true)
    }
}
