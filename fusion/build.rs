//! Makes `POSEFUSE_FUSION_BUILD`: the version and a fingerprint of every source that decides what the engine gives.

use std::path::{Path, PathBuf};
use std::{fs, io};

/// The crates that the engine consists of, from this one's folder.
const SOURCES: [&str; 3] = ["src", "../skeleton/src", "../sgfilter/src"];

fn main() -> io::Result<()> {
    let here = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        let folder = here.join(source);
        for file in files(&folder)? {
            // Names with `/` and lines without carriage returns, so that every checkout gives the same.
            let name = file.strip_prefix(&folder).unwrap_or(&file);
            let name: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
            let text = fs::read(&file)?;
            hash = fnv_1a(
                hash,
                source
                    .bytes()
                    .chain([0])
                    .chain(name.join("/").bytes())
                    .chain([0]),
            );
            hash = fnv_1a(
                hash,
                text.into_iter().filter(|byte| *byte != b'\r').chain([0]),
            );
        }
    }
    println!("cargo::rerun-if-changed=build.rs");
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    println!("cargo::rustc-env=POSEFUSE_FUSION_BUILD=posefuse {version} ({hash:016x})");
    Ok(())
}

/// The files below `folder`, in order of their paths.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else if path
            .extension()
            .is_some_and(|extension| extension == "rs" || extension == "bin")
        {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn fnv_1a(hash: u64, bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(hash, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
