//! Takes: MCAP files that hold every engine input, in the order the engine consumed them, and every fused frame.
//!
//! [`TakeWriter`] records, [`TakeReader`] reads, [`recover`] repairs what a crash cut off, [`Catalogue`] lists, and
//! [`refuse`] fuses a take again. Files are reached through a [`Storage`] that is handed in; no clock is read here,
//! times come in as data. All times in a file are nanoseconds since 1970 (server time + `unix_offset_ns`).
//!
//! Files of a take folder: `NAME.mcap` is a take (locked while it is being recorded), `NAME.mcap.new` is one that is
//! being written and could be made again; the next start throws it away.

mod catalogue;
mod container;
mod convert;
mod draft;
mod error;
mod header;
mod info;
mod name;
mod reader;
mod record;
mod recover;
mod refuse;
mod rewrite;
mod storage;
mod tally;
mod topic;
mod writer;

pub use catalogue::{Catalogue, TakeChange};
pub use convert::{input_from_bytes, input_to_bytes};
pub use error::TakeError;
pub use header::{EngineState, TakeHeader};
pub use info::{TakeInfo, TakeState};
pub use name::check_take_name;
pub use reader::{Entries, Entry, TakeReader};
pub use record::{Event, Recorded, RecordedRejection, TruePerson, Truth};
pub use recover::{Recovery, RecoveryOutcome, recover};
pub use refuse::{
    FrameDifference, RefuseOptions, RefuseProgress, RefuseReport, refuse, refuse_with,
};
pub use storage::{Append, DiskStorage, MemoryStorage, ReadAt, Storage, Stored};
pub use topic::Topic;
pub use writer::{Flushed, TakeOptions, TakeWriter};

/// What a take records of the engine's inputs.
pub use posefuse_fusion::{ClockSample, Input};

/// What this crate's functions give.
pub type Result<T, E = TakeError> = std::result::Result<T, E>;
