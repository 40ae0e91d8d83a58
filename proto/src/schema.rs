//! Schemas for takes and viewers: of all .proto files just those that a message needs, so that each schema stands alone.

use std::collections::BTreeSet;

use prost::Message;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

use crate::{DESCRIPTORS, foxglove};

/// The serialised `FileDescriptorSet` of a message by its full name, e.g. `foxglove.SceneUpdate`, dependencies first; empty
/// if there is no such message.
pub fn schema_of(full_name: &str) -> Vec<u8> {
    let (package, message) = full_name.rsplit_once('.').unwrap_or_default();
    let descriptors = match package {
        "foxglove" => foxglove::DESCRIPTORS,
        _ => DESCRIPTORS,
    };
    let all = FileDescriptorSet::decode(descriptors).unwrap_or_default();
    let holds = |file: &&FileDescriptorProto| {
        file.package() == package && file.message_type.iter().any(|m| m.name() == message)
    };
    let mut needed = FileDescriptorSet::default();
    let mut seen = BTreeSet::new();
    if let Some(file) = all.file.iter().find(holds) {
        add(&all, file, &mut seen, &mut needed);
    }
    needed.encode_to_vec()
}

fn add<'a>(
    all: &'a FileDescriptorSet,
    file: &'a FileDescriptorProto,
    seen: &mut BTreeSet<&'a str>,
    needed: &mut FileDescriptorSet,
) {
    if !seen.insert(file.name()) {
        return;
    }
    for import in &file.dependency {
        if let Some(imported) = all.file.iter().find(|other| other.name() == import) {
            add(all, imported, seen, needed);
        }
    }
    let mut bare = file.clone();
    bare.source_code_info = None;
    needed.file.push(bare);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_schema_stands_alone_and_holds_its_message() {
        for name in [
            "posefuse.v1.EngineInput",
            "posefuse.v1.RoomFrame",
            "posefuse.v1.Truth",
            "foxglove.SceneUpdate",
            "foxglove.FrameTransforms",
        ] {
            let schema = FileDescriptorSet::decode(schema_of(name).as_slice()).unwrap();
            let mut known = BTreeSet::new();
            for file in &schema.file {
                for import in &file.dependency {
                    assert!(
                        known.contains(import),
                        "{name}: {import} comes late or never"
                    );
                }
                known.insert(file.name().to_owned());
            }
            let last = schema.file.last().unwrap();
            let full =
                |m: &prost_types::DescriptorProto| format!("{}.{}", last.package(), m.name());
            assert!(last.message_type.iter().any(|m| full(m) == name), "{name}");
        }
        assert!(schema_of("posefuse.v1.Nothing").is_empty());
    }
}
