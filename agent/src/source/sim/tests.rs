//! Simulated sensors of several processes against the truth of their common room.

use posefuse_simulator::SensorErrors;
use posefuse_skeleton::Joint;

use super::*;

struct Fixed(i64, i64);

impl Clock for Fixed {
    fn monotonic_ns(&self) -> i64 {
        self.0
    }
    fn unix_ns(&self) -> i64 {
        self.1
    }
}

const EPOCH: i64 = 1_700_000_000_000_000_000;

fn config(sensor: usize, errors: SensorErrors) -> SimConfig {
    let scenario = Scenario {
        seed: 5,
        people: 2,
        errors,
        ..Scenario::default()
    };
    SimConfig {
        scenario,
        sensor,
        epoch_unix_ns: Some(EPOCH),
    }
}

fn open(config: &SimConfig, monotonic_ns: i64, unix_ns: i64) -> SimSource {
    let clock: Arc<dyn Clock> = Arc::new(Fixed(monotonic_ns, unix_ns));
    SimSource::open(config, &clock).unwrap()
}

#[test]
fn agents_of_different_processes_see_the_same_people_at_the_same_time() {
    let world = World::new(&config(0, SensorErrors::none()).scenario).unwrap();
    // Two processes: other sensors, other monotonic clocks, one started before the epoch and one long after.
    let starts = [
        (0, 7_000_000, EPOCH - 300_000_000),
        (2, 99, EPOCH + 20_000_000_000),
    ];
    for (sensor, monotonic_ns, unix_ns) in starts {
        let mut source = open(&config(sensor, SensorErrors::none()), monotonic_ns, unix_ns);
        for _ in 0..40 {
            let frame = source.next_frame().unwrap().unwrap();
            let civil_ns = unix_ns + frame.due_ns.unwrap() - monotonic_ns;
            assert!(civil_ns >= unix_ns, "nothing from before the agent's start");
            let truth = world.truth((civil_ns - EPOCH) as f64 * 1e-9);
            assert_eq!(frame.bodies.len(), 2);
            for (body, person) in frame.bodies.iter().zip(&truth) {
                for joint in Joint::ALL {
                    let seen = body.joints[joint as usize].unwrap().position;
                    let placed = world.room_from_sensor(sensor).apply(seen);
                    let distance = placed.distance(person.joints[joint].unwrap());
                    assert!(distance < 1e-6, "sensor {sensor}, {joint}: {distance} m");
                }
            }
        }
    }
}

#[test]
fn agents_started_by_hand_in_different_rounds_see_the_same_people() {
    let scenario = config(0, SensorErrors::none()).scenario;
    let world = World::new(&scenario).unwrap();
    let round_ns = (world.performance().round_s().unwrap() * 1e9).round() as i64;
    let first = shared_epoch_unix_ns(&scenario, EPOCH).unwrap();
    assert!(first <= EPOCH && EPOCH - first < round_ns);
    let boundary = first + round_ns;
    let second = shared_epoch_unix_ns(&scenario, boundary + 1).unwrap();
    assert_eq!(
        shared_epoch_unix_ns(&scenario, boundary - 1).unwrap(),
        first
    );
    assert_eq!(second, boundary);
    for seconds in [0.0, 7.3, 120.0, 1000.1] {
        let since = |epoch: i64| (boundary - epoch) as f64 * 1e-9 + seconds;
        for (one, other) in world
            .truth(since(first))
            .iter()
            .zip(world.truth(since(second)))
        {
            for joint in Joint::ALL {
                let apart = one.joints[joint]
                    .unwrap()
                    .distance(other.joints[joint].unwrap());
                assert!(apart < 1e-5, "{joint} at {seconds} s: {apart} m");
            }
        }
    }
    let empty = Scenario {
        people: 0,
        ..scenario
    };
    assert_eq!(
        shared_epoch_unix_ns(&empty, 301_000_000_000).unwrap(),
        300_000_000_000
    );
}

#[test]
fn frames_and_probes_are_stamped_by_the_same_faulty_clock() {
    let mut errors = SensorErrors::none();
    (
        errors.clock_offset_ms,
        errors.clock_drift_ppm,
        errors.delay_ms,
    ) = (50.0, 50.0, 20.0);
    let mut source = open(&config(1, errors), 1_000, EPOCH);
    let shows = source.clock();
    let mut offsets = Vec::new();
    for _ in 0..3000 {
        let frame = source.next_frame().unwrap().unwrap();
        let caught_at = frame.due_ns.unwrap() - 20_000_000;
        assert!(
            (shows(caught_at).ns() - frame.captured.ns()).abs() <= 1,
            "{frame:?}"
        );
        offsets.push(frame.captured.ns() - (caught_at - 1_000));
    }
    assert!(
        offsets[0].abs() > 1_000_000,
        "the clock is off: {} ns",
        offsets[0]
    );
    assert!((offsets[2999] - offsets[0]).abs() > 100_000, "and drifts");
}

#[test]
fn frames_are_due_at_the_sensors_pace_and_never_out_of_order() {
    let mut source = open(&config(3, SensorErrors::harsh()), 0, EPOCH);
    let due: Vec<i64> = (0..600)
        .map(|_| source.next_frame().unwrap().unwrap().due_ns.unwrap())
        .collect();
    assert!(due.windows(2).all(|pair| pair[0] <= pair[1]));
    let seconds = (due[599] - due[0]) as f64 * 1e-9;
    assert!(
        (seconds - 20.0).abs() < 1.2,
        "600 frames at 30 Hz less 2 % drops took {seconds} s"
    );
}

#[test]
fn a_sensor_that_the_room_does_not_have_is_refused() {
    let clock: Arc<dyn Clock> = Arc::new(Fixed(0, 0));
    let error = SimSource::open(&config(4, SensorErrors::none()), &clock)
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.contains("`sensor` must be 0 to 3") && error.contains("found 4"),
        "{error}"
    );
    let mut wrong = config(0, SensorErrors::none());
    wrong.scenario.rate_hz = 0.0;
    let error = SimSource::open(&wrong, &clock).err().unwrap().to_string();
    assert!(error.contains("rate_hz"), "{error}");
}

#[test]
fn settings_read_from_text_and_refuse_unknown_keys() {
    use crate::SourceConfig;
    let text = r#"{"kind":"sim","sensor":2,"epoch_unix_ns":5,"scenario":{"people":2}}"#;
    let config: SourceConfig = serde_json::from_str(text).unwrap();
    assert!(
        matches!(&config, SourceConfig::Sim(sim) if sim.sensor == 2 && sim.scenario.people == 2)
    );
    let back: SourceConfig =
        serde_json::from_str(&serde_json::to_string(&config).unwrap()).unwrap();
    assert_eq!(back, config);
    for wrong in [
        r#"{"kind":"sim","sensors":2}"#,
        r#"{"kind":"csv","file":"a","kinect":"1","sped":2}"#,
        r#"{"kind":"csv","file":"a","kinect":"1","replay":{"sped":2}}"#,
        r#"{"kind":"lidar"}"#,
    ] {
        assert!(
            serde_json::from_str::<SourceConfig>(wrong).is_err(),
            "{wrong} was taken"
        );
    }
}
