//! Windows as occlusion models get them in simulated rooms, beside the truth, for `models/training`:
//! `cargo run --release -p posefuse-evaluate --example pairs -- OUT live|offline SEEDS SECONDS [ROOMS] [FOLDER]`.
//!
//! Each of ROOMS (as in `posefuse evaluate simulated`; the usual ones if left out) is simulated with SEEDS seeds from 1001 on,
//! which no evaluation uses, with one and two people in turn who do all that the simulator knows. With a FOLDER of motion
//! files, each recording in it that trains (models/training/split.toml) moves through one of the rooms, too. Errors of
//! hidden joints differ from room to room, so that a model does not learn one number.
//!
//! OUT/ROOM_SEED.npy is a NumPy array of records, little-endian, one for a window: `pose` (T, 25, 3) metres, `mask` and `age`
//! (T, 25) as in models/data/README.md; of the pose to be filled `truth` and `plain`, the engine's own, (25, 3), NaN where
//! there is none, and `seen` (25), by how many sensors. T is 64 (live), the last one filled, or 127, the middle one filled.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use posefuse_evaluate::repair::Split;
use posefuse_evaluate::suite::Setting;
use posefuse_evaluate::{Method, RepairPair, preset, repair_pairs};
use posefuse_fusion::Needs;
use posefuse_simulator::load::{find, load};
use posefuse_simulator::motion::{Clip, Situation};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

const FIRST_SEED: u64 = 1001;
/// Of a person's windows every so many-th: those between are nearly the same.
const EVERY: usize = 12;
const ROOMS: &str = "arc1,desk1,arc2,desk2,ring2,arc2,desk2,arc3,desk3,ring3";
/// What hidden joints are off by, against the simulator's usual error.
const HIDDEN: [f64; 3] = [1.0, 0.7, 1.3];
const LONGEST_CLIP_S: f64 = 20.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, kind, seeds, seconds, rest @ ..] = arguments.as_slice() else {
        return Err("expected: pairs OUT live|offline SEEDS SECONDS [ROOMS] [FOLDER]".into());
    };
    let (method, after) = match kind.as_str() {
        "live" => ("kalman", 0),
        "offline" => ("offline", 63),
        other => return Err(format!("expected live or offline, found {other}").into()),
    };
    let asked = Asked {
        method: preset(method).ok_or("the method is gone")?,
        needs: Needs {
            before: 63,
            after,
            rate_hz: 30.0,
        },
        seconds: seconds.parse()?,
        out: Path::new(out),
    };
    let rooms = rest.first().map_or(ROOMS, String::as_str);
    let settings: Option<Vec<Setting>> = rooms.split(',').map(Setting::named).collect();
    let settings = settings.ok_or("no such room")?;
    fs::create_dir_all(out)?;
    let seeds: u64 = seeds.parse()?;
    let mut windows = 0;
    for seed in FIRST_SEED..FIRST_SEED + seeds {
        for (index, setting) in settings.iter().enumerate() {
            let scenario = varied(setting, seed + 97 * index as u64);
            windows += asked.write(setting, &World::new(&scenario)?)?;
        }
    }
    eprintln!("{windows} windows of the simulator's own people");
    if let Some(folder) = rest.get(1) {
        let mut windows = 0;
        let clips = clips(Path::new(folder))?;
        for (index, (setting, clip)) in settings.iter().cycle().zip(&clips).enumerate() {
            let scenario = varied(setting, 2 * FIRST_SEED + index as u64);
            let world = World::with_clips(&scenario, [Arc::clone(clip)])?;
            windows += asked.write(setting, &world)?;
        }
        eprintln!("{windows} windows of {} recordings", clips.len());
    }
    Ok(())
}

/// What is done with every room.
struct Asked<'a> {
    method: Method,
    needs: Needs,
    seconds: f64,
    out: &'a Path,
}

impl Asked<'_> {
    fn write(&self, setting: &Setting, world: &World) -> Result<usize, Box<dyn Error>> {
        let seconds = match world.performance().round_s() {
            Some(_) => self.seconds,
            // A clip goes there and back.
            None => self.seconds.min(LONGEST_CLIP_S),
        };
        let world = Arc::new(world.clone());
        let pairs = repair_pairs(&world, &self.method, self.needs, seconds, EVERY)?;
        let name = format!("{}_{}.npy", setting.name, world.scenario().seed);
        if !pairs.is_empty() {
            fs::write(self.out.join(name), array(&pairs, self.needs.poses()))?;
        }
        Ok(pairs.len())
    }
}

/// The room with this seed; people and errors follow from it.
fn varied(setting: &Setting, seed: u64) -> Scenario {
    let mut scenario = setting.scenario.clone();
    // Half of them do as usual.
    let special = Situation::ALL[(seed / 2) as usize % Situation::ALL.len()];
    if seed.is_multiple_of(2) {
        scenario.situation = special;
        scenario.hugs = special == Situation::Hugging;
    }
    scenario.seed = seed;
    scenario.people = 1 + (seed / 3) as usize % 2;
    scenario.errors.hidden_error_mm *= HIDDEN[seed as usize % HIDDEN.len()];
    scenario
}

/// The recordings below `folder` that train. What cannot be read is told and left out.
fn clips(folder: &Path) -> Result<Vec<Arc<Clip>>, Box<dyn Error>> {
    let split = Split::shipped()?;
    let mut clips = Vec::new();
    for file in find(folder)? {
        let place = file
            .strip_prefix(folder)?
            .to_string_lossy()
            .replace('\\', "/");
        if split.tests(&place).is_some() {
            continue;
        }
        match load(&file) {
            Ok(clip) if clip.duration_s() > 1.0 => clips.push(Arc::new(clip)),
            Ok(_) => {}
            Err(error) => eprintln!("left out: {error}"),
        }
    }
    Ok(clips)
}

/// NumPy's file format 1.0 with records: magic, version, length of the header, the header padded to a multiple of 64.
fn array(pairs: &[RepairPair], poses: usize) -> Vec<u8> {
    let mut header = format!(
        "{{'descr': [('pose', '<f4', ({poses}, 25, 3)), ('mask', '<f4', ({poses}, 25)), ('age', '<f4', ({poses}, 25)), \
         ('truth', '<f4', (25, 3)), ('plain', '<f4', (25, 3)), ('seen', '|u1', (25,))], 'fortran_order': False, \
         'shape': ({},), }}",
        pairs.len()
    );
    const BEFORE_HEADER: usize = 10;
    while !(BEFORE_HEADER + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for pair in pairs {
        let joints = || pair.window.poses.iter().flatten();
        let mut push = |number: f64| bytes.extend((number as f32).to_le_bytes());
        joints().for_each(|joint| joint.position.iter().for_each(|x| push(*x)));
        joints().for_each(|joint| push(joint.weight.into()));
        joints().for_each(|joint| push(joint.age_s.into()));
        places(&pair.truth)
            .chain(places(&pair.plain))
            .for_each(push);
        let seen = Joint::ALL.map(|joint| pair.seen[joint].unwrap_or(0) as u8);
        bytes.extend(seen);
    }
    bytes
}

fn places(joints: &JointMap<Position<Room>>) -> impl Iterator<Item = f64> {
    Joint::ALL.into_iter().flat_map(|joint| {
        let place = joints[joint].map_or([f64::NAN; 3], |position| position.vector().into());
        <[f64; 3]>::into_iter(place)
    })
}
