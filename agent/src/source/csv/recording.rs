//! Reads a recording of two Kinects v2: one line per Kinect, person and instant.
//!
//! Kinect camera space (x to the sensor's left, y up, z forward) becomes optical (x right, y down, z forward) by
//! (-x, -y, z): the file's left is the person's own, as everywhere here. -9999 is missing. The file holds no tracking
//! state, so every joint that is there has confidence 1. Lines that repeat a stale frame are kept.

use std::collections::{BTreeMap, BTreeSet};
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};

use posefuse_skeleton::{Confidence, Joint, Position, RawJoint};
use thiserror::Error;

use super::header::Header;
use crate::source::{RecordedFrame, SourceBody};

/// Longest recording, nanoseconds: a day. Times further apart are broken.
const LONGEST_NS: i64 = 86_400_000_000_000;
/// What stands for a missing value.
const MISSING: f64 = -9999.0;
/// Most bodies that one Kinect can have at once (it tracks six); more means that the file is something else.
const MAX_BODIES: usize = 16;

/// Why a recording cannot be used.
#[derive(Debug, Error)]
pub enum CsvError {
    /// The file cannot be read.
    #[error("{file}: {source}", file = file.display())]
    Read {
        /// Which.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line is broken.
    #[error("{file}, line {line}: {reason}", file = file.display())]
    Line {
        /// Which file.
        file: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What was expected and found.
        reason: String,
    },
    /// The Kinect that was asked for is not in the file.
    #[error("{file}: no Kinect `{wanted}`; there are {known}", file = file.display())]
    Kinect {
        /// Which file.
        file: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What there is.
        known: String,
    },
}

/// One Kinect's part of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Its frames in the file's order: Kinect v2 joints, metres, optical axes.
    pub frames: Vec<RecordedFrame>,
    /// The first delivery of any Kinect in the file, nanoseconds.
    pub begins_ns: i64,
    /// When a next round may begin: a frame's time after the last delivery of any Kinect.
    pub ends_ns: i64,
    /// What the Kinect's own clock shows at `begins_ns`.
    pub device_origin_ns: i64,
}

/// One line. Times count from the file's first line and from the Kinect's first line: since the year 1 they would not
/// fit into nanoseconds.
struct Line {
    kinect: String,
    delivered_ns: i64,
    device_ns: i64,
    body: Option<SourceBody>,
}

/// The times of a line as the file has them.
#[derive(Clone, Copy)]
struct RawTimes {
    tracker_ms: i64,
    device_ticks: i64,
}

impl Recording {
    /// Reads the frames of one Kinect, named by IPv4 address or by number (1, 2) in the order of addresses.
    /// Every line of the file is checked, those of other Kinects too.
    pub fn read(file: &Path, kinect: &str) -> Result<Self, CsvError> {
        let bytes = std::fs::read(file).map_err(|source| CsvError::Read {
            file: file.to_owned(),
            source,
        })?;
        Self::parse(&bytes, file, kinect)
    }

    /// Like [`Recording::read`], of bytes already read; `file` is for messages.
    pub fn parse(bytes: &[u8], file: &Path, kinect: &str) -> Result<Self, CsvError> {
        let (lines, origins) = parse_lines(bytes, file)?;
        let wanted = choose(&lines, file, kinect)?;
        let first_ticks = origins.get(&wanted).map_or(0, |origin| origin.device_ticks);
        let (first, last) = lines
            .iter()
            .fold((i64::MAX, i64::MIN), |(low, high), line| {
                (low.min(line.delivered_ns), high.max(line.delivered_ns))
            });
        let own = || lines.iter().filter(|line| line.kinect == wanted);
        // The quickest frame: the Kinect's clock is taken to be behind the logger's by this much.
        let behind_ns = own()
            .map(|line| line.delivered_ns - line.device_ns)
            .min()
            .unwrap_or(0);
        Ok(Self {
            frames: frames(own(), behind_ns),
            begins_ns: first,
            ends_ns: last + 33_333_333,
            device_origin_ns: first_ticks
                .saturating_mul(100)
                .saturating_add(first - behind_ns),
        })
    }
}

fn frames<'a>(lines: impl Iterator<Item = &'a Line>, behind_ns: i64) -> Vec<RecordedFrame> {
    let mut frames: Vec<RecordedFrame> = Vec::new();
    for line in lines {
        let captured_ns = line.device_ns + behind_ns;
        let same = frames.last_mut().filter(|frame| {
            frame.delivered_ns == line.delivered_ns
                && frame.captured_ns == captured_ns
                && frame.bodies.len() < MAX_BODIES
                && line.body.as_ref().is_none_or(|body| {
                    frame
                        .bodies
                        .iter()
                        .all(|other| other.tracking_id != body.tracking_id)
                })
        });
        match same {
            Some(frame) => frame.bodies.extend(line.body.clone()),
            None => frames.push(RecordedFrame {
                delivered_ns: line.delivered_ns,
                captured_ns,
                bodies: line.body.iter().cloned().collect(),
            }),
        }
    }
    frames
}

