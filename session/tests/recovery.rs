//! A take that was cut off is repaired: every whole chunk is there again.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_session::{
    Catalogue, MemoryStorage, RecoveryOutcome, RefuseOptions, Storage, TakeInfo, TakeReader,
    TakeState, Topic, recover, refuse,
};
use proptest::prelude::*;
use support::{BUILD, record};

/// A finished take's bytes and where its chunks end, with the frames there are up to there.
struct Whole {
    bytes: Vec<u8>,
    chunks: Vec<(usize, Vec<Vec<u8>>)>,
}

fn whole() -> Whole {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    record(&storage, "t", 1.2, 5.0, 1);
    let bytes = memory.read("t.mcap").unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let frames_channel = summary
        .channels
        .values()
        .find(|c| c.topic == "/frames")
        .unwrap()
        .id;
    let (mut chunks, mut frames) = (Vec::new(), Vec::new());
    let mut indexes = summary.chunk_indexes.clone();
    indexes.sort_by_key(|index| index.chunk_start_offset);
    for index in &indexes {
        for message in summary.stream_chunk(&bytes, index).unwrap() {
            let message = message.unwrap();
            if message.channel.id == frames_channel {
                frames.push(message.data.to_vec());
            }
        }
        let end = index.chunk_start_offset + index.chunk_length;
        chunks.push((end as usize, frames.clone()));
    }
    assert!(chunks.len() > 10, "{} chunks", chunks.len());
    Whole { bytes, chunks }
}

/// Recovers a folder that holds just this file; the take's list entry and frames.
fn recovered(bytes: Vec<u8>) -> (RecoveryOutcome, Arc<dyn Storage>) {
    let storage: Arc<dyn Storage> =
        Arc::new(MemoryStorage::holding([("t.mcap".to_owned(), bytes)]));
    let mut recoveries = recover(&storage).unwrap();
    assert_eq!(recoveries.len(), 1);
    (recoveries.remove(0).outcome, storage)
}

fn frames(storage: &dyn Storage) -> Vec<Vec<u8>> {
    let take = TakeReader::open(storage, "t").unwrap();
    take.entries(&[Topic::Frames], None)
        .map(|entry| entry.unwrap().bytes)
        .collect()
}

fn check_cut(whole: &Whole, length: usize) {
    let complete = whole.chunks.iter().rev().find(|(end, _)| *end <= length);
    let expected = complete.map_or(&[][..], |(_, frames)| frames);
    let (outcome, storage) = recovered(whole.bytes[..length].to_vec());
    let RecoveryOutcome::Recovered { info, .. } = outcome else {
        // Only what ends before the description of the take is beyond repair, and it is left as it was.
        assert!(length < 1_500, "cut at {length}: {outcome:?}");
        assert_eq!(Catalogue::info(&*storage, "t").state, TakeState::Damaged);
        return;
    };
    assert!(frames(&*storage) == expected, "cut at {length}");
    assert_eq!(
        (info.frames, info.state),
        (expected.len() as u64, TakeState::Recovered)
    );
    assert_eq!(Catalogue::list(&*storage).unwrap(), [*info]);
    assert!(recover(&storage).unwrap().is_empty(), "once is enough");
    assert_eq!(storage.list().unwrap().len(), 1);
}

#[test]
fn a_cut_anywhere_costs_only_the_chunk_it_cuts() {
    let whole = whole();
    for (end, _) in &whole.chunks {
        for length in [end - 1, *end, end + 1, end + 9, end + 40] {
            check_cut(&whole, length);
        }
    }
    for length in [
        0,
        1,
        7,
        8,
        9,
        40,
        300,
        whole.bytes.len() - 1,
        whole.bytes.len() - 30,
    ] {
        check_cut(&whole, length);
    }
}

#[test]
fn random_cuts() {
    let whole = whole();
    let config = ProptestConfig::with_cases(120);
    proptest!(config, |(length in 0..whole.bytes.len())| check_cut(&whole, length));
}

#[test]
fn a_recovered_take_fuses_again_to_the_same_bytes() {
    let whole = whole();
    let middle = whole.chunks[whole.chunks.len() / 2].0 + 100;
    let (_, storage) = recovered(whole.bytes[..middle].to_vec());
    let options = RefuseOptions {
        build: BUILD.into(),
        ..RefuseOptions::default()
    };
    let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
    assert!(
        report.identical && report.from_snapshot && report.frames > 40,
        "{report:?}"
    );
}

#[test]
fn zeros_after_a_power_cut_are_dropped() {
    let whole = whole();
    let end = whole.chunks[6].0;
    let mut bytes = whole.bytes[..end].to_vec();
    bytes.extend([0; 10_000]);
    let (outcome, storage) = recovered(bytes);
    assert!(
        matches!(outcome, RecoveryOutcome::Recovered { .. }),
        "{outcome:?}"
    );
    assert!(frames(&*storage) == whole.chunks[6].1);
}

