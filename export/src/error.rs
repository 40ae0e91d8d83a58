//! What can go wrong with an export: what was expected, what was found, what to do.

use std::io;
use std::path::PathBuf;

use posefuse_session::TakeError;
use thiserror::Error;

/// An export that was not made. Files that were finished before stay; no file is left half written.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The take cannot be read.
    #[error(transparent)]
    Take(#[from] TakeError),
    /// The options contradict each other or a format.
    #[error("{0}")]
    Option(String),
    /// Nobody to export.
    #[error("take `{take}`: {reason}")]
    Nobody {
        /// The take.
        take: String,
        /// Why there is nobody, and what can be done.
        reason: String,
    },
    /// A file of that name is there.
    #[error("{0} is there already; choose another folder with --out, or --force to write over it")]
    Exists(PathBuf),
    /// Two files of one export would be the same one.
    #[error(
        "two files of this export would both be {0}; export fewer people (--person) or formats (--format) at a time"
    )]
    Twice(PathBuf),
    /// More files than a process may have open: all are written at the same time.
    #[error(
        "this would be {files} files at once, one for each person and format, and at most {most} can be; choose some of the \
         people with --person, leave short ones out with --least, or export fewer formats at a time"
    )]
    TooMany {
        /// So many.
        files: usize,
        /// The most.
        most: usize,
    },
    /// A file cannot be written.
    #[error("{path} cannot be written: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl ExportError {
    pub(crate) fn write(path: &std::path::Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}

/// What this crate's functions give.
pub type Result<T, E = ExportError> = std::result::Result<T, E>;