/// The name, as the file has it, of the Kinect that was asked for.
fn choose(lines: &[Line], file: &Path, wanted: &str) -> Result<String, CsvError> {
    let order = |name: &&str| (name.parse::<Ipv4Addr>().ok(), name.to_string());
    let mut names: Vec<&str> = lines
        .iter()
        .map(|line| line.kinect.as_str())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    names.sort_by_key(order);
    let by_number = || {
        let number: usize = wanted.trim().parse().ok()?;
        names.get(number.checked_sub(1)?)
    };
    let found = names
        .iter()
        .find(|name| **name == wanted.trim())
        .or_else(by_number);
    found
        .map(|name| (*name).to_owned())
        .ok_or_else(|| CsvError::Kinect {
            file: file.to_owned(),
            wanted: wanted.to_owned(),
            known: match names.len() {
                0 => "no frames at all".to_owned(),
                _ => names
                    .iter()
                    .enumerate()
                    .map(|(i, name)| format!("{name} (or {})", i + 1))
                    .collect::<Vec<_>>()
                    .join(", "),
            },
        })
}

type Origins = BTreeMap<String, RawTimes>;

/// All lines, and the times that each Kinect's lines count from.
fn parse_lines(bytes: &[u8], file: &Path) -> Result<(Vec<Line>, Origins), CsvError> {
    let broken = |line: usize, reason: String| CsvError::Line {
        file: file.to_owned(),
        line,
        reason,
    };
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()]
            .iter()
            .filter(|&&b| b == b'\n')
            .count();
        broken(line, "expected text, found bytes that are not UTF-8".into())
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut rows = text.lines().enumerate();
    let (_, first) = rows
        .next()
        .ok_or_else(|| broken(1, "expected a header, found an empty file".into()))?;
    let header = Header::read(first).map_err(|reason| broken(1, reason))?;
    let (mut lines, mut origins, mut first_ms) = (Vec::new(), Origins::new(), None);
    for (index, row) in rows.filter(|(_, row)| !row.trim().is_empty()) {
        let refused = |reason| broken(index + 1, reason);
        let Some((kinect, times, body)) = parse_line(&header, row).map_err(refused)? else {
            continue;
        };
        let origin_ms = *first_ms.get_or_insert(times.tracker_ms);
        let origin = origins.entry(kinect.clone()).or_insert(times);
        let since = |name, value: i64, origin: i64, unit: i64| {
            let ns = value
                .checked_sub(origin)
                .and_then(|count| count.checked_mul(unit));
            ns.filter(|ns| ns.abs() <= LONGEST_NS).ok_or_else(|| {
                refused(format!(
                    "{name} {value} is more than a day away from the first, {origin}"
                ))
            })
        };
        lines.push(Line {
            delivered_ns: since("Tracker_Time", times.tracker_ms, origin_ms, 1_000_000)?,
            device_ns: since(
                "Skeleton_Time",
                times.device_ticks,
                origin.device_ticks,
                100,
            )?,
            kinect,
            body,
        });
    }
    Ok((lines, origins))
}

type Parsed = (String, RawTimes, Option<SourceBody>);

/// One line: Kinect, times, and the body unless all its joints are missing. `None` where the line has no time,
/// which is how the file says that its Kinect saw nobody.
fn parse_line(header: &Header, row: &str) -> Result<Option<Parsed>, String> {
    let cells: Vec<&str> = row.split(',').map(str::trim).collect();
    if cells.len() != header.width {
        return Err(format!(
            "expected {} cells as in the header, found {}; is the line cut off?",
            header.width,
            cells.len()
        ));
    }
    let whole = |name: &str, column: usize| {
        let cell = cells[column];
        cell.parse::<i64>()
            .map_err(|_| format!("expected a whole number for {name}, found `{cell}`"))
    };
    let small = |name: &str, column: usize| {
        let value = whole(name, column)?;
        u32::try_from(value).map_err(|_| format!("expected {name} from 0 on, found {value}"))
    };
    let times = RawTimes {
        tracker_ms: whole("Tracker_Time", header.tracker_time)?,
        device_ticks: whole("Skeleton_Time", header.skeleton_time)?,
    };
    if times.device_ticks == MISSING as i64 {
        return Ok(None);
    }
    let kinect = cells[header.kinect];
    if kinect.is_empty() {
        return Err("expected the address of a Kinect, found nothing".into());
    }
    let (person, skeleton) = (
        small("Person", header.person)?,
        small("Skeleton", header.skeleton)?,
    );
    let joints = parse_joints(header, &cells)?;
    // In files with several people the skeleton's number is that of the Kinect, and the person's tells them apart.
    let body = joints.iter().any(Option::is_some).then(|| SourceBody {
        tracking_id: u64::from(person) << 32 | u64::from(skeleton),
        joints,
        orientations: Vec::new(),
        hands_closed: [None; 2],
    });
    Ok(Some((kinect.to_owned(), times, body)))
}

fn parse_joints(header: &Header, cells: &[&str]) -> Result<Vec<Option<RawJoint>>, String> {
    let joint = |joint: Joint| {
        let mut xyz = [0.0; 3];
        for (axis, &column) in header.joints[joint as usize].iter().enumerate() {
            let cell = cells[column];
            let metres = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            xyz[axis] = metres.ok_or_else(|| {
                format!(
                    "expected metres for {joint}_{}, found `{cell}`",
                    ["X", "Y", "Z"][axis]
                )
            })?;
        }
        Ok((!xyz.contains(&MISSING)).then(|| RawJoint {
            position: Position::new(-xyz[0], -xyz[1], xyz[2]),
            confidence: Confidence::FULL,
        }))
    };
    Joint::ALL.into_iter().map(joint).collect()
}
