//! A sensor's bodies are given to tracks: the cheapest assignment within a gate, a sensor's own ids as a hint.

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint, Provenance, SensorId, SensorSet, Timestamp};

use super::cost::distance;
use super::swap::{SwapOdds, facing_cues};
use super::track::{JointEstimate, Sample, TrackState};
use super::{People, Placed, Scratch};
use crate::Config;
use crate::body::Body;
use crate::config::AssociateConfig;
use crate::noise::Noise;

/// What no assignment can cost.
const NEVER: f64 = 1e6;
/// A candidate counts as this much further away than a person, metres.
const CANDIDATE_HANDICAP_M: f64 = 0.05;
/// The gate widens by this much per second without sight, up to the limit.
const GATE_GROWTH_MPS: f64 = 1.2;
const GATE_GROWTH_LIMIT_M: f64 = 1.5;
/// Distances up to this share of the gate count as they are, however wide it has become.
const NEAR: f64 = 0.6;
/// After this long out of everybody's sight, where a person is and their sides are found out anew, ns.
const POSE_MEMORY_NS: i64 = 400_000_000;
/// A body of fewer joints does not begin a track.
const MIN_JOINTS: usize = 6;
/// Candidates beyond the people that are followed.
const SPARE_CANDIDATES: usize = 8;

impl People {
    /// Takes what `sensor`, standing at `origin`, saw at `time`.
    pub(crate) fn observe(
        &mut self,
        sensor: SensorId,
        origin: Vector3<f64>,
        time: Timestamp,
        bodies: &[Placed],
        config: &Config,
    ) {
        self.expire(time, &config.associate);
        self.predict(time);
        self.assign(sensor, time, bodies, &config.associate);
        for (row, placed) in bodies.iter().enumerate() {
            let index = match self.scratch.chosen[row] {
                Some(index) => index,
                None if placed.body.len() < MIN_JOINTS => continue,
                None if self.is_full(&config.associate) => continue,
                None => self.spawn(time),
            };
            self.release(sensor, placed.tracking_id, index);
            let empty = Body::default();
            let predicted = self.scratch.predicted.get(index).unwrap_or(&empty);
            self.tracks[index].take(sensor, origin, time, placed, predicted, config);
        }
    }

    /// Every track's pose at `time`, into the scratch.
    fn predict(&mut self, time: Timestamp) {
        self.scratch
            .predicted
            .resize_with(self.tracks.len(), Body::default);
        for (track, into) in self.tracks.iter().zip(&mut self.scratch.predicted) {
            track.predicted(time, into);
        }
    }

    /// For each body the track it belongs to, into the scratch.
    fn assign(
        &mut self,
        sensor: SensorId,
        time: Timestamp,
        bodies: &[Placed],
        config: &AssociateConfig,
    ) {
        let tracks = self.tracks.len();
        let Scratch {
            hungarian,
            predicted,
            cost,
            chosen,
            ..
        } = &mut self.scratch;
        chosen.clear();
        if tracks == 0 {
            chosen.resize(bodies.len(), None);
            return;
        }
        // One spare column per body: to belong to nobody known costs as much as the gate is wide.
        let columns = tracks + bodies.len();
        cost.clear();
        for placed in bodies {
            let known = self.tracks.iter().zip(&*predicted);
            cost.extend(known.map(|(track, predicted)| {
                self::cost(track, predicted, placed, sensor, time, config)
            }));
            cost.resize(cost.len() + bodies.len(), config.gate_m);
        }
        let solved = hungarian.solve(cost, bodies.len(), columns);
        let known = |(row, column): (usize, &usize)| {
            (*column < tracks && cost[row * columns + column] < config.gate_m).then_some(*column)
        };
        chosen.extend(solved.iter().enumerate().map(known));
    }

    fn is_full(&self, config: &AssociateConfig) -> bool {
        self.tracks.len() >= config.max_people + SPARE_CANDIDATES
    }

    fn spawn(&mut self, time: Timestamp) -> usize {
        self.next_key += 1;
        self.tracks.push(TrackState::spawn(self.next_key, time));
        self.tracks.len() - 1
    }

    /// The sensor's person `tracking_id` is now track `index` and nobody else.
    fn release(&mut self, sensor: SensorId, tracking_id: u64, index: usize) {
        for (other, track) in self.tracks.iter_mut().enumerate() {
            if other != index {
                track
                    .sources
                    .retain(|s| (s.sensor, s.tracking_id) != (sensor, tracking_id));
            }
        }
    }
}

