//! Frames that are late, lost or out of order, false bodies, and what is said of them to evaluators.

use super::*;
use crate::Situation;

fn only(errors: SensorErrors) -> Arc<World> {
    world_of(Scenario {
        people: 2,
        errors,
        ..Scenario::default()
    })
}

#[test]
fn bursts_come_together_and_gaps_are_gaps() {
    let world = only(SensorErrors {
        bursts_per_min: 6.0,
        gaps_per_min: 6.0,
        ..SensorErrors::none()
    });
    let frames = frames(&world, 0, 1800);
    let arrivals: Vec<i64> = frames
        .iter()
        .map(|f| f.at_ns + f.arrival_delay_ns)
        .collect();
    let together = arrivals
        .windows(2)
        .filter(|w| w[1] - w[0] < 2_000_000)
        .count();
    // 6 bursts of 250 ms hold 6 to 8 frames each.
    assert!((30..=50).contains(&together), "{together}");
    let lost = frames.iter().filter(|f| f.dropped).count();
    assert!((100..=116).contains(&lost), "6 gaps of 600 ms: {lost}");
}

#[test]
fn reordered_frames_come_after_their_successor() {
    let world = only(SensorErrors {
        reordered: 0.1,
        ..SensorErrors::none()
    });
    let frames = frames(&world, 0, 1000);
    let arrivals: Vec<i64> = frames
        .iter()
        .map(|f| f.at_ns + f.arrival_delay_ns)
        .collect();
    let overtaken = arrivals.windows(2).filter(|w| w[1] < w[0]).count();
    assert!((60..=130).contains(&overtaken), "{overtaken}");
}

#[test]
fn furniture_is_seen_now_and_then_where_it_stands_and_said_to_be_nobody() {
    let world = only(SensorErrors {
        furniture_per_min: 6.0,
        ..SensorErrors::none()
    });
    for index in 0..4 {
        let mut sensor = SimSensor::new(Arc::clone(&world), index);
        let (mut seen, mut ids, mut place) = (0, Vec::new(), None);
        for _ in 0..1800 {
            let frame = sensor.next_frame();
            let ghosts = sensor.truth().iter().zip(&frame.bodies);
            for (truth, body) in ghosts.filter(|(truth, _)| truth.person.is_none()) {
                assert_eq!(truth.tracking_id, body.tracking_id);
                let at = body.joints[Joint::SpineBase as usize]
                    .unwrap()
                    .position
                    .vector();
                assert!(
                    (at - *place.get_or_insert(at)).norm() < 1e-9,
                    "stands still"
                );
                seen += 1;
                ids.push(truth.tracking_id);
            }
        }
        ids.dedup();
        assert_eq!(ids.len(), 6, "a new body each time");
        assert!((6 * 60..=6 * 150).contains(&seen), "{seen} frames");
    }
}

#[test]
fn a_mirror_shows_people_behind_the_wall_with_their_sides_named_as_they_look() {
    let world = world_of(Scenario {
        errors: SensorErrors {
            mirror: true,
            ..SensorErrors::none()
        },
        ..Scenario::default()
    });
    let mut images = 0;
    for index in 0..4 {
        let mut sensor = SimSensor::new(Arc::clone(&world), index);
        for _ in 0..600 {
            let frame = sensor.next_frame();
            for (truth, body) in sensor.truth().iter().zip(&frame.bodies) {
                if truth.person.is_some() {
                    continue;
                }
                images += 1;
                let joint = |joint: Joint| {
                    let raw = body.joints[joint as usize]?;
                    Some(world.room_from_sensor(index).apply(raw.position).vector())
                };
                if let Some(base) = joint(Joint::SpineBase) {
                    assert!(base.xy().norm() > 2.2, "behind the wall: {base:?}");
                }
                if let (Some(left), Some(right), Some(ankle), Some(foot)) = (
                    joint(Joint::HipLeft),
                    joint(Joint::HipRight),
                    joint(Joint::AnkleLeft),
                    joint(Joint::FootLeft),
                ) {
                    let forward = (left - right).cross(&Vector3::z());
                    assert!(forward.dot(&(foot - ankle)) > 0.0);
                }
            }
        }
    }
    assert!(images > 50, "{images}");
}

#[test]
fn who_is_away_is_not_seen_and_comes_back_under_another_id() {
    let world = world_of(Scenario {
        situation: Situation::Leaving,
        errors: SensorErrors::none(),
        ..Scenario::default()
    });
    let mut sensor = SimSensor::new(Arc::clone(&world), 0);
    let mut ids = Vec::new();
    for _ in 0..1800 {
        let frame = sensor.next_frame();
        let here = world.truth(frame.at_ns as f64 * 1e-9).len();
        assert_eq!(frame.bodies.len(), here);
        ids.extend(frame.bodies.iter().map(|body| body.tracking_id));
    }
    ids.dedup();
    assert!(
        ids.len() > 3 && ids.windows(2).all(|w| w[0] < w[1]),
        "{ids:?}"
    );
}

#[test]
fn what_is_said_of_swaps_is_true() {
    let world = only(SensorErrors {
        swaps: 0.7,
        ..SensorErrors::none()
    });
    let mut sensor = SimSensor::new(Arc::clone(&world), 1);
    let from_room = world.room_from_sensor(1).inverse();
    let mut swapped = 0;
    for _ in 0..1200 {
        let frame = sensor.next_frame();
        let people = world.truth(frame.at_ns as f64 * 1e-9);
        for (truth, body) in sensor.truth().iter().zip(&frame.bodies) {
            let person = &people[truth.person.unwrap() as usize - 1];
            for (half, joint) in [Joint::ElbowLeft, Joint::KneeLeft].into_iter().enumerate() {
                let at = body.joints[joint as usize].unwrap().position;
                let off = |joint| at.distance(from_room.apply(person.joints[joint].unwrap()));
                assert_eq!(truth.swapped[half], off(joint) > off(joint.mirrored()));
            }
            swapped += usize::from(truth.swapped[0]);
        }
    }
    assert!(swapped > 100, "{swapped}");
}
