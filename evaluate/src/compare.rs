//! Compares fused frames with the truth.

use posefuse_skeleton::{JointMap, RoomFrame, TrackId};

use posefuse_simulator::TruePerson;

/// How one fused frame compares with the truth of the same instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Tracks and the people they belong to.
    pub pairs: Vec<Pair>,
    /// People without a track, by id.
    pub missed: Vec<u64>,
    /// Tracks without a person.
    pub extra: Vec<TrackId>,
}

/// A track and the person it follows.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The person's id.
    pub person: u64,
    /// The track's id.
    pub track: TrackId,
    /// Distance of each joint that both have, metres.
    pub errors: JointMap<f64>,
}

/// A track further than this from a person (mean over the joints) does not follow them, metres.
pub const FURTHEST_MATCH_M: f64 = 0.7;

/// Pairs tracks with people, nearest first, and gives the distance of each joint.
pub fn compare(frame: &RoomFrame, truth: &[TruePerson]) -> Comparison {
    let mut candidates: Vec<(f64, usize, usize, JointMap<f64>)> = Vec::new();
    for (p, person) in truth.iter().enumerate() {
        for (t, track) in frame.tracks.iter().enumerate() {
            let errors = person.joints.filter_map(|joint, position| {
                Some(track.skeleton.position(joint)?.distance(*position))
            });
            if let Some(mean) = mean(errors.iter().map(|(_, error)| *error))
                && mean <= FURTHEST_MATCH_M
            {
                candidates.push((mean, p, t, errors));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut people, mut tracks) = (vec![false; truth.len()], vec![false; frame.tracks.len()]);
    let mut comparison = Comparison::default();
    for (_, p, t, errors) in candidates {
        if !people[p] && !tracks[t] {
            (people[p], tracks[t]) = (true, true);
            comparison.pairs.push(Pair {
                person: truth[p].id,
                track: frame.tracks[t].id,
                errors,
            });
        }
    }
    let alone = |taken: &[bool], i: usize| !taken[i];
    comparison.missed = (0..truth.len())
        .filter(|&p| alone(&people, p))
        .map(|p| truth[p].id)
        .collect();
    comparison.extra = (0..frame.tracks.len())
        .filter(|&t| alone(&tracks, t))
        .map(|t| frame.tracks[t].id)
        .collect();
    comparison
}

impl Comparison {
    /// Mean per-joint position error over all pairs, metres; `None` without any pair.
    pub fn mpjpe_m(&self) -> Option<f64> {
        mean(
            self.pairs
                .iter()
                .flat_map(|pair| pair.errors.iter().map(|(_, error)| *error)),
        )
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::{Confidence, JointState, SensorId, SensorSet, Timestamp, Track};

    use super::*;
    use posefuse_simulator::{Scenario, World};

    fn track(id: u64, person: &TruePerson, offset: nalgebra::Vector3<f64>) -> Track {
        let sensor = SensorId::new(0).unwrap();
        Track {
            id: TrackId(id),
            since: Timestamp::ZERO,
            sensors: SensorSet::only(sensor),
            skeleton: person.joints.map(|_, position| {
                JointState::measured(position.moved(offset), 0.01, Confidence::FULL, sensor)
            }),
            hands: [None; 2],
        }
    }

    #[test]
    fn tracks_find_their_people_and_the_rest_is_named() {
        let scenario = Scenario {
            people: 3,
            ..Scenario::default()
        };
        let truth = World::new(&scenario).unwrap().truth(0.0);
        let frame = RoomFrame {
            number: 0,
            time: Timestamp::ZERO,
            look_ahead_ns: 0,
            tracks: vec![
                track(7, &truth[2], nalgebra::Vector3::new(0.0, 0.0, 0.03)),
                track(8, &truth[0], nalgebra::Vector3::new(0.01, 0.0, 0.0)),
                track(9, &truth[0], nalgebra::Vector3::new(0.0, 0.0, 9.0)),
            ],
        };
        let comparison = compare(&frame, &truth);
        let pairs: Vec<_> = comparison
            .pairs
            .iter()
            .map(|p| (p.person, p.track.0))
            .collect();
        assert_eq!(pairs, [(1, 8), (3, 7)]);
        assert_eq!(comparison.missed, [2]);
        assert_eq!(comparison.extra, [TrackId(9)]);
        assert!((comparison.mpjpe_m().unwrap() - 0.02).abs() < 1e-12);
    }
}
