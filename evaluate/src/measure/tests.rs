//! Laws of the metrics: a perfect run is perfect, and a known fault gives a known figure.

use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_simulator::{Scenario, SensorErrors, TruePerson, World};
use posefuse_skeleton::{
    Confidence, Joint, JointState, Position, Room, RoomFrame, SensorId, SensorSet, Timestamp,
    Track, TrackId,
};

use super::*;
use crate::metrics::Metrics;
use crate::room::SimulatedRoom;
use crate::truth::SimulatedTruth;

const SECONDS: f64 = 12.0;
const RATE_HZ: f64 = 30.0;
/// Seconds as f64 and nanoseconds are not quite the same.
const NOTHING: f64 = 1e-4;

fn world(people: usize) -> Arc<World> {
    let scenario = Scenario {
        people,
        seed: 3,
        errors: SensorErrors::none(),
        ..Scenario::default()
    };
    Arc::new(World::new(&scenario).unwrap())
}

fn frame(number: usize, time: Timestamp, people: &[TruePerson]) -> RoomFrame {
    let sensor = SensorId::new(0).unwrap();
    let track = |person: &TruePerson| Track {
        id: TrackId(person.id),
        since: Timestamp::ZERO,
        sensors: SensorSet::only(sensor),
        skeleton: person
            .joints
            .map(|_, p| JointState::measured(*p, 0.01, Confidence::FULL, sensor)),
        hands: [None; 2],
    };
    RoomFrame {
        number: number as u64,
        time,
        look_ahead_ns: 33_000_000,
        tracks: people.iter().map(track).collect(),
    }
}

/// What a sensor at rate 30 Hz without any error would have fused `late_s` too late.
fn frames(world: &World, late_s: f64) -> Vec<RoomFrame> {
    (0..(SECONDS * RATE_HZ) as usize)
        .map(|i| {
            let seconds = 1.0 + i as f64 / RATE_HZ;
            let people = world.truth(seconds - late_s);
            frame(i, SimulatedRoom::server_time(seconds), &people)
        })
        .collect()
}

fn judged(world: &Arc<World>, frames: &[RoomFrame]) -> Metrics {
    let truth = SimulatedTruth::new(world, SECONDS + 2.0);
    Metrics::from(&measure(frames, &truth, Timestamp::ZERO))
}

/// Moves a joint of everybody in the frames from `first` on, `count` of them.
fn displace(frames: &mut [RoomFrame], joint: Joint, first: usize, count: usize, by: Vector3<f64>) {
    for frame in frames.iter_mut().skip(first).take(count) {
        for track in &mut frame.tracks {
            if let Some(state) = &mut track.skeleton[joint] {
                state.position = state.position.moved(by);
            }
        }
    }
}

#[test]
fn the_truth_has_no_fault() {
    let world = world(2);
    let found = judged(&world, &frames(&world, 0.0));
    for spread in [found.error, found.error_visible, found.own_error] {
        assert!(spread.mean_mm.unwrap() < NOTHING && spread.p95_mm.unwrap() < NOTHING);
    }
    assert!(found.lag_ms.unwrap().abs() < NOTHING, "{found:?}");
    assert!(found.jitter_mps2.unwrap() < NOTHING);
    assert!(found.wrist_absolute_cm.unwrap() < NOTHING);
    assert!(found.wrist_shortest_cm.unwrap() < NOTHING);
    assert_eq!(found.spikes_per_min, Some(0.0));
    assert_eq!(found.deviations_per_min, Some(0.0));
    assert_eq!((found.id_switches, found.people_missed), (0, Some(0.0)));
    assert_eq!(
        (found.tracks_extra, found.sides_right),
        (Some(0.0), Some(1.0))
    );
    assert_eq!(found.joints_missing, Some(0.0));
    assert!((found.look_ahead_ms.unwrap() - 33.0).abs() < 1e-9);
    assert!((found.person_seconds - 2.0 * SECONDS).abs() < 0.1);
    // The simulator's people bend; their bones do not stretch.
    assert!(found.bone_sigma_mm.unwrap() < 8.0, "{found:?}");
}

#[test]
fn a_shift_in_time_is_found_as_lag_and_nearly_forgiven_by_the_shortest_distance() {
    let world = world(1);
    for late_ms in [-40.0, 15.0, 70.0] {
        let found = judged(&world, &frames(&world, late_ms * 1e-3));
        let lag = found.lag_ms.unwrap();
        assert!((lag - late_ms).abs() < 2.0, "{late_ms}: {lag}");
        let (absolute, shortest) = (
            found.wrist_absolute_cm.unwrap(),
            found.wrist_shortest_cm.unwrap(),
        );
        assert!(shortest < 0.5 * absolute, "{absolute} {shortest}");
    }
}

