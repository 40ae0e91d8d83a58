//! How soon a moved sensor is named, and how often an innocent one is.
//!
//! `cargo run --release -p posefuse-calibration --example drift [rooms] [hours] [usual|harsh] [first] [setup]`: in each of
//! so many rooms per motion (3) a real calibration of 30 s and three minutes of learning, then each of the four sensors is
//! moved in eight ways; then so many simulated hours (8) in which nothing moves, in rings and arcs of 2 to 6, from room
//! number `first` (0) on, or in one of those setups only. No rooms per motion: only the hours. Sensors give 10 frames a
//! second. `harsh`: biases of single sensors, swaps that are no mirrors and repeated frames on top.
//!
//! A sensor can be found out only while it sees somebody whom another sees, too: such seconds are counted.

mod room;

use std::time::Instant;

use nalgebra::Vector3;
use posefuse_calibration::SensorDrift;
use posefuse_simulator::{Layout, SensorErrors};
use room::{Motion, Move, Room, id};

const SETUP: (Layout, usize) = (Layout::Ring, 4);
const SENSORS: usize = SETUP.1;
/// Where nothing moves: the usual room and others.
const SETUPS: [(Layout, usize); 4] = [
    SETUP,
    (Layout::Arc, 3),
    (Layout::Ring, 2),
    (Layout::Ring, 6),
];
const RATE_HZ: f64 = 10.0;
/// How long nothing moves first, and how long is waited for an alarm, seconds.
const LEARNING_S: f64 = 180.0;
const WAIT_S: f64 = 40.0;
/// In time, seconds.
const AIM_S: f64 = 15.0;
/// Minutes of one room in which nothing moves.
const ROOM_MIN: f64 = 20.0;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, usual: f64| {
        let given = args.get(index).and_then(|arg| arg.parse::<f64>().ok());
        given.unwrap_or(usual)
    };
    let (rooms, hours) = (number(0, 3.0) as u64, number(1, 8.0));
    let errors = match args.get(2).map(String::as_str) {
        Some("harsh") => SensorErrors::harsh(),
        _ => SensorErrors::default(),
    };
    if rooms > 0 {
        cost(&errors);
        moves(rooms, &errors);
    }
    let only = args.get(4).map(|_| number(4, 0.0) as u64);
    quiet(hours, number(3, 0.0) as u64, only, &errors);
}

/// What comparing costs the engine, and a look the monitor: the same minute with and without, in turns.
fn cost(errors: &SensorErrors) {
    let mut room = Room::new(1, SETUP, 30.0, Motion::TwoPeople, errors.clone());
    let minute = room.record(60.0);
    let mut best_s = [f64::INFINITY; 2];
    let (mut look_s, mut looks) = (0.0, 0);
    for _ in 0..5 {
        for compares in [false, true] {
            let mut brain = room.brain.clone();
            brain.compare(compares);
            let took_s = brain.time(&minute, |took_s| {
                look_s += took_s;
                looks += 1;
            });
            let best = &mut best_s[usize::from(compares)];
            *best = best.min(took_s);
        }
    }
    println!(
        "engine, {SENSORS} sensors at 30 Hz, 2 people, 60 s: {:.0} ms without comparing, {:.0} ms with it (x {:.3}); a look \
         takes {:.1} ms",
        best_s[0] * 1e3,
        best_s[1] * 1e3,
        best_s[1] / best_s[0],
        look_s / f64::from(looks.max(1)) * 1e3
    );
}

/// The ways to move a sensor, in its own axes: right, down, ahead.
fn ways() -> Vec<(&'static str, Move)> {
    let way = |shift_cm: [f64; 3], turn_deg: [f64; 3]| Move {
        shift_m: Vector3::from(shift_cm) * 0.01,
        turn_rad: Vector3::from(turn_deg.map(f64::to_radians)),
    };
    let none = [0.0; 3];
    vec![
        ("2 cm aside", way([2.0, 0.0, 0.0], none)),
        ("2 cm down", way([0.0, 2.0, 0.0], none)),
        ("2 cm ahead", way([0.0, 0.0, 2.0], none)),
        ("1 degree up", way(none, [1.0, 0.0, 0.0])),
        ("1 degree aside", way(none, [0.0, 1.0, 0.0])),
        ("1 degree of roll", way(none, [0.0, 0.0, 1.0])),
        ("5 cm aside", way([5.0, 0.0, 0.0], none)),
        ("3 degrees aside", way(none, [0.0, 3.0, 0.0])),
    ]
}

/// What became of one kind of move.
#[derive(Default)]
struct Tally {
    moves: usize,
    /// Seconds in view until it was named.
    named_s: Vec<f64>,
    in_time: usize,
    /// Together with another that could be it, too.
    either: usize,
    /// Looks at which another sensor was named alone.
    innocent: usize,
    shift_mm: Vec<f64>,
    turn_deg: Vec<f64>,
    /// Median distance to the others over what is usual.
    residual: Vec<f64>,
}

fn moves(rooms: u64, errors: &SensorErrors) {
    println!(
        "{:<14}{:<18}{:>6}{:>8}{:>10}{:>8}{:>8}{:>10}{:>18}{:>20}{:>10}",
        "people",
        "move",
        "moves",
        "named",
        "in 15 s",
        "median",
        "worst",
        "innocent",
        "shift found (mm)",
        "turn found (deg)",
        "residual"
    );
    for motion in Motion::ALL.into_iter().filter(|m| *m != Motion::Nobody) {
        let mut tallies: Vec<Tally> = ways().iter().map(|_| Tally::default()).collect();
        for seed in 1..=rooms {
            let mut room = Room::new(seed, SETUP, RATE_HZ, motion, errors.clone());
            for slot in room.record(LEARNING_S) {
                room.brain.run(&slot, None, &mut |_, _| {});
            }
            let future = room.record(WAIT_S);
            for ((_, by), tally) in ways().into_iter().zip(&mut tallies) {
                for sensor in 0..SENSORS {
                    one_move(&room, &future, sensor, by, tally);
                }
            }
        }
        for ((name, _), tally) in ways().into_iter().zip(&mut tallies) {
            tally.print(motion.name(), name);
        }
    }
}

