//! Schemas for a take: of all .proto files just those that a message needs, so that each schema stands alone.

use std::collections::BTreeSet;

use prost::Message;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

use crate::Topic;

/// The serialised `FileDescriptorSet` of the topic's message, dependencies first.
pub(crate) fn schema_of(topic: Topic) -> Vec<u8> {
    let all = FileDescriptorSet::decode(topic.descriptors()).unwrap_or_default();
    let (package, message) = topic.schema().rsplit_once('.').unwrap_or_default();
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
        for topic in Topic::ALL {
            let schema = FileDescriptorSet::decode(schema_of(topic).as_slice()).unwrap();
            let mut known = BTreeSet::new();
            for file in &schema.file {
                for import in &file.dependency {
                    assert!(
                        known.contains(import),
                        "{topic:?}: {import} comes late or never"
                    );
                }
                known.insert(file.name().to_owned());
            }
            let last = schema.file.last().unwrap();
            let name =
                |m: &prost_types::DescriptorProto| format!("{}.{}", last.package(), m.name());
            assert!(
                last.message_type.iter().any(|m| name(m) == topic.schema()),
                "{topic:?}"
            );
        }
    }
}