#[test]
fn a_constant_displacement_is_an_error_of_its_size_and_nothing_else() {
    let world = world(1);
    let mut moved = frames(&world, 0.0);
    for joint in Joint::ALL {
        displace(
            &mut moved,
            joint,
            0,
            usize::MAX,
            Vector3::new(0.0, 0.03, 0.04),
        );
    }
    let found = judged(&world, &moved);
    assert!((found.error.mean_mm.unwrap() - 50.0).abs() < NOTHING);
    assert!((found.error.rms_mm.unwrap() - 50.0).abs() < NOTHING);
    assert!((found.error.p95_mm.unwrap() - 50.0).abs() < 0.5);
    assert!(found.jitter_mps2.unwrap() < NOTHING);
    assert_eq!(found.spikes_per_min, Some(0.0));
    assert!(found.lag_ms.unwrap().abs() < 10.0, "{found:?}");
}

#[test]
fn shaking_by_a_known_amount_is_a_known_jitter() {
    let world = world(1);
    let mut shaken = frames(&world, 0.0);
    let by = 0.002;
    for (index, frame) in shaken.iter_mut().enumerate() {
        let sign = if index % 2 == 0 { by } else { -by };
        for joint in Joint::ALL {
            displace(
                std::slice::from_mut(frame),
                joint,
                0,
                1,
                Vector3::x() * sign,
            );
        }
    }
    // Second difference of +d, -d, +d is 4 d.
    let expected = 4.0 * by * RATE_HZ * RATE_HZ;
    let found = judged(&world, &shaken).jitter_mps2.unwrap();
    assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
}

#[test]
fn a_jump_counts_once_as_a_spike_and_a_long_one_as_a_deviation_too() {
    let world = world(1);
    let per_minute = 60.0 / SECONDS;
    let mut jumped = frames(&world, 0.0);
    displace(&mut jumped, Joint::HandLeft, 50, 3, Vector3::z() * 0.15);
    displace(&mut jumped, Joint::Head, 50, 3, Vector3::z() * 0.08);
    let found = judged(&world, &jumped);
    assert!(
        (found.spikes_per_min.unwrap() - per_minute).abs() < 0.1,
        "{found:?}"
    );
    assert_eq!(found.deviations_per_min, Some(0.0));

    let mut stayed = frames(&world, 0.0);
    displace(&mut stayed, Joint::HandLeft, 50, 40, Vector3::z() * 0.25);
    let found = judged(&world, &stayed);
    // Away and back.
    assert!(
        (found.spikes_per_min.unwrap() - 2.0 * per_minute).abs() < 0.1,
        "{found:?}"
    );
    assert!(
        (found.deviations_per_min.unwrap() - per_minute).abs() < 0.1,
        "{found:?}"
    );
}

#[test]
fn mirrored_people_missed_people_and_changed_numbers_are_counted() {
    let world = world(2);
    let mut wrong = frames(&world, 0.0);
    let count = wrong.len();
    for (index, frame) in wrong.iter_mut().enumerate() {
        if index >= count / 2 {
            frame.tracks[0].id = TrackId(17);
        }
        let track = &mut frame.tracks[0];
        if index % 4 == 0 {
            let before = track.skeleton.clone();
            track.skeleton = before.map(|joint, state| JointState {
                position: before.position(joint.mirrored()).unwrap(),
                ..*state
            });
        }
        if index % 10 == 0 {
            frame.tracks.truncate(1);
        }
        if index % 5 == 0 {
            let mut ghost = frame.tracks[0].clone();
            ghost.id = TrackId(99);
            ghost.skeleton = ghost.skeleton.map(|_, state| JointState {
                position: Position::<Room>::from_vector(
                    state.position.vector() + Vector3::x() * 9.0,
                ),
                ..*state
            });
            frame.tracks.push(ghost);
        }
    }
    let found = judged(&world, &wrong);
    assert_eq!(found.id_switches, 1);
    let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 0.005;
    assert!(near(found.people_missed, 0.05), "{found:?}");
    assert!(near(found.tracks_extra, 0.2 / 2.1), "{found:?}");
    // One of two people in a quarter of the frames; the other one is missed in a tenth.
    assert!(near(found.sides_right, 1.0 - 0.25 / 1.9), "{found:?}");
}

#[test]
fn joints_without_a_place_are_missing_and_not_wrong() {
    let world = world(1);
    let mut bare = frames(&world, 0.0);
    for frame in &mut bare {
        frame.tracks[0].skeleton[Joint::Head] = None;
    }
    let found = judged(&world, &bare);
    assert!((found.joints_missing.unwrap() - 0.04).abs() < 1e-9);
    assert!(found.error.mean_mm.unwrap() < NOTHING);
}
