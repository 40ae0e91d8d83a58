//! What goes wrong with NiTE, and what to do about it.

use std::path::PathBuf;

use thiserror::Error;

/// How one gets NiTE, for messages.
pub const HOW_TO_INSTALL: &str = "NiTE 2.2 came with PrimeSense's sensors and is not given out any more; if you have it, \
    name the folder of libNiTE2.so (NiTE2.dll), where the folder NiTE2 with its data must lie too, in NITE2_REDIST64 or \
    with --library. Without it, `posefuse agent openni` tracks people with our own tracker";

/// What went wrong.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NiteError {
    /// There is no library.
    #[error("NiTE is not installed (looked for {}); {HOW_TO_INSTALL}", tried.join(", "))]
    Missing {
        /// What was tried, each with why it did not do.
        tried: Vec<String>,
    },
    /// It is there, and is another NiTE.
    #[error("{} is not NiTE 2.2: {reason}; {HOW_TO_INSTALL}", library.display())]
    NotNite {
        /// The file, or the name that the system found it by.
        library: PathBuf,
        /// Why.
        reason: String,
    },
    /// A call failed.
    #[error("NiTE could not {doing} (status {status}); {advice}")]
    Call {
        /// What was to be done.
        doing: &'static str,
        /// A `NITE_STATUS_...`.
        status: i32,
        /// What to look after.
        advice: &'static str,
    },
    /// The device that was asked for cannot be opened.
    #[error("{0}")]
    Device(String),
}
