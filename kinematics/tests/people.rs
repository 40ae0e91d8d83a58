//! Simulated people with their truth: lengths, accuracy, feet, hands.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod support;

use posefuse_kinematics::{Body, Config, HandFilter, HandsConfig, Solver};
use posefuse_skeleton::{Confidence, HandVotes, Joint, Position, Room, Track};
use support::{RATE_HZ, at, body, exact, mean_error, noise, noisy, performance};

#[test]
fn lengths_are_learned_through_noise_and_outliers() {
    for seed in 1..4 {
        let person = performance(seed);
        let shape = person.shape(0).unwrap();
        let mut shake = noise(0.015, seed);
        let tracks: Vec<Track> = (0..900)
            .map(|frame| {
                let mut track = noisy(&person.pose(0, frame as f64 / RATE_HZ), 0.015, &mut shake);
                if frame % 10 == 0
                    && let Some(state) = &mut track.skeleton[Joint::KneeLeft]
                {
                    let at: Position<Room> = state.position;
                    state.position = at.moved(nalgebra::Vector3::new(0.3, 0.0, 0.0));
                }
                track
            })
            .collect();
        let learned = Body::learn(&tracks);
        let pairs = [
            (learned.legs[0].upper, shape.thigh),
            (learned.legs[1].lower, shape.shin),
            (learned.arms[0].upper, shape.upper_arm),
            (learned.arms[1].lower, shape.forearm),
            (learned.lower_spine, shape.lower_spine),
            (learned.upper_spine, shape.upper_spine),
            (learned.arms[0].shoulder, shape.shoulder_half),
            (learned.ankle_height, shape.ankle_height),
        ];
        for (index, (found, truth)) in pairs.into_iter().enumerate() {
            assert!(
                (found - truth).abs() < 0.012,
                "seed {seed}, {index}: {found} {truth}"
            );
        }
    }
}

#[test]
fn unseen_lengths_follow_from_the_seen_ones() {
    let person = performance(1);
    let shape = person.shape(0).unwrap();
    let tracks: Vec<Track> = (0..60)
        .map(|frame| {
            let mut track = exact(&person.pose(0, frame as f64 / RATE_HZ));
            for joint in [
                Joint::WristLeft,
                Joint::WristRight,
                Joint::AnkleLeft,
                Joint::AnkleRight,
            ] {
                track.skeleton[joint] = None;
            }
            track
        })
        .collect();
    let learned = Body::learn(&tracks);
    assert!((learned.arms[0].lower / shape.forearm - 1.0).abs() < 0.12);
    assert!((learned.legs[0].lower / shape.shin - 1.0).abs() < 0.12);
}

/// Frames of a person with noise, solved; mean errors before and after, and how far standing ankles moved.
fn run(config: &Config, sigma_m: f64) -> (f64, f64, [f64; 2]) {
    let person = performance(1);
    let mut solver = Solver::new(&body(&person), config.clone());
    let mut shake = noise(sigma_m, 9);
    let (mut raw, mut made, mut skate) = (0.0, 0.0, [0.0; 2]);
    let mut before: Option<[Position<Room>; 2]> = None;
    let frames = 600;
    for frame in 0..frames {
        let time = frame as f64 / RATE_HZ;
        let truth = person.pose(0, time);
        let track = noisy(&truth, sigma_m, &mut shake);
        let seen = track.skeleton.map(|_, state| state.position);
        let solved = solver.step(&track, at(frame)).unwrap();
        raw += mean_error(&seen, &truth) / frames as f64;
        made += mean_error(&solved.joints, &truth) / frames as f64;
        let ankle = Joint::AnkleLeft;
        let now = [seen[ankle].unwrap(), solved.joints[ankle].unwrap()];
        let stands = |time: f64| person.feet_standing(0, time).unwrap()[0];
        if let Some(before) = before
            && stands(time)
            && stands(time - 1.0 / RATE_HZ)
        {
            for (skate, (a, b)) in skate.iter_mut().zip(before.iter().zip(now)) {
                *skate += (b.vector() - a.vector()).xy().norm();
            }
        }
        before = Some(now);
    }
    (raw, made, skate)
}

#[test]
fn the_fit_is_nearer_to_the_truth_than_what_it_is_given() {
    let (raw, made, _) = run(&Config::default(), 0.015);
    assert!(made < 0.75 * raw, "{made} {raw}");
    let (_, made, _) = run(&Config::default(), 1e-4);
    assert!(made < 0.008, "{made}");
}

