//! The room at one instant: every track's samples moved there, fused joint by joint.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{
    Confidence, JOINT_COUNT, Joint, JointState, Position, Provenance, SensorId, SensorSet,
    Skeleton, Timestamp, Track, TrackId,
};

use super::track::JointEstimate;
use super::{Origins, People, TrackState, VELOCITY_DECAY_S, View, median};
use crate::Config;
use crate::fuse::{Sighting, fuse};

/// Share of a prediction's error that goes into velocity.
const VELOCITY_GAIN: f64 = 0.35;
/// No velocity is learned across a longer gap, seconds.
const MAX_VELOCITY_GAP_S: f64 = 0.2;
/// Nothing moves faster, m/s.
const MAX_SPEED_MPS: f64 = 12.0;
/// How fast the place of an unseen joint becomes uncertain, m/s.
const COAST_MPS: f64 = 0.6;
/// Confidence of an unseen joint dies away with this time constant, seconds.
const COAST_CONFIDENCE_S: f64 = 0.3;
/// One sensor's view of the track that is being fused.
type Seen<'a> = (SensorId, Vector3<f64>, View<'a>);

impl People {
    /// Fuses everybody at `time` and gives those to be shown, in order of their ids. `residual` gets each
    /// sensor's median distance (metres) to the fused person.
    pub(crate) fn frame(
        &mut self,
        time: Timestamp,
        origins: &Origins,
        config: &Config,
        mut residual: impl FnMut(SensorId, f64),
    ) -> Vec<Track> {
        self.expire(time, &config.associate);
        for track in &mut self.tracks {
            let elapsed_s = time.since_seconds(track.pose_time).max(0.0);
            let weigh = track.weigh_facing(elapsed_s);
            track.fuse_at(
                time,
                origins,
                config,
                &mut self.scratch.sightings,
                &mut residual,
            );
            if config.fuse.swaps && weigh && track.settle_facing(time) {
                self.flipped.extend(track.id);
            }
        }
        self.merge(time, &config.associate);
        self.give_ids(&config.associate);
        let show_ns = config.associate.show_ns();
        let mut shown: Vec<Track> = self
            .tracks
            .iter()
            .filter(|t| time.since_ns(t.last_seen) <= show_ns && !t.is_nowhere())
            .filter_map(|t| t.shown(time, show_ns))
            .collect();
        shown.sort_unstable_by_key(|track| track.id);
        shown
    }

    /// Candidates that were seen often enough become people.
    fn give_ids(&mut self, config: &crate::config::AssociateConfig) {
        let mut people = self.tracks.iter().filter(|t| t.id.is_some()).count();
        for track in &mut self.tracks {
            if track.id.is_none() && track.hits >= config.birth_hits && people < config.max_people {
                self.next_id += 1;
                track.id = Some(TrackId(self.next_id));
                people += 1;
            }
        }
    }
}

impl TrackState {
    /// As the outside sees it at `time`, if it is a person: the joints seen within `show_ns`.
    fn shown(&self, time: Timestamp, show_ns: i64) -> Option<Track> {
        let mut skeleton = Skeleton::empty();
        for (joint, known) in Joint::ALL.into_iter().zip(&self.pose) {
            let fresh = known
                .as_ref()
                .filter(|known| time.since_ns(known.seen) <= show_ns);
            skeleton[joint] = fresh.map(|known| JointState {
                position: Position::from_vector(known.position),
                covariance: known.covariance,
                confidence: Confidence::saturating(known.confidence as f32),
                provenance: known.provenance,
            });
        }
        Some(Track {
            id: self.id?,
            since: self.since,
            sensors: self.sensors,
            skeleton,
        })
    }

