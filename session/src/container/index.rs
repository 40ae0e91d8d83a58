//! The index at the end of a finished file: what there is and where, read without reading the messages.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{AttachmentIndex, MetadataIndex, Record, op};

use crate::storage::ReadAt;
use crate::{Result, TakeError};

use super::chunk::words;
use super::scan::{RecordRef, Scan, Window, read_bytes};

const MAGIC: u64 = mcap::MAGIC.len() as u64;
/// Head and body of the footer, and the magic behind it.
const TAIL: u64 = 9 + 20 + MAGIC;

/// What a finished file says of itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Index {
    /// Topic and encoding by channel.
    pub(crate) channels: BTreeMap<u16, String>,
    /// Messages by channel.
    pub(crate) counts: BTreeMap<u16, u64>,
    /// In the order of the file; they do not overlap.
    pub(crate) chunks: Vec<ChunkRef>,
    /// By name; the last one of a name.
    pub(crate) attachments: BTreeMap<String, RecordRef>,
    /// By name; the last one of a name.
    pub(crate) metadata: BTreeMap<String, RecordRef>,
}

/// Where a chunk lies and what it holds.
#[derive(Clone, Debug)]
pub(crate) struct ChunkRef {
    pub(crate) record: RecordRef,
    /// Latest log time in it, ns since 1970.
    pub(crate) end_time: u64,
    /// Channels with messages in it; empty: not known.
    pub(crate) channels: BTreeSet<u16>,
}

impl Index {
    /// Reads the index; [`TakeError::Unfinished`] if the file has no footer.
    pub(crate) fn read(file: &dyn ReadAt, name: &str) -> Result<Self> {
        let length = file.length().map_err(TakeError::io("read", name))?;
        check_start(file, name, length)?;
        if length < MAGIC + TAIL {
            return Err(TakeError::Unfinished(name.to_owned()));
        }
        let tail = read_bytes(file, name, length - TAIL, TAIL)?;
        let number = |at: usize| {
            let bytes: [u8; 8] = tail[at..at + 8].try_into().unwrap_or_default();
            u64::from_le_bytes(bytes)
        };
        let is_footer = tail[0] == op::FOOTER && number(1) == 20;
        if !is_footer || tail[29..] != *mcap::MAGIC {
            return Err(TakeError::Unfinished(name.to_owned()));
        }
        let (start, end) = (number(9), length - TAIL);
        if !(MAGIC..=end).contains(&start) {
            return Err(TakeError::damaged(name, "the footer points nowhere"));
        }
        let mut index = Self::default();
        let summary = Window::read(file, name, start, end)?;
        let mut scan = Scan::new(&summary, name, start, end);
        while let Some(record) = scan.next()? {
            index.take_in(&summary, name, record, start)?;
        }
        index.check_chunks(name)?;
        Ok(index)
    }

