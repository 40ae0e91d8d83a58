//! A hostile file gets an error: no panic, no endless loop, bounded memory.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_session::{
    Catalogue, MemoryStorage, RefuseOptions, Storage, TakeReader, Topic, recover, refuse,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// Everything a server or user could do with the file, results ignored.
fn try_everything(bytes: Vec<u8>) {
    let files = [("t.mcap".to_owned(), bytes)];
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::holding(files));
    read_all(&*storage);
    let _ = Catalogue::list(&*storage).unwrap();
    let _ = recover(&storage).unwrap();
    read_all(&*storage);
    let options = RefuseOptions {
        build: support::BUILD.into(),
        ..RefuseOptions::default()
    };
    let _ = refuse(&storage, "t", &options, &mut |_| {});
    let _ = Catalogue::list(&*storage).unwrap();
}

fn read_all(storage: &dyn Storage) {
    let Ok(take) = TakeReader::open(storage, "t") else {
        return;
    };
    for entry in take.entries(&Topic::ALL, None).flatten() {
        let _ = entry.decode();
    }
    let _ = (take.beginning(), take.inputs().count());
}

fn small_take() -> Vec<u8> {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    record_small(&storage);
    memory.read("t.mcap").unwrap()
}

fn record_small(storage: &Arc<dyn Storage>) {
    support::record(storage, "t", 0.2, 0.9, 1);
}

/// Peak of this process's address space, bytes.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmPeak:"))
        .unwrap();
    let kilobytes: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    kilobytes * 1024
}

/// Where records of the file begin: opcode, then eight bytes of length.
fn record_places(bytes: &[u8]) -> Vec<usize> {
    let (mut at, mut places) = (8, Vec::new());
    while at + 9 <= bytes.len() - 8 {
        places.push(at);
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + length as usize;
    }
    places
}

#[test]
fn lengths_that_lie_cost_no_memory() {
    let before = peak_bytes();
    // 33 bytes that ask for 2 GiB.
    for opcode in 1..=0x0F_u8 {
        for length in [1_u64 << 31, u64::MAX, 1 << 62, (1 << 26) - 1] {
            let mut file = mcap::MAGIC.to_vec();
            file.push(opcode);
            file.extend(length.to_le_bytes());
            file.extend([0; 8]);
            file.extend(mcap::MAGIC);
            assert_eq!(file.len(), 33);
            try_everything(file);
        }
    }
    let whole = small_take();
    for place in record_places(&whole) {
        for length in [1_u64 << 31, u64::MAX, 0, 1 << 40] {
            let mut bytes = whole.clone();
            bytes[place + 1..place + 9].copy_from_slice(&length.to_le_bytes());
            try_everything(bytes);
        }
    }
    // Chunks that claim to unpack to more, or to be packed in more, than there is.
    for place in record_places(&whole)
        .into_iter()
        .filter(|place| whole[*place] == 6)
    {
        for offset in [16, 28, 36] {
            for claim in [1_u64 << 31, u64::MAX / 2, (1 << 26) + 1] {
                let mut bytes = whole.clone();
                let at = place + 9 + offset;
                let length = if offset == 28 { 4 } else { 8 };
                bytes[at..at + length].copy_from_slice(&claim.to_le_bytes()[..length]);
                try_everything(bytes);
            }
        }
    }
    let grown = peak_bytes() - before;
    assert!(grown < 400 << 20, "{} MiB were asked for", grown >> 20);
}

#[test]
fn changed_bytes_never_panic() {
    let whole = small_take();
    let change = (any::<prop::sample::Index>(), any::<u8>());
    let config = ProptestConfig::with_cases(400);
    proptest!(config, |(changes in vec(change, 1..12))| {
        let mut bytes = whole.clone();
        for (place, value) in changes {
            let at = place.index(bytes.len());
            bytes[at] = value;
        }
        try_everything(bytes);
    });
}

#[test]
fn changed_heads_never_panic() {
    // Changes where they hurt: the heads of records and the index at the end.
    let whole = small_take();
    let places = record_places(&whole);
    let change = (any::<prop::sample::Index>(), 0..60_usize, any::<u8>());
    let config = ProptestConfig::with_cases(400);
    proptest!(config, |(changes in vec(change, 1..6))| {
        let mut bytes = whole.clone();
        for (place, offset, value) in changes {
            let at = (places[place.index(places.len())] + offset).min(bytes.len() - 1);
            bytes[at] = value;
        }
        try_everything(bytes);
    });
}

