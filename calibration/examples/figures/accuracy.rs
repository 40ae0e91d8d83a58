//! The tables of exactness, honesty and time.

use std::time::Instant;

use posefuse_calibration::{Options, solve};
use posefuse_simulator::Layout;

use crate::simulated::{PairError, record};
use crate::survey::{METHODS, Surveyed, WALKS, world};

/// Median and worst error by room, walk and method.
pub(crate) fn print(rooms: &[Surveyed]) {
    println!(
        "Exactness: volume RMS mm, degrees, ms; median / worst over pairs of sensors and seeds"
    );
    print!("{:<24}{:>6}", "room", "walk");
    METHODS
        .iter()
        .for_each(|method| print!("{:>32}", format!("{method}  mm | deg | ms")));
    println!("{:>8}{:>22}", "solve s", "passed/weak/failed");
    for group in rooms.chunk_by(|x, y| key(x) == key(y)) {
        for (index, seconds) in WALKS.iter().enumerate() {
            let (layout, sensors, biased) = key(&group[0]);
            let bias = if biased { ", 8 mm bias" } else { "" };
            print!(
                "{:<24}{seconds:>4.0} s",
                format!("{layout:?} of {sensors}{bias}")
            );
            for method in 0..METHODS.len() {
                let errors = group
                    .iter()
                    .flat_map(|room| &room.walks[index].errors[method]);
                print!("{:>32}", cell(&errors.copied().collect::<Vec<_>>()));
            }
            let times = group.iter().map(|room| room.walks[index].solve_s);
            let mut counts = [0; 3];
            for room in group {
                let verdict = room.walks[index]
                    .report
                    .as_ref()
                    .map_or(2, |r| r.verdict as usize);
                counts[verdict] += 1;
            }
            println!("{:>8.3}{:>22}", median(times), format!("{counts:?}"));
        }
    }
    for (biased, walk) in [(false, 1), (true, 1), (false, 0), (true, 0)] {
        let of = rooms.iter().filter(|room| room.biased == biased);
        let errors: Vec<PairError> = of.flat_map(|r| r.walks[walk].errors[2].clone()).collect();
        let bias = if biased {
            "8 mm bias"
        } else {
            "default errors"
        };
        println!(
            "all rooms, {bias}, {:.0} s: ours {}",
            WALKS[walk],
            cell(&errors)
        );
    }
}

fn key(room: &Surveyed) -> (Layout, usize, bool) {
    (room.layout, room.sensors, room.biased)
}

fn cell(errors: &[PairError]) -> String {
    let part = |of: fn(&PairError) -> f64, digits: usize| {
        let values = || errors.iter().map(|error| of(error).abs());
        let worst = values().fold(0.0, f64::max);
        format!("{:.digits$}/{worst:.digits$}", median(values()))
    };
    if errors.is_empty() {
        return "-".to_owned();
    }
    format!(
        "{} {} {}",
        part(|e| e.volume_mm, 1),
        part(|e| e.turn_deg, 2),
        part(|e| e.time_ms, 1)
    )
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// How often the true error lies inside the stated 95 % bound.
pub(crate) fn print_covariance(rooms: &[Surveyed]) {
    println!(
        "\nHonesty: share of sensors' true errors inside the stated 95 % bound: place, turn, time"
    );
    for (index, seconds) in WALKS.iter().enumerate() {
        for biased in [false, true] {
            let of = rooms.iter().filter(|room| room.biased == biased);
            let ratios: Vec<_> = of.flat_map(|r| r.walks[index].over_bound.clone()).collect();
            let bias = if biased {
                "8 mm bias"
            } else {
                "default errors"
            };
            if ratios.is_empty() {
                println!("{bias}, {seconds:.0} s: no sigma is stated");
                continue;
            }
            let share = |part: usize| {
                let inside = ratios.iter().filter(|ratio| ratio[part] <= 1.0);
                format!(
                    "{:.1} %",
                    100.0 * inside.count() as f64 / ratios.len() as f64
                )
            };
            let typical = |part: usize| format!("{:.2}", median(ratios.iter().map(|r| r[part])));
            println!(
                "{bias}, {seconds:.0} s, {} sensors: {} {} {}; median error over bound {} {} {}",
                ratios.len(),
                share(0),
                share(1),
                share(2),
                typical(0),
                typical(1),
                typical(2)
            );
        }
    }
}

/// Seconds to solve four sensors and 30 s on one core.
pub(crate) fn print_time() {
    let times = (1..=5).map(|seed| {
        let walk = record(&world(Layout::Ring, 4, false, seed), 30.0);
        let start = Instant::now();
        let solved = solve(&walk, &Options::default());
        let seconds = start.elapsed().as_secs_f64();
        solved.map_or(f64::INFINITY, |_| seconds)
    });
    let times: Vec<f64> = times.collect();
    let worst = times.iter().copied().fold(0.0, f64::max);
    let typical = median(times.into_iter());
    println!("Time: ring of 4, 30 s, one core: median {typical:.3} s, worst of 5 {worst:.3} s\n");
}