    fn take_in(
        &mut self,
        file: &dyn ReadAt,
        name: &str,
        record: RecordRef,
        end: u64,
    ) -> Result<()> {
        let known = [
            op::CHANNEL,
            op::STATISTICS,
            op::CHUNK_INDEX,
            op::ATTACHMENT_INDEX,
            op::METADATA_INDEX,
        ];
        if !known.contains(&record.opcode) {
            return Ok(());
        }
        let body = read_bytes(file, name, record.body(), record.length)?;
        let parsed = mcap::parse_record(record.opcode, &body)
            .map_err(|error| TakeError::damaged(name, format!("its index: {}", words(error))))?;
        let place = |opcode, offset: u64, length: u64| -> Result<RecordRef> {
            let fits = offset >= MAGIC
                && length >= 9
                && offset.checked_add(length).is_some_and(|to| to <= end);
            if !fits || length > super::MAX_RECORD {
                return Err(TakeError::damaged(
                    name,
                    "its index points outside the file",
                ));
            }
            Ok(RecordRef {
                opcode,
                offset,
                length: length - 9,
            })
        };
        match parsed {
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel.topic);
            }
            Record::Statistics(statistics) => self.counts = statistics.channel_message_counts,
            Record::ChunkIndex(chunk) => self.chunks.push(ChunkRef {
                record: place(op::CHUNK, chunk.chunk_start_offset, chunk.chunk_length)?,
                end_time: chunk.message_end_time,
                channels: chunk.message_index_offsets.into_keys().collect(),
            }),
            Record::AttachmentIndex(AttachmentIndex {
                offset,
                length,
                name,
                ..
            }) => {
                self.attachments
                    .insert(name, place(op::ATTACHMENT, offset, length)?);
            }
            Record::MetadataIndex(MetadataIndex {
                offset,
                length,
                name,
            }) => {
                self.metadata
                    .insert(name, place(op::METADATA, offset, length)?);
            }
            _ => {}
        }
        Ok(())
    }

    fn check_chunks(&mut self, name: &str) -> Result<()> {
        self.chunks.sort_by_key(|chunk| chunk.record.offset);
        let overlap = |pair: &[ChunkRef]| pair[0].record.end() > pair[1].record.offset;
        if self.chunks.windows(2).any(overlap) {
            return Err(TakeError::damaged(name, "chunks of its index overlap"));
        }
        Ok(())
    }

    /// The metadata record of this name.
    pub(crate) fn read_metadata(
        &self,
        file: &dyn ReadAt,
        name: &str,
        wanted: &str,
    ) -> Result<Option<BTreeMap<String, String>>> {
        let Some(record) = self.metadata.get(wanted) else {
            return Ok(None);
        };
        match read_record(file, name, *record)? {
            Record::Metadata(metadata) if metadata.name == wanted => Ok(Some(metadata.metadata)),
            _ => Err(TakeError::damaged(
                name,
                format!("no metadata `{wanted}` lies where its index says"),
            )),
        }
    }

    /// The attachment of this name, as text.
    pub(crate) fn read_attachment(
        &self,
        file: &dyn ReadAt,
        name: &str,
        wanted: &str,
    ) -> Result<Option<String>> {
        let Some(record) = self.attachments.get(wanted) else {
            return Ok(None);
        };
        match read_record(file, name, *record)? {
            Record::Attachment { header, data, .. } if header.name == wanted => {
                let text = String::from_utf8(data.into_owned()).map_err(|_| {
                    TakeError::damaged(name, format!("attachment `{wanted}` is no text"))
                })?;
                Ok(Some(text))
            }
            _ => Err(TakeError::damaged(
                name,
                format!("no attachment `{wanted}` lies where its index says"),
            )),
        }
    }
}

/// Reads a record whose place was checked, after comparing its head with what was expected.
pub(crate) fn read_record(
    file: &dyn ReadAt,
    name: &str,
    expected: RecordRef,
) -> Result<Record<'static>> {
    check_head(file, name, expected)?;
    let body = read_bytes(file, name, expected.body(), expected.length)?;
    let record = mcap::parse_record(expected.opcode, &body).map_err(|error| {
        TakeError::damaged(
            name,
            format!("at byte {}: {}", expected.offset, words(error)),
        )
    })?;
    Ok(record.into_owned())
}

/// Checks that a record lies where the index says.
pub(crate) fn check_head(file: &dyn ReadAt, name: &str, expected: RecordRef) -> Result<()> {
    let found = Scan::new(file, name, expected.offset, expected.end()).next()?;
    if found == Some(expected) {
        return Ok(());
    }
    let place = expected.offset;
    Err(TakeError::damaged(
        name,
        format!("its index expects another record at byte {place}"),
    ))
}

/// Checks that the file begins as MCAP does.
pub(crate) fn check_start(file: &dyn ReadAt, name: &str, length: u64) -> Result<()> {
    if length < MAGIC {
        return Err(TakeError::damaged(
            name,
            format!("it has {length} bytes; no MCAP file is that short"),
        ));
    }
    if read_bytes(file, name, 0, MAGIC)? != mcap::MAGIC {
        return Err(TakeError::Foreign {
            name: name.to_owned(),
            problem: "it does not begin as an MCAP file does".to_owned(),
        });
    }
    Ok(())
}
