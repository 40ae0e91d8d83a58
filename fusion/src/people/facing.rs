//! Are a person's own left and right right? Evidence for it, gathered from all sensors over time.

use posefuse_skeleton::Timestamp;

use super::TrackState;

/// Facing evidence dies away with this time constant and counts up to this much, seconds.
const FACING_MEMORY_S: f64 = 5.0;
const FACING_LIMIT_S: f64 = 1.0;
/// Evidence against the track's left and right that turns it, seconds: of a settled person, of a new one.
const FACING_TURN_S: f64 = -0.3;
const FACING_TURN_YOUNG_S: f64 = -0.08;
/// Until this age a person is new, ns.
const YOUNG_NS: i64 = 1_000_000_000;

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
        for (facing, sum) in self.facing.iter_mut().zip(sum) {
            let kept = *facing * (1.0 - elapsed_s / FACING_MEMORY_S);
            *facing = (kept + elapsed_s * sum / count).clamp(-FACING_LIMIT_S, FACING_LIMIT_S);
        }
        true
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
