//! What a network can break must not be lost: the real server and real agents over several seeds, in simulated time, so
//! that a minute of partition takes a second and a failure comes again from its seed (`POSEFUSE_SEED=3` runs only that).

use std::collections::BTreeMap;
use std::time::Duration;

use posefuse_agent::AgentReport;
use posefuse_proto::v1::SensorState;
use posefuse_skeleton::Observation;
use posefuse_tests::account::{assert_as_captured, not_recorded, observations, sensor};
use posefuse_tests::simulated::{Happening, Lab, Plan, sensor_name};

const MS: Duration = Duration::from_millis(1);
const S: Duration = Duration::from_secs(1);

/// The seeds of a test, or the one asked for.
fn seeds(count: u64) -> Vec<u64> {
    match std::env::var("POSEFUSE_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok())
    {
        Some(seed) => vec![seed],
        None => (1..=count).collect(),
    }
}

/// A number from 0 to `below`, excluded, for one question of one seed.
fn drawn(seed: u64, question: u64, below: u64) -> u64 {
    use rand::{RngExt, SeedableRng};
    let mut random =
        rand::rngs::StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(question));
    random.random_range(0..below)
}

/// A frame of this sensor has reached a subscriber.
fn observed(index: usize) -> impl Fn(&Happening) -> bool {
    move |what| matches!(what, Happening::Observed { sensor, .. } if *sensor == sensor_name(index))
}

fn is_state(index: usize, wanted: SensorState) -> impl Fn(&Happening) -> bool {
    move |what| matches!(what, Happening::State { sensor, state } if *sensor == sensor_name(index) && *state == wanted)
}

/// Ends the take and closes the books of one life of the server: received = recorded + counted drops, for every
/// sensor, and no frame twice.
fn close_books(lab: &mut Lab, take: &str) -> BTreeMap<String, Vec<Observation>> {
    let status = lab.status();
    let info = lab.stop_take();
    assert_eq!((info.dropped, info.trouble.as_str()), (0, ""));
    let recorded = observations(&lab.take(take));
    for (name, captured) in lab.captured() {
        let (sensor, recorded) = (
            sensor(&status, &name),
            recorded.get(&name).map_or(&[][..], Vec::as_slice),
        );
        assert_as_captured(&name, &captured, recorded);
        assert_eq!(
            sensor.frames_received,
            recorded.len() as u64 + not_recorded(sensor),
            "{name}: received is not recorded + refused: {sensor:#?}"
        );
        assert_eq!(
            sensor.frames_lost, 0,
            "{name}: gaps in the sequence numbers"
        );
    }
    recorded
}

fn assert_all_delivered(reports: &[AgentReport]) {
    for report in reports {
        let undelivered = (report.dropped, report.unacknowledged);
        assert_eq!(
            (report.captured - report.delivered, undelivered),
            (0, (0, 0)),
            "{report:?}"
        );
    }
}

/// Fused frames of a take are numbered without gap and their times strictly increase.
fn assert_frames_in_order(lab: &Lab, take: &str) -> usize {
    let frames: Vec<_> = lab.take(take).frames().map(Result::unwrap).collect();
    for pair in frames.windows(2) {
        assert_eq!(
            pair[0].number + 1,
            pair[1].number,
            "a frame is missing in the take"
        );
        assert!(
            pair[0].time < pair[1].time,
            "{:?} then {:?}",
            pair[0].time,
            pair[1].time
        );
    }
    frames.len()
}

#[test]
fn an_agent_that_is_cut_off_for_up_to_50_s_loses_nothing() {
    for seed in seeds(6) {
        let (sensors, away) = (3, Duration::from_millis(20_000 + drawn(seed, 0, 30_000)));
        let cut_off = drawn(seed, 1, sensors as u64) as usize;
        let mut lab = Lab::new(&Plan::new(seed, sensors));
        lab.start_take("partition");
        lab.start_agents(away.as_secs_f64() + 12.0);
        lab.run_for(5 * S + drawn(seed, 2, 1000) as u32 * MS);

        lab.partition(cut_off);
        let gone = is_state(cut_off, SensorState::Disconnected);
        let noticed = lab.until_happens("the server has noticed", 3 * S, gone);
        lab.run_for(away - noticed);
        lab.repair(cut_off);
        let resumed = lab.until_happens("frames come again", 5 * S, observed(cut_off));
        println!(
            "seed {seed}: cut off for {away:?}, noticed after {noticed:?}, resumed after {resumed:?}"
        );
        assert!(noticed <= 2 * S, "seed {seed}: noticed after {noticed:?}");
        assert!(resumed <= 2 * S, "seed {seed}: resumed after {resumed:?}");

        assert_all_delivered(&lab.until_agents_end(30 * S));
        let recorded = close_books(&mut lab, "partition");
        for (name, captured) in lab.captured() {
            assert_eq!(
                recorded[&name].len(),
                captured.len(),
                "seed {seed}: {name} lost frames"
            );
        }
        assert!(assert_frames_in_order(&lab, "partition") > 300);
    }
}

