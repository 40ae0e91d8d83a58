//! The room at one instant: every track's samples moved there, fused joint by joint.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{
    Confidence, HandVotes, JOINT_COUNT, Joint, JointState, Position, Provenance, RoomFrame,
    SensorId, SensorSet, Skeleton, Timestamp, Track,
};

use super::track::{JointEstimate, Source};
use super::{Origins, People, TrackState, VELOCITY_DECAY_S, View, median};
use crate::config::{Config, FuseMethod};
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
        self.scratch.parts.clear();
        for track in &mut self.tracks {
            let elapsed_s = time.since_seconds(track.pose_time).max(0.0);
            let weigh = track.weigh_facing(elapsed_s);
            let scratch = &mut self.scratch;
            match config.fuse.method {
                FuseMethod::Kalman => {
                    track.filter_to(time, origins, config, scratch);
                }
                FuseMethod::Average | FuseMethod::Weighted => {
                    track.fuse_at(time, origins, config, &mut scratch.sightings);
                }
            }
            track.report_residuals(time, origins, config, &mut residual);
            if config.fuse.swaps && weigh && track.settle_facing(time) {
                self.flipped.extend(track.id);
            }
        }
        self.merge(time, &config.associate);
        self.give_ids(time, &config.associate);
        let show_ns = config.associate.show_ns();
        let max_age_ns = config.intake.max_age_ns();
        let mut shown: Vec<Track> = self
            .tracks
            .iter()
            .filter(|t| time.since_ns(t.last_seen) <= show_ns && !t.is_nowhere())
            .filter_map(|t| t.shown(time, show_ns, max_age_ns))
            .collect();
        shown.sort_unstable_by_key(|track| track.id);
        shown
    }

    /// Puts the joints of earlier `frames` (oldest first) where they look to have been by now.
    pub(crate) fn look_back(&self, frames: &mut [RoomFrame]) {
        let (Some(oldest), Some(newest)) = (frames.first(), frames.last()) else {
            return;
        };
        let span = oldest.time..=newest.time;
        for track in &self.tracks {
            let Some(id) = track.id else {
                continue;
            };
            track
                .filter
                .look_back(&span, |time, joint, place, covariance| {
                    let frame = frames.binary_search_by_key(&time, |frame| frame.time);
                    let shown = frame.ok().and_then(|at| {
                        let mut tracks = frames[at].tracks.iter_mut();
                        tracks.find(|shown| shown.id == id)
                    });
                    if let Some(state) = shown.and_then(|shown| shown.skeleton[joint].as_mut()) {
                        state.position = Position::from_vector(place);
                        state.covariance = covariance;
                    }
                });
        }
    }
}

impl TrackState {
    /// As the outside sees it at `time`, if it is a person: the joints seen within `show_ns`, the hands within
    /// `max_age_ns`.
    fn shown(&self, time: Timestamp, show_ns: i64, max_age_ns: i64) -> Option<Track> {
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
            hands: self.hands(time, max_age_ns),
        })
    }

    /// What the sensors say of the hands at `time`.
    fn hands(&self, time: Timestamp, max_age_ns: i64) -> [Option<HandVotes>; 2] {
        [0, 1].map(|side| {
            let (mut sum, mut sensors) = (0.0, 0u8);
            let views = self.sources.iter();
            for view in views.filter_map(|source| source.view(time, max_age_ns)) {
                if let Some(closed) = view.hand_closed(side) {
                    sum += closed;
                    sensors += 1;
                }
            }
            (sensors > 0).then(|| HandVotes {
                closed: Confidence::saturating(sum / f32::from(sensors)),
                sensors,
            })
        })
    }

    /// Moves the pose to `time`: joints that were seen are fused, the others carried on for a while.
    fn fuse_at(
        &mut self,
        time: Timestamp,
        origins: &Origins,
        config: &Config,
        sightings: &mut Vec<Sighting>,
    ) {
        let elapsed_s = time.since_seconds(self.pose_time);
        let max_age_ns = config.intake.max_age_ns();
        let Self { sources, pose, .. } = self;
        let seen: Vec<Seen> = views(sources, time, origins, max_age_ns).collect();
        let mut used = SensorSet::EMPTY;
        for (index, known) in pose.iter_mut().enumerate() {
            let velocity = known.as_ref().map_or_else(Vector3::zeros, |k| k.velocity);
            sightings.clear();
            sightings.extend(seen.iter().filter_map(|(sensor, origin, view)| {
                let (position, confidence, age_s) = view.joint(index, velocity)?;
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
        self.sensors = used;
        self.pose_time = time;
    }

    /// Each sensor's median distance to the pose, trusted joints only.
    fn report_residuals(
        &self,
        time: Timestamp,
        origins: &Origins,
        config: &Config,
        residual: &mut impl FnMut(SensorId, f64),
    ) {
        let max_age_ns = config.intake.max_age_ns();
        for (sensor, _, view) in views(&self.sources, time, origins, max_age_ns) {
            let mut distances = [0.0; JOINT_COUNT];
            let mut count = 0;
            for (index, known) in self.pose.iter().enumerate() {
                let Some(known) = known else {
                    continue;
                };
                let seen = view.joint(index, known.velocity);
                if let Some((position, confidence, _)) = seen
                    && confidence >= config.fuse.min_confidence
                {
                    distances[count] = (position - known.position).norm();
                    count += 1;
                }
            }
            if let Some(median) = median(&mut distances[..count]) {
                residual(sensor, median);
            }
        }
    }
}

/// Each source's view at `time`, where the sensor's place is known.
fn views<'a>(
    sources: &'a [Source],
    time: Timestamp,
    origins: &'a Origins,
    max_age_ns: i64,
) -> impl Iterator<Item = Seen<'a>> {
    sources.iter().filter_map(move |source| {
        Some((
            source.sensor,
            origins[source.sensor.index()]?,
            source.view(time, max_age_ns)?,
        ))
    })
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