#[test]
fn an_index_that_cannot_be_read_is_made_anew() {
    let whole = whole();
    let mut bytes = whole.bytes.clone();
    let place = bytes.len() - 37;
    // The footer says where the index begins; the length of the first record there lies.
    let start = u64::from_le_bytes(bytes[place + 9..place + 17].try_into().unwrap()) as usize;
    bytes[start + 6] = 0x7F;
    let (outcome, storage) = recovered(bytes);
    assert!(
        matches!(outcome, RecoveryOutcome::Recovered { lost_bytes: 0, .. }),
        "{outcome:?}"
    );
    assert!(frames(&*storage) == whole.chunks.last().unwrap().1);
}

#[test]
fn a_bad_chunk_in_the_middle_costs_only_itself() {
    let whole = whole();
    let (end, before) = &whole.chunks[5];
    let mut bytes = whole.bytes[..whole.chunks[9].0].to_vec();
    bytes[end - 20] ^= 0x40;
    let (outcome, storage) = recovered(bytes);
    let RecoveryOutcome::Recovered { info, lost_bytes } = outcome else {
        panic!("{outcome:?}");
    };
    let lost = before.len() - whole.chunks[4].1.len();
    assert_eq!(frames(&*storage).len(), whole.chunks[9].1.len() - lost);
    assert!(
        lost_bytes > 100 && info.trouble.contains("could not be read"),
        "{}",
        info.trouble
    );
}

#[test]
fn a_power_cut_costs_what_was_not_synced() {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    let mut recorder = support::Recorder::new();
    let start = posefuse_skeleton::Timestamp::ZERO;
    recorder.begin(&storage, "t", start, Default::default());
    for input in support::arrivals(3.0, 1) {
        recorder.arrive(input);
    }
    let given = recorder.live.frames.last().unwrap().time;
    let durable = recorder
        .writer
        .as_mut()
        .unwrap()
        .flush(start.plus_ns(2_900_000_000))
        .unwrap();
    let after: Arc<dyn Storage> = Arc::new(memory.after_power_cut());
    recover(&after).unwrap();
    let take = TakeReader::open(&*after, "t").unwrap();
    let read: Vec<_> = take.frames().map(Result::unwrap).collect();
    assert_eq!(
        read.len() as u64,
        durable.frames,
        "what was acknowledged is there"
    );
    let lost_ns = given.since_ns(read.last().unwrap().time);
    assert!(lost_ns <= 500_000_000, "{lost_ns} ns lost");
}

#[test]
fn what_is_no_take_is_left_alone_and_named() {
    let note = ("notes.txt".to_owned(), b"not a take".to_vec());
    let text = (
        "text.mcap".to_owned(),
        b"not an MCAP file at all, whatever its name says".to_vec(),
    );
    let half = ("half.mcap.new".to_owned(), vec![1, 2, 3]);
    let memory = MemoryStorage::holding([note, text.clone(), half]);
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    let recoveries = recover(&storage).unwrap();
    assert_eq!(recoveries.len(), 1);
    assert!(
        matches!(&recoveries[0].outcome, RecoveryOutcome::Damaged(why) if why.contains("does not begin"))
    );
    assert_eq!(memory.read("text.mcap").unwrap(), text.1);
    assert!(
        memory.read("half.mcap.new").is_err(),
        "half a rewrite is thrown away"
    );
    let list: Vec<TakeInfo> = Catalogue::list(&*storage).unwrap();
    assert_eq!((list.len(), list[0].state), (1, TakeState::Damaged));
    assert!(!list[0].trouble.is_empty());
}

#[test]
fn a_crash_during_recovery_costs_nothing() {
    let whole = whole();
    let cut_off = whole.bytes[..whole.chunks[6].0].to_vec();
    let half_done = cut_off[..whole.chunks[2].0].to_vec();
    let files = [("t.mcap", cut_off), ("t.mcap.new", half_done)];
    let files = files.map(|(file, bytes)| (file.to_owned(), bytes));
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::holding(files));
    let recoveries = recover(&storage).unwrap();
    assert!(
        matches!(
            recoveries[..],
            [posefuse_session::Recovery {
                outcome: RecoveryOutcome::Recovered { .. },
                ..
            }]
        ),
        "{recoveries:?}"
    );
    assert!(frames(&*storage) == whole.chunks[6].1);
    assert_eq!(storage.list().unwrap().len(), 1);
}

#[test]
fn what_another_process_is_writing_is_left_alone() {
    let whole = whole();
    let cut_off = (
        "t.mcap".to_owned(),
        whole.bytes[..whole.chunks[6].0].to_vec(),
    );
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::holding([cut_off]));
    let _writing = storage.create("t.mcap.new").unwrap();
    let recoveries = recover(&storage).unwrap();
    assert!(
        matches!(&recoveries[0].outcome, RecoveryOutcome::Damaged(why) if why.contains("t")),
        "{recoveries:?}"
    );
    assert_eq!(storage.list().unwrap().len(), 2);
}
