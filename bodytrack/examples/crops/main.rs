//! Writes training data for the body-tracking network: crops of rendered people, and where their joints truly are.
//!
//! `cargo run --release -p posefuse-bodytrack --example crops -- MOTION SPLIT train|held_out|unseen COUNT SEED OUT`: MOTION is a
//! folder of recorded motion (as `posefuse_simulator::load::find` reads it), SPLIT is `models/training/split.toml`. Writes
//! OUT.crops (COUNT x 64 x 64 i16, see [`record`]) and OUT.truth (COUNT x [`record::TRUTH`] f32).
//!
//! What is recorded is retargeted to bodies of many sizes; the rest is the simulator's own motion. People stand anywhere before
//! sensors of several kinds, alone or in each other's way, cut off by the image's border or a desk, and the mask that cuts
//! them out has the faults that a real segmentation has.

mod chance;
mod mask;
mod poses;
mod record;
mod scene;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use chance::Chance;
use poses::{Poses, Subset};
use record::Writer;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [motion, split, subset, count, seed, out] = arguments.as_slice() else {
        return Err("expected: crops MOTION SPLIT train|held_out|unseen COUNT SEED OUT".into());
    };
    let (count, seed): (usize, u64) = (count.parse()?, seed.parse()?);
    let subset: Subset = subset.parse()?;
    let poses = Poses::read(Path::new(motion), Path::new(split), subset, seed)?;
    eprintln!("{poses}");
    let mut writer = Writer::create(Path::new(out))?;
    let mut chance = Chance::new(seed);
    let began = Instant::now();
    while writer.written() < count {
        let before = writer.written();
        let staged = scene::stage(&poses, &mut chance);
        staged.write(&mut chance, &mut writer)?;
        if before / 10_000 != writer.written() / 10_000 {
            let each = began.elapsed().as_secs_f64() * 1e3 / writer.written() as f64;
            eprintln!("{} crops, {each:.2} ms each", writer.written());
        }
    }
    writer.finish()?;
    Ok(())
}
