//! Fixtures of our own for each spelling and each kind of damage; the real recordings are in `tests/recordings.rs`.

use std::path::Path;

use posefuse_skeleton::Joint;

use super::*;
use crate::SensorSource;

struct Fixed(i64, i64);

impl Clock for Fixed {
    fn monotonic_ns(&self) -> i64 {
        self.0
    }
    fn unix_ns(&self) -> i64 {
        self.1
    }
}

const A: &str = "10.0.0.9";
const B: &str = "10.0.0.10";
/// Milliseconds since the year 1, as the recordings have them: in nanoseconds they do not fit into 64 bits.
const T0: i64 = 63_562_368_661_308;
/// Ticks of 100 ns.
const D0: i64 = 2_270_779_020_856;

fn alphabetical() -> Vec<Joint> {
    let mut joints = Joint::ALL.to_vec();
    joints.sort_by_key(|joint| joint.name());
    joints
}

fn header(ids: [&str; 12]) -> String {
    let coordinates = alphabetical().into_iter();
    let coordinates =
        coordinates.flat_map(|joint| ["X", "Y", "Z"].map(|axis| format!("{joint}_{axis}")));
    ids.map(str::to_owned)
        .into_iter()
        .chain(coordinates)
        .collect::<Vec<_>>()
        .join(", ")
}

fn plain_header() -> String {
    header([
        "Study",
        "KinectConfig",
        "Scenario",
        "Tracker_Time",
        "Person#",
        "Skeleton#",
        "Skeleton_Time",
        "Skeleton_Init_Angle",
        "Skeleton_Init_Dist",
        "Kinect#",
        "Kinect_Tilt_Angle",
        "Kinect_Height",
    ])
}

fn id_header() -> String {
    header([
        "Study_Id",
        "Kinect_Config",
        "Scenario_Id",
        "Tracker_Time",
        "Person_Id",
        "Skeleton_Id",
        "Skeleton_Time",
        "Skeleton_Init_Angle",
        "Skeleton_Init_Dist",
        "Kinect_Id",
        "Kinect_Tilt_Angle",
        "Kinect_Height",
    ])
}

/// Each joint at (index in canonical order / 100, 0.5, 2.5), Kinect camera space.
fn line(tracker_ms: i64, person: u32, kinect: &str, ticks: i64) -> String {
    let head =
        format!("20, 1, -9999, {tracker_ms}, {person}, 0, {ticks}, 0.27, 2.49, {kinect}, 0, 100");
    let xyz = alphabetical()
        .into_iter()
        .map(|joint| format!(", {}, 0.5, 2.5", f64::from(joint as u8) / 100.0));
    head + &xyz.collect::<String>()
}

fn parse(text: &str, kinect: &str) -> Result<Recording, CsvError> {
    Recording::parse(text.as_bytes(), Path::new("walk.csv"), kinect)
}

fn recording() -> String {
    let rows = [
        plain_header(),
        line(T0, 0, A, D0),
        line(T0, 0, B, 77_000_000),
        line(T0, 1, A, D0),
        // Delivered 10 ms later than the quickest, then stale, then the quickest again.
        line(T0 + 43, 0, A, D0 + 330_000),
        line(T0 + 60, 0, A, D0 + 330_000),
        line(T0 + 100, 0, A, D0 + 1_000_000),
        line(T0 + 120, 0, B, 77_000_000 + 1_000_000),
    ];
    rows.join("\n") + "\n"
}

#[test]
fn every_spelling_of_the_header_reads_the_same() {
    let expected = parse(&recording(), A).unwrap();
    let other = recording().replace(&plain_header(), &id_header());
    let lower = recording().replace(&plain_header(), &id_header().to_lowercase());
    let variants = [
        other.clone(),
        lower,
        format!("\u{feff}{other}"),
        other.replace('\n', "\r\n"),
        other.replace(", ", ","),
        format!("{other}\n\n"),
        other.trim_end().to_owned(),
    ];
    for variant in variants {
        assert_eq!(parse(&variant, A).unwrap(), expected, "{}", &variant[..60]);
    }
}

#[test]
fn frames_have_the_kinects_own_time_and_the_recordings_delivery() {
    let recording = parse(&recording(), A).unwrap();
    let times: Vec<(i64, i64)> = recording
        .frames
        .iter()
        .map(|f| (f.captured_ns / 1_000_000, f.delivered_ns / 1_000_000))
        .collect();
    assert_eq!(times, [(0, 0), (33, 43), (33, 60), (100, 100)]);
    assert_eq!(
        recording.device_origin_ns,
        D0 * 100,
        "the Kinect's own epoch"
    );
    assert_eq!(
        (recording.begins_ns, recording.ends_ns / 1_000_000),
        (0, 153)
    );
    let bodies: Vec<usize> = recording
        .frames
        .iter()
        .map(|frame| frame.bodies.len())
        .collect();
    assert_eq!(bodies, [2, 1, 1, 1]);
    assert_ne!(
        recording.frames[0].bodies[0].tracking_id,
        recording.frames[0].bodies[1].tracking_id
    );
    assert_eq!(
        recording.frames[0].bodies[0].tracking_id,
        recording.frames[1].bodies[0].tracking_id
    );
    assert_eq!(
        recording.frames[1].bodies, recording.frames[2].bodies,
        "stale repeats are passed on"
    );
}

