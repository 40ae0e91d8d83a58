//! MCAP itself: appending so that a full disk cannot spoil the file, and reading without trust in what it claims.

mod append;
mod chunk;
mod index;
mod scan;

pub(crate) use append::{Container, NewChannel, Pushed};
pub(crate) use chunk::{ChunkContent, RawMessage, decode_chunk};
pub(crate) use index::{Index, check_head, check_start, read_record};
pub(crate) use scan::{RecordRef, Scan, read_bytes};

/// Longest record or chunk (packed or unpacked) that is read, bytes. What a writer of ours makes is far shorter.
pub(crate) const MAX_RECORD: u64 = 64 * 1024 * 1024;
