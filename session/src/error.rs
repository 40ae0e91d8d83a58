//! What can go wrong with a take: what was expected, what was found, what to do.

use std::io;

use posefuse_proto::WireError;
use thiserror::Error;

/// Something about a take or the folder of takes.
#[derive(Debug, Error)]
pub enum TakeError {
    /// The name cannot be used.
    #[error(
        "take name `{0}`: use 1 to 100 of the letters a-z A-Z, digits, `.`, `_` and `-`, not `.` first"
    )]
    Name(String),
    /// A take of this name is there.
    #[error("take `{0}` exists already; choose another name")]
    Exists(String),
    /// No take has this name.
    #[error("there is no take `{0}`; the list of takes has the names there are")]
    Missing(String),
    /// The take has no footer.
    #[error(
        "take `{0}` has no end: if it is being recorded, stop that first; if it was cut off, start the server, which repairs it"
    )]
    Unfinished(String),
    /// It is another program's file.
    #[error(
        "take `{name}` cannot be read: {problem}, so it is no take of Posefuse; move it out of the take folder"
    )]
    Foreign {
        /// Whose file.
        name: String,
        /// What it has not that a take has.
        problem: String,
    },
    /// A later version of Posefuse recorded it.
    #[error(
        "take `{name}` has format {found}, this build reads formats up to {known}: update Posefuse (it was recorded by {build})"
    )]
    Newer {
        /// The take.
        name: String,
        /// Its format.
        found: i64,
        /// The latest format that this build reads.
        known: i64,
        /// What recorded it.
        build: String,
    },
    /// The file is not what a take must be.
    #[error(
        "take `{name}` cannot be read: {problem}; the file is damaged, use a copy of it if there is one"
    )]
    Damaged {
        /// Whose file.
        name: String,
        /// What is wrong, where.
        problem: String,
    },
    /// A message in the take breaks the rules of the wire.
    #[error(
        "take `{name}`, message {number} of {topic}: {problem}; the file was changed, or a build with other rules wrote it: \
         use a copy, or the build that recorded it"
    )]
    Message {
        /// The take.
        name: String,
        /// The topic.
        topic: &'static str,
        /// The message's number on its topic.
        number: u32,
        /// What is wrong.
        problem: String,
    },
    /// Too little space is free to begin.
    #[error(
        "only {} MB are free where takes go ({place}), {} MB are needed to begin: delete takes or choose another folder",
        free_bytes / 1_000_000, needed_bytes / 1_000_000
    )]
    DiskLow {
        /// The folder.
        place: String,
        /// What is free.
        free_bytes: u64,
        /// What is needed.
        needed_bytes: u64,
    },
    /// The take ended by itself; what was accepted before is in the file.
    #[error("the take has ended: {0}")]
    Ended(String),
    /// A take that was fused again could not be written.
    #[error(
        "take `{name}` could not be made: {trouble}. Nothing of it is kept, and the old take is as it was: fuse it again"
    )]
    NotMade {
        /// The new take.
        name: String,
        /// Why it ended.
        trouble: String,
    },
    /// The take folder cannot be used.
    #[error("take folder {place}: {source}; create it writable for this user, or name another one")]
    Folder {
        /// The folder.
        place: String,
        /// What the system said.
        source: io::Error,
    },
    /// The file system refused something.
    #[error(
        "cannot {doing} take `{name}`: {source}; check the disk and this user's rights in the take folder"
    )]
    Io {
        /// What was tried.
        doing: &'static str,
        /// The take.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// The configuration of a take is none that this build can use.
    #[error("the configuration of take `{name}`: {problem}")]
    Config {
        /// The take.
        name: String,
        /// What is wrong.
        problem: String,
    },
}

impl TakeError {
    pub(crate) fn io(doing: &'static str, name: &str) -> impl FnOnce(io::Error) -> Self {
        let name = name.to_owned();
        move |source| Self::Io {
            doing,
            name,
            source,
        }
    }

    pub(crate) fn damaged(name: &str, problem: impl Into<String>) -> Self {
        Self::Damaged {
            name: name.to_owned(),
            problem: problem.into(),
        }
    }
}

/// What is wrong inside one message, before it is known which one.
#[derive(Debug, Error)]
pub(crate) enum ContentError {
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error("no message of its schema: {0}")]
    Protobuf(#[from] prost::DecodeError),
    #[error("it is empty")]
    Empty,
    #[error("{0}")]
    Value(String),
}
