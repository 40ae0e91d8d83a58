//! People in rendered depth are found, told apart and followed; things are not people; nonsense does no harm.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod support;

use std::collections::BTreeSet;

use posefuse_bodytrack::{BodyTracker, TrackedBody, TrackerConfig, TrackerError};
use posefuse_simulator::depth::{Block, DepthCamera, DepthView, Scene};
use posefuse_skeleton::{DepthImage, Intrinsics, Position};
use support::{
    RATE_HZ, at_ns, camera, chair, room_from_sensor, somebody, tracker, tracker_of, view, walls,
};

/// The id that has most of a person's pixels, with its share of them and theirs of its own.
fn best(tracker: &BodyTracker, seen: &DepthView, number: u8) -> (u64, f64, f64) {
    let owners: Vec<u64> = tracker.owners().collect();
    let measured = |pixel: &usize| seen.image.millimetres[*pixel] > 0;
    let theirs: Vec<usize> = (0..owners.len())
        .filter(measured)
        .filter(|&pixel| seen.owners[pixel] == number)
        .collect();
    let ids: BTreeSet<u64> = theirs.iter().map(|&pixel| owners[pixel]).collect();
    let count = |id: u64| theirs.iter().filter(|&&pixel| owners[pixel] == id).count();
    let id = ids.into_iter().max_by_key(|&id| count(id)).unwrap();
    let all = (0..owners.len())
        .filter(measured)
        .filter(|&pixel| owners[pixel] == id);
    (
        id,
        count(id) as f64 / theirs.len() as f64,
        count(id) as f64 / all.count() as f64,
    )
}

#[test]
fn two_people_who_are_there_from_the_first_image_are_told_apart_and_never_absorbed() {
    let mut tracker = tracker(&camera());
    let mut last = Vec::new();
    for image in 0..90 {
        let seconds = image as f64 / RATE_HZ;
        // They stand, and move as slowly as people do who stand about.
        let people = vec![
            somebody(1, 4.0 + 0.3 * seconds, [2.4, -0.5], 3.0),
            somebody(2, 4.0 + 0.3 * seconds, [3.0, 0.5], 2.6),
        ];
        let seen = view(people, Vec::new(), image);
        last = tracker.track(&seen.image, at_ns(image)).unwrap();
        if image == 89 {
            let (first, second) = (best(&tracker, &seen, 1), best(&tracker, &seen, 2));
            assert!(first.0 > 0 && second.0 > 0 && first.0 != second.0);
            for (id, share, pure) in [first, second] {
                assert!(share > 0.9 && pure > 0.95, "{id}: {share} {pure}");
            }
        }
    }
    assert_eq!(last.len(), 2, "{last:?}");
}

#[test]
fn somebody_who_is_there_from_the_first_image_and_keeps_still_is_found_and_stays() {
    let mut tracker = tracker(&camera());
    let mut found = BTreeSet::new();
    for image in 0..90 {
        // The same pose, as of a doll: longer than a thing that does not move is looked at.
        let people = vec![somebody(1, 4.0, [2.6, 0.2], 3.0)];
        let seen = view(people, Vec::new(), image);
        let bodies = tracker.track(&seen.image, at_ns(image)).unwrap();
        assert!(image < 12 || bodies.len() == 1, "image {image}");
        found.extend(bodies.iter().map(|body| body.id));
    }
    assert_eq!(found.len(), 1);
}

#[test]
fn things_of_a_persons_size_are_nobody() {
    let thing = |[x, y]: [f64; 2], [wide, deep, high]: [f64; 3], heading: f64| Block {
        middle: Position::new(x, y, high / 2.0),
        half_m: [wide / 2.0, deep / 2.0, high / 2.0],
        heading,
    };
    let mut tracker = tracker(&camera());
    for image in 0..75 {
        let things = vec![
            thing([2.6, -1.0], [0.45, 0.25, 1.75], 0.3),
            thing([2.2, 0.1], [0.5, 0.5, 0.9], 0.8),
            thing([2.3, 0.1], [0.45, 0.08, 1.4], 0.8),
            thing([3.2, 1.1], [0.2, 0.2, 1.6], 0.0),
        ];
        let seen = view(Vec::new(), things, image);
        let bodies = tracker.track(&seen.image, at_ns(image)).unwrap();
        assert_eq!(bodies, [], "image {image}");
    }
}

#[test]
fn no_more_people_are_followed_than_are_wanted() {
    let config = TrackerConfig {
        people: 1,
        ..TrackerConfig::default()
    };
    let mut tracker = tracker_of(&camera(), config);
    let mut found = 0;
    for image in 0..40 {
        let seconds = image as f64 / RATE_HZ;
        let people = vec![
            somebody(1, seconds, [2.4, -0.6], 3.0),
            somebody(2, seconds, [2.6, 0.6], 2.6),
        ];
        let seen = view(people, Vec::new(), image);
        let bodies = tracker.track(&seen.image, at_ns(image)).unwrap();
        assert!(bodies.len() <= 1, "image {image}: {bodies:?}");
        found += bodies.len();
    }
    assert!(found > 5, "{found}");
}

