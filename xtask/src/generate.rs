//! Generates the Rust code and the descriptor sets of our .proto files: the wire (`proto/posefuse/v1`) and what takes and
//! live streams hold for viewers (`proto/foxglove`).
//!
//! The result is checked in, so that building Posefuse needs no generator; `--check` compares instead of writing.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use prost::Message;

/// One set of .proto files and where its generated code lies.
struct Set {
    /// The folder that imports start from.
    root: &'static str,
    sources: &'static [&'static str],
    target: &'static str,
    /// The file that prost makes of the package.
    code: &'static str,
}

const SETS: [Set; 2] = [
    Set {
        root: "proto",
        sources: &[
            "posefuse/v1/types.proto",
            "posefuse/v1/ingest.proto",
            "posefuse/v1/room.proto",
            "posefuse/v1/take.proto",
        ],
        target: "proto/src/generated",
        code: "posefuse.v1.rs",
    },
    Set {
        root: "proto/foxglove",
        sources: &["foxglove.proto"],
        target: "proto/src/foxglove/generated",
        code: "foxglove.rs",
    },
];

/// Writes (or with `check` compares) the generated folders.
pub(crate) fn run(root: &Path, check: bool) -> Result<()> {
    SETS.iter().try_for_each(|set| generate(root, set, check))
}

fn generate(root: &Path, set: &Set, check: bool) -> Result<()> {
    let descriptors = protox::compile(set.sources, [root.join(set.root)])
        .with_context(|| format!("the .proto files in {} do not compile", set.root))?;
    let fresh = tempdir()?;
    fs::write(fresh.join("descriptors.bin"), descriptors.encode_to_vec())?;
    tonic_prost_build::configure()
        .out_dir(&fresh)
        .compile_fds(descriptors)
        .context("code generation failed")?;
    let target = root.join(set.target);
    for name in [set.code, "descriptors.bin"] {
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
