//! Each error source does what its number says, and nothing else.

mod sight;
mod sizes;
mod troubles;

use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_skeleton::Confidence;

use super::*;
use crate::{Layout, Scenario};

fn world(errors: SensorErrors) -> Arc<World> {
    world_of(Scenario {
        errors,
        ..Scenario::default()
    })
}

fn world_of(scenario: Scenario) -> Arc<World> {
    Arc::new(World::new(&scenario).unwrap())
}

fn frames(world: &Arc<World>, sensor: usize, count: usize) -> Vec<SimFrame> {
    let mut sensor = SimSensor::new(Arc::clone(world), sensor);
    (0..count).map(|_| sensor.next_frame()).collect()
}

/// What is wrong with each joint of the only person, in the sensor's frame: joint, true place, error.
fn deviations(
    world: &Arc<World>,
    sensor: usize,
    frame: &SimFrame,
) -> Vec<(Joint, Vector3<f64>, Vector3<f64>)> {
    let sensor_from_room = world.room_from_sensor(sensor).inverse();
    let truth = &world.truth(frame.at_ns as f64 * 1e-9)[0].joints;
    let Some(body) = frame.bodies.first() else {
        return Vec::new();
    };
    Joint::ALL
        .into_iter()
        .zip(&body.joints)
        .filter_map(|(joint, raw)| {
            let at = sensor_from_room.apply(truth[joint]?).vector();
            Some((joint, at, raw.as_ref()?.position.vector() - at))
        })
        .collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

fn near(found: f64, expected: f64, share: f64) {
    assert!(
        (found / expected - 1.0).abs() < share,
        "found {found}, expected {expected}"
    );
}

#[test]
fn a_perfect_sensor_tells_the_truth() {
    for sensor in 0..4 {
        let world = world(SensorErrors::none());
        for frame in frames(&world, sensor, 300) {
            assert_eq!(
                (frame.captured.ns(), frame.arrival_delay_ns),
                (frame.at_ns, 0)
            );
            let deviations = deviations(&world, sensor, &frame);
            assert_eq!(deviations.len(), 25);
            assert!(deviations.iter().all(|(_, _, error)| error.norm() < 1e-9));
        }
    }
}

#[test]
fn frames_do_not_depend_on_who_else_looks_or_when_one_begins() {
    let scenario = Scenario {
        people: 2,
        errors: SensorErrors::harsh(),
        ..Scenario::default()
    };
    let shared = world_of(scenario.clone());
    let mut sensors: Vec<SimSensor> = (0..4)
        .map(|i| SimSensor::new(Arc::clone(&shared), i))
        .collect();
    let mut third = Vec::new();
    for _ in 0..400 {
        for (index, sensor) in sensors.iter_mut().enumerate() {
            let frame = sensor.next_frame();
            if index == 2 {
                third.push(frame);
            }
        }
    }
    assert_eq!(frames(&world_of(scenario.clone()), 2, 400), third);
    let mut late = SimSensor::new(world_of(scenario), 2);
    late.skip_to(8.0);
    let first = late.next_frame();
    assert!(first.at_ns >= 8_000_000_000 && first.at_ns < 8_034_000_000);
    assert_eq!(first, third[first.number as usize]);
}

#[test]
fn clocks_drops_delays_and_stale_frames() {
    let world = world(SensorErrors {
        clock_offset_ms: 50.0,
        clock_drift_ppm: 50.0,
        clock_jitter_ms: 2.0,
        drops: 0.02,
        delay_ms: 15.0,
        delay_jitter_ms: 3.0,
        stale: 0.06,
        white_noise: 1.0,
        ..SensorErrors::none()
    });
    let clock = world.sensor_clock(1);
    assert!(
        clock.offset_ns != 0
            && clock.offset_ns.abs() <= 50_000_000
            && clock.drift_ppm.abs() <= 50.0
    );
    assert_ne!(clock, world.sensor_clock(2));
    let frames = frames(&world, 1, 10_000);
    let jitter = frames
        .iter()
        .map(|f| f.captured.since_ns(clock.shows(f.at_ns)) as f64 * 1e-9);
    near(rms(jitter), 0.002, 0.05);
    let hour = 3_600_000_000_000;
    let gained = clock.shows(hour).ns() - hour - clock.offset_ns;
    near(gained as f64, hour as f64 * clock.drift_ppm * 1e-6, 1e-6);
    let dropped = frames.iter().filter(|frame| frame.dropped).count() as f64 / 10_000.0;
    assert!((dropped - 0.02).abs() < 0.006, "{dropped}");
    assert!(
        frames
            .iter()
            .all(|frame| frame.bodies.is_empty() == frame.dropped)
    );
    let stale = frames
        .windows(2)
        .filter(|pair| !pair[0].dropped && pair[0].bodies == pair[1].bodies)
        .count();
    assert!((stale as f64 / 10_000.0 - 0.06).abs() < 0.012, "{stale}");
    assert!(
        frames
            .iter()
            .all(|frame| frame.arrival_delay_ns >= 15_000_000)
    );
    let spaced = frames
        .windows(2)
        .all(|pair| ((pair[1].at_ns - pair[0].at_ns) - 33_333_333).abs() <= 1);
    assert!(spaced, "30 frames per second");
}

#[test]
fn impossible_scenarios_are_refused_by_name() {
    let refused = |scenario: Scenario| World::new(&scenario).unwrap_err().to_string();
    let none = Scenario {
        sensors: 0,
        ..Scenario::default()
    };
    assert!(refused(none).contains("`sensors` must be 1 to 64, found 0"));
    let crowd = Scenario {
        people: 9,
        ..Scenario::default()
    };
    assert!(refused(crowd).contains("`people`"));
    let errors = SensorErrors {
        drops: f64::NAN,
        ..SensorErrors::none()
    };
    assert!(
        refused(Scenario {
            errors,
            ..Scenario::default()
        })
        .contains("`errors.drops`")
    );
}

#[test]
fn scenarios_are_read_from_toml_and_typos_refused() {
    let text = "seed = 5\nlayout = \"arc\"\n[errors]\nspikes_per_s = 0.0\n";
    let scenario: Scenario = toml::from_str(text).unwrap();
    let errors = SensorErrors {
        spikes_per_s: 0.0,
        ..SensorErrors::default()
    };
    let expected = Scenario {
        seed: 5,
        layout: Layout::Arc,
        errors,
        ..Scenario::default()
    };
    assert_eq!(scenario, expected);
    assert_eq!(
        toml::from_str::<Scenario>(&toml::to_string(&scenario).unwrap()).unwrap(),
        scenario
    );
    let typo = toml::from_str::<Scenario>("[errors]\nspikes = 1.0\n").unwrap_err();
    assert!(typo.to_string().contains("spikes_per_s"), "{typo}");
}
