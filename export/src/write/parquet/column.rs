//! A column of a row group: numbers as they are, or as runs of entries of a dictionary.

use std::io::{self, Write};

use super::thrift::{Record, uleb};

/// Parquet's numbers for what a column holds.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Int = 1,
    Long = 2,
    Float = 4,
    Double = 5,
    Text = 6,
}

const PLAIN: i32 = 0;
const RLE: i32 = 3;
const RLE_DICTIONARY: i32 = 8;
const DATA_PAGE: i32 = 0;
const DICTIONARY_PAGE: i32 = 2;

/// A value that repeats.
#[derive(Clone, Copy)]
pub(super) enum Value<'a> {
    Int(i32),
    Long(i64),
    Double(f64),
    Text(&'a str),
}

impl Value<'_> {
    fn plain(self) -> Vec<u8> {
        match self {
            Self::Int(value) => value.to_le_bytes().to_vec(),
            Self::Long(value) => value.to_le_bytes().to_vec(),
            Self::Double(value) => value.to_le_bytes().to_vec(),
            Self::Text(text) => {
                let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
                bytes.extend(text.as_bytes());
                bytes
            }
        }
    }
}

/// The values of one row group.
pub(super) enum Values {
    Plain(Vec<f32>),
    Runs {
        /// Values as bytes.
        entries: Vec<Vec<u8>>,
        /// Entry and how many times it follows itself.
        runs: Vec<(u32, u32)>,
    },
}

pub(super) struct Column {
    pub(super) name: String,
    pub(super) kind: Kind,
    values: Values,
}

/// Where a column of a row group lies, for the end of the file.
pub(super) struct Chunk {
    pub(super) record: Record,
    pub(super) bytes: u64,
}

impl Column {
    /// Of `f32`, all different.
    pub(super) fn floats(name: impl Into<String>) -> Self {
        let (name, values) = (name.into(), Values::Plain(Vec::new()));
        Self {
            name,
            kind: Kind::Float,
            values,
        }
    }

    /// Of values that repeat.
    pub(super) fn repeating(name: &str, kind: Kind) -> Self {
        let values = Values::Runs {
            entries: Vec::new(),
            runs: Vec::new(),
        };
        Self {
            name: name.to_owned(),
            kind,
            values,
        }
    }

    pub(super) fn push_float(&mut self, value: f32) {
        if let Values::Plain(values) = &mut self.values {
            values.push(value);
        }
    }

    pub(super) fn push(&mut self, value: Value) {
        let Values::Runs { entries, runs } = &mut self.values else {
            return;
        };
        let bytes = value.plain();
        if let Some((entry, length)) = runs.last_mut()
            && entries[*entry as usize] == bytes
        {
            *length += 1;
            return;
        }
        // Texts are few and come again; numbers count on, so that only the last few can.
        let searched = match value {
            Value::Text(_) => 0,
            _ => entries.len().saturating_sub(2),
        };
        let found = entries[searched..].iter().position(|entry| *entry == bytes);
        let entry = found.map_or(entries.len(), |position| searched + position);
        if entry == entries.len() {
            entries.push(bytes);
        }
        runs.push((entry as u32, 1));
    }

    /// Writes the column's pages at `offset` of the file and empties it.
    pub(super) fn write(
        &mut self,
        rows: u64,
        offset: u64,
        out: &mut impl Write,
    ) -> io::Result<Chunk> {
        let (mut dictionary, mut data) = (Vec::new(), Vec::new());
        let encodings: &[i32] = match &mut self.values {
            Values::Plain(values) => {
                data.extend(values.drain(..).flat_map(f32::to_le_bytes));
                &[PLAIN]
            }
            Values::Runs { entries, runs } => {
                let head = Record::default().int(1, entries.len() as i32).int(2, PLAIN);
                let width = entry_bits(entries.len());
                let values = entries.drain(..).flatten().collect::<Vec<u8>>();
                dictionary = page(DICTIONARY_PAGE, (7, head), &values);
                data.push(width);
                for (entry, length) in runs.drain(..) {
                    data.extend(uleb(u64::from(length) << 1));
                    data.extend(&entry.to_le_bytes()[..usize::from(width.div_ceil(8))]);
                }
                &[PLAIN, RLE, RLE_DICTIONARY]
            }
        };
        let encoding = *encodings.last().unwrap_or(&PLAIN);
        let head = Record::default().int(1, rows as i32).int(2, encoding);
        let data = page(DATA_PAGE, (5, head.int(3, RLE).int(4, RLE)), &data);
        out.write_all(&dictionary)?;
        out.write_all(&data)?;
        let bytes = (dictionary.len() + data.len()) as u64;
        let meta = Record::default()
            .int(1, self.kind as i32)
            .ints(2, encodings)
            .texts(3, &[&self.name])
            .int(4, 0)
            .long(5, rows as i64)
            .long(6, bytes as i64)
            .long(7, bytes as i64)
            .long(9, (offset + dictionary.len() as u64) as i64);
        let meta = match dictionary.is_empty() {
            true => meta,
            false => meta.long(11, offset as i64),
        };
        let record = Record::default().long(2, offset as i64).record(3, meta);
        Ok(Chunk { record, bytes })
    }
}

/// How many bits tell one of `entries` entries, at least one.
fn entry_bits(entries: usize) -> u8 {
    (usize::BITS - entries.saturating_sub(1).leading_zeros()).max(1) as u8
}

/// A page with its header; `head` is the header of its kind, under its field's number.
fn page(kind: i32, (field, head): (u8, Record), content: &[u8]) -> Vec<u8> {
    let length = content.len() as i32;
    let header = Record::default().int(1, kind).int(2, length).int(3, length);
    let mut bytes = header.record(field, head).finished();
    bytes.extend(content);
    bytes
}
