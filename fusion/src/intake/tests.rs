use super::*;

fn at(ms: f64) -> Timestamp {
    Timestamp::from_ns(10_000_000_000 + ms_to_ns(ms))
}

fn id(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

fn config(mode: IntakeMode) -> IntakeConfig {
    IntakeConfig {
        mode,
        ..IntakeConfig::default()
    }
}

/// Feeds sensors at 30 Hz with these phases (ms) and a delay of 10 ms; gives the frame times in ms.
fn frames(phases: &[f64], seconds: f64, config: &IntakeConfig) -> Vec<f64> {
    let mut intake = Intake::default();
    let mut arrivals: Vec<(f64, usize)> = Vec::new();
    for (sensor, phase) in phases.iter().enumerate() {
        let count = (seconds * 30.0) as usize;
        arrivals.extend((0..count).map(|i| (phase + i as f64 * 1000.0 / 30.0, sensor)));
    }
    arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut times = Vec::new();
    for (ms, sensor) in arrivals {
        let now = at(ms + 10.0);
        while let Some(wake) = intake
            .wake(at(0.0), true, config)
            .filter(|wake| *wake < now)
        {
            match intake.due(wake, true, config) {
                Some(time) => times.push(time.since_seconds(at(0.0)) * 1e3),
                None => break,
            }
        }
        intake.delivered(id(sensor), at(ms), now, config);
        while let Some(time) = intake.due(now, true, config) {
            times.push(time.since_seconds(at(0.0)) * 1e3);
        }
    }
    times
}

#[test]
fn one_sensor_gives_all_its_frames() {
    let times = frames(&[3.0], 4.0, &config(IntakeMode::Async));
    assert_eq!(times.len(), 120);
}

#[test]
fn four_sensors_out_of_step_give_the_rate_and_no_more() {
    let times = frames(&[0.0, 8.3, 16.6, 25.0], 10.0, &config(IntakeMode::Async));
    assert!((290..=305).contains(&times.len()), "{}", times.len());
}

#[test]
fn sensors_in_step_are_taken_together() {
    let config = config(IntakeMode::Async);
    let mut intake = Intake::default();
    for sensor in 0..3 {
        intake.delivered(id(sensor), at(0.0), at(10.0), &config);
    }
    assert_eq!(intake.due(at(10.0), false, &config), Some(at(0.0)));
    // The next instant: due with the first, made with the last.
    for sensor in 0..3 {
        assert_eq!(intake.due(at(43.0), false, &config), None);
        intake.delivered(id(sensor), at(33.0), at(43.0), &config);
    }
    assert_eq!(intake.due(at(43.0), false, &config), Some(at(33.0)));
    // One stays away: its time is waited for, not longer.
    intake.delivered(id(0), at(66.0), at(76.0), &config);
    assert_eq!(intake.due(at(76.0), false, &config), None);
    let wake = intake.wake(at(76.0), false, &config).unwrap();
    assert_eq!(wake, at(80.0));
    assert_eq!(intake.due(wake, false, &config), Some(at(66.0)));
}

#[test]
fn ticks_go_on_when_all_fall_silent_and_only_while_someone_is_there() {
    let config = config(IntakeMode::Async);
    let mut intake = Intake::default();
    intake.delivered(id(0), at(0.0), at(10.0), &config);
    assert_eq!(intake.due(at(10.0), true, &config), Some(at(0.0)));
    assert_eq!(intake.wake(at(10.0), false, &config), None);
    let mut wake = intake.wake(at(10.0), true, &config).unwrap();
    assert_eq!(wake, at(110.0));
    for _ in 0..10 {
        let time = intake
            .due(wake, true, &config)
            .expect("a frame at the deadline");
        assert_eq!(wake.since_ns(time), 10_000_000, "the usual delay is kept");
        wake = intake.wake(wake, true, &config).unwrap();
    }
}

#[test]
fn the_window_is_a_grid_and_waits_for_the_slowest() {
    let config = config(IntakeMode::Window);
    let times = frames(&[0.0, 20.0], 2.0, &config);
    assert!(times.len() >= 57, "{}", times.len());
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0] - 1000.0 / 30.0).abs() < 1e-3, "{pair:?}");
    }
    let mut intake = Intake::default();
    intake.delivered(id(0), at(0.0), at(10.0), &config);
    intake.delivered(id(1), at(1.0), at(11.0), &config);
    intake.delivered(id(0), at(70.0), at(80.0), &config);
    let grid = intake.grid.unwrap();
    assert_eq!(
        intake.due(at(80.0), true, &config),
        None,
        "sensor 1 has not passed {grid:?}"
    );
    let wake = intake.wake(at(80.0), true, &config).unwrap();
    assert_eq!(intake.due(wake, true, &config), Some(grid));
}

#[test]
fn times_that_overflow_do_no_harm() {
    for mode in [IntakeMode::Async, IntakeMode::Window] {
        let config = config(mode);
        let mut intake = Intake::default();
        let mut last = None;
        for ns in [i64::MIN, 0, i64::MAX, 5, i64::MAX - 1] {
            let time = Timestamp::from_ns(ns);
            intake.delivered(id(0), time, time, &config);
            for _ in 0..8 {
                if let Some(frame) = intake.due(time, true, &config) {
                    assert!(last.is_none_or(|last| frame > last));
                    last = Some(frame);
                }
            }
            intake.wake(time, true, &config);
        }
    }
}
