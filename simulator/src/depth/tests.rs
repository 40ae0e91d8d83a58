use posefuse_skeleton::{Joint, Position, Sensor};

use super::*;
use crate::motion::Situation;
use crate::{Layout, Scenario};

fn camera(noise: DepthNoise) -> DepthCamera {
    DepthCamera {
        noise,
        ..DepthCamera::structured_light(320, 240)
    }
}

fn world(people: usize) -> World {
    World::new(&Scenario {
        seed: 11,
        people,
        layout: Layout::Arc,
        sensors: 3,
        ..Scenario::default()
    })
    .unwrap()
}

fn joints_here(world: &World, sensor: usize, seconds: f64) -> Vec<JointMap<Position<Sensor>>> {
    let here = world.room_from_sensor(sensor).inverse();
    let truth = world.truth(seconds);
    truth
        .iter()
        .map(|person| person.joints.map(|_, p| here.apply(*p)))
        .collect()
}

#[test]
fn joints_lie_within_the_flesh_that_is_seen() {
    let (mut seen, mut hidden, mut beside) = (0, 0, 0);
    let world = world(1);
    let camera = camera(DepthNoise::none());
    for step in 0..60 {
        let (sensor, seconds) = (step % 3, step as f64 * 3.7);
        let view = world.depth_with_owners(sensor, seconds, &camera);
        let joints = &joints_here(&world, sensor, seconds)[0];
        for (joint, at) in joints.iter() {
            // A fist has neither.
            let fingers = matches!(
                joint,
                Joint::HandTipLeft | Joint::HandTipRight | Joint::ThumbLeft | Joint::ThumbRight
            );
            if fingers {
                continue;
            }
            match view.sees(&camera.intrinsics, 1, joint, at) {
                Some(true) => seen += 1,
                Some(false) => hidden += 1,
                None => continue,
            }
            let [u, v] = camera.intrinsics.pixel(at).unwrap();
            let pixel = v.round() as usize * 320 + u.round() as usize;
            if view.owners[pixel] != 1 {
                beside += 1;
                continue;
            }
            let before = at.vector().z - f64::from(view.exact_m[pixel]);
            assert!(
                before > -0.01,
                "{joint} sticks out by {before} at {seconds} s"
            );
        }
    }
    assert!(seen > 3 * hidden && hidden > 50, "{seen} {hidden}");
    assert!(
        beside < seen / 50,
        "{beside} of {seen} joints with no flesh over them"
    );
}

#[test]
fn errors_grow_with_distance_and_leave_most_pixels_alone() {
    let world = world(0);
    let camera = camera(DepthNoise::structured_light());
    let view = world.depth_with_owners(0, 1.0, &camera);
    let (mut near, mut far, mut lost) = ((0.0, 0), (0.0, 0), 0);
    for (exact, measured) in view.exact_m.iter().zip(&view.image.millimetres) {
        if *measured == 0 {
            lost += 1;
            continue;
        }
        let error = (f32::from(*measured) / 1000.0 - exact).abs();
        let sum = if *exact < 3.5 { &mut near } else { &mut far };
        // Edges of furniture are a matter of pixels, not of millimetres.
        if error < 0.1 {
            *sum = (sum.0 + error, sum.1 + 1);
        }
    }
    let mean = |(sum, count): (f32, i32)| sum / count as f32;
    assert!(
        near.1 > 1000 && far.1 > 1000 && lost < 16_000,
        "{near:?} {far:?} {lost}"
    );
    assert!(
        mean(near) < 0.02 && mean(far) > 2.0 * mean(near),
        "{near:?} {far:?}"
    );
}

#[test]
fn who_stands_in_front_hides_who_stands_behind() {
    let scenario = Scenario {
        seed: 2,
        people: 2,
        situation: Situation::Crossing,
        ..Scenario::default()
    };
    let world = World::new(&scenario).unwrap();
    let camera = camera(DepthNoise::none());
    let mut hidden = 0;
    for step in 0..80 {
        let (sensor, seconds) = (step % 4, step as f64 * 0.6);
        let view = world.depth_with_owners(sensor, seconds, &camera);
        let people = joints_here(&world, sensor, seconds);
        for (index, joints) in people.iter().enumerate() {
            let Some(at) = joints[Joint::SpineMid] else {
                continue;
            };
            let Some([u, v]) = camera.intrinsics.pixel(&at) else {
                continue;
            };
            if !(0.0..319.0).contains(&u) || !(0.0..239.0).contains(&v) {
                continue;
            }
            let pixel = v.round() as usize * 320 + u.round() as usize;
            let owner = usize::from(view.owners[pixel]);
            assert!(owner > 0, "nobody where a chest is");
            if owner != index + 1 {
                let other = people[owner - 1][Joint::SpineMid].unwrap();
                hidden += 1;
                assert!(f64::from(view.exact_m[pixel]) < at.vector().z);
                assert!(other.vector().z < at.vector().z + 0.3);
            }
        }
    }
    assert!(hidden > 2, "{hidden}");
}

#[test]
fn the_same_moment_looks_the_same_and_another_does_not() {
    let camera = camera(DepthNoise::structured_light());
    let first = world(2).depth_with_owners(1, 2.0, &camera);
    assert_eq!(first, world(2).depth_with_owners(1, 2.0, &camera));
    assert_ne!(first, world(2).depth_with_owners(1, 2.033, &camera));
}

#[test]
fn structured_light_leaves_a_shadow_beside_people_and_time_of_flight_none() {
    let world = world(1);
    let lost = |noise: DepthNoise| {
        let view = world.depth_with_owners(1, 2.0, &camera(noise));
        view.image.millimetres.iter().filter(|m| **m == 0).count()
    };
    let quiet = |noise: DepthNoise| DepthNoise {
        holes: 0.0,
        range_m: [0.1, 20.0],
        ..noise
    };
    let shadow = lost(quiet(DepthNoise::structured_light()));
    assert!((200..12_000).contains(&shadow), "{shadow}");
    assert_eq!(lost(quiet(DepthNoise::time_of_flight())), 0);
}

#[test]
fn a_recorded_pose_keeps_its_directions_on_another_body() {
    let pose = world(1).truth(3.0).remove(0).joints;
    let shape = crate::motion::BodyShape::of_height(1.5);
    let smaller = retargeted(&pose, &shape).unwrap();
    let way = |joints: &JointMap<Position<Room>>| {
        let [a, b] = [Joint::ElbowLeft, Joint::WristLeft].map(|j| joints[j].unwrap().vector());
        (b - a).normalize()
    };
    assert!((way(&pose) - way(&smaller)).norm() < 1e-9);
    let forearm = smaller[Joint::ElbowLeft]
        .unwrap()
        .distance(smaller[Joint::WristLeft].unwrap());
    assert!((forearm - shape.forearm).abs() < 1e-9);
    assert_eq!(smaller.len(), 25);
}
