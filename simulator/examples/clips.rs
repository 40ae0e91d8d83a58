//! Turns motion files into arrays for training: `cargo run --release -p posefuse-simulator --example clips -- FOLDER OUT [MADE]`.
//!
//! Every `.bvh`, `.amc` and exponential-map `.txt` or `.csv` below FOLDER becomes the file of the same place and name
//! below OUT, as `.npy`: frames x 25 joints x 3 as little-endian f32, 30 frames per second, metres, room axes (x forward,
//! y left, z up), joints in the order of [`Joint::ALL`], NaN where the file has no such joint. With a number MADE, that
//! many seeds of each of the simulator's own situations are written as well, below OUT/made. stdout lists what was
//! skipped and why, as `path<TAB>reason`; a summary goes to stderr. Exit code 3 if anything was skipped.

use std::error::Error;
use std::fs;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use posefuse_simulator::load::{find, load};
use posefuse_simulator::motion::{Cast, Clip, Performance, Situation};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

const RATE_HZ: f64 = 30.0;
/// Shorter clips teach nothing.
const SHORTEST_S: f64 = 0.5;
const MADE_S: f64 = 120.0;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (folder, out, made) = match arguments.as_slice() {
        [folder, out] => (Path::new(folder), Path::new(out), 0),
        [folder, out, made] => (Path::new(folder), Path::new(out), made.parse::<u64>()?),
        _ => return Err("expected: clips FOLDER OUT [MADE]".into()),
    };
    let files = find(folder)?;
    let (mut written, mut skipped, mut frames) = (0, 0, 0);
    for file in &files {
        match convert(folder, file, out) {
            Ok(count) => {
                written += 1;
                frames += count;
            }
            Err(reason) => {
                skipped += 1;
                println!("{}\t{reason}", file.display());
            }
        }
    }
    let minutes = frames as f64 / RATE_HZ / 60.0;
    eprintln!("{written} files written, {minutes:.1} minutes; {skipped} skipped");
    if made > 0 {
        let minutes = make(out, made)?;
        eprintln!("{minutes:.1} minutes of made motion written");
    }
    Ok(ExitCode::from(if skipped > 0 { 3 } else { 0 }))
}

fn convert(folder: &Path, file: &Path, out: &Path) -> Result<usize, Box<dyn Error>> {
    let clip = load(file)?;
    let place = file.strip_prefix(folder)?;
    if clip.duration_s() < SHORTEST_S {
        let duration = clip.duration_s();
        return Err(
            format!("expected at least {SHORTEST_S} s of motion, found {duration:.2} s").into(),
        );
    }
    let poses = resampled(&clip);
    write(&out.join(place).with_extension("npy"), &poses)?;
    Ok(poses.len())
}

fn resampled(clip: &Clip) -> Vec<JointMap<Position<Room>>> {
    let count = (clip.duration_s() * RATE_HZ).floor() as usize + 1;
    (0..count)
        .map(|index| clip.pose(index as f64 / RATE_HZ))
        .collect()
}

/// The simulator's own motion: one file for each person of `seeds` seeds of every situation. Returns minutes.
fn make(out: &Path, seeds: u64) -> io::Result<f64> {
    let mut seconds = 0.0;
    for situation in Situation::ALL {
        for seed in 0..seeds {
            let performance = Performance::procedural(Cast {
                seed,
                people: 2,
                area_m: 3.0,
                hugs: situation == Situation::Hugging,
                situation,
                away_s: 10.0,
            });
            for person in 0..performance.people() {
                let poses: Vec<_> = (0..(MADE_S * RATE_HZ) as usize)
                    .map(|index| performance.pose(person, index as f64 / RATE_HZ))
                    .collect();
                let name = format!("{situation:?}_{seed}_{person}.npy").to_lowercase();
                write(&out.join("made").join(name), &poses)?;
                seconds += MADE_S;
            }
        }
    }
    Ok(seconds / 60.0)
}

/// NumPy's file format 1.0: magic, version, length of the header, the header padded to a multiple of 64, numbers.
fn write(path: &Path, poses: &[JointMap<Position<Room>>]) -> io::Result<()> {
    let mut header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 3), }}",
        poses.len(),
        Joint::ALL.len()
    );
    const BEFORE_HEADER: usize = 10;
    while !(BEFORE_HEADER + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for pose in poses {
        for joint in Joint::ALL {
            let numbers = pose[joint].map_or([f64::NAN; 3], |position| position.vector().into());
            for number in numbers {
                bytes.extend((number as f32).to_le_bytes());
            }
        }
    }
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(path, bytes)
}