#[test]
fn joints_are_sorted_by_name_and_turned_into_optical_axes() {
    let body = parse(&recording(), A)
        .unwrap()
        .frames
        .remove(0)
        .bodies
        .remove(0);
    for joint in Joint::ALL {
        let raw = body.joints[joint as usize].unwrap();
        let expected = nearly(-f64::from(joint as u8) / 100.0, -0.5, 2.5);
        assert!(
            raw.position.distance(expected) < 1e-12,
            "{joint}: {:?}",
            raw.position
        );
        assert_eq!(raw.confidence.get(), 1.0);
    }
}

fn nearly(x: f64, y: f64, z: f64) -> posefuse_skeleton::Position<posefuse_skeleton::Sensor> {
    posefuse_skeleton::Position::new(x, y, z)
}

#[test]
fn missing_values_are_missing_joints_bodies_and_frames() {
    let head = plain_header();
    // AnkleLeft's y, which is the second coordinate of the first joint.
    let joint = line(T0, 0, A, D0).replacen(", 0.5, 2.5", ", -9999, 2.5", 1);
    let body = {
        let full = line(T0 + 33, 0, A, D0 + 330_000);
        full.split(", ")
            .take(12)
            .chain(std::iter::repeat_n("-9999", 75))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let nothing = line(T0 + 66, 0, A, -9999);
    let text = [head, joint, body, nothing].join("\n");
    let frames = parse(&text, A).unwrap().frames;
    assert_eq!(frames.len(), 2);
    assert_eq!(frames[0].bodies[0].joints[Joint::AnkleLeft as usize], None);
    assert_eq!(frames[0].bodies[0].joints.iter().flatten().count(), 24);
    assert_eq!(frames[1].bodies, [], "nobody in view is a frame too");
}

#[test]
fn a_kinect_is_chosen_by_address_or_number() {
    let text = recording();
    assert_eq!(
        parse(&text, "1").unwrap(),
        parse(&text, A).unwrap(),
        "10.0.0.9 comes before 10.0.0.10"
    );
    assert_eq!(parse(&text, "2").unwrap(), parse(&text, B).unwrap());
    for wrong in ["3", "0", "10.0.0.1", ""] {
        let error = parse(&text, wrong).unwrap_err().to_string();
        assert!(
            error.contains("walk.csv") && error.contains("10.0.0.9 (or 1), 10.0.0.10 (or 2)"),
            "{error}"
        );
    }
    let error = parse(&plain_header(), "1").unwrap_err().to_string();
    assert!(error.contains("no frames at all"), "{error}");
}

#[test]
fn broken_lines_are_refused_with_file_line_and_reason() {
    let good = recording();
    let damaged = |from: &str, to: &str| good.replacen(from, to, 1);
    let cut = good.trim_end()[..good.len() - 40].to_owned();
    let cases = [
        (String::new(), 1, "empty file"),
        (
            damaged("Tracker_Time, ", "Clock, "),
            1,
            "no column `Tracker_Time`",
        ),
        (
            damaged("AnkleLeft_Y", "AnkleLeft_X"),
            1,
            "`AnkleLeft_X` twice",
        ),
        (
            damaged(", 0.5, 2.5", ", 0.5"),
            2,
            "expected 87 cells as in the header, found 86",
        ),
        (
            damaged(", 0.5, 2.5", ", half, 2.5"),
            2,
            "expected metres for AnkleLeft_Y, found `half`",
        ),
        (
            damaged(", 0.5, 2.5", ", NaN, 2.5"),
            2,
            "expected metres for AnkleLeft_Y, found `NaN`",
        ),
        (damaged(", 0.5, 2.5", ", , 2.5"), 2, "found ``"),
        (
            damaged(&(T0 + 43).to_string(), "soon"),
            5,
            "whole number for Tracker_Time, found `soon`",
        ),
        (
            damaged(&(T0 + 43).to_string(), "-9999"),
            5,
            "more than a day away",
        ),
        (
            damaged(&(D0 + 330_000).to_string(), &i64::MAX.to_string()),
            5,
            "more than a day away",
        ),
        (
            damaged(&format!("{T0}, 1, 0"), &format!("{T0}, -1, 0")),
            4,
            "Person from 0 on, found -1",
        ),
        (
            damaged(&format!(", {A}, 0, 100"), ", , 0, 100"),
            2,
            "address of a Kinect",
        ),
        (cut, 8, "is the line cut off?"),
    ];
    for (text, line, reason) in cases {
        let error = parse(&text, A).unwrap_err().to_string();
        assert!(
            error.starts_with(&format!("walk.csv, line {line}: ")) && error.contains(reason),
            "{reason}: {error}"
        );
    }
    let error = Recording::parse(b"Study\n\xff\xfe", Path::new("x.csv"), "1")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("x.csv, line 2") && error.contains("UTF-8"),
        "{error}"
    );
    let error = Recording::read(Path::new("/no/such.csv"), "1")
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("/no/such.csv: "), "{error}");
}

