//! Recorded motion from files: BVH, Acclaim ASF/AMC, and CMU's exponential maps, as [`Clip`]s.
//!
//! Whatever a file's axes and units, a clip has room axes (x forward, y left, z up), metres, canonical joints, and
//! its feet on the floor. A broken file is refused with its path, the line and the reason.

mod acclaim;
mod amc;
mod bvh;
mod expmap;
mod names;
#[cfg(test)]
mod tests;
mod tree;

use std::fs;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::motion::Clip;

pub use amc::acclaim;
pub use bvh::bvh;
pub use expmap::expmap;

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {reason}")]
pub struct Flaw {
    /// The line, from 1.
    pub line: usize,
    /// What was expected and what was found.
    pub reason: String,
}

/// A file that cannot be read as a motion.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file system says no.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The content is broken.
    #[error("{path}, {flaw}")]
    Broken {
        /// The file.
        path: PathBuf,
        /// Where and why.
        flaw: Flaw,
    },
    /// No loader for this kind of file.
    #[error(
        "{path}: expected a .bvh, an .amc with its .asf beside it, or an exponential-map .txt or .csv"
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
    /// An AMC needs the skeleton it was made with.
    #[error("{path}: no skeleton found; expected {expected} beside it")]
    NoSkeleton {
        /// The AMC.
        path: PathBuf,
        /// The ASF that was looked for.
        expected: PathBuf,
    },
}

/// CMU's salsa, as BVH, says 120 Hz and was taken at 60.
const REALLY_60_HZ: &str = "salsa";

/// The motion in the file at `path`, by its extension.
///
/// A BVH file below a folder `salsa` that says 120 Hz is taken to be CMU's, and at 60 Hz. An `.amc` needs its skeleton in the same folder: for `35_01.amc` that is `35.asf`, or `35_01.asf`.
pub fn load(path: &Path) -> Result<Clip, LoadError> {
    let name = path
        .file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let broken = |path: &Path| {
        let path = path.to_owned();
        move |flaw| LoadError::Broken { path, flaw }
    };
    match extension.as_deref() {
        Some("bvh") => {
            let clip = bvh(&name, &read(path)?).map_err(broken(path))?;
            let salsa = path.iter().any(|part| part == REALLY_60_HZ) && clip.rate_hz() > 100.0;
            Ok(if salsa { clip.at_half_rate() } else { clip })
        }
        Some("txt" | "csv") => expmap(&name, &read(path)?).map_err(broken(path)),
        Some("amc") => {
            let skeleton = skeleton_of(path, &name)?;
            let asf = acclaim::Skeleton::parse(&read(&skeleton)?).map_err(broken(&skeleton))?;
            amc::motion(&name, &asf, &read(path)?).map_err(broken(path))
        }
        _ => Err(LoadError::UnknownKind {
            path: path.to_owned(),
        }),
    }
}

/// All files below `folder` that look like motion by their names, in order.
///
/// # Errors
/// A folder that cannot be read.
pub fn find(folder: &Path) -> Result<Vec<PathBuf>, LoadError> {
    let unreadable = |source| LoadError::Unreadable {
        path: folder.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if path.is_dir() {
            files.extend(find(&path)?);
        } else if matches!(extension.as_deref(), Some("bvh" | "amc" | "txt" | "csv")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn skeleton_of(amc: &Path, name: &str) -> Result<PathBuf, LoadError> {
    let subject = name.split('_').next().unwrap_or(name);
    let expected = amc.with_file_name(format!("{subject}.asf"));
    [expected.clone(), amc.with_extension("asf")]
        .into_iter()
        .find(|path| path.is_file())
        .ok_or_else(|| LoadError::NoSkeleton {
            path: amc.to_owned(),
            expected,
        })
}

fn read(path: &Path) -> Result<String, LoadError> {
    let unreadable = |source| LoadError::Unreadable {
        path: path.to_owned(),
        source,
    };
    let bytes = fs::read(path).map_err(unreadable)?;
    // Comments of old files hold bytes of forgotten encodings; numbers and names are ASCII.
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn flaw<T>(line: usize, reason: impl Into<String>) -> Result<T, Flaw> {
    Err(Flaw {
        line,
        reason: reason.into(),
    })
}

/// A finite number.
fn number(line: usize, word: &str) -> Result<f64, Flaw> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => flaw(line, format!("expected a finite number, found `{word}`")),
    }
}

/// Exactly `count` finite numbers.
fn numbers(line: usize, words: &[&str], count: usize) -> Result<Vec<f64>, Flaw> {
    if words.len() != count {
        return flaw(
            line,
            format!("expected {count} numbers, found {}", words.len()),
        );
    }
    words.iter().map(|word| number(line, word)).collect()
}
