//! The statistics behind the simple model `gaussian`, from recorded motion.
//!
//! `cargo run --release -p posefuse-fusion --example pose_statistics -- FOLDER TABLE` reads every recording below FOLDER
//! (BVH, AMC, exponential maps) that `models/training/split.toml` lets train, and writes TABLE, which is
//! `fusion/src/repair/gaussian/poses.bin` (its layout: `table.rs` beside it). How good the model is that it serves, says
//! `posefuse evaluate repair --simple`.

mod learn;
mod recordings;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [folder, table] => learn::learn(Path::new(folder), Path::new(table)),
        _ => Err("expected: FOLDER TABLE".into()),
    }
}
