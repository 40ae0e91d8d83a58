//! Unpacking one chunk, all of it or none: its checksum is compared before a message is believed.

use mcap::McapError;
use mcap::records::{Channel, MessageHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::MAX_RECORD;

/// A message as the file holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RawMessage {
    pub(crate) header: MessageHeader,
    pub(crate) data: Vec<u8>,
}

/// A schema as the file holds it.
#[derive(Clone, Debug)]
pub(crate) struct RawSchema {
    pub(crate) id: u16,
    pub(crate) name: String,
    pub(crate) encoding: String,
    pub(crate) data: Vec<u8>,
}

/// What one record of a chunk is.
#[derive(Clone, Debug)]
pub(crate) enum ChunkContent {
    Schema(RawSchema),
    Channel(Channel),
    Message(RawMessage),
}

/// The contents of a chunk record with this body. The words of an error name no place.
pub(crate) fn decode_chunk(body: &[u8]) -> Result<Vec<ChunkContent>, String> {
    check_sizes(body)?;
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD as usize);
    let mut reader = LinearReader::new_with_options(options);
    let mut head = vec![op::CHUNK];
    head.extend((body.len() as u64).to_le_bytes());
    let mut left: [&[u8]; 2] = [&head, body];
    let mut contents = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.map_err(words)? {
            LinearReadEvent::ReadRequest(wanted) => {
                let source = if left[0].is_empty() { 1 } else { 0 };
                let given = wanted.min(left[source].len());
                reader.insert(given).copy_from_slice(&left[source][..given]);
                reader.notify_read(given);
                left[source] = &left[source][given..];
            }
            LinearReadEvent::Record { opcode, data } => {
                let record = mcap::parse_record(opcode, data).map_err(words)?;
                contents.extend(content_of(record));
            }
        }
    }
    Ok(contents)
}

fn content_of(record: Record<'_>) -> Option<ChunkContent> {
    Some(match record {
        Record::Schema { header, data } => ChunkContent::Schema(RawSchema {
            id: header.id,
            name: header.name,
            encoding: header.encoding,
            data: data.into_owned(),
        }),
        Record::Channel(channel) => ChunkContent::Channel(channel),
        Record::Message { header, data } => ChunkContent::Message(RawMessage {
            header,
            data: data.into_owned(),
        }),
        _ => return None,
    })
}

/// Looks at the sizes that the chunk's head claims before anything is allocated for them.
fn check_sizes(body: &[u8]) -> Result<(), String> {
    let number = |at: usize| -> Option<u64> {
        let bytes = body.get(at..at.checked_add(8)?)?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?))
    };
    let name_length = || -> Option<usize> {
        let bytes = body.get(28..32)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    let sizes = || {
        let unpacked = number(16)?;
        let packed_at = 32usize.checked_add(name_length()?)?;
        let packed = number(packed_at)?;
        Some((unpacked, packed, packed_at + 8))
    };
    let Some((unpacked, packed, start)) = sizes() else {
        return Err("a chunk ends inside its head".into());
    };
    if unpacked > MAX_RECORD {
        return Err(format!(
            "a chunk claims to unpack to {unpacked} bytes, at most 64 MiB are taken"
        ));
    }
    if packed > (body.len() - start.min(body.len())) as u64 {
        return Err("a chunk claims to be longer than it is".into());
    }
    Ok(())
}

pub(crate) fn words(error: McapError) -> String {
    match error {
        McapError::Io(inner) => format!("it does not unpack: {inner}"),
        McapError::Parse(_) => "a record does not hold what it must".to_owned(),
        other => other.to_string(),
    }
}
