//! Writes training data for the body-tracking network: crops of rendered people, and where their joints truly are.
//!
//! `cargo run --release -p posefuse-bodytrack --example crops -- MOTION SPLIT train|held_out|unseen COUNT SEED OUT [hands]`: MOTION is a
//! folder of recorded motion (as `posefuse_simulator::load::find` reads it), SPLIT is `models/training/split.toml`. Writes
//! OUT.crops (COUNT x 64 x 64 i16, see [`record`]) and OUT.truth (COUNT x [`record::TRUTH`] f32); with `hands` crops of hands instead (see [`hands`]).
//!
//! What is recorded is retargeted to bodies of many sizes; the rest is the simulator's own motion. People stand anywhere before
//! sensors of several kinds, alone or in each other's way, cut off by the image's border or a desk, and the mask that cuts
//! them out has the faults that a real segmentation has.

mod alter;
mod chance;
mod hands;
mod mask;
mod poses;
mod record;
mod scene;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use chance::Chance;
use hands::Hands;
use poses::{Poses, Subset};
use record::Writer;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (arguments, of_hands) = match arguments.split_last() {
        Some((last, before)) if last == "hands" => (before, true),
        _ => (arguments.as_slice(), false),
    };
    let [motion, split, subset, count, seed, out] = arguments else {
        return Err(
            "expected: crops MOTION SPLIT train|held_out|unseen COUNT SEED OUT [hands]".into(),
        );
    };
    let (count, seed): (usize, u64) = (count.parse()?, seed.parse()?);
    let subset: Subset = subset.parse()?;
    let poses = Poses::read(Path::new(motion), Path::new(split), subset, seed)?;
    eprintln!("{poses}");
    let (out, mut chance) = (Path::new(out), Chance::new(seed));
    if of_hands {
        return hands(&poses, &mut chance, count, out);
    }
    let mut writer = Writer::create(out)?;
    let mut told = Told::default();
    while writer.written() < count {
        let camera = scene::camera(&mut chance);
        let staged = scene::stage(&poses, camera, &mut chance);
        staged.write(&mut chance, &mut writer)?;
        told.tell(writer.written());
    }
    writer.finish()?;
    Ok(())
}

fn hands(
    poses: &Poses,
    chance: &mut Chance,
    count: usize,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let mut writer = Hands::create(out)?;
    let mut told = Told::default();
    while writer.written() < count {
        let (camera, kind) = hands::camera(chance);
        let staged = scene::stage(poses, camera, chance);
        writer.put(&staged, kind, chance)?;
        told.tell(writer.written());
    }
    writer.finish()?;
    Ok(())
}

/// Tells how far it is, every ten thousand crops.
struct Told {
    began: Instant,
    tens: usize,
}

impl Default for Told {
    fn default() -> Self {
        Self {
            began: Instant::now(),
            tens: 0,
        }
    }
}

impl Told {
    fn tell(&mut self, written: usize) {
        if written / 10_000 > self.tens {
            self.tens = written / 10_000;
            let each = self.began.elapsed().as_secs_f64() * 1e3 / written as f64;
            eprintln!("{written} crops, {each:.2} ms each");
        }
    }
}