/// Metres of distance, less what speaks for it beyond distance.
fn cost(
    track: &TrackState,
    predicted: &Body,
    placed: &Placed,
    sensor: SensorId,
    time: Timestamp,
    config: &AssociateConfig,
) -> f64 {
    let bound = track
        .source(sensor)
        .is_some_and(|source| source.tracking_id == placed.tracking_id);
    let Some(distance) = distance(&placed.body, predicted) else {
        return if track.is_nowhere() && bound {
            0.0
        } else {
            NEVER
        };
    };
    let unseen_s = time.since_seconds(track.last_seen).max(0.0);
    let growth = ((unseen_s - 0.1) * GATE_GROWTH_MPS).clamp(0.0, GATE_GROWTH_LIMIT_M);
    let bonus = if bound { config.id_bonus_m } else { 0.0 };
    let handicap = if track.id.is_none() {
        CANDIDATE_HANDICAP_M
    } else {
        0.0
    };
    within_gate(distance, growth, config.gate_m) + handicap - bonus
}

/// `distance` brought from the widened gate into the gate, so that nobody who was lost is preferred to somebody nearer.
fn within_gate(distance: f64, growth: f64, gate: f64) -> f64 {
    let near = NEAR * gate;
    if distance <= near {
        return distance;
    }
    near + (distance - near) * (gate - near) / (gate + growth - near)
}

impl TrackState {
    /// Takes one sensor's body as a sample of this person, left and right put right.
    fn take(
        &mut self,
        sensor: SensorId,
        origin: Vector3<f64>,
        time: Timestamp,
        placed: &Placed,
        predicted: &Body,
        config: &Config,
    ) {
        let lost = time.since_ns(self.last_seen) > POSE_MEMORY_NS;
        if lost {
            // Wherever they were, and whichever way they faced: they begin anew where they come back.
            self.uproot();
            self.facing = [0.0; 2];
        }
        let (walk, anew) = (self.walk(), self.is_nowhere());
        let source = self.source_mut(sensor, placed.tracking_id);
        if source.tracking_id != placed.tracking_id {
            source.tracking_id = placed.tracking_id;
            source.samples.clear();
        }
        let mut body = placed.body.clone();
        if config.fuse.swaps {
            source.facing_cue = facing_cues(&body, origin, walk);
            let was = source.mirrored;
            if anew {
                source.swap = SwapOdds::first(source.facing_cue);
                source.mirrored = source.swap.mirrored();
            } else {
                let elapsed_s = source.newest().map_or(1.0, |last| time.since_seconds(last));
                source.mirrored = source.swap.weigh(&body, predicted, origin, elapsed_s);
            }
            if source.mirrored != was {
                // Samples are never interpolated across a change of mind that may be wrong.
                source.samples.clear();
            }
            body.mirror(source.mirrored);
        }
        if self.is_nowhere() {
            self.plant(sensor, origin, time, &body, config);
        }
        self.hits = self.hits.saturating_add(1);
        self.last_seen = self.last_seen.max(time);
        let fused = self.pose_time;
        self.source_mut(sensor, placed.tracking_id)
            .push(Sample { time, body }, fused);
    }

    /// Mean velocity of the trunk, m/s.
    fn walk(&self) -> Vector3<f64> {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for joint in Joint::TORSO {
            if let Some(joint) = &self.pose[joint as usize] {
                sum += joint.velocity;
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { sum }
    }

    /// Takes the first pose from one body.
    fn plant(
        &mut self,
        sensor: SensorId,
        origin: Vector3<f64>,
        time: Timestamp,
        body: &Body,
        config: &Config,
    ) {
        let trusted = config.fuse.min_confidence;
        self.pose_time = time;
        for index in 0..JOINT_COUNT {
            self.pose[index] = body.has(index).then(|| {
                let confidence = f64::from(body.confidence[index]);
                let position = body.position[index];
                JointEstimate {
                    position,
                    velocity: Vector3::zeros(),
                    covariance: Noise::of(position, origin, confidence, trusted, 0.0).covariance(),
                    confidence,
                    provenance: Provenance::Measured(SensorSet::only(sensor)),
                    seen: time,
                }
            });
        }
    }
}
