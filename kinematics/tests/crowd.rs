//! A room of people, live: rigs that settle, people who come and go.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod support;

use std::sync::Arc;

use posefuse_kinematics::{Body, Config, Crowd, Figure};
use posefuse_simulator::motion::Performance;
use posefuse_skeleton::{Joint, RoomFrame, Timestamp, Track, TrackId};
use support::{RATE_HZ, at, mean_error, noise, noisy, performance};

fn frame(number: usize, tracks: Vec<Track>) -> RoomFrame {
    RoomFrame {
        number: number as u64,
        time: at(number),
        look_ahead_ns: 0,
        tracks,
    }
}

/// A person at this frame, 10 mm off.
fn track(person: &Performance, id: u64, number: usize, shake: impl FnMut() -> f64) -> Track {
    let mut track = noisy(&person.pose(0, number as f64 / RATE_HZ), 0.010, shake);
    track.id = TrackId(id);
    track
}

#[test]
fn rigs_settle_and_bones_have_the_rigs_lengths_all_the_time() {
    let person = performance(2);
    let mut crowd = Crowd::new(Config::default());
    let mut shake = noise(0.010, 5);
    let mut last: Option<Figure> = None;
    let mut changes = Vec::new();
    for number in 0..40 * RATE_HZ as usize {
        let room = frame(number, vec![track(&person, 7, number, &mut shake)]);
        let Some(figure) = crowd.step(&room).pop() else {
            assert!(number < 9, "no figure in frame {number}");
            continue;
        };
        assert!(number >= 9, "a figure from {} frames", number + 1);
        assert_eq!(figure.id, TrackId(7));
        let placed = figure.rig.place(&figure.pose);
        for (bone, (origin, _)) in figure.rig.bones.iter().zip(&placed) {
            if let Some(parent) = bone.parent {
                let length = origin.distance(placed[parent].0);
                assert!((length - bone.offset.norm()).abs() < 1e-9, "{}", bone.name);
            }
            if let Some(joint) = bone.joint {
                assert!(figure.joints[joint].unwrap().distance(*origin) < 1e-9);
            }
        }
        if let Some(last) = &last {
            let same = Arc::ptr_eq(&last.rig, &figure.rig);
            assert_eq!(same, last.revision == figure.revision, "frame {number}");
            if !same {
                assert_eq!(figure.revision, last.revision + 1);
                changes.push(number as f64 / RATE_HZ);
            }
            let moved = mean_error(&last.joints, &figure.joints);
            assert!(moved < 0.12, "{moved} m in frame {number}");
        }
        last = Some(figure);
    }
    assert!(!changes.is_empty() && changes.len() <= 5, "{changes:?}");
    assert!(changes.iter().all(|s| *s < 16.1), "{changes:?}");
    let body = crowd.body(TrackId(7)).unwrap();
    let thigh = person.shape(0).unwrap().thigh;
    assert!((body.legs[0].upper - thigh).abs() < 0.015);
}

#[test]
fn people_come_and_go_and_are_forgotten() {
    let people = [performance(1), performance(2)];
    let mut crowd = Crowd::new(Config::default());
    let mut seen = Vec::new();
    for number in 0..900 {
        // The second comes after 2 s and leaves after 5; after 29 s, long forgotten, they are back.
        let there = [true, (60..150).contains(&number) || number >= 870];
        let tracks = (0..2)
            .filter(|&index| there[index])
            .map(|index| track(&people[index], index as u64 + 1, number, || 0.0))
            .collect();
        let ids: Vec<u64> = crowd
            .step(&frame(number, tracks))
            .iter()
            .map(|figure| figure.id.0)
            .collect();
        seen.push(ids);
    }
    assert_eq!(seen[8], [0u64; 0]);
    assert_eq!(seen[9], [1]);
    assert_eq!(seen[68], [1]);
    assert_eq!(seen[69], [1, 2]);
    assert_eq!(seen[150], [1]);
    assert_eq!(seen[870], [1], "forgotten, so learned anew");
    assert_eq!(seen[899], [1, 2]);
}

#[test]
fn a_body_that_is_told_needs_no_learning_and_stays() {
    let person = performance(3);
    let told = Body::of_height(1.5);
    let mut crowd = Crowd::new(Config::default());
    crowd.set_body(TrackId(4), &told);
    for number in 0..90 {
        let room = frame(number, vec![track(&person, 4, number, || 0.0)]);
        let figure = crowd.step(&room).pop().unwrap();
        assert_eq!(figure.revision, 0);
        assert_eq!(*figure.rig, told.rig());
    }
    crowd.set_body(TrackId(4), &Body::of_height(1.8));
    let room = frame(90, vec![track(&person, 4, 90, || 0.0)]);
    assert_eq!(crowd.step(&room).pop().unwrap().revision, 1);
}

#[test]
fn memory_is_bounded_and_another_clock_begins_anew() {
    let person = performance(1);
    let mut crowd = Crowd::new(Config::default());
    // Somebody new in every frame: 3 of 100 in view are known.
    for number in 0..200 {
        crowd.set_body(TrackId(number), &Body::of_height(1.7));
        crowd.step(&frame(
            number as usize,
            vec![track(&person, number, number as usize, || 0.0)],
        ));
    }
    let known = (0..200).filter(|id| crowd.body(TrackId(*id)).is_some());
    assert_eq!(known.count(), 65, "64 that are gone and one in view");
    let mut room = frame(0, vec![track(&person, 199, 0, || 0.0)]);
    room.time = Timestamp::ZERO;
    assert!(crowd.step(&room).is_empty(), "learned anew");
    assert!(room.tracks[0].skeleton[Joint::Head].is_some());
}
