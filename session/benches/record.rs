//! What recording costs: bytes a minute, and processor time for a second of take against bare protobuf encoding of
//! the same messages. `cargo bench -p posefuse-session`; `-- FOLDER` also leaves the takes there.
#![allow(clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_fusion::{Config, Engine, Input, Output};
use posefuse_proto::room_frame_to_wire;
use posefuse_session::{
    DiskStorage, MemoryStorage, RefuseOptions, Storage, TakeReader, TakeWriter, Topic,
    input_to_bytes, refuse,
};
use posefuse_skeleton::{RoomFrame, Timestamp};
use prost::Message;

const SECONDS: f64 = 30.0;

enum Given {
    Input(Input),
    Frame(RoomFrame),
}

/// A room's inputs and frames in the order a recorder gets them.
fn room(people: usize) -> Vec<Given> {
    let mut engine = Engine::new(Config::default());
    let mut given = Vec::new();
    for input in support::arrivals(SECONDS, people) {
        let now = support::time_of(&input);
        let mut step = |engine: &mut Engine, input: Input| {
            given.push(Given::Input(input.clone()));
            engine.handle(input);
            loop {
                match engine.poll() {
                    Output::Frame(frame) => given.push(Given::Frame(frame)),
                    Output::Rejected(_) | Output::Repair(_) => {}
                    Output::WakeAt(wake) => break wake,
                }
            }
        };
        while let Output::WakeAt(Some(wake)) = engine.poll() {
            if wake > now {
                break;
            }
            step(&mut engine, Input::Tick(wake));
        }
        step(&mut engine, input);
    }
    given
}

fn write(storage: &Arc<dyn Storage>, name: &str, room: &[Given]) -> Duration {
    let begun = Instant::now();
    let header = support::header(name, Timestamp::ZERO);
    let mut writer = TakeWriter::create(storage, header, &[], None).unwrap();
    for given in room {
        match given {
            Given::Input(input) => {
                writer.input(input).unwrap();
                writer.flush(support::time_of(input)).unwrap();
            }
            Given::Frame(frame) => writer.frame(frame).unwrap(),
        }
    }
    writer.finish().unwrap();
    begun.elapsed()
}

fn encode(room: &[Given]) -> (Duration, usize) {
    let begun = Instant::now();
    let bytes = room.iter().map(|given| match given {
        Given::Input(input) => input_to_bytes(input).len(),
        Given::Frame(frame) => room_frame_to_wire(frame).encode_to_vec().len(),
    });
    let bytes = bytes.sum();
    (begun.elapsed(), bytes)
}

fn main() {
    let folder = std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with('-'));
    for people in [1, 2] {
        let room = room(people);
        let (bare, bare_bytes) = encode(&room);
        let memory: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
        let name = format!("sensors4-people{people}");
        let taken = write(&memory, &name, &room);
        let take = TakeReader::open(&*memory, &name).unwrap();
        let info = take.info();
        println!(
            "4 sensors x {people} people, {SECONDS} s, {} frames",
            info.frames
        );
        let per_minute = |bytes: f64| bytes * 60.0 / SECONDS / 1e6;
        println!(
            "  {:.2} MB a minute in the file; inputs and frames alone are {:.2} MB unpacked",
            per_minute(info.size_bytes as f64),
            per_minute(bare_bytes as f64)
        );
        println!(
            "  {:.2} ms of processor for a second of take; {:.1} times bare encoding",
            taken.as_secs_f64() * 1e3 / SECONDS,
            taken.as_secs_f64() / bare.as_secs_f64()
        );
        let begun = Instant::now();
        let messages = take
            .entries(&[Topic::Inputs, Topic::Frames], None)
            .flatten();
        let messages = messages.filter(|entry| entry.decode().is_ok()).count();
        println!(
            "  read and decoded {messages} messages in {:.0} ms",
            begun.elapsed().as_secs_f64() * 1e3
        );
        let begun = Instant::now();
        let options = RefuseOptions {
            build: support::BUILD.into(),
            ..RefuseOptions::default()
        };
        let report = refuse(&memory, &name, &options, &mut |_| {}).unwrap();
        println!(
            "  fused again {:.0} times faster than it happened, identical: {}",
            SECONDS / begun.elapsed().as_secs_f64(),
            report.identical
        );
        if let Some(folder) = &folder {
            let disk: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder).unwrap());
            let on_disk = write(&disk, &name, &room);
            println!(
                "  written to {folder} in {:.0} ms, synced {} times",
                on_disk.as_secs_f64() * 1e3,
                SECONDS * 4.0
            );
        }
    }
}