fn one_move(room: &Room, future: &[room::Slot], sensor: usize, by: Move, tally: &mut Tally) {
    let sensor = id(sensor);
    let mut brain = room.brain.clone();
    let (mut seen_s, mut named, mut last) = (0.0, false, None);
    for slot in future {
        brain.run(
            slot,
            Some((sensor, by)),
            &mut |_, drifts: &[SensorDrift]| {
                let own = drifts.iter().find(|drift| drift.sensor == sensor);
                let Some(own) = own else { return };
                seen_s += 1.0;
                if own.alarm && !named {
                    named = true;
                    tally.named_s.push(seen_s);
                    tally.in_time += usize::from(seen_s <= AIM_S);
                    tally.either += usize::from(own.instead.is_some());
                }
                let innocent = |drift: &&SensorDrift| {
                    drift.sensor != sensor && drift.alarm && drift.instead.is_none()
                };
                tally.innocent += drifts.iter().filter(innocent).count();
                last = Some(*own);
            },
        );
    }
    // Who is never in view of a second sensor is not judged.
    if seen_s < AIM_S && !named {
        return;
    }
    tally.moves += 1;
    if let Some(last) = last {
        tally.shift_mm.push(last.moved_m * 1e3);
        tally.turn_deg.push(last.turned_rad.to_degrees());
        tally.residual.push(last.residual_m / last.usual_m);
    }
}

impl Tally {
    fn print(&mut self, motion: &str, name: &str) {
        let median = middle(&mut self.named_s);
        let worst = self.named_s.last().copied().unwrap_or(f64::NAN);
        println!(
            "{motion:<14}{name:<18}{:>6}{:>8}{:>10}{median:>7.0}s{worst:>7.0}s{:>10}{:>18.0}{:>20.2}{:>8.2} x{}",
            self.moves,
            self.named_s.len(),
            self.in_time,
            self.innocent,
            middle(&mut self.shift_mm),
            middle(&mut self.turn_deg),
            middle(&mut self.residual),
            match self.either {
                0 => String::new(),
                some => format!("  ({some} as one of two)"),
            }
        );
    }
}

/// Nothing moves: every way of moving in every kind of room, then the same with other seeds.
fn quiet(hours: f64, first: u64, only: Option<u64>, errors: &SensorErrors) {
    let rooms = (hours * 60.0 / ROOM_MIN).ceil() as u64;
    let mut sum = Quiet::default();
    let began = Instant::now();
    for number in first..first + rooms {
        let (motions, setups) = (Motion::ALL.len() as u64, SETUPS.len() as u64);
        let motion = Motion::ALL[(number % motions) as usize];
        let setup = SETUPS[(only.unwrap_or(number / motions) % setups) as usize];
        let seed = 1 + number / motions;
        let mut room = Room::new(seed, setup, RATE_HZ, motion, errors.clone());
        let found = quiet_room(&mut room);
        println!(
            "  seed {seed}, {} in {:?}, {}: in view {:.0} s, {} false alarms, furthest from nothing {:.1}, residual up to {:.2} x",
            setup.1,
            setup.0,
            motion.name(),
            found.looked_s,
            found.false_alarms,
            found.worst,
            found.residual
        );
        sum.false_alarms += found.false_alarms;
        sum.looked_s += found.looked_s;
        sum.worst = sum.worst.max(found.worst);
        sum.residual = sum.residual.max(found.residual);
    }
    println!(
        "{:.1} h in which nothing moved ({rooms} rooms of {ROOM_MIN} min, people in view for {:.1} h): {} false alarms; \
         furthest from nothing {:.1} standard deviations; residual up to {:.2} x what is usual; {:.0} s of computing",
        rooms as f64 * ROOM_MIN / 60.0,
        sum.looked_s / 3600.0,
        sum.false_alarms,
        sum.worst,
        sum.residual,
        began.elapsed().as_secs_f64()
    );
}

#[derive(Default)]
struct Quiet {
    false_alarms: u64,
    looked_s: f64,
    /// Largest significance once something has been learnt.
    worst: f64,
    /// Largest median distance over what is usual, then.
    residual: f64,
}

fn quiet_room(room: &mut Room) -> Quiet {
    let mut found = Quiet::default();
    let mut alarmed = Vec::new();
    for _ in 0..(ROOM_MIN * 60.0) as usize {
        for slot in room.record(1.0) {
            room.brain.run(&slot, None, &mut |time_s, drifts| {
                for drift in drifts.iter().filter(|drift| drift.alarm) {
                    if !alarmed.contains(&drift.sensor) {
                        println!("  false alarm at {time_s:.0} s: {drift:?}");
                        found.false_alarms += 1;
                    }
                }
                let alarms = drifts.iter().filter(|d| d.alarm);
                alarmed = alarms.map(|d| d.sensor).collect();
                for drift in drifts.iter().filter(|_| time_s > LEARNING_S) {
                    found.worst = found.worst.max(drift.significance);
                    found.residual = found.residual.max(drift.residual_m / drift.usual_m);
                }
                found.looked_s += if drifts.is_empty() { 0.0 } else { 1.0 };
            });
        }
    }
    found
}

fn middle(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
