//! What goes wrong with liblsl, and what to do about it.

use std::path::PathBuf;

use thiserror::Error;

/// How one gets liblsl, for messages.
pub const HOW_TO_INSTALL: &str = "install it with `conda install -c conda-forge liblsl`, `brew install \
    labstreaminglayer/tap/lsl` or from https://github.com/sccn/liblsl/releases (`pip install pylsl` brings it, too, in its \
    folder pylsl/lib), and where it is not found, name it in PYLSL_LIB or in the settings";

/// What went wrong.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LslError {
    /// There is no library.
    #[error("liblsl is not installed (looked for {}); {HOW_TO_INSTALL}", tried.join(", "))]
    Missing {
        /// What was tried, each with why it did not do.
        tried: Vec<String>,
    },
    /// It is there, and is something else.
    #[error("{} is not liblsl: it has no function {missing}; {HOW_TO_INSTALL}", library.display())]
    NotLsl {
        /// The file, or the name that the system found it by.
        library: PathBuf,
        /// What it lacks.
        missing: &'static str,
    },
    /// A name or a description that C cannot hold.
    #[error("`{0}` is no text for liblsl: it must not hold a zero character")]
    Text(String),
    /// A call failed.
    #[error(
        "liblsl could not {doing}; are its ports (16572 and the next ones) taken by many other streams?"
    )]
    Call {
        /// What was to be done.
        doing: &'static str,
    },
    /// A sample that does not fit the stream.
    #[error("a sample of the stream has {expected} values, found {found}")]
    Sample {
        /// As many as there are channels.
        expected: usize,
        /// How many there were.
        found: usize,
    },
}