#[test]
fn feet_that_stand_stand_still_and_only_where_that_is_wanted() {
    let mut config = Config::default();
    // White noise in every frame looks fast.
    config.feet.slow_mps = 0.35;
    config.feet.fast_mps = 0.6;
    let (_, _, [raw, made]) = run(&config, 0.008);
    assert!(made < 0.3 * raw, "{made} {raw}");
    config.feet.enabled = false;
    let (_, _, [raw, made]) = run(&config, 0.008);
    assert!(made > 0.5 * raw, "{made} {raw}");
}

#[test]
fn hands_follow_votes_and_do_not_flicker() {
    // Three sensors that are right in two of three frames; the hand closes after 2 s and opens after 4.
    let mut hand = HandFilter::new(HandsConfig::default());
    let mut coin = noise(1.0, 3);
    let (mut changes, mut right, mut was) = (0, 0, false);
    let frames = 180;
    for frame in 0..frames {
        let truth = (60..120).contains(&frame);
        let votes: Vec<Confidence> = (0..3)
            .map(|_| {
                // Above 0.43 standard deviations a third of the time.
                let says = truth != (coin() > 0.43);
                Confidence::saturating(f32::from(u8::from(says)))
            })
            .collect();
        hand.vote(&votes, at(frame));
        let state = hand.state().unwrap();
        changes += u32::from(state.closed != was);
        right += u32::from(state.closed == truth);
        was = state.closed;
    }
    assert!(changes <= 4, "{changes} changes");
    assert!(
        f64::from(right) > 0.85 * frames as f64,
        "{right} of {frames}"
    );
}

#[test]
fn a_hand_of_which_nobody_says_anything_any_more_is_not_known() {
    let mut hand = HandFilter::new(HandsConfig::default());
    for frame in 0..30 {
        hand.vote(&[Confidence::FULL; 3], at(frame));
    }
    assert!(hand.state().unwrap().closed);
    for frame in 30..60 {
        hand.vote(&[], at(frame));
    }
    assert!(hand.state().unwrap().closed, "a second is not long");
    for frame in 60..150 {
        hand.vote(&[], at(frame));
    }
    assert_eq!(hand.state(), None);
}

#[test]
fn configuration_reads_what_it_writes_and_refuses_the_rest() {
    let config = Config::default();
    let text = toml::to_string(&config).unwrap();
    assert_eq!(toml::from_str::<Config>(&text).unwrap(), config);
    assert!(toml::from_str::<Config>("[feet]\nenabledd = true").is_err());
    assert_eq!(config.validate(), Ok(()));
    let mut wrong = config;
    wrong.look.settle_s = f64::NAN;
    let told = wrong.validate().unwrap_err().to_string();
    assert!(told.contains("look.settle_s"), "{told}");
}

#[test]
fn fingers_bend_while_sensors_say_closed_and_only_where_that_is_wanted() {
    let person = performance(1);
    let body = body(&person);
    let bend = |bend_deg: f64, votes: [Option<f32>; 2]| {
        let mut config = Config::default();
        config.hands.bend_deg = bend_deg;
        let mut solver = Solver::new(&body, config);
        let mut last = None;
        for frame in 0..60 {
            let mut track = exact(&person.pose(0, frame as f64 / RATE_HZ));
            track.hands = votes.map(|closed| {
                Some(HandVotes {
                    closed: Confidence::new(closed?).unwrap(),
                    sensors: 2,
                })
            });
            last = solver.step(&track, at(frame));
        }
        let solved = last.unwrap();
        let placed = solver.rig().place(&solved.pose);
        for (bone, (origin, _)) in solver.rig().bones.iter().zip(&placed) {
            if let Some(joint) = bone.joint {
                assert!(solved.joints[joint].unwrap().distance(*origin) < 1e-9);
            }
        }
        let angles = solver.angles();
        let of = |bone| angles.iter().find(|angle| angle.bone == bone).unwrap();
        let fingers = ["LeftFingers", "RightFingers"].map(|bone| of(bone).degrees);
        (fingers, solved.hands.map(|hand| Some(hand?.closed)))
    };
    let (fitted, unknown) = bend(80.0, [None, None]);
    assert_eq!(unknown, [None, None]);
    let (fingers, hands) = bend(80.0, [Some(0.9), Some(0.1)]);
    assert_eq!(hands, [Some(true), Some(false)]);
    assert!((fingers[0] - 80.0).abs() < 1e-9, "{fingers:?}");
    assert!(fitted[0] < 60.0, "{fitted:?} shows nothing of it");
    assert_eq!(fingers[1], fitted[1], "open hands are as fitted");
    let (fingers, hands) = bend(0.0, [Some(0.9), Some(0.1)]);
    assert_eq!((fingers, hands[0]), (fitted, Some(true)));
}