#[test]
fn after_a_restart_of_the_server_agents_are_back_soon_and_at_most_half_a_second_is_lost() {
    for seed in seeds(6) {
        let sensors = 3;
        let mut lab = Lab::new(&Plan::new(seed, sensors));
        lab.start_take("before");
        lab.start_agents(25.0);
        lab.run_for(6 * S + drawn(seed, 0, 1000) as u32 * MS);
        // Killed, connections end with a FIN; cut from power, they end without a word.
        let without_a_word = seed % 2 == 0;
        let all = 0..sensors;
        if without_a_word {
            all.clone().for_each(|index| lab.partition(index));
        }
        lab.crash_server();
        lab.run_for(S + drawn(seed, 1, 8000) as u32 * MS);
        if without_a_word {
            all.clone().for_each(|index| lab.repair(index));
        }
        lab.start_server();
        let start = lab.now();
        lab.start_take("after");
        let mut slowest = Duration::ZERO;
        for index in all {
            let back = || lab.log().first(start, observed(index));
            let at = match back() {
                Some(at) => at - start,
                None => {
                    lab.now() - start + lab.until_happens("its frames come", 5 * S, observed(index))
                }
            };
            slowest = slowest.max(at);
        }
        println!("seed {seed}: all agents back {slowest:?} after the server's start");
        assert!(
            slowest <= 2 * S,
            "seed {seed}: an agent came back only after {slowest:?}"
        );

        assert_all_delivered(&lab.until_agents_end(30 * S));
        let after = close_books(&mut lab, "after");
        let before = observations(&lab.take("before"));
        assert!(assert_frames_in_order(&lab, "before") > 100);
        for (name, captured) in lab.captured() {
            assert_as_captured(&name, &captured, &before[&name]);
            let recorded_until = before[&name].last().unwrap().sequence + 1;
            let resent_from = after[&name][0].sequence;
            let lost = resent_from.saturating_sub(recorded_until);
            println!("seed {seed}: {name}: {lost} acknowledged frames were not on the disk yet");
            assert!(
                lost <= 15,
                "seed {seed}: {name} lost {lost} frames, more than 0.5 s"
            );
            let came = (resent_from..captured.len() as u64).count();
            assert_eq!(
                after[&name].len(),
                came,
                "seed {seed}: {name}: frames missing after the restart"
            );
        }
    }
}

#[test]
fn a_bad_network_leaves_no_silent_gap() {
    let mut reconnections = 0;
    for seed in seeds(6) {
        let plan = Plan {
            max_latency: 120 * MS,
            loss: 0.002,
            repair: 0.1,
            ..Plan::new(seed, 3)
        };
        let mut lab = Lab::new(&plan);
        lab.start_take("bad");
        lab.start_agents(25.0);
        let reports = lab.until_agents_end(60 * S);
        let again: u64 = reports.iter().map(|report| report.connections - 1).sum();
        println!("seed {seed}: {again} times connected again");
        reconnections += again;
        assert_all_delivered(&reports);
        let recorded = close_books(&mut lab, "bad");
        for (name, captured) in lab.captured() {
            assert_eq!(
                recorded[&name].len(),
                captured.len(),
                "seed {seed}: {name} lost frames"
            );
        }
        assert!(assert_frames_in_order(&lab, "bad") > 300);
    }
    assert!(
        reconnections >= seeds(6).len() as u64,
        "the network was too good: {reconnections} reconnections"
    );
}

#[test]
fn fifty_agents_come_back_within_10_s() {
    for seed in seeds(1) {
        let sensors = 50;
        let plan = Plan {
            rate_hz: 4.0,
            tick: 5 * MS,
            ..Plan::new(seed, sensors)
        };
        let mut lab = Lab::new(&plan);
        lab.start_agents(20.0);
        lab.run_for(4 * S);
        let connected = |lab: &mut Lab| {
            lab.status()
                .sensors
                .iter()
                .filter(|s| s.state() == SensorState::Live)
                .count()
        };
        assert_eq!(connected(&mut lab), sensors, "before the restart");
        lab.crash_server();
        lab.run_for(6 * S);
        lab.start_server();
        let start = lab.now();
        lab.run_until("all agents are back", 10 * S, |lab| {
            (0..sensors).all(|index| lab.log().first(start, observed(index)).is_some())
        });
        println!(
            "seed {seed}: {sensors} agents back after {:?}",
            lab.now() - start
        );
        assert_all_delivered(&lab.until_agents_end(30 * S));
    }
}

#[test]
fn both_ends_notice_a_half_open_connection_within_2_s() {
    for seed in seeds(5) {
        let mut lab = Lab::new(&Plan::new(seed, 2));
        lab.start_take("held");
        lab.start_agents(20.0);
        lab.run_for(3 * S + drawn(seed, 0, 1000) as u32 * MS);
        lab.hold(0);
        let held = lab.now();
        lab.run_for(2 * S);
        let by_server = lab
            .log()
            .first(held, is_state(0, SensorState::Disconnected));
        let by_agent = lab.log().first(
            held,
            |what| matches!(what, Happening::Connects { agent } if *agent == sensor_name(0)),
        );
        let after = |at: Option<Duration>| at.map(|at| at - held);
        println!(
            "seed {seed}: noticed by the server after {:?}, by the agent after {:?}",
            after(by_server),
            after(by_agent)
        );
        assert!(
            by_server.is_some(),
            "seed {seed}: the server has not noticed after 2 s"
        );
        assert!(
            by_agent.is_some(),
            "seed {seed}: the agent has not noticed after 2 s"
        );
        lab.run_for(6 * S);
        lab.release(0);
        let resumed = lab.until_happens("frames come again", 5 * S, observed(0));
        assert!(resumed <= 2 * S, "seed {seed}: resumed after {resumed:?}");
        assert_all_delivered(&lab.until_agents_end(30 * S));
        let recorded = close_books(&mut lab, "held");
        for (name, captured) in lab.captured() {
            assert_eq!(
                recorded[&name].len(),
                captured.len(),
                "seed {seed}: {name} lost frames"
            );
        }
    }
}
