//! Bodies that move no more than what they are given: covariances that jump, numbers that are none, feet that leave.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod support;

use nalgebra::Vector3;
use posefuse_kinematics::{Config, Solver};
use posefuse_skeleton::{Joint, JointMap, Position, Room, Track};
use support::{RATE_HZ, at, body, exact, performance};

/// The largest acceleration of any joint in what a solver makes of these tracks, m/s^2.
fn largest_jolt(config: &Config, tracks: &[Track]) -> f64 {
    let mut solver = Solver::new(&body(&performance(1)), config.clone());
    let frames: Vec<JointMap<Position<Room>>> = tracks
        .iter()
        .enumerate()
        .map(|(frame, track)| solver.step(track, at(frame)).unwrap().joints)
        .collect();
    let jolt = |three: &[JointMap<Position<Room>>], joint: Joint| {
        let [a, b, c] = [0, 1, 2].map(|index| three[index][joint].unwrap().vector());
        (a - b * 2.0 + c).norm() * RATE_HZ * RATE_HZ
    };
    frames
        .windows(3)
        .flat_map(|three| Joint::ALL.map(|joint| jolt(three, joint)))
        .fold(0.0, f64::max)
}

/// Somebody who stands still, with elbows and knees off by 4 cm, as trackers have them.
fn standing() -> Vec<Track> {
    let pose = performance(1).pose(0, 1.0);
    let mut track = exact(&pose);
    for joint in [Joint::ElbowLeft, Joint::KneeRight, Joint::SpineMid] {
        let state = track.skeleton[joint].as_mut().unwrap();
        state.position = state.position.moved(Vector3::new(0.0, 0.04, 0.0));
    }
    vec![track; 120]
}

#[test]
fn sensors_that_come_and_go_do_not_shake_the_body() {
    let mut tracks = standing();
    for (frame, track) in tracks.iter_mut().enumerate() {
        let far = frame / 20 % 2 == 0;
        for (joint, state) in track.skeleton.iter_mut() {
            if far == ((joint as usize).is_multiple_of(2)) {
                state.covariance *= 900.0;
            }
        }
    }
    let steady = largest_jolt(&Config::default(), &tracks);
    let mut at_once = Config::default();
    at_once.fit.steady_s = 0.0;
    at_once.fit.sudden_dps2 = 0.0;
    at_once.fit.sudden_mps2 = 0.0;
    let shaken = largest_jolt(&at_once, &tracks);
    assert!(steady < 0.5 * shaken, "{steady} {shaken} m/s^2");
}

#[test]
fn covariances_that_say_nothing_do_not_count() {
    let mut tracks = standing();
    let calm = largest_jolt(&Config::default(), &tracks);
    for track in tracks.iter_mut().skip(60).step_by(7) {
        let state = track.skeleton[Joint::KneeRight].as_mut().unwrap();
        let line = Vector3::new(1e8, -3e7, 2e8);
        state.covariance += line * line.transpose();
        let state = track.skeleton[Joint::AnkleLeft].as_mut().unwrap();
        state.covariance[(0, 1)] = 4.0;
        state.covariance[(1, 0)] = 4.0;
    }
    let jolt = largest_jolt(&Config::default(), &tracks);
    assert!(jolt < calm + 25.0, "{jolt} {calm} m/s^2");
}

#[test]
fn a_foot_that_leaves_is_not_held_back() {
    let person = performance(1);
    let mut config = Config::default();
    config.fit.sudden_dps2 = 0.0;
    let mut solver = Solver::new(&body(&person), config.clone());
    config.feet.enabled = false;
    let mut free = Solver::new(&body(&person), config);
    let mut furthest: f64 = 0.0;
    for frame in 0..900 {
        let track = exact(&person.pose(0, frame as f64 / RATE_HZ));
        let [held, free] = [&mut solver, &mut free].map(|s| s.step(&track, at(frame)).unwrap());
        for joint in [Joint::AnkleLeft, Joint::AnkleRight] {
            let apart = held.joints[joint]
                .unwrap()
                .distance(free.joints[joint].unwrap());
            furthest = furthest.max(apart);
        }
    }
    assert!(furthest > 0.005, "feet are held: {furthest} m");
    assert!(furthest < 0.075, "{furthest} m");
}