#[test]
fn two_people_keep_their_ids_when_one_walks_past_behind_the_other() {
    let mut tracker = tracker(&camera());
    let mut ids = Vec::new();
    for image in 0..75 {
        let seconds = image as f64 / RATE_HZ;
        let way = (0.7 * (seconds - 1.5).max(0.0) - 0.9).min(0.9);
        let people = vec![
            somebody(1, 4.0 + seconds, [2.2, -way], 1.6),
            somebody(2, 4.0 + seconds, [3.3, way], -1.6),
        ];
        let seen = view(people, Vec::new(), image);
        tracker.track(&seen.image, at_ns(image)).unwrap();
        if image == 33 || image == 74 {
            ids.push([1, 2].map(|number| best(&tracker, &seen, number).0));
        }
    }
    assert!(ids[0].iter().all(|id| *id > 0), "{ids:?}");
    assert_eq!(ids[0], ids[1]);
}

#[test]
fn an_empty_room_and_a_chair_that_stands_there_all_along_are_nobody() {
    let mut tracker = tracker(&camera());
    for image in 0..90 {
        let seen = view(Vec::new(), vec![chair()], image);
        let bodies = tracker.track(&seen.image, at_ns(image)).unwrap();
        assert_eq!(bodies, [], "image {image}");
    }
    // Somebody comes, and the chair still is none.
    let mut found = 0;
    for image in 90..135 {
        let seconds = image as f64 / RATE_HZ;
        let people = vec![somebody(
            1,
            seconds,
            [2.2, -1.6 + 0.5 * (seconds - 6.0)],
            1.6,
        )];
        let seen = view(people, vec![chair()], image);
        let bodies = tracker.track(&seen.image, at_ns(image)).unwrap();
        assert!(bodies.len() <= 1, "image {image}: {bodies:?}");
        found += bodies.len();
    }
    assert!(found > 20, "{found}");
}

fn same(a: &[TrackedBody], b: &[TrackedBody]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b) && a.len() == b.len()
}

#[test]
fn the_same_images_give_the_same_bodies() {
    let (mut one, mut other) = (tracker(&camera()), tracker(&camera()));
    let mut bodies = 0;
    for image in 0..40 {
        let seconds = image as f64 / RATE_HZ;
        let seen = view(
            vec![somebody(1, seconds, [2.5, 0.0], 3.1)],
            Vec::new(),
            image,
        );
        let first = one.track(&seen.image, at_ns(image)).unwrap();
        assert!(same(
            &first,
            &other.track(&seen.image, at_ns(image)).unwrap()
        ));
        bodies += first.len();
    }
    assert!(bodies > 0, "nobody was found");
}

#[test]
fn nonsense_is_nobody_and_an_image_of_another_size_is_told_of() {
    let camera = camera();
    let mut tracker = tracker(&camera);
    let mut noise = 7u32;
    for image in 0..12 {
        let mut depth = DepthImage::empty(320, 240);
        for mm in &mut depth.millimetres {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *mm = match image % 3 {
                0 => 0,
                1 => u16::MAX,
                _ => (noise >> 16) as u16,
            };
        }
        // A clock that stands still, then goes back.
        let at_ns = if image < 6 { 5 } else { -(image as i64) };
        assert_eq!(tracker.track(&depth, at_ns).unwrap(), []);
    }
    let error = tracker.track(&DepthImage::empty(160, 120), 0).unwrap_err();
    assert!(matches!(error, TrackerError::Size { .. }), "{error}");
    assert!(error.to_string().contains("[320, 240]"), "{error}");
    let cut = DepthImage {
        millimetres: vec![0; 7],
        ..DepthImage::empty(320, 240)
    };
    assert!(tracker.track(&cut, 0).is_err());
    tracker.track(&DepthImage::empty(320, 240), 1).unwrap();
}

#[test]
fn cameras_and_settings_that_cannot_be_are_refused() {
    let good = camera().intrinsics;
    for (width, fx) in [(0, 500.0), (320, 0.0), (320, f64::NAN), (100_000, 500.0)] {
        let camera = Intrinsics { width, fx, ..good };
        let refused = BodyTracker::new(TrackerConfig::default(), camera)
            .err()
            .unwrap();
        assert!(matches!(refused, TrackerError::Camera { .. }), "{refused}");
    }
    let config = TrackerConfig {
        range_m: [3.0, 1.0],
        ..TrackerConfig::default()
    };
    let refused = BodyTracker::new(config, good).err().unwrap();
    assert!(refused.to_string().contains("range_m"), "{refused}");
    let config = TrackerConfig {
        network: "nowhere/else.toml".into(),
        ..TrackerConfig::default()
    };
    let refused = BodyTracker::new(config, good).err().unwrap();
    assert!(
        refused.to_string().contains("nowhere/else.toml"),
        "{refused}"
    );
}

#[test]
fn every_usual_size_of_image_is_taken() {
    for camera in [
        DepthCamera::structured_light(640, 480),
        DepthCamera::time_of_flight(512, 424),
    ] {
        let mut tracker = tracker(&camera);
        let mut bodies = 0;
        for image in 0..20 {
            let scene = Scene {
                figures: vec![somebody(
                    1,
                    image as f64 / RATE_HZ,
                    [2.4, 0.02 * image as f64],
                    3.0,
                )],
                walls: walls(),
                blocks: Vec::new(),
            };
            let seen = scene.view(&room_from_sensor(), &camera, image as u64);
            bodies += tracker.track(&seen.image, at_ns(image)).unwrap().len();
        }
        assert!(tracker.thinned().width <= 330);
        assert!(bodies > 0, "nobody was found");
    }
}
