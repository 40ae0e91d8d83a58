//! The take that the tests export, and what is truly in it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use posefuse_export::{Options, Report, export};
use posefuse_kinematics::{Body, Config, Rig, Solver};
use posefuse_session::{MemoryStorage, Storage, TakeHeader, TakeReader, TakeWriter};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{
    Confidence, JointMap, JointState, Position, Room, RoomFrame, SensorId, Skeleton, TimecodeZone,
    Timestamp, Track, TrackId,
};

pub(crate) const RATE_HZ: f64 = 30.0;
pub(crate) const FRAMES: usize = 300;
/// Civil time of server time 0.
pub(crate) const UNIX_OFFSET_NS: i64 = 1_790_000_000_000_000_000;
/// The take's start, server time.
pub(crate) const START: Timestamp = Timestamp::from_ns(100_000_000_000);
pub(crate) const FIRST: u64 = 3;
/// Comes and goes, and is lost for half a second between.
pub(crate) const SECOND: u64 = 8;
pub(crate) const SECOND_IS_THERE: std::ops::RangeInclusive<usize> = 60..=240;
pub(crate) const SECOND_IS_LOST: std::ops::Range<usize> = 150..165;

pub(crate) fn time(frame: usize) -> Timestamp {
    START.plus_ns((frame as f64 * 1e9 / RATE_HZ).round() as i64)
}

pub(crate) fn header(name: &str) -> TakeHeader {
    TakeHeader {
        name: name.to_owned(),
        started: "2026-09-21T14:13:20Z".to_owned(),
        start: Some(START),
        unix_offset_ns: UNIX_OFFSET_NS,
        timecode: Some(TimecodeZone::default()),
        ..TakeHeader::default()
    }
}

pub(crate) fn world() -> World {
    let scenario = Scenario {
        people: 2,
        seed: 11,
        ..Scenario::default()
    };
    World::new(&scenario).unwrap()
}

pub(crate) fn measured(joints: &JointMap<Position<Room>>) -> Skeleton<Room> {
    let sensor = SensorId::new(0).unwrap();
    joints.map(|_, position| JointState::measured(*position, 0.002, Confidence::FULL, sensor))
}

/// A take of two people over 10 s.
pub(crate) fn walk() -> TakeReader {
    walk_in_which(|_, _, skeleton| skeleton)
}

/// The same, with what is seen of a person (by its number) in a frame as `seen` makes it.
pub(crate) fn walk_in_which(
    seen: impl Fn(u64, usize, Skeleton<Room>) -> Skeleton<Room>,
) -> TakeReader {
    let world = world();
    recorded("walk", FRAMES, |frame| {
        let people = world.truth(frame as f64 / RATE_HZ).into_iter();
        let people = people.map(|person| {
            let id = if person.id == 1 { FIRST } else { SECOND };
            (id, seen(id, frame, measured(&person.joints)))
        });
        let is_there = SECOND_IS_THERE.contains(&frame) && !SECOND_IS_LOST.contains(&frame);
        people.filter(|(id, _)| *id == FIRST || is_there).collect()
    })
}

/// A take of so many people, all of them there in each of three frames.
pub(crate) fn crowd(people: u64) -> TakeReader {
    let skeleton = measured(&world().truth(0.0)[0].joints);
    recorded("crowd", 3, |_| {
        (1..=people).map(|id| (id, skeleton.clone())).collect()
    })
}

fn recorded(
    name: &str,
    frames: usize,
    people: impl Fn(usize) -> Vec<(u64, Skeleton<Room>)>,
) -> TakeReader {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
    let mut writer = TakeWriter::create(&storage, header(name), &[], None).unwrap();
    for number in 0..frames {
        let track = |(id, skeleton)| Track {
            id: TrackId(id),
            since: START,
            sensors: Default::default(),
            skeleton,
            hands: [None; 2],
        };
        let frame = RoomFrame {
            number: number as u64,
            time: time(number),
            look_ahead_ns: 0,
            tracks: people(number).into_iter().map(track).collect(),
        };
        writer.frame(&frame).unwrap();
    }
    writer.finish().unwrap();
    TakeReader::open(&*storage, name).unwrap()
}

/// The take's skeletons of a person; `None` where they are not in a frame.
pub(crate) fn skeletons(take: &TakeReader, person: u64) -> Vec<Option<Skeleton<Room>>> {
    let of_person = |frame: RoomFrame| {
        let mut tracks = frame.tracks.into_iter();
        tracks
            .find(|track| track.id.0 == person)
            .map(|track| track.skeleton)
    };
    take.frames()
        .map(|frame| of_person(frame.unwrap()))
        .collect()
}

/// The rig of a person, and for each frame the origins of its bones, room metres.
pub(crate) fn moved(take: &TakeReader, person: u64) -> (Rig, Vec<Option<Vec<Position<Room>>>>) {
    let tracks = skeletons(take, person).into_iter().map(|skeleton| {
        let skeleton = skeleton?;
        let (id, since) = (TrackId(person), START);
        Some(Track {
            id,
            since,
            sensors: Default::default(),
            skeleton,
            hands: [None; 2],
        })
    });
    let tracks: Vec<Option<Track>> = tracks.collect();
    let mut solver = Solver::new(&Body::learn(tracks.iter().flatten()), Config::default());
    let rig = solver.rig().clone();
    let origins = tracks.iter().enumerate().map(|(frame, track)| {
        let pose = solver.step(track.as_ref()?, time(frame))?.pose;
        Some(
            rig.place(&pose)
                .into_iter()
                .map(|(origin, _)| origin)
                .collect(),
        )
    });
    let origins = origins.collect();
    (rig, origins)
}

/// A folder that vanishes, with what was exported to it.
pub(crate) struct Exported {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) report: Report,
}

impl Exported {
    pub(crate) fn of(take: &TakeReader, options: &Options) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let report = export(take, options, folder.path(), false, &mut |_| {}).unwrap();
        Self { folder, report }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub(crate) fn names(&self) -> Vec<String> {
        names_in(self.folder.path())
    }
}

pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
