//! A hundred calibrations that must not pass: ten of each kind.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use posefuse_calibration::Walk;
use posefuse_simulator::motion::{Action, Clip, TimedAction};
use posefuse_simulator::{Layout, Scenario, World};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use crate::simulated::record;
use crate::spoil;
use crate::survey::world;

/// Cases of each kind.
pub(crate) const EACH: usize = 10;

/// A kind's name, and how a case of it is made from its number.
type Kind = (&'static str, fn(usize) -> Walk);

/// The kinds.
pub(crate) const KINDS: [Kind; 10] = [
    ("standing still", standing),
    ("one plane", one_plane),
    ("bumped half-way", bumped),
    ("mirrored", mirrored),
    ("wrong pairing of two", wrong_pairing),
    ("clock off by 2 s", clock),
    ("upside down", upside_down),
    ("too few frames", too_few),
    ("disconnected graph", disconnected),
    ("wrong unit", wrong_unit),
];

const WALK_S: f64 = 30.0;

/// A good walk to spoil: rooms differ from case to case, and from those of the good ones.
fn good(case: usize) -> Walk {
    record(&good_world(case), WALK_S)
}

fn good_world(case: usize) -> Arc<World> {
    world(
        layout(case),
        [3, 4, 2, 6, 3][case % 5],
        case.is_multiple_of(3),
        200 + case as u64,
    )
}

fn layout(case: usize) -> Layout {
    if case.is_multiple_of(2) {
        Layout::Ring
    } else {
        Layout::Arc
    }
}

/// A number in -1..1 that belongs to the case.
fn number(case: usize, which: u32) -> f64 {
    let mixed = (case as u64 * 31 + u64::from(which) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64
        / (1_u64 << 52) as f64
        - 1.0
}

fn spoilt(case: usize, spoil: impl Fn(&mut posefuse_calibration::SensorWalk)) -> Walk {
    let mut walk = good(case);
    let which = case % walk.sensors.len();
    spoil(&mut walk.sensors[which]);
    walk
}

/// Somebody stays on the spot: stands, waves, holds out their arms.
fn standing(case: usize) -> Walk {
    let seed = 300 + case as u64;
    let performance = world(Layout::Ring, 1, false, seed).performance().clone();
    let actions = performance
        .script(0)
        .map_or(&[][..], |script| &script.actions);
    let still = |action: Action| {
        !matches!(
            action,
            Action::Walk | Action::Turn | Action::Shuffle | Action::Sit
        )
    };
    let longest = actions
        .chunk_by(|x, y| still(x.action) == still(y.action))
        .filter(|run| still(run[0].action))
        .max_by(|x, y| length(x).total_cmp(&length(y)));
    let (start, seconds) = longest.map_or((0.0, 1.0), |run| (run[0].start, length(run)));
    // Feet come together in the first moments.
    let begin = start + 1.3;
    let pose = |t: f64| performance.pose(0, begin + t);
    play(clip(seconds - 1.3, pose), case, seed)
}

fn length(run: &[TimedAction]) -> f64 {
    run.iter().map(|action| action.duration).sum()
}

/// Up and down one line without turning, or arms that move in one plane.
fn one_plane(case: usize) -> Walk {
    let seed = 400 + case as u64;
    if case % 5 == 4 {
        return play(
            clip(4.0, |t| stick(Vector2::zeros(), 0.0, 0.0, (t * 1.5).sin())),
            case,
            seed,
        );
    }
    let direction = std::f64::consts::PI * number(case, 1);
    let half = 1.0 + 0.3 * number(case, 2);
    let speed = 0.8;
    let line = move |t: f64| {
        let along = Vector2::new(direction.cos(), direction.sin());
        stick(along * (speed * t - half), direction, speed * t, 0.0)
    };
    play(clip(2.0 * half / speed, line), case, seed)
}

/// A body that walks straight ahead: feet planted, arms and legs in the plane of the walk. `gone` metres, and how far
/// the arms are lifted sideways (0 hanging, 1 level).
fn stick(at: Vector2<f64>, heading: f64, gone: f64, lifted: f64) -> JointMap<Position<Room>> {
    let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
    let left = Vector3::new(-heading.sin(), heading.cos(), 0.0);
    let mut joints = JointMap::empty();
    let mut put = |joint: Joint, x: f64, y: f64, z: f64| {
        let p = Vector3::new(at.x, at.y, z) + ahead * x + left * y;
        joints[joint] = Some(Position::from_vector(p));
    };
    use Joint::*;
    put(SpineBase, 0.0, 0.0, 0.95);
    put(SpineMid, 0.02, 0.0, 1.2);
    put(SpineShoulder, 0.0, 0.0, 1.42);
    put(Neck, 0.01, 0.0, 1.5);
    put(Head, 0.05, 0.0, 1.66);
    const STRIDE_M: f64 = 0.6;
    let arm = [
        ShoulderLeft,
        ElbowLeft,
        WristLeft,
        HandLeft,
        HandTipLeft,
        ThumbLeft,
    ];
    let leg = [HipLeft, KneeLeft, AnkleLeft, FootLeft];
    for (side, phase) in [(1.0, 0.0), (-1.0, 0.5)] {
        let own = |joint: Joint| if side > 0.0 { joint } else { joint.mirrored() };
        let (arm, leg) = (arm.map(own), leg.map(own));
        // A sole stands for half of its stride of two steps and swings twice as fast as the body.
        let stride = gone / (2.0 * STRIDE_M) + phase;
        let (index, part) = (stride.floor(), stride.fract());
        let swing = ((part - 0.5) * 2.0).max(0.0);
        let planted = (index - phase + 0.25) * 2.0 * STRIDE_M;
        let ease = swing * swing * (3.0 - 2.0 * swing);
        let foot = planted + ease * 2.0 * STRIDE_M - gone;
        let lift = 0.1 * (std::f64::consts::PI * swing).sin();
        put(leg[0], 0.0, 0.09 * side, 0.9);
        put(leg[1], 0.5 * foot + 0.05, 0.09 * side, 0.49 + 0.5 * lift);
        put(leg[2], foot, 0.1 * side, 0.08 + lift);
        put(leg[3], foot + 0.12, 0.1 * side, 0.03 + lift);
        let (sin, cos) = (0.5 * std::f64::consts::PI * lifted.abs()).sin_cos();
        put(arm[0], 0.0, 0.18 * side, 1.38);
        let lengths = [0.28, 0.52, 0.6, 0.68, 0.6];
        for (joint, length) in arm[1..].iter().zip(lengths) {
            let forth = -0.4 * foot * length;
            put(
                *joint,
                forth,
                (0.18 + 0.06 * cos + length * sin) * side,
                1.38 - length * cos,
            );
        }
    }
    joints
}

fn clip(seconds: f64, pose: impl Fn(f64) -> JointMap<Position<Room>>) -> Clip {
    const RATE_HZ: f64 = 60.0;
    let frames = (0..(seconds * RATE_HZ) as usize).map(|i| pose(i as f64 / RATE_HZ));
    Clip::new("bad", RATE_HZ, frames.collect()).expect("a clip with frames")
}

fn play(clip: Clip, case: usize, seed: u64) -> Walk {
    let scenario = Scenario {
        seed,
        sensors: [3, 4, 2][case % 3],
        layout: layout(case),
        ..Scenario::default()
    };
    let world = World::with_clips(&scenario, [Arc::new(clip)]).expect("a possible scenario");
    record(&Arc::new(world), WALK_S)
}

/// From 3 cm and 2 degrees to 15 cm and 10 degrees, somewhere in the middle of the walk.
fn bumped(case: usize) -> Walk {
    let size = 1.0 + case as f64 * 4.0 / (EACH - 1) as f64;
    let axis = |first: u32| {
        let v = Vector3::new(
            number(case, first),
            number(case, first + 1),
            number(case, first + 2),
        );
        v.normalize()
    };
    let since = 15.0 + 5.0 * number(case, 9);
    spoilt(case, |sensor| {
        spoil::bump(
            sensor,
            since,
            axis(1) * 0.03 * size,
            axis(4) * (2.0 * size).to_radians(),
        );
    })
}

/// The picture is mirrored: most trackers then see a proper person with the sides exchanged, some keep the sides;
/// or only the labels are.
fn mirrored(case: usize) -> Walk {
    spoilt(case, |sensor| {
        if case % 5 != 4 {
            spoil::positions(sensor, f64::NEG_INFINITY, |p| Vector3::new(-p.x, p.y, p.z));
        }
        if case % 5 != 3 {
            spoil::labels(sensor);
        }
    })
}

/// Two people walk; one sensor's tracker holds on to the one, the others' to the other.
fn wrong_pairing(case: usize) -> Walk {
    let scenario = Scenario {
        seed: 500 + case as u64,
        people: 2,
        sensors: [2, 3, 4][case % 3],
        layout: layout(case),
        ..Scenario::default()
    };
    let world = Arc::new(World::new(&scenario).expect("a possible scenario"));
    let mut walk = record(&world, WALK_S);
    let odd = case % walk.sensors.len();
    for index in 0..walk.sensors.len() {
        let wanted = usize::from(index == odd);
        let pose = world.room_from_sensor(index);
        let late_s = world.sensor_clock(index).offset_ns as f64 * 1e-9;
        spoil::only(&mut walk, index, |stamp, centre| {
            let at = pose.apply(Position::from_vector(centre)).vector();
            let far = |person: usize| {
                let joints = world.performance().pose(person, (stamp - late_s).max(0.0));
                joints[Joint::SpineMid].map_or(f64::INFINITY, |p| (p.vector() - at).norm())
            };
            far(wanted) < far(1 - wanted)
        });
    }
    walk
}

fn clock(case: usize) -> Walk {
    let late_ns = if case.is_multiple_of(2) {
        2_000_000_000
    } else {
        -2_000_000_000
    };
    spoilt(case, |sensor| {
        for frame in &mut sensor.frames {
            frame.time = frame.time.plus_ns(late_ns);
        }
    })
}

fn upside_down(case: usize) -> Walk {
    spoilt(case, |sensor| {
        spoil::positions(sensor, f64::NEG_INFINITY, |p| Vector3::new(-p.x, -p.y, p.z));
    })
}

/// From 1 to 5 seconds, or one frame in 60.
fn too_few(case: usize) -> Walk {
    let mut walk = good(case);
    for sensor in &mut walk.sensors {
        if case % 5 == 4 {
            let mut count = 0;
            sensor.frames.retain(|_| {
                count += 1;
                count % 60 == 0
            });
        } else {
            let from = 5.0 + case as f64;
            spoil::keep(sensor, from, from + 1.0 + 0.5 * case as f64);
        }
    }
    walk
}

/// The sensors of one half see the first half of the walk, the others the second.
fn disconnected(case: usize) -> Walk {
    let mut walk = good(case);
    let count = walk.sensors.len();
    for (index, sensor) in walk.sensors.iter_mut().enumerate() {
        let first = if case.is_multiple_of(2) {
            index % 2 == 0
        } else {
            index + 1 < count
        };
        let (from, to) = if first { (0.0, 14.0) } else { (15.0, 30.0) };
        spoil::keep(sensor, from, to);
    }
    walk
}

/// Millimetres, centimetres, inches, feet, yards taken for metres, and the other way round.
fn wrong_unit(case: usize) -> Walk {
    let yard = 0.9144;
    let factors = [
        1000.0,
        0.001,
        100.0,
        0.01,
        1.0 / 0.0254,
        0.0254,
        1.0 / 0.3048,
        0.3048,
        1.0 / yard,
        yard,
    ];
    spoilt(case, |sensor| {
        spoil::positions(sensor, f64::NEG_INFINITY, |p| p * factors[case]);
    })
}
