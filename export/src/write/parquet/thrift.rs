//! Thrift's compact protocol, as far as Parquet's own records need it (apache/thrift, `thrift-compact-protocol.md`).

/// Types of fields and of list elements.
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A record under construction. Fields come in the order of their numbers.
#[derive(Default)]
pub(super) struct Record {
    bytes: Vec<u8>,
    last_field: u8,
}

fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push((value as u8 & 0x7f) | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

/// An unsigned number of seven bits a byte, the low ones first.
pub(super) fn uleb(value: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(2);
    varint(&mut bytes, value);
    bytes
}

impl Record {
    fn field(&mut self, number: u8, kind: u8) {
        // All numbers that are written here are less than 15 apart.
        self.bytes.push((number - self.last_field) << 4 | kind);
        self.last_field = number;
    }

    pub(super) fn int(mut self, number: u8, value: i32) -> Self {
        self.field(number, I32);
        varint(&mut self.bytes, zigzag(value.into()));
        self
    }

    pub(super) fn long(mut self, number: u8, value: i64) -> Self {
        self.field(number, I64);
        varint(&mut self.bytes, zigzag(value));
        self
    }

    pub(super) fn text(mut self, number: u8, value: &str) -> Self {
        self.field(number, BINARY);
        varint(&mut self.bytes, value.len() as u64);
        self.bytes.extend(value.as_bytes());
        self
    }

    pub(super) fn record(mut self, number: u8, value: Self) -> Self {
        self.field(number, STRUCT);
        self.bytes.extend(value.finished());
        self
    }

    pub(super) fn records(mut self, number: u8, values: Vec<Self>) -> Self {
        self.list(number, STRUCT, values.len());
        for value in values {
            self.bytes.extend(value.finished());
        }
        self
    }

    pub(super) fn ints(mut self, number: u8, values: &[i32]) -> Self {
        self.list(number, I32, values.len());
        for value in values {
            varint(&mut self.bytes, zigzag((*value).into()));
        }
        self
    }

    pub(super) fn texts(mut self, number: u8, values: &[&str]) -> Self {
        self.list(number, BINARY, values.len());
        for value in values {
            varint(&mut self.bytes, value.len() as u64);
            self.bytes.extend(value.as_bytes());
        }
        self
    }

    fn list(&mut self, number: u8, kind: u8, length: usize) {
        self.field(number, LIST);
        match u8::try_from(length) {
            Ok(length @ 0..=14) => self.bytes.push(length << 4 | kind),
            _ => {
                self.bytes.push(0xf0 | kind);
                varint(&mut self.bytes, length as u64);
            }
        }
    }

    pub(super) fn finished(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_the_protocol_says() {
        assert_eq!(uleb(300), [0xac, 0x02]);
        assert_eq!(
            Record::default().int(1, -1).long(4, 50399).finished(),
            [0x15, 0x01, 0x36, 0xbe, 0x93, 0x06, 0x00]
        );
    }
}
