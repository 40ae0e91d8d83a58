//! Walking the records of a file whose claims are not trusted: no length is believed beyond the file's end.

use std::io;

use crate::storage::ReadAt;
use crate::{Result, TakeError};

use super::MAX_RECORD;

/// Opcode and length.
const RECORD_HEAD: u64 = 9;

/// Where a record lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordRef {
    pub(crate) opcode: u8,
    /// Of the opcode, from the file's start.
    pub(crate) offset: u64,
    /// Of the body.
    pub(crate) length: u64,
}

impl RecordRef {
    pub(crate) fn body(&self) -> u64 {
        self.offset + RECORD_HEAD
    }

    pub(crate) fn end(&self) -> u64 {
        self.body() + self.length
    }
}

/// Walks the records from a place to an end.
pub(crate) struct Scan<'a> {
    file: &'a dyn ReadAt,
    name: &'a str,
    at: u64,
    end: u64,
}

impl<'a> Scan<'a> {
    /// Walks the records from `start` to `end`, which is at most the file's length.
    pub(crate) fn new(file: &'a dyn ReadAt, name: &'a str, start: u64, end: u64) -> Self {
        Self {
            file,
            name,
            at: start,
            end,
        }
    }

    /// Where the next record would begin.
    pub(crate) fn position(&self) -> u64 {
        self.at
    }

    /// The next record; `None` at the end. An error where no whole record of at most 64 MiB lies.
    pub(crate) fn next(&mut self) -> Result<Option<RecordRef>> {
        if self.at == self.end {
            return Ok(None);
        }
        let left = self.end.saturating_sub(self.at);
        if left < RECORD_HEAD {
            return Err(self.broken("it ends inside a record's head"));
        }
        let mut head = [0; RECORD_HEAD as usize];
        self.file
            .read_at(self.at, &mut head)
            .map_err(TakeError::io("read", self.name))?;
        let (opcode, length) = (
            head[0],
            u64::from_le_bytes([
                head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8],
            ]),
        );
        if length > left - RECORD_HEAD {
            return Err(self.broken("a record is longer than the file"));
        }
        if length > MAX_RECORD {
            return Err(self.broken("a record is longer than 64 MiB"));
        }
        let record = RecordRef {
            opcode,
            offset: self.at,
            length,
        };
        self.at = record.end();
        Ok(Some(record))
    }

    fn broken(&self, problem: &str) -> TakeError {
        TakeError::damaged(self.name, format!("at byte {}: {problem}", self.at))
    }
}

/// Reads `length` bytes at `offset`; `length` has been checked against [`MAX_RECORD`] and the file.
pub(crate) fn read_bytes(
    file: &dyn ReadAt,
    name: &str,
    offset: u64,
    length: u64,
) -> Result<Vec<u8>> {
    let mut bytes = vec![0; usize::try_from(length.min(MAX_RECORD)).unwrap_or(0)];
    file.read_at(offset, &mut bytes)
        .map_err(TakeError::io("read", name))?;
    Ok(bytes)
}

/// A part of a file in memory, at the offsets it has in the file.
pub(crate) struct Window {
    start: u64,
    bytes: Vec<u8>,
}

impl Window {
    /// Reads the part from `start` to `end`, at most 64 MiB.
    pub(crate) fn read(file: &dyn ReadAt, name: &str, start: u64, end: u64) -> Result<Self> {
        let length = end.saturating_sub(start);
        if length > MAX_RECORD {
            return Err(TakeError::damaged(name, "its index is longer than 64 MiB"));
        }
        let bytes = read_bytes(file, name, start, length)?;
        Ok(Self { start, bytes })
    }
}

impl ReadAt for Window {
    fn length(&self) -> io::Result<u64> {
        Ok(self.start + self.bytes.len() as u64)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<()> {
        let from = offset
            .checked_sub(self.start)
            .and_then(|from| usize::try_from(from).ok());
        let part = from.and_then(|from| self.bytes.get(from..from.checked_add(buffer.len())?));
        buffer.copy_from_slice(part.ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }
}
