//! Open hands and fists in rendered depth are told apart where they can be.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod support;

use std::f64::consts::PI;

use nalgebra::Vector3;
use posefuse_simulator::depth::{DepthCamera, Figure, Scene};
use posefuse_skeleton::{ARMS, Position};
use support::{at_ns, room_from_sensor, somebody, tracker, walls};

/// How many votes on somebody's hands, who stands at `x` metres with hands held away from the body, are right and wrong.
fn votes(camera: &DepthCamera, x: f64, closed: [bool; 2]) -> [usize; 2] {
    let mut tracker = tracker(camera);
    let mut count = [0; 2];
    for image in 0..22 {
        let mut person = arms_out(somebody(1, 4.0, [x, 0.02 * image as f64], PI));
        person.hands_closed = closed;
        let scene = Scene {
            figures: vec![person],
            walls: walls(),
            blocks: Vec::new(),
        };
        let seen = scene.view(&room_from_sensor(), camera, image as u64);
        for body in tracker.track(&seen.image, at_ns(image)).unwrap() {
            for (said, closed) in body.hands_closed.iter().zip(closed) {
                if let Some(said) = said {
                    count[usize::from((*said > 0.5) != closed)] += 1;
                }
            }
        }
    }
    count
}

/// Arms raised to the sides and forwards, palms to the sensor.
fn arms_out(mut person: Figure) -> Figure {
    for (side, arm) in [1.0, -1.0].into_iter().zip(ARMS) {
        let shoulder = person.joints[arm[0]].unwrap().vector();
        // The person faces -x: their left is -y.
        let elbow = shoulder + Vector3::new(-0.05, -0.24 * side, -0.14);
        let wrist = elbow + Vector3::new(-0.10, -0.08 * side, 0.21);
        let up = Vector3::new(-0.2, 0.0, 0.98);
        let thumb = Vector3::new(0.0, 0.06 * side, 0.04);
        let points = [
            elbow,
            wrist,
            wrist + up * 0.088,
            wrist + up * 0.167,
            wrist + thumb,
        ];
        for (joint, at) in arm[1..].iter().zip(points) {
            person.joints[*joint] = Some(Position::from_vector(at));
        }
    }
    person
}

#[test]
fn open_and_closed_hands_are_told_apart_near_by_and_not_guessed_at_far_away() {
    let near = DepthCamera::structured_light(640, 480);
    for closed in [[false, true], [true, false]] {
        let [right, wrong] = votes(&near, 1.8, closed);
        assert!(right > 8 && wrong * 10 <= right, "{right} {wrong}");
    }
    let far = DepthCamera::structured_light(160, 120);
    assert_eq!(votes(&far, 3.4, [false, true]), [0, 0], "too few pixels");
}
