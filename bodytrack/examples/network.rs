//! Whether each runtime says of the network's golden crops what was stored at its export, and what a person costs: the cut
//! and the network.
//!
//! `cargo run --release -p posefuse-bodytrack --example network [-- bodytrack/data/depth-joints.toml]`

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use posefuse_bodytrack::crop::{CHANNELS, Cropper, SIZE};
use posefuse_models::{BackendChoice, Config, Network, NetworkFile};
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{Scenario, World};

const CROP: usize = CHANNELS * SIZE * SIZE;
/// Outputs in the golden file's order with their numbers for one crop.
const OUTPUTS: [(&str, usize); 5] = [
    ("joints", 75),
    ("sigma", 25),
    ("visible", 25),
    ("heading", 2),
    ("hands", 2),
];
/// Most that two runtimes may differ.
const NEAR: f32 = 1e-3;
const TIMED: usize = 60;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let shipped = || Path::new(env!("CARGO_MANIFEST_DIR")).join("data/depth-joints.toml");
    let path = std::env::args().nth(1).map_or_else(shipped, PathBuf::from);
    let file = NetworkFile::read(&path)?;
    let golden: Vec<f32> = std::fs::read(path.with_extension("golden.bin"))?
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes(std::array::from_fn(|i| bytes[i])))
        .collect();
    let mut good = true;
    for backend in [BackendChoice::Rten, BackendChoice::Ort] {
        let config = Config {
            backend,
            ..Config::default()
        };
        match Network::open(&file, &config) {
            Ok(mut network) => good &= check(&mut network, &golden)?,
            Err(refused) => println!("{backend:?}: not compared: {refused}"),
        }
    }
    cut();
    Ok(if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

fn check(network: &mut Network, golden: &[f32]) -> Result<bool, Box<dyn Error>> {
    let each = CROP + OUTPUTS.iter().map(|(_, numbers)| numbers).sum::<usize>();
    let count = golden.len() / each;
    let crops = &golden[..count * CROP];
    fill(network, crops);
    network.run(count)?;
    let (mut worst, mut at) = (0.0f32, count * CROP);
    for (name, numbers) in OUTPUTS {
        let stored = &golden[at..at + count * numbers];
        at += count * numbers;
        let found = network.output(name);
        let differences = found.iter().zip(stored).map(|(a, b)| (a - b).abs());
        worst = differences.fold(worst, f32::max);
    }
    let word = if worst <= NEAR { "agrees" } else { "DIFFERS" };
    println!(
        "{}: {word} ({worst:.1e}) on {count} golden crops",
        network.runtime()
    );
    for people in [1, 2, 4] {
        let input: Vec<f32> = crops.iter().copied().cycle().take(people * CROP).collect();
        fill(network, &input);
        let mut times = Vec::with_capacity(TIMED);
        for _ in 0..TIMED {
            let began = Instant::now();
            network.run(people)?;
            times.push(began.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let [least, median] = [times[0], times[TIMED / 2]].map(|ms| ms / people as f64);
        println!("  {people} people: {median:.2} ms a person (least {least:.2})");
    }
    Ok(worst <= NEAR)
}

fn fill(network: &mut Network, crops: &[f32]) {
    if let Some(input) = network.input("crop") {
        input.clear();
        input.extend_from_slice(crops);
    }
}

/// What it costs to cut a person out.
fn cut() {
    let Ok(world) = World::new(&Scenario::default()) else {
        return;
    };
    for [width, height] in [[320, 240], [640, 480]] {
        let camera = DepthCamera::structured_light(width, height);
        let view = world.depth_with_owners(0, 2.0, &camera);
        let (mut cropper, mut crop) = (Cropper::default(), Vec::new());
        let belongs = |at: usize| view.owners[at] == 1;
        let extent = extent(width as usize, &view.owners);
        let mut times: Vec<f64> = Vec::with_capacity(TIMED);
        for _ in 0..TIMED {
            crop.clear();
            let began = Instant::now();
            let frame = cropper.cut(&view.image, &camera.intrinsics, extent, belongs, &mut crop);
            times.push(began.elapsed().as_secs_f64() * 1e3);
            assert!(frame.is_some(), "the person is in view");
        }
        times.sort_by(f64::total_cmp);
        let ms = times[TIMED / 2];
        println!("cut out of {width} x {height}: {ms:.2} ms");
    }
}

/// Columns and rows that hold all of person 1.
fn extent(width: usize, owners: &[u8]) -> [[usize; 2]; 2] {
    let mut extent = [[usize::MAX, 0]; 2];
    for (at, _) in owners.iter().enumerate().filter(|(_, owner)| **owner == 1) {
        for (side, index) in extent.iter_mut().zip([at % width, at / width]) {
            *side = [side[0].min(index), side[1].max(index + 1)];
        }
    }
    extent
}
