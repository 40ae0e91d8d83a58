//! How a take is written, and what a flush tells.

/// How a take is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TakeOptions {
    /// Between two flushes, nanoseconds. What a crash costs at most.
    pub flush_every_ns: i64,
    /// A take begins, and goes on, only while this many bytes stay free.
    pub min_free_bytes: u64,
    /// Between two frames for viewers, nanoseconds.
    pub scene_every_ns: u64,
}

impl Default for TakeOptions {
    fn default() -> Self {
        Self {
            flush_every_ns: 250_000_000,
            min_free_bytes: 64 * 1024 * 1024,
            scene_every_ns: 30_000_000,
        }
    }
}

/// What a flush tells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Flushed {
    /// Inputs that are durable, preamble and snapshot left out.
    pub inputs: u64,
    /// Frames that are durable.
    pub frames: u64,
    /// The file's bytes.
    pub bytes: u64,
    /// Why the take ended by itself, if it did.
    pub ended: Option<String>,
}
