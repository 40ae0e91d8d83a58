//! Fused frames to and from the wire.

use nalgebra::Matrix3;
use posefuse_skeleton::{
    Confidence, HandVotes, JOINT_COUNT, Joint, JointState, Position, Provenance, RoomFrame,
    SensorSet, Skeleton, Timestamp, Track, TrackId,
};

use super::WireError;
use crate::v1;

/// Row and column of the six numbers that make a covariance.
const TRIANGLE: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// A fused frame as the wire says it.
pub fn room_frame_to_wire(frame: &RoomFrame) -> v1::RoomFrame {
    v1::RoomFrame {
        number: frame.number,
        time_ns: frame.time.ns(),
        look_ahead_ns: frame.look_ahead_ns,
        tracks: frame.tracks.iter().map(track_to_wire).collect(),
        unix_ns: 0,
        timecode: String::new(),
    }
}

/// A fused frame from the wire, checked.
pub fn room_frame_from_wire(frame: &v1::RoomFrame) -> Result<RoomFrame, WireError> {
    Ok(RoomFrame {
        number: frame.number,
        time: Timestamp::from_ns(frame.time_ns),
        look_ahead_ns: frame.look_ahead_ns,
        tracks: frame
            .tracks
            .iter()
            .map(track_from_wire)
            .collect::<Result<_, _>>()?,
    })
}

fn track_to_wire(track: &Track) -> v1::Track {
    let mut wire = v1::Track {
        id: track.id.0,
        since_ns: track.since.ns(),
        sensors: track.sensors.bits(),
        positions: Vec::with_capacity(3 * JOINT_COUNT),
        covariances: Vec::with_capacity(6 * JOINT_COUNT),
        confidences: Vec::with_capacity(JOINT_COUNT),
        provenances: Vec::with_capacity(JOINT_COUNT),
        joint_sensors: Vec::with_capacity(JOINT_COUNT),
        hands_closed: Vec::new(),
        hands_sensors: Vec::new(),
    };
    if track.hands != [None; 2] {
        for hand in track.hands {
            let votes = hand.map_or((0.0, 0), |votes| (votes.closed.get(), votes.sensors));
            wire.hands_closed.push(votes.0);
            wire.hands_sensors.push(votes.1.into());
        }
    }
    for joint in Joint::ALL {
        let Some(state) = &track.skeleton[joint] else {
            wire.positions.extend([0.0; 3]);
            wire.covariances.extend([0.0; 6]);
            wire.confidences.push(0.0);
            wire.provenances.push(v1::Provenance::Missing.into());
            wire.joint_sensors.push(0);
            continue;
        };
        wire.positions
            .extend(state.position.vector().iter().map(|v| *v as f32));
        wire.covariances
            .extend(TRIANGLE.map(|place| state.covariance[place] as f32));
        wire.confidences.push(state.confidence.get());
        wire.provenances
            .push(provenance_to_wire(state.provenance).into());
        wire.joint_sensors.push(state.provenance.sensors().bits());
    }
    wire
}

fn provenance_to_wire(provenance: Provenance) -> v1::Provenance {
    match provenance {
        Provenance::Measured(_) => v1::Provenance::Measured,
        Provenance::Predicted(_) => v1::Provenance::Predicted,
        Provenance::Repaired => v1::Provenance::Repaired,
    }
}

fn track_from_wire(wire: &v1::Track) -> Result<Track, WireError> {
    let need = |field, found: usize, per_joint: usize| {
        let wrong = WireError::Track {
            track: wire.id,
            field,
        };
        if found == per_joint * JOINT_COUNT {
            Ok(())
        } else {
            Err(wrong)
        }
    };
    need("positions", wire.positions.len(), 3)?;
    need("covariances", wire.covariances.len(), 6)?;
    need("confidences", wire.confidences.len(), 1)?;
    need("provenances", wire.provenances.len(), 1)?;
    need("joint_sensors", wire.joint_sensors.len(), 1)?;
    let mut skeleton = Skeleton::empty();
    for joint in Joint::ALL {
        skeleton[joint] = joint_from_wire(wire, joint as usize)?;
    }
    Ok(Track {
        id: TrackId(wire.id),
        since: Timestamp::from_ns(wire.since_ns),
        sensors: SensorSet::from_bits(wire.sensors),
        skeleton,
        hands: hands_from_wire(wire)?,
    })
}

