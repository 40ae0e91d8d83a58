//! FBX's tree of nodes, written as it is told: nodes with attributes, properties, arrays, and connections kept for the end.

use std::io;

use fbxcel::low::FbxVersion;
use fbxcel::low::v7400::ArrayAttributeEncoding;
use fbxcel::writer::v7400::binary::{Error, FbxFooter, Writer};

use crate::write::Out;

/// A node's attribute.
#[derive(Clone, Copy)]
pub(super) enum Attribute<'a> {
    Int(i32),
    Long(i64),
    Double(f64),
    Text(&'a str),
    Bytes(&'a [u8]),
}

use Attribute::*;

/// The file's separator between a name and its class.
fn classed(name: &str, class: &str) -> String {
    format!("{name}\0\u{1}{class}")
}

/// Shorter arrays are not worth compressing.
const LEAST_COMPRESSED: usize = 64;

/// A document under construction.
pub(super) struct Document {
    writer: Writer<Out>,
    next_id: i64,
    connections: Vec<(i64, i64, Option<&'static str>)>,
}

pub(super) fn in_io(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        error => io::Error::other(error.to_string()),
    }
}

impl Document {
    pub(super) fn new(out: Out) -> io::Result<Self> {
        Ok(Self {
            writer: Writer::new(out, FbxVersion::V7_4).map_err(in_io)?,
            next_id: 1_000_000,
            connections: Vec::new(),
        })
    }

    /// A number that no object has.
    pub(super) fn id(&mut self) -> i64 {
        self.next_id += 1;
        self.next_id
    }

    /// Begins a node.
    pub(super) fn open(&mut self, name: &str, attributes: &[Attribute]) -> io::Result<()> {
        let mut node = self.writer.new_node(name).map_err(in_io)?;
        for attribute in attributes {
            match *attribute {
                Int(value) => node.append_i32(value),
                Long(value) => node.append_i64(value),
                Double(value) => node.append_f64(value),
                Text(value) => node.append_string_direct(value),
                Bytes(value) => node.append_binary_direct(value),
            }
            .map_err(in_io)?;
        }
        Ok(())
    }

    pub(super) fn close(&mut self) -> io::Result<()> {
        self.writer.close_node().map_err(in_io)
    }

    /// A node that has nothing below it.
    pub(super) fn leaf(&mut self, name: &str, attributes: &[Attribute]) -> io::Result<()> {
        self.open(name, attributes)?;
        self.close()
    }

    /// A node with what `inside` writes below it.
    pub(super) fn node(
        &mut self,
        name: &str,
        attributes: &[Attribute],
        inside: impl FnOnce(&mut Self) -> io::Result<()>,
    ) -> io::Result<()> {
        self.open(name, attributes)?;
        inside(self)?;
        self.close()
    }

    /// An object of the scene: `kind` is the node's name, `class` and `sub` say what it is.
    pub(super) fn object(
        &mut self,
        kind: &str,
        (id, name, class, sub): (i64, &str, &str, &str),
        inside: impl FnOnce(&mut Self) -> io::Result<()>,
    ) -> io::Result<()> {
        self.node(
            kind,
            &[Long(id), Text(&classed(name, class)), Text(sub)],
            inside,
        )
    }

    /// `Properties70` with what `inside` writes.
    pub(super) fn properties(
        &mut self,
        inside: impl FnOnce(&mut Self) -> io::Result<()>,
    ) -> io::Result<()> {
        self.node("Properties70", &[], inside)
    }

    /// A property of `Properties70`.
    pub(super) fn property(
        &mut self,
        [name, kind, label, flags]: [&str; 4],
        values: &[Attribute],
    ) -> io::Result<()> {
        let mut attributes = vec![Text(name), Text(kind), Text(label), Text(flags)];
        attributes.extend(values);
        self.leaf("P", &attributes)
    }

    pub(super) fn doubles(&mut self, name: &str, values: &[f64]) -> io::Result<()> {
        let mut node = self.writer.new_node(name).map_err(in_io)?;
        let values_of = values.iter().copied();
        node.append_arr_f64_from_iter(packing(values.len()), values_of)
            .map_err(in_io)?;
        self.close()
    }

    pub(super) fn floats(&mut self, name: &str, values: &[f32]) -> io::Result<()> {
        let mut node = self.writer.new_node(name).map_err(in_io)?;
        let values_of = values.iter().copied();
        node.append_arr_f32_from_iter(packing(values.len()), values_of)
            .map_err(in_io)?;
        self.close()
    }

    pub(super) fn ints(&mut self, name: &str, values: &[i32]) -> io::Result<()> {
        let mut node = self.writer.new_node(name).map_err(in_io)?;
        let values_of = values.iter().copied();
        node.append_arr_i32_from_iter(packing(values.len()), values_of)
            .map_err(in_io)?;
        self.close()
    }

    pub(super) fn longs(&mut self, name: &str, values: &[i64]) -> io::Result<()> {
        let mut node = self.writer.new_node(name).map_err(in_io)?;
        let values_of = values.iter().copied();
        node.append_arr_i64_from_iter(packing(values.len()), values_of)
            .map_err(in_io)?;
        self.close()
    }

    /// `child` belongs to `parent` (0: the scene), or moves one of its properties.
    pub(super) fn connect(&mut self, child: i64, parent: i64, property: Option<&'static str>) {
        self.connections.push((child, parent, property));
    }

    /// Writes who belongs to whom.
    pub(super) fn connections(&mut self) -> io::Result<()> {
        self.open("Connections", &[])?;
        for (child, parent, property) in std::mem::take(&mut self.connections) {
            match property {
                None => self.leaf("C", &[Text("OO"), Long(child), Long(parent)])?,
                Some(property) => {
                    self.leaf(
                        "C",
                        &[Text("OP"), Long(child), Long(parent), Text(property)],
                    )?;
                }
            }
        }
        self.close()
    }

    /// Writes the end.
    pub(super) fn finish(self) -> io::Result<()> {
        self.writer
            .finalize_and_flush(&FbxFooter::default())
            .map_err(in_io)?;
        Ok(())
    }
}

fn packing(length: usize) -> Option<ArrayAttributeEncoding> {
    (length >= LEAST_COMPRESSED).then_some(ArrayAttributeEncoding::Zlib)
}