#[test]
fn pieces_put_together_never_panic() {
    let whole = small_take();
    let places = record_places(&whole);
    let piece = (any::<prop::sample::Index>(), 1..4_usize);
    let footer = prop::option::of(any::<prop::sample::Index>());
    let config = ProptestConfig::with_cases(300);
    proptest!(config, |(pieces in vec(piece, 0..8), noise in vec(any::<u8>(), 0..64), footer in footer)| {
        let mut bytes = mcap::MAGIC.to_vec();
        let mut starts = vec![8];
        for (place, records) in pieces {
            let first = place.index(places.len() - 1);
            let last = (first + records).min(places.len() - 1);
            bytes.extend(&whole[places[first]..places[last]]);
            starts.push(bytes.len());
        }
        bytes.extend(&noise);
        if let Some(start) = footer {
            let start = starts[start.index(starts.len())] as u64;
            bytes.extend([2, 20, 0, 0, 0, 0, 0, 0, 0]);
            bytes.extend(start.to_le_bytes());
            bytes.extend([0; 12]);
            bytes.extend(mcap::MAGIC);
        }
        try_everything(bytes);
    });
}

/// The take with one message's bytes changed, all checksums right.
fn with_changed_message(
    whole: &[u8],
    number: usize,
    changes: &[(prop::sample::Index, u8)],
) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut file).unwrap();
    for record in mcap::read::LinearReader::new(whole).unwrap() {
        match record.unwrap() {
            mcap::records::Record::Metadata(metadata) => writer.write_metadata(&metadata).unwrap(),
            mcap::records::Record::Attachment { header, data, .. } => {
                let attachment = mcap::Attachment {
                    log_time: header.log_time,
                    create_time: header.create_time,
                    name: header.name,
                    media_type: header.media_type,
                    data,
                };
                writer.attach(&attachment).unwrap();
            }
            _ => {}
        }
    }
    for (at, message) in mcap::MessageStream::new(whole).unwrap().enumerate() {
        let mut message = message.unwrap();
        let data = message.data.to_mut();
        if at == number && !data.is_empty() {
            for (place, value) in changes {
                let place = place.index(data.len());
                data[place] = *value;
            }
        }
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

#[test]
fn changed_messages_never_panic() {
    let whole = small_take();
    let messages = mcap::MessageStream::new(&whole).unwrap().count();
    let change = (any::<prop::sample::Index>(), any::<u8>());
    // The first message is the engine's snapshot: it gets its share.
    let number = prop_oneof![Just(0), 0..messages];
    let config = ProptestConfig::with_cases(300);
    proptest!(config, |(number in number, changes in vec(change, 1..4))| {
        try_everything(with_changed_message(&whole, number, &changes));
    });
}

/// The file with one word of it replaced by another of the same length, checksums left as they were.
fn with_word(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let at = bytes.windows(old.len()).position(|part| part == old);
    let at = at.unwrap();
    [&bytes[..at], new, &bytes[at + old.len()..]].concat()
}

#[test]
fn each_kind_of_trouble_says_what_to_do() {
    let whole = small_take();
    let format = |digit: u8| [b"\x06\0\0\0format\x01\0\0\0".as_slice(), &[digit]].concat();
    let newer = with_word(&whole, &format(b'1'), &format(b'2'));
    let mut other_program = std::io::Cursor::new(Vec::new());
    mcap::Writer::new(&mut other_program)
        .unwrap()
        .finish()
        .unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 0x10;
    let cases = [
        (
            b"RIFF....WAVEfmt and so on, for a while".to_vec(),
            "move it out",
        ),
        (other_program.into_inner(), "move it out"),
        (whole[..whole.len() - 9].to_vec(), "start the server"),
        (Vec::new(), "copy of it"),
        (damaged, "copy of it"),
        (newer, "update Posefuse"),
    ];
    for (bytes, remedy) in cases {
        let files = [("t.mcap".to_owned(), bytes.clone())];
        let memory = MemoryStorage::holding(files);
        let opened = TakeReader::open(&memory, "t");
        let read = opened.and_then(|take| take.inputs().collect::<Result<Vec<_>, _>>());
        let said = read.unwrap_err().to_string();
        assert!(said.contains(remedy) && said.contains("`t`"), "{said}");
        // Whatever cannot be repaired stays as it was.
        let storage: Arc<dyn Storage> = Arc::new(memory.clone());
        let recovered = recover(&storage).unwrap();
        let is_cut_off = remedy == "start the server";
        assert_eq!(
            memory.read("t.mcap").unwrap() == bytes,
            !is_cut_off,
            "{recovered:?}"
        );
    }
}