fn hands_from_wire(wire: &v1::Track) -> Result<[Option<HandVotes>; 2], WireError> {
    let hand = |closed: f32, sensors: u32| {
        let sensors = u8::try_from(sensors).unwrap_or(u8::MAX);
        let closed = Confidence::new(closed).ok().filter(|_| sensors > 0)?;
        Some(HandVotes { closed, sensors })
    };
    match (&wire.hands_closed[..], &wire.hands_sensors[..]) {
        ([], []) => Ok([None; 2]),
        (&[left, right], &[of_left, of_right]) => Ok([hand(left, of_left), hand(right, of_right)]),
        _ => Err(WireError::TrackHands { track: wire.id }),
    }
}

fn joint_from_wire(
    wire: &v1::Track,
    index: usize,
) -> Result<Option<JointState<posefuse_skeleton::Room>>, WireError> {
    let sensors = SensorSet::from_bits(wire.joint_sensors[index]);
    let provenance = match v1::Provenance::try_from(wire.provenances[index]) {
        Ok(v1::Provenance::Missing) => return Ok(None),
        Ok(v1::Provenance::Measured) => Provenance::Measured(sensors),
        Ok(v1::Provenance::Predicted) => Provenance::Predicted(sensors),
        Ok(v1::Provenance::Repaired) => Provenance::Repaired,
        _ => {
            return Err(WireError::Track {
                track: wire.id,
                field: "provenances",
            });
        }
    };
    let xyz = &wire.positions[3 * index..3 * index + 3];
    let mut covariance = Matrix3::zeros();
    for ((row, column), value) in TRIANGLE
        .into_iter()
        .zip(&wire.covariances[6 * index..6 * index + 6])
    {
        covariance[(row, column)] = f64::from(*value);
        covariance[(column, row)] = f64::from(*value);
    }
    Ok(Some(JointState {
        position: Position::new(xyz[0].into(), xyz[1].into(), xyz[2].into()),
        covariance,
        confidence: Confidence::saturating(wire.confidences[index]),
        provenance,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_comes_back_and_a_short_one_is_refused() {
        let mut skeleton = Skeleton::empty();
        let sensors = SensorSet::from_bits(0b101);
        for (joint, provenance) in [
            (Joint::Head, Provenance::Measured(sensors)),
            (Joint::HandLeft, Provenance::Predicted(sensors)),
            (Joint::FootRight, Provenance::Repaired),
        ] {
            let covariance = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, 0.25, 0.5, 0.25, 2.0);
            let confidence = Confidence::new(0.75).unwrap();
            let position = Position::new(0.5, -1.25, 1.75);
            skeleton[joint] = Some(JointState {
                position,
                covariance,
                confidence,
                provenance,
            });
        }
        let since = Timestamp::from_ns(12);
        let frame = RoomFrame {
            number: 3,
            time: Timestamp::from_ns(99),
            look_ahead_ns: 33,
            tracks: vec![Track {
                id: TrackId(5),
                since,
                sensors,
                skeleton,
                hands: [
                    None,
                    Some(HandVotes {
                        closed: Confidence::new(0.25).unwrap(),
                        sensors: 3,
                    }),
                ],
            }],
        };
        let mut wire = room_frame_to_wire(&frame);
        assert_eq!(room_frame_from_wire(&wire).unwrap(), frame);
        wire.tracks[0].hands_sensors.pop();
        let error = room_frame_from_wire(&wire).unwrap_err().to_string();
        assert!(error.contains("hands_sensors"), "{error}");
        wire.tracks[0].hands_sensors.clear();
        wire.tracks[0].hands_closed.clear();
        let older = room_frame_from_wire(&wire).unwrap();
        assert_eq!(older.tracks[0].hands, [None; 2], "before hands were told");
        wire.tracks[0].positions.pop();
        let error = room_frame_from_wire(&wire).unwrap_err().to_string();
        assert!(
            error.contains("track 5") && error.contains("positions"),
            "{error}"
        );
    }
}
