//! Generates the Rust code and the descriptor set of the wire from `proto/posefuse/v1/*.proto`.
//!
//! The result is checked in, so that building Posefuse needs no generator; `--check` compares instead of writing.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use prost::Message;

const SOURCES: [&str; 4] = [
    "posefuse/v1/types.proto",
    "posefuse/v1/ingest.proto",
    "posefuse/v1/room.proto",
    "posefuse/v1/take.proto",
];

/// Writes (or with `check` compares) `proto/src/generated`.
pub(crate) fn run(root: &Path, check: bool) -> Result<()> {
    let proto = root.join("proto");
    let descriptors =
        protox::compile(SOURCES, [&proto]).context("the .proto files do not compile")?;
    let fresh = tempdir()?;
    fs::write(fresh.join("descriptors.bin"), descriptors.encode_to_vec())?;
    tonic_prost_build::configure()
        .out_dir(&fresh)
        .compile_fds(descriptors)
        .context("code generation failed")?;
    let target = proto.join("src/generated");
    for name in ["posefuse.v1.rs", "descriptors.bin"] {
        let made = fs::read(fresh.join(name))?;
        let place = target.join(name);
        if !check {
            fs::create_dir_all(&target)?;
            fs::write(&place, &made)?;
        } else if fs::read(&place).ok().as_deref() != Some(&made) {
            bail!(
                "{} is not what the .proto files give; run `cargo xtask generate` and commit it",
                place.display()
            );
        }
    }
    fs::remove_dir_all(fresh)?;
    Ok(())
}

fn tempdir() -> Result<std::path::PathBuf> {
    let path = std::env::temp_dir().join(format!("posefuse-generate-{}", std::process::id()));
    fs::create_dir_all(&path)?;
    Ok(path)
}
