//! A growing MCAP file that can always be ended properly.
//!
//! The `mcap` writer works in memory and never sees the disk; its bytes are moved to the file here. Space for
//! the rest of the file (the chunk in the making, index, footer) is set aside ahead: when the disk is full no more
//! can be set aside, and what was set aside is enough to end the file with all that was accepted.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer};

use crate::storage::Append;

/// A chunk is closed when it holds this much, bytes unpacked.
const CHUNK_SIZE: usize = 256 * 1024;
/// Set aside for the chunk in the making and what surrounds it, bytes.
const ROOM_TO_END: u64 = 2 * 1024 * 1024;
/// Set aside for one chunk's entry in the index, bytes (72 + 10 a topic).
const ROOM_PER_CHUNK: u64 = 192;
/// Set aside at a time, bytes.
const STEP: u64 = 4 * 1024 * 1024;

/// Whether the file can go on after a push.
#[derive(Debug)]
pub(crate) enum Pushed {
    /// It can.
    Ample,
    /// Everything so far is in the file, but no more space can be set aside: end it now.
    Ending(io::Error),
}

/// The bytes that the `mcap` writer made and the file has not got yet.
#[derive(Clone, Default)]
struct Pending(Arc<Mutex<Vec<u8>>>);

impl Pending {
    fn lock(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A schema and the channel that uses it.
pub(crate) struct NewChannel<'a> {
    pub(crate) id: u16,
    pub(crate) topic: &'a str,
    pub(crate) encoding: &'a str,
    pub(crate) metadata: &'a BTreeMap<String, String>,
    /// 0: the channel has no schema.
    pub(crate) schema_id: u16,
}

/// An MCAP file in the making.
pub(crate) struct Container {
    mcap: Writer<NoSeek<Pending>>,
    pending: Pending,
    file: Box<dyn Append>,
    written: u64,
    reserved: u64,
    chunks: u64,
    /// Bytes in the chunk in the making, unpacked; `None`: there is none.
    open_chunk: Option<usize>,
}

impl Container {
    /// Begins the file; nothing reaches it before the first [`Container::push`].
    pub(crate) fn new(file: Box<dyn Append>) -> McapResult<Self> {
        let pending = Pending::default();
        let options = WriteOptions::new()
            .profile("posefuse")
            .library(concat!("posefuse ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .disable_seeking(true);
        let mcap = options.create(NoSeek::new(pending.clone()))?;
        Ok(Self {
            mcap,
            pending,
            file,
            written: 0,
            reserved: 0,
            chunks: 0,
            open_chunk: None,
        })
    }

    /// Adds a schema to the chunk in the making, unless it is in the file.
    pub(crate) fn add_schema(
        &mut self,
        id: u16,
        name: &str,
        encoding: &str,
        data: &[u8],
    ) -> McapResult<()> {
        *self.open_chunk.get_or_insert(0) += data.len();
        self.mcap
            .add_schema_with_id(id, name, encoding, data)
            .map(|_| ())
    }

    /// Adds a channel to the chunk in the making, unless it is in the file.
    pub(crate) fn add_channel(&mut self, channel: &NewChannel<'_>) -> McapResult<()> {
        self.open_chunk.get_or_insert(0);
        let NewChannel {
            id,
            schema_id,
            topic,
            encoding,
            metadata,
        } = *channel;
        self.mcap
            .add_channel_with_id(id, schema_id, topic, encoding, metadata)
            .map(|_| ())
    }

    /// Adds a message to the chunk in the making.
    pub(crate) fn message(&mut self, header: &MessageHeader, data: &[u8]) -> McapResult<()> {
        if self.open_chunk.is_some_and(|size| size > CHUNK_SIZE) {
            self.close_chunk()?;
        }
        *self.open_chunk.get_or_insert(0) += data.len() + 31;
        self.mcap.write_to_known_channel(header, data)
    }

    /// Adds an attachment; ends the chunk in the making.
    pub(crate) fn attach(&mut self, attachment: &Attachment<'_>) -> McapResult<()> {
        self.close_chunk()?;
        self.mcap.attach(attachment)
    }

    /// Adds a metadata record; ends the chunk in the making.
    pub(crate) fn metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> McapResult<()> {
        self.close_chunk()?;
        self.mcap.write_metadata(&Metadata {
            name: name.to_owned(),
            metadata,
        })
    }

    /// Ends the chunk in the making.
    pub(crate) fn close_chunk(&mut self) -> McapResult<()> {
        if self.open_chunk.take().is_some() {
            self.mcap.flush()?;
            self.chunks += 1;
        }
        Ok(())
    }

    /// Bytes that wait to be pushed.
    pub(crate) fn pending_bytes(&self) -> usize {
        self.pending.lock().len()
    }

    /// Bytes in the file.
    pub(crate) fn written_bytes(&self) -> u64 {
        self.written
    }

    /// Moves all closed chunks to the file (not yet durable), and sets space aside for what comes.
    pub(crate) fn push(&mut self) -> io::Result<Pushed> {
        let room = ROOM_TO_END + self.chunks * ROOM_PER_CHUNK;
        let need = self.written + self.pending_bytes() as u64 + room;
        let pushed = if need <= self.reserved {
            Pushed::Ample
        } else {
            self.reserve(need)
        };
        self.append_pending()?;
        Ok(pushed)
    }

    fn reserve(&mut self, need: u64) -> Pushed {
        for total in [need + STEP, need] {
            match self.file.reserve(total) {
                Ok(()) => {
                    self.reserved = total;
                    return Pushed::Ample;
                }
                Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                    // The guard on free bytes has to do alone on such a file system.
                    self.reserved = u64::MAX;
                    return Pushed::Ample;
                }
                Err(error) if total == need => return Pushed::Ending(error),
                Err(_) => {}
            }
        }
        Pushed::Ample
    }

    fn append_pending(&mut self) -> io::Result<()> {
        let mut pending = self.pending.lock();
        if pending.is_empty() {
            return Ok(());
        }
        if let Err(error) = self.file.append(&pending) {
            // What could not be written stays pending, so that a later try (the end of the take) has it.
            self.file.cut(self.written)?;
            self.reserved = self.reserved.min(self.written);
            return Err(error);
        }
        self.written += pending.len() as u64;
        pending.clear();
        Ok(())
    }

    /// Makes everything pushed durable.
    pub(crate) fn sync(&mut self) -> io::Result<()> {
        self.file.sync()
    }

    /// Writes index and footer, makes all durable and gives back what was set aside. Gives the file's length.
    pub(crate) fn finish(&mut self) -> io::Result<u64> {
        self.mcap.finish().map_err(io::Error::other)?;
        self.append_pending()?;
        self.file.sync()?;
        self.file.cut(self.written)?;
        Ok(self.written)
    }
}
