//! What sensors say of hands reaches the people: as votes, on the right side, of those sensors only that said something.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, Engine, Input};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Confidence, HandVotes, RoomFrame, Timestamp};
use support::{Outcome, drive, inputs_and_truth};

const SECONDS: f64 = 5.0;

fn said(probability: f32) -> Option<Confidence> {
    Some(Confidence::new(probability).unwrap())
}

/// Everybody's left hand is closed: three of four sensors say so with these probabilities, and of the right one nothing.
fn voted(votes: [f32; 3]) -> [Vec<(Timestamp, Input)>; 2] {
    let scenario = Scenario {
        seed: 4,
        sensors: 4,
        people: 2,
        ..Scenario::default()
    };
    let world = Arc::new(World::new(&scenario).unwrap());
    let mut swapped = Vec::new();
    let silent = inputs_and_truth(&world, SECONDS, &mut |sensor, frame, truth| {
        let sides: Vec<bool> = truth.iter().map(|body| body.swapped[0]).collect();
        swapped.push((sensor, frame.number, sides));
    });
    let mut loud = silent.clone();
    for (_, input) in &mut loud {
        let Input::Observation(observation) = input else {
            continue;
        };
        let sensor = observation.sensor.index();
        let key = |(number, frame, _): &&(usize, u64, Vec<bool>)| {
            *number == sensor && *frame == observation.sequence
        };
        let (_, _, sides) = swapped.iter().find(key).unwrap();
        for (body, swapped) in observation.bodies.iter_mut().zip(sides) {
            // A sensor that takes a person's back for the front exchanges hands, too.
            let side = usize::from(*swapped);
            body.hands_closed[side] = votes.get(sensor).and_then(|vote| said(*vote));
        }
    }
    [silent, loud]
}

fn fused(events: Vec<(Timestamp, Input)>) -> Vec<RoomFrame> {
    let mut outcome = Outcome::default();
    let mut engine = Engine::new(Config::default());
    drive(&mut engine, events, &mut outcome);
    outcome.frames
}

#[test]
fn votes_are_gathered_and_change_nothing_else() {
    let [silent, loud] = voted([0.9, 0.8, 0.7]);
    let (silent, loud) = (fused(silent), fused(loud));
    let (mut people, mut left, mut right, mut all) = (0, 0, 0, 0);
    for (without, with) in silent.iter().zip(&loud) {
        for track in &with.tracks {
            people += 1;
            left += usize::from(track.hands[0].is_some());
            right += usize::from(track.hands[1].is_some());
            if let Some(HandVotes { closed, sensors: 3 }) = track.hands[0] {
                all += 1;
                assert!((closed.get() - 0.8).abs() < 1e-6, "{closed:?}");
            }
        }
        let mut with = with.clone();
        for track in &mut with.tracks {
            track.hands = [None; 2];
        }
        assert_eq!(*without, with);
    }
    assert_eq!(silent.len(), loud.len());
    assert!(people > 200, "{people}");
    assert!(left > people * 95 / 100, "{left} of {people}");
    assert!(right < people / 50, "{right} of {people} on the wrong side");
    assert!(all > people / 3, "{all} of {people} seen by all three");
}

#[test]
fn nobody_says_anything_of_hands_and_nothing_is_known() {
    let [silent, _] = voted([0.0; 3]);
    let frames = fused(silent);
    assert!(frames.iter().any(|frame| !frame.tracks.is_empty()));
    let mut tracks = frames.iter().flat_map(|frame| &frame.tracks);
    assert!(tracks.all(|track| track.hands == [None; 2]));
}