    /// Moves the pose to `time`: joints that were seen are fused, the others carried on for a while.
    fn fuse_at(
        &mut self,
        time: Timestamp,
        origins: &Origins,
        config: &Config,
        sightings: &mut Vec<Sighting>,
        residual: &mut impl FnMut(SensorId, f64),
    ) {
        let elapsed_s = time.since_seconds(self.pose_time);
        let max_age_ns = config.intake.max_age_ns();
        let Self { sources, pose, .. } = self;
        let seen: Vec<Seen> = sources
            .iter()
            .filter_map(|s| {
                Some((
                    s.sensor,
                    origins[s.sensor.index()]?,
                    s.view(time, max_age_ns)?,
                ))
            })
            .collect();
        let mut velocity = [Vector3::zeros(); JOINT_COUNT];
        let mut used = SensorSet::EMPTY;
        for (index, known) in pose.iter_mut().enumerate() {
            velocity[index] = known.as_ref().map_or_else(Vector3::zeros, |k| k.velocity);
            sightings.clear();
            sightings.extend(seen.iter().filter_map(|(sensor, origin, view)| {
                let (position, confidence, age_s) = view.joint(index, velocity[index])?;
                Some(Sighting {
                    sensor: *sensor,
                    position,
                    confidence,
                    origin: *origin,
                    age_s,
                })
            }));
            *known = match fuse(sightings, &config.fuse) {
                Some(fused) => {
                    used = used.union(fused.provenance.sensors());
                    Some(JointEstimate {
                        position: fused.position,
                        velocity: learn_velocity(known.as_ref(), fused.position, time, elapsed_s),
                        covariance: fused.covariance,
                        confidence: fused.confidence,
                        provenance: fused.provenance,
                        seen: time,
                    })
                }
                None => {
                    known.map(|known| coast(known, time, elapsed_s, config.associate.show_ns()))
                }
            };
        }
        report_residuals(&seen, pose, &velocity, config.fuse.min_confidence, residual);
        self.sensors = used;
        self.pose_time = time;
    }
}

/// The velocity after a joint was found at `position`; its pose had been carried on for `elapsed_s`.
fn learn_velocity(
    known: Option<&JointEstimate>,
    position: Vector3<f64>,
    time: Timestamp,
    elapsed_s: f64,
) -> Vector3<f64> {
    let Some(known) = known else {
        return Vector3::zeros();
    };
    let unseen_s = time.since_seconds(known.seen);
    if unseen_s <= 0.0 || elapsed_s <= 0.0 {
        return known.velocity;
    }
    if unseen_s > MAX_VELOCITY_GAP_S {
        return Vector3::zeros();
    }
    let error = position - (known.position + known.velocity * elapsed_s);
    let velocity = known.velocity + error * (VELOCITY_GAIN / unseen_s);
    velocity.cap_magnitude(MAX_SPEED_MPS)
}

/// An unseen joint carried on, less and less certain. After `show_ns` it stays where it is, not to be shown any
/// more, but so that the person is known again by it.
fn coast(known: JointEstimate, time: Timestamp, elapsed_s: f64, show_ns: i64) -> JointEstimate {
    if time.since_ns(known.seen) > show_ns {
        return known;
    }
    let elapsed_s = elapsed_s.max(0.0);
    let left = (-elapsed_s / VELOCITY_DECAY_S).exp();
    // The variance is (speed * time unseen)^2, however many frames that time is made of.
    let unseen_s = time.since_seconds(known.seen).max(elapsed_s);
    let before_s = unseen_s - elapsed_s;
    let unsure = COAST_MPS * COAST_MPS * (unseen_s * unseen_s - before_s * before_s);
    JointEstimate {
        position: known.position + known.velocity * (VELOCITY_DECAY_S * (1.0 - left)),
        velocity: known.velocity * left,
        covariance: known.covariance + Matrix3::from_diagonal_element(unsure),
        confidence: known.confidence * (-elapsed_s / COAST_CONFIDENCE_S).exp(),
        provenance: Provenance::Predicted(SensorSet::EMPTY),
        seen: known.seen,
    }
}

/// Each sensor's median distance to the fused joints, trusted sightings only.
fn report_residuals(
    seen: &[Seen],
    pose: &[Option<JointEstimate>; JOINT_COUNT],
    velocity: &[Vector3<f64>; JOINT_COUNT],
    trusted: f64,
    residual: &mut impl FnMut(SensorId, f64),
) {
    for (sensor, _, view) in seen {
        let mut distances = [0.0; JOINT_COUNT];
        let mut count = 0;
        for index in 0..JOINT_COUNT {
            let (Some(known), Some((position, confidence, _))) =
                (&pose[index], view.joint(index, velocity[index]))
            else {
                continue;
            };
            if confidence >= trusted {
                distances[count] = (position - known.position).norm();
                count += 1;
            }
        }
        if let Some(median) = median(&mut distances[..count]) {
            residual(*sensor, median);
        }
    }
}
