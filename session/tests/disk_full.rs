//! A disk that fills up ends the take properly: footer, index, everything that was accepted.
#![allow(clippy::unwrap_used)]

mod support;

use std::process::Command;
use std::sync::Arc;

use posefuse_session::{
    Catalogue, DiskStorage, MemoryStorage, Storage, TakeError, TakeOptions, TakeReader, TakeState,
    TakeWriter,
};
use posefuse_skeleton::Timestamp;
use support::{arrivals, header, time_of};

/// What was accepted before the take ended by itself.
struct Accepted {
    inputs: u64,
    ended: String,
}

/// Records until the disk ends the take; `at` runs before each input.
fn record_until_ended(
    storage: &Arc<dyn Storage>,
    options: TakeOptions,
    mut at: impl FnMut(u64),
) -> Accepted {
    let header = header("t", Timestamp::ZERO);
    let mut writer = TakeWriter::create_with(storage, header, &[], None, options).unwrap();
    let mut inputs = 0;
    // The same minute over and over: nothing here fuses.
    let minute = arrivals(20.0, 2);
    for (round, input) in (0..).flat_map(|round| minute.iter().map(move |input| (round, input))) {
        at(inputs);
        match writer.input(input) {
            Ok(()) => inputs += 1,
            Err(TakeError::Ended(ended)) => {
                let info = writer.finish().unwrap();
                assert_eq!((info.state, &info.trouble), (TakeState::Complete, &ended));
                return Accepted { inputs, ended };
            }
            Err(other) => panic!("{other}"),
        }
        let now = time_of(input).plus_ns(round * 20_000_000_000);
        let flushed = writer.flush(now).unwrap();
        assert!(flushed.inputs <= inputs);
        assert!(inputs < 3_000_000, "the disk never filled");
    }
    unreachable!("inputs go on for ever")
}

fn check(storage: &dyn Storage, accepted: &Accepted, why: &str) {
    assert!(accepted.ended.contains(why), "{}", accepted.ended);
    let take = TakeReader::open(storage, "t").unwrap();
    let read = take.inputs().map(Result::unwrap).count() as u64;
    assert_eq!(read, accepted.inputs, "no accepted input is lost");
    let events: Vec<_> = take.events().map(Result::unwrap).collect();
    assert_eq!(events.last().unwrap().kind, "take-ended");
    let info = Catalogue::info(storage, "t");
    assert_eq!(
        (info.state, info.trouble),
        (TakeState::Complete, accepted.ended.clone())
    );
}

fn no_guard() -> TakeOptions {
    TakeOptions {
        min_free_bytes: 0,
        ..TakeOptions::default()
    }
}

#[test]
fn space_set_aside_is_enough_to_end_properly() {
    for capacity in [8_000_000, 11_111_111, 20_000_000] {
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::with_capacity(capacity, true));
        let accepted = record_until_ended(&storage, no_guard(), |_| {});
        check(&*storage, &accepted, "disk was full");
    }
}

#[test]
fn another_process_may_fill_the_disk_at_any_time() {
    for moment in [1, 50, 700, 1_501, 4_000] {
        let memory = MemoryStorage::with_capacity(60_000_000, true);
        let storage: Arc<dyn Storage> = Arc::new(memory.clone());
        let accepted = record_until_ended(&storage, no_guard(), |inputs| {
            if inputs >= moment {
                memory.occupied_by_others(u64::MAX);
            }
        });
        assert!(accepted.inputs >= moment);
        check(&*storage, &accepted, "disk was full");
    }
}

#[test]
fn the_guard_ends_the_take_where_nothing_can_be_set_aside() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::with_capacity(20_000_000, false));
    let options = TakeOptions {
        min_free_bytes: 8_000_000,
        ..TakeOptions::default()
    };
    let accepted = record_until_ended(&storage, options, |_| {});
    check(&*storage, &accepted, "8 MB were free");
}

#[test]
fn a_disk_that_takes_nothing_more_leaves_a_take_to_recover() {
    // Nothing can be set aside and nobody guards: the worst there is.
    let memory = MemoryStorage::with_capacity(2_000_000, false);
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    let header = header("t", Timestamp::ZERO);
    let mut writer = TakeWriter::create_with(&storage, header, &[], None, no_guard()).unwrap();
    let minute = arrivals(60.0, 2);
    let mut durable = 0;
    let failed = minute.iter().find_map(|input| {
        let given = writer.input(input).err();
        let flushed = writer.flush(time_of(input));
        durable = durable.max(flushed.as_ref().map_or(0, |flushed| flushed.inputs));
        given.or(flushed.err())
    });
    assert!(failed.unwrap().to_string().contains("cannot end take `t`"));
    assert!(matches!(writer.input(&minute[0]), Err(TakeError::Ended(_))));
    assert!(
        writer
            .flush(Timestamp::from_seconds(100.0))
            .unwrap()
            .ended
            .is_some()
    );
    assert_eq!(writer.finish().unwrap().state, TakeState::Damaged);
    let after: Arc<dyn Storage> = Arc::new(memory.after_power_cut());
    posefuse_session::recover(&after).unwrap();
    let take = TakeReader::open(&*after, "t").unwrap();
    assert_eq!(take.info().state, TakeState::Recovered);
    assert!(take.inputs().map(Result::unwrap).count() as u64 >= durable && durable > 1_000);
}

#[test]
fn a_take_does_not_begin_on_a_full_disk() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::with_capacity(1_000_000, true));
    let refused = TakeWriter::create(&storage, header("t", Timestamp::ZERO), &[], None);
    let error = refused.err().unwrap().to_string();
    assert!(
        error.contains("1 MB are free") && error.contains("delete takes"),
        "{error}"
    );
    // With no guard it is the space to be set aside that is missing; no file is left behind.
    let refused = TakeWriter::create_with(
        &storage,
        header("t", Timestamp::ZERO),
        &[],
        None,
        no_guard(),
    );
    assert!(
        refused
            .err()
            .unwrap()
            .to_string()
            .contains("set space aside")
    );
    assert!(storage.list().unwrap().is_empty());
}

/// A file system of a fixed size, unmounted at the end.
struct Tmpfs(tempfile::TempDir);

impl Tmpfs {
    /// `None` where this user may not mount.
    fn mount(megabytes: u32) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let size = format!("size={megabytes}m");
        let mut mount = Command::new("mount");
        mount
            .args(["-t", "tmpfs", "-o", &size, "posefuse-test"])
            .arg(folder.path());
        let mounted = mount.output().is_ok_and(|done| done.status.success());
        mounted.then_some(Self(folder))
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}

#[test]
fn a_real_file_system_that_fills_up() {
    let Some(disk) = Tmpfs::mount(24) else {
        eprintln!("skipped: mounting a file system needs root");
        return;
    };
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(disk.0.path()).unwrap());
    let mut others = std::fs::File::create(disk.0.path().join("others.bin")).unwrap();
    let block = vec![7_u8; 100_000];
    let accepted = record_until_ended(&storage, no_guard(), |inputs| {
        // Somebody else writes ten times as fast, and then as much as there is.
        let blocks = if inputs > 3_000 {
            1_000
        } else {
            usize::from(inputs % 100 == 0)
        };
        for _ in 0..blocks {
            if std::io::Write::write_all(&mut others, &block).is_err() {
                break;
            }
        }
    });
    assert!(storage.free_bytes().unwrap() < 3_000_000 || accepted.inputs > 1_000);
    check(&*storage, &accepted, "disk was full");
}