fn source(
    config: impl FnOnce(&mut CsvConfig),
    clock: &Fixed,
) -> (tempfile::TempDir, Replay<CsvTape>) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walk.csv");
    std::fs::write(&file, recording()).unwrap();
    let mut settings = CsvConfig::new(file, A);
    config(&mut settings);
    let source = open(&settings, clock).unwrap();
    (folder, source)
}

fn times(source: &mut dyn SensorSource, frames: usize) -> Vec<(i64, i64)> {
    let next = |_| source.next_frame().unwrap().unwrap();
    let ms = |ns: i64| (ns as f64 / 1e6).round() as i64;
    (0..frames)
        .map(next)
        .map(|f| (ms(f.captured.ns() - D0 * 100), ms(f.due_ns.unwrap())))
        .collect()
}

#[test]
fn a_replay_keeps_the_recordings_time_or_runs_faster() {
    let clock = Fixed(5_000_000, 0);
    let (_folder, mut once) = source(|_| {}, &clock);
    assert_eq!(
        times(&mut once, 4),
        [(0, 5), (33, 48), (33, 65), (100, 105)]
    );
    assert_eq!(once.next_frame(), Ok(None));
    assert_eq!(
        (once.clock())(5_000_000).ns(),
        D0 * 100,
        "stamps and echoes are by one clock"
    );

    let (_folder, mut fast) = source(|config| config.replay.speed = 2.0, &clock);
    assert_eq!(times(&mut fast, 4), [(0, 5), (17, 27), (17, 35), (50, 55)]);

    let (_folder, mut prompt) = source(|config| config.prompt = true, &clock);
    assert_eq!(
        times(&mut prompt, 4),
        [(0, 5), (33, 38), (33, 38), (100, 105)]
    );

    let (_folder, mut endless) = source(|config| config.replay.repeat = true, &clock);
    let rounds = times(&mut endless, 9);
    assert_eq!(
        rounds[4],
        (153, 158),
        "a frame's time after the last line of any Kinect"
    );
    assert_eq!(rounds[8], (307, 312));
}

#[test]
fn replays_start_together_and_can_be_joined_midway() {
    let align = |config: &mut CsvConfig| config.replay.align_s = 2.0;
    let (one, other) = (Fixed(10, 3_000_000_000), Fixed(900_000_010, 3_900_000_000));
    let (_folder, mut first) = source(align, &one);
    let (_folder, mut second) = source(align, &other);
    assert_eq!(times(&mut first, 1)[0].1, 1_000);
    assert_eq!(
        times(&mut second, 1)[0].1,
        1_000,
        "one civil instant on one machine's clock"
    );

    let late = Fixed(0, 10_050_000_000);
    let (_folder, mut joined) = source(
        |config| config.replay.epoch_unix_ns = Some(10_000_000_000),
        &late,
    );
    assert_eq!(
        times(&mut joined, 2),
        [(33, 10), (100, 50)],
        "what was due before is passed over"
    );
    // Looped replays are in step whenever they were started, also after thousands of rounds.
    for rounds in [7, 70_000] {
        let much_later = Fixed(0, 10_000_000_000 + 153_333_333 * rounds + 50_000_000);
        let (_folder, mut joined) = source(
            |config| {
                config.replay.repeat = true;
                config.replay.epoch_unix_ns = Some(10_000_000_000);
            },
            &much_later,
        );
        assert_eq!(times(&mut joined, 1), [(33, 10)], "after {rounds} rounds");
    }
}

#[test]
fn impossible_settings_are_refused() {
    for (speed, align_s) in [
        (0.0, 0.0),
        (f64::NAN, 0.0),
        (1.0, -1.0),
        (1.0, f64::INFINITY),
    ] {
        let mut config = CsvConfig::new("walk.csv", "1");
        (config.replay.speed, config.replay.align_s) = (speed, align_s);
        let error = open(&config, &Fixed(0, 0)).err().unwrap().to_string();
        assert!(error.contains("must lie between"), "{error}");
    }
}
