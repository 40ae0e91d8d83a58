//! The container of a GLB: numbers, the views and accessors that tell where they lie, and the two chunks.

use std::io::{self, Write};

use serde_json::{Value, json};

/// What numbers are.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Keys' times.
    Time,
    Vec3,
    Vec4,
    Mat4,
    /// Vertices' places.
    Place,
    /// Something else of vertices, with so many numbers each.
    Vertex(usize),
}

pub(super) enum Data {
    Floats(Vec<f32>),
    Bytes(Vec<u8>),
}

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const ARRAY_BUFFER: u32 = 34962;
const MAGIC: u32 = 0x4654_6c67;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;

/// The numbers of a file. Every piece is a multiple of 4 bytes long.
#[derive(Default)]
pub(super) struct Container {
    pieces: Vec<Data>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    bytes: usize,
}

impl Container {
    /// Adds numbers; gives the index of their accessor.
    pub(super) fn add(&mut self, kind: Kind, data: Data) -> usize {
        let (shape, width) = match kind {
            Kind::Time => ("SCALAR", 1),
            Kind::Vec3 | Kind::Place | Kind::Vertex(3) => ("VEC3", 3),
            Kind::Vec4 | Kind::Vertex(_) => ("VEC4", 4),
            Kind::Mat4 => ("MAT4", 16),
        };
        let (component, count, length) = match &data {
            Data::Floats(numbers) => (FLOAT, numbers.len() / width, 4 * numbers.len()),
            Data::Bytes(numbers) => (UNSIGNED_BYTE, numbers.len() / width, numbers.len()),
        };
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes, "byteLength": length });
        if matches!(kind, Kind::Place | Kind::Vertex(_)) {
            view["target"] = json!(ARRAY_BUFFER);
        }
        let mut accessor = json!({
            "bufferView": self.views.len(),
            "componentType": component,
            "count": count,
            "type": shape,
        });
        if let (Kind::Time | Kind::Place, Data::Floats(numbers)) = (kind, &data) {
            let (least, most) = bounds(numbers, width);
            accessor["min"] = json!(least);
            accessor["max"] = json!(most);
        }
        self.bytes += length;
        self.views.push(view);
        self.accessors.push(accessor);
        self.pieces.push(data);
        self.accessors.len() - 1
    }

    /// Writes the file: `head` is the JSON without what this container knows.
    pub(super) fn write(self, mut head: Value, out: &mut impl Write) -> io::Result<()> {
        head["buffers"] = json!([{ "byteLength": self.bytes }]);
        head["bufferViews"] = Value::Array(self.views);
        head["accessors"] = Value::Array(self.accessors);
        let mut text = serde_json::to_vec(&head)?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() + 8 + self.bytes;
        let too_long = |_| {
            io::Error::other("a GLB has at most 4 GB; export a shorter span or at a lower rate")
        };
        let length = |bytes: usize| u32::try_from(bytes).map_err(too_long);
        for word in [MAGIC, 2, length(whole)?, length(text.len())?, JSON_CHUNK] {
            out.write_all(&word.to_le_bytes())?;
        }
        out.write_all(&text)?;
        for word in [length(self.bytes)?, BINARY_CHUNK] {
            out.write_all(&word.to_le_bytes())?;
        }
        for piece in self.pieces {
            match piece {
                Data::Bytes(bytes) => out.write_all(&bytes)?,
                Data::Floats(numbers) => {
                    for number in numbers {
                        out.write_all(&number.to_le_bytes())?;
                    }
                }
            }
        }
        out.flush()
    }
}

/// Least and greatest of each of `width` columns.
fn bounds(numbers: &[f32], width: usize) -> (Vec<f32>, Vec<f32>) {
    let (mut least, mut most) = (vec![f32::INFINITY; width], vec![f32::NEG_INFINITY; width]);
    for row in numbers.chunks(width) {
        for (column, number) in row.iter().enumerate() {
            least[column] = least[column].min(*number);
            most[column] = most[column].max(*number);
        }
    }
    (least, most)
}
