//! Writing a take anew from what can be read of a file: to recover it, or to change its slate and notes.
//!
//! The file is walked record by record, not by its index. A chunk whose checksum is wrong is left out; where no
//! record follows any more, the take ends. Messages keep their numbers, times and bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use mcap::records::{Record, op};

use crate::container::{
    ChunkContent, Container, NewChannel, Pushed, RecordRef, Scan, check_start, decode_chunk,
    read_bytes, read_record,
};
use crate::header::START;
use crate::info::END;
use crate::storage::ReadAt;
use crate::tally::Tally;
use crate::{Result, TakeError, TakeHeader, Topic, convert};

/// What was found of the old file.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// The metadata record the take began with.
    pub(crate) header: Option<TakeHeader>,
    /// The one it ended with, if it did.
    pub(crate) end: Option<BTreeMap<String, String>>,
    pub(crate) tally: Tally,
    /// Bytes that were no whole record, or chunks with a wrong checksum.
    pub(crate) lost_bytes: u64,
    /// Where and why something was left out.
    pub(crate) losses: Vec<String>,
}

/// Copies what can be read of `file` into `out`, all but the record it ended with; `edit` may change the record
/// it began with.
pub(crate) fn copy(
    file: &dyn ReadAt,
    name: &str,
    out: &mut Container,
    edit: &dyn Fn(&mut BTreeMap<String, String>),
) -> Result<Found> {
    let length = file.length().map_err(TakeError::io("read", name))?;
    check_start(file, name, length)?;
    let mut copy = Copy {
        file,
        name,
        out,
        edit,
        topics: BTreeMap::new(),
        schemas: BTreeSet::from([0]),
        found: Found::default(),
    };
    let mut scan = Scan::new(file, name, mcap::MAGIC.len() as u64, length);
    loop {
        let at = scan.position();
        match scan.next() {
            Ok(Some(record)) if [op::DATA_END, op::FOOTER].contains(&record.opcode) => break,
            Ok(Some(record)) => copy.record(record)?,
            Ok(None) => break,
            Err(error @ TakeError::Io { .. }) => return Err(error),
            Err(error) => {
                copy.lose(length - at, error.to_string());
                break;
            }
        }
    }
    Ok(copy.found)
}

struct Copy<'a> {
    file: &'a dyn ReadAt,
    name: &'a str,
    out: &'a mut Container,
    edit: &'a dyn Fn(&mut BTreeMap<String, String>),
    topics: BTreeMap<u16, Option<Topic>>,
    schemas: BTreeSet<u16>,
    found: Found,
}

impl Copy<'_> {
    fn lose(&mut self, bytes: u64, why: String) {
        self.found.lost_bytes += bytes;
        if self.found.losses.len() < 8 {
            self.found.losses.push(why);
        }
    }

    fn record(&mut self, record: RecordRef) -> Result<()> {
        match record.opcode {
            op::CHUNK => self.chunk(record),
            op::METADATA | op::ATTACHMENT => match read_record(self.file, self.name, record) {
                Ok(content) => self.outside_chunks(content),
                Err(error @ TakeError::Io { .. }) => Err(error),
                Err(error) => {
                    self.lose(record.length, error.to_string());
                    Ok(())
                }
            },
            // The header and indices are made anew.
            _ => Ok(()),
        }
    }

    fn outside_chunks(&mut self, content: Record<'_>) -> Result<()> {
        let written = match content {
            Record::Metadata(mut record) if record.name == START => {
                (self.edit)(&mut record.metadata);
                self.found.header = Some(TakeHeader::from_metadata(self.name, &record.metadata)?.0);
                self.out.metadata(START, record.metadata)
            }
            Record::Metadata(record) if record.name == END => {
                self.found.end = Some(record.metadata);
                Ok(())
            }
            Record::Metadata(record) => self.out.metadata(&record.name, record.metadata),
            Record::Attachment { header, data, .. } => self.out.attach(&mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            }),
            _ => Ok(()),
        };
        written.map_err(|error| self.unwritable(error))
    }

    fn chunk(&mut self, record: RecordRef) -> Result<()> {
        let body = read_bytes(self.file, self.name, record.body(), record.length)?;
        match decode_chunk(&body) {
            Ok(contents) => {
                for content in contents {
                    self.content(content)?;
                }
                self.out
                    .close_chunk()
                    .map_err(|error| self.unwritable(error))?;
                self.push()
            }
            Err(problem) => {
                self.lose(
                    record.length,
                    format!("chunk at byte {}: {problem}", record.offset),
                );
                Ok(())
            }
        }
    }

    fn content(&mut self, content: ChunkContent) -> Result<()> {
        let written = match content {
            ChunkContent::Schema(schema) => {
                self.schemas.insert(schema.id);
                self.out
                    .add_schema(schema.id, &schema.name, &schema.encoding, &schema.data)
            }
            // A channel whose schema was lost cannot be read any more, nor can its messages.
            ChunkContent::Channel(channel) if !self.schemas.contains(&channel.schema_id) => Ok(()),
            ChunkContent::Channel(channel) => {
                self.topics
                    .insert(channel.id, Topic::of_name(&channel.topic));
                self.out.add_channel(&NewChannel {
                    id: channel.id,
                    topic: &channel.topic,
                    encoding: &channel.message_encoding,
                    metadata: &channel.metadata,
                    schema_id: channel.schema_id,
                })
            }
            ChunkContent::Message(message) => match self.topics.get(&message.header.channel_id) {
                Some(topic) => {
                    let time = message.header.log_time;
                    match topic.map(|topic| convert::recorded(topic, &message.data)) {
                        Some(Ok(recorded)) => self.found.tally.count(time, &recorded),
                        _ => self.found.tally.count_time(time),
                    }
                    self.out.message(&message.header, &message.data)
                }
                None => Ok(()),
            },
        };
        written.map_err(|error| self.unwritable(error))
    }

    fn push(&mut self) -> Result<()> {
        match self.out.push() {
            Ok(Pushed::Ample) => Ok(()),
            Ok(Pushed::Ending(error)) | Err(error) => {
                Err(TakeError::io("rewrite", self.name)(error))
            }
        }
    }

    fn unwritable(&self, error: mcap::McapError) -> TakeError {
        TakeError::io("rewrite", self.name)(io::Error::other(error))
    }
}
