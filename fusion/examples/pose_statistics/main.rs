//! The statistics behind the simple model `gaussian`, from recorded motion.
//!
//! `cargo run --release -p posefuse-fusion --example pose_statistics -- learn FOLDER TABLE` reads every recording below FOLDER
//! (BVH, AMC, exponential maps) that `models/training/split.toml` lets train, and writes TABLE, which is
//! `fusion/src/repair/gaussian/poses.bin` (its layout: `table.rs` beside it).
//!
//! `... -- measure FOLDER [NOISE_MM]` hides limbs of the recordings held out and unseen, lets every simple model fill them in, and
//! prints to stdout, per model, limb and length of the gap: the mean error (mm), its 95th percentile, and the root mean
//! square error over the standard deviation that the model itself named (1 is right).

mod learn;
mod measure;
mod recordings;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["learn", folder, table] => learn::learn(Path::new(folder), Path::new(table)),
        ["measure", folder] => measure::measure(Path::new(folder), 0.0),
        ["measure", folder, noise_mm] => measure::measure(Path::new(folder), noise_mm.parse()?),
        _ => Err("expected: learn FOLDER TABLE, or measure FOLDER [NOISE_MM]".into()),
    }
}
