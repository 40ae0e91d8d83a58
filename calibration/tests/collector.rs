//! The collector: bounded, and honest about what has been seen.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{Errors, Scene, pair_errors};
use nalgebra::Matrix3;
use posefuse_calibration::{Collector, Options, Solution, Verdict, solve};
use posefuse_skeleton::{
    Body, JointState, Observation, Provenance, SensorId, SensorSet, Timestamp,
};

fn id(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

fn names(count: usize) -> Vec<(SensorId, String)> {
    (0..count).map(|i| (id(i), format!("s{i}"))).collect()
}

/// The scene's frames as a server would take them in: (sensor, time, bodies) in order of time.
fn stream(scene: &Scene) -> Vec<(SensorId, Timestamp, Vec<Body>)> {
    let mut stream = Vec::new();
    for (index, sensor) in scene.record().0.sensors.iter().enumerate() {
        for frame in &sensor.frames {
            let bodies = frame.bodies.iter().map(|body| Body {
                tracking_id: body.tracking_id,
                skeleton: body.joints.map(|_, joint| JointState {
                    position: joint.position,
                    covariance: Matrix3::identity() * 1e-4,
                    confidence: joint.confidence,
                    provenance: Provenance::Measured(SensorSet::only(id(index))),
                }),
                orientations: None,
                hands_closed: [None; 2],
            });
            stream.push((id(index), frame.time, bodies.collect()));
        }
    }
    stream.sort_by_key(|(_, time, _)| *time);
    stream
}

#[test]
fn a_walk_is_gathered_until_it_suffices() {
    let scene = Scene::ring(3, 30.0, Errors::USUAL, 21);
    let mut collector = Collector::new(names(3));
    let mut last = 0.0;
    for (sensor, time, bodies) in stream(&scene) {
        collector.add(sensor, time, &bodies);
        let share = collector.coverage().share;
        assert!(share >= last, "coverage went back from {last} to {share}");
        last = share;
    }
    let coverage = collector.coverage();
    assert_eq!(coverage.share, 1.0, "{coverage:?}");
    assert_eq!(coverage.hint, "");
    for sensor in &coverage.sensors {
        assert!(
            (29.0..30.1).contains(&sensor.seconds_with_body),
            "{sensor:?}"
        );
        assert_eq!(sensor.shared_frames.len(), 2);
    }
    let solution = solve(&collector.walk(), &Options::default()).unwrap();
    assert_eq!(solution.report.verdict, Verdict::Passed);
    // Half of the frames are left aside, and little with them.
    let all = solve(&scene.record().0, &Options::default()).unwrap();
    let worst = |solution: &Solution| {
        let errors = pair_errors(&solution.calibration, &scene.sensors);
        errors.into_iter().fold(0.0, f64::max)
    };
    let (thinned, all) = (worst(&solution), worst(&all));
    assert!(
        thinned < all + 0.003,
        "{thinned} m of a part, {all} m of all"
    );
}

#[test]
fn hints_say_what_is_missing() {
    let mut collector = Collector::new(names(2));
    assert!(collector.coverage().hint.contains("start its agent"));
    let frames = stream(&Scene::ring(2, 3.0, Errors::USUAL, 22));
    for (sensor, time, _) in &frames {
        collector.add(*sensor, *time, &[]);
    }
    assert!(collector.coverage().hint.contains("seen nobody"));
    for (sensor, time, bodies) in &frames {
        let apart = time.plus_ns(if *sensor == id(0) {
            10_000_000_000
        } else {
            20_000_000_000
        });
        collector.add(*sensor, apart, bodies);
    }
    assert!(
        collector.coverage().hint.contains("at the same time"),
        "{:?}",
        collector.coverage()
    );
    for (sensor, time, bodies) in &frames {
        collector.add(*sensor, time.plus_ns(40_000_000_000), bodies);
    }
    let coverage = collector.coverage();
    assert!(
        coverage.hint.contains("`s0` and `s1` both see you") && coverage.share < 0.5,
        "{coverage:?}"
    );
}

#[test]
fn memory_is_bounded_and_strangers_are_left_aside() {
    let mut collector = Collector::with_limit(names(2), 100);
    let frames = stream(&Scene::ring(2, 10.0, Errors::NONE, 23));
    for (sensor, time, bodies) in &frames {
        let crowd: Vec<Body> = bodies.iter().cycle().take(40).cloned().collect();
        collector.add(*sensor, *time, &crowd);
        collector.add(id(9), *time, bodies);
    }
    let walk = collector.walk();
    assert_eq!(walk.sensors.len(), 2);
    let coverage = collector.coverage();
    for (sensor, coverage) in walk.sensors.iter().zip(&coverage.sensors) {
        assert_eq!(sensor.frames.len(), 100);
        let most = Observation::MAX_BODIES;
        assert!(sensor.frames.iter().all(|frame| frame.bodies.len() == most));
        assert_eq!(coverage.frames, 100);
        let kept_s = sensor.frames[99].time.since_seconds(sensor.frames[0].time);
        assert!(
            (coverage.seconds_with_body - kept_s).abs() < 1e-6,
            "what is not kept is not counted: {kept_s} s kept, {coverage:?}"
        );
    }
}

#[test]
fn ten_minutes_fit_and_what_is_counted_is_what_is_kept() {
    let mut collector = Collector::new(names(2));
    let frames = stream(&Scene::ring(2, 20.0, Errors::USUAL, 24));
    for round in 0..30 {
        for (sensor, time, bodies) in &frames {
            collector.add(*sensor, time.plus_ns(round * 20_000_000_000), bodies);
        }
    }
    let (walk, coverage) = (collector.walk(), collector.coverage());
    for (sensor, coverage) in walk.sensors.iter().zip(&coverage.sensors) {
        let (first, last) = (&sensor.frames[0], sensor.frames.last().unwrap());
        assert!(last.time.since_seconds(first.time) > 599.0);
        assert_eq!(coverage.frames, sensor.frames.len() as u64);
        assert!(
            (598.0..600.5).contains(&coverage.seconds_with_body),
            "{coverage:?}"
        );
        let rate = sensor.frames.len() as f64 / 600.0;
        assert!((10.0..=15.5).contains(&rate), "{rate} frames a second");
    }
}

#[test]
fn a_lone_sensor_is_covered_by_its_own_view() {
    let scene = Scene::ring(1, 25.0, Errors::USUAL, 25);
    let mut collector = Collector::new(names(1));
    assert!(collector.coverage().hint.contains("start its agent"));
    for (sensor, time, bodies) in stream(&scene) {
        collector.add(sensor, time, &bodies);
    }
    let coverage = collector.coverage();
    assert_eq!(
        (coverage.share, coverage.hint.as_str()),
        (1.0, ""),
        "{coverage:?}"
    );
    assert!(
        Collector::new(names(0))
            .coverage()
            .hint
            .contains("start an agent")
    );
}

/// Everything that `scene` shows, gathered.
fn gathered(scene: &Scene) -> Collector {
    let mut collector = Collector::new(names(scene.sensors.len()));
    for (sensor, time, bodies) in stream(scene) {
        collector.add(sensor, time, &bodies);
    }
    collector
}

#[test]
fn the_share_is_that_of_the_weakest_part() {
    let full = gathered(&Scene::ring(2, 30.0, Errors::USUAL, 26)).coverage();
    assert_eq!(full.share, 1.0, "{full:?}");
    // Somebody who stands shows neither the floor nor all sides.
    let mut scene = Scene::ring(2, 30.0, Errors::USUAL, 26);
    scene.people = vec![common::standing];
    let stood = gathered(&scene).coverage();
    let goals = stood.sensors[0].goals;
    assert_eq!(goals.seconds, 1.0, "{stood:?}");
    assert!(goals.floor < 0.5 && goals.turning < 0.5, "{stood:?}");
    assert_eq!(stood.share, goals.share(), "{stood:?}");
    assert!(stood.hint.contains("both see you"), "{stood:?}");
    // A line is walked without turning, except that this one turns round at its ends.
    scene.people = vec![common::line];
    let line = gathered(&scene).coverage();
    assert!(line.share < 1.0, "{line:?}");
    assert!(line.hint.contains("turn around slowly"), "{line:?}");
}

#[test]
fn a_room_is_no_better_than_what_joins_it() {
    // s0 and s1 share the first half of the walk, s2 and s3 the second: each has enough, together they have nothing.
    let scene = Scene::ring(4, 60.0, Errors::USUAL, 27);
    let mut collector = Collector::new(names(4));
    for (sensor, time, bodies) in stream(&scene) {
        let first = time.seconds() < 1030.0;
        if first == (sensor.index() < 2) {
            collector.add(sensor, time, &bodies);
        }
    }
    let coverage = collector.coverage();
    assert!(
        coverage.sensors.iter().all(|s| s.share > 0.9),
        "{coverage:?}"
    );
    assert!(coverage.share < 0.1, "{coverage:?}");
    collector.remove(id(2));
    collector.remove(id(3));
    assert_eq!(collector.coverage().share, 1.0);
}
