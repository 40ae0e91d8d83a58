//! What a take is told when it begins, and how the file keeps it: a metadata record and attachments.

use std::collections::BTreeMap;

use posefuse_skeleton::{Calibration, TimecodeZone, Timestamp, calibration_text};

use crate::{Result, TakeError};

/// The metadata record that a take begins with.
pub(crate) const START: &str = "posefuse.take";
/// The format that this build writes, and the latest it reads.
const FORMAT: i64 = 1;
/// The key with the room's distance from UTC, seconds.
const TIMECODE_ZONE: &str = "timecode_utc_offset_s";
/// The attachment with the engine's configuration.
pub(crate) const CONFIG: &str = "config.toml";
/// The attachment with the calibration that was in force at the start.
pub(crate) const CALIBRATION: &str = "calibration.toml";

/// What a take begins with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TakeHeader {
    /// Unique in its folder; see [`crate::check_take_name`].
    pub name: String,
    /// What the user calls the scene.
    pub slate: String,
    /// What the user wrote down.
    pub notes: String,
    /// Civil time of the start, RFC 3339, UTC.
    pub started: String,
    /// Server time of the start.
    pub start: Option<Timestamp>,
    /// Added to server time gives nanoseconds since 1970.
    pub unix_offset_ns: i64,
    /// How civil time becomes the room's timecode; `None` in takes from before there was one.
    pub timecode: Option<TimecodeZone>,
    /// The engine's configuration (`fusion::Config`), TOML.
    pub config_toml: String,
    /// The calibration in force at the start; read from a take, to the decimals of its file's text.
    pub calibration: Option<Calibration>,
    /// What built the engine; a take is fused again from its snapshot by the same build only.
    pub build: String,
}

/// The engine's whole state at one instant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EngineState {
    /// The build that can read it.
    pub build: String,
    /// What `Engine::state` gave.
    pub state: Vec<u8>,
}

impl TakeHeader {
    pub(crate) fn start_ns(&self) -> i64 {
        self.start.unwrap_or(Timestamp::ZERO).ns()
    }

    /// Nanoseconds since 1970 of a server time; 0 for what lies before.
    pub(crate) fn unix_ns(&self, time: Timestamp) -> u64 {
        u64::try_from(time.ns().saturating_add(self.unix_offset_ns)).unwrap_or(0)
    }

    /// The server time of nanoseconds since 1970.
    pub(crate) fn server_time(&self, unix_ns: u64) -> Timestamp {
        let unix_ns = i64::try_from(unix_ns).unwrap_or(i64::MAX);
        Timestamp::from_ns(unix_ns.saturating_sub(self.unix_offset_ns))
    }

    /// The timecode of a server time, and its rate; empty where the take has none.
    pub fn timecode(&self, time: Timestamp) -> [String; 2] {
        let Some(zone) = self.timecode else {
            return Default::default();
        };
        let unix_ns = time.ns().saturating_add(self.unix_offset_ns);
        [zone.at(unix_ns).to_string(), zone.rate.to_string()]
    }

    /// The metadata record; `preamble` is how many of the first inputs only set the scene.
    pub(crate) fn to_metadata(&self, preamble: usize) -> BTreeMap<String, String> {
        let pairs = [
            ("format", FORMAT.to_string()),
            ("name", self.name.clone()),
            ("slate", self.slate.clone()),
            ("notes", self.notes.clone()),
            ("started", self.started.clone()),
            ("start_ns", self.start_ns().to_string()),
            ("unix_offset_ns", self.unix_offset_ns.to_string()),
            ("build", self.build.clone()),
            ("preamble", preamble.to_string()),
        ];
        let start = self.start.unwrap_or(Timestamp::ZERO);
        let [timecode, rate] = self.timecode(start);
        let timecode = self.timecode.map(|zone| {
            [
                // For readers without our arithmetic; ours reads rate and zone.
                ("timecode", timecode),
                ("timecode_rate", rate),
                (TIMECODE_ZONE, zone.utc_offset_s.to_string()),
            ]
        });
        pairs
            .into_iter()
            .chain(timecode.into_iter().flatten())
            .map(|(key, value)| (key.to_owned(), value))
            .collect()
    }

    /// The header without its attachments, and how many inputs only set the scene.
    pub(crate) fn from_metadata(
        take: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<(Self, u32)> {
        let text = |key: &str| metadata.get(key).cloned().unwrap_or_default();
        let number = |key: &str| {
            let found = text(key);
            found.parse::<i64>().map_err(|_| {
                TakeError::damaged(
                    take,
                    format!("metadata `{START}`: `{key}` must be a number, found `{found}`"),
                )
            })
        };
        let found = number("format")?;
        if found > FORMAT {
            return Err(TakeError::Newer {
                name: take.to_owned(),
                found,
                known: FORMAT,
                build: text("build"),
            });
        }
        let preamble = u32::try_from(number("preamble")?).unwrap_or(0);
        // A rate of a later build is none to this one; the take is as good without.
        let timecode = text("timecode_rate").parse().ok().map(|rate| TimecodeZone {
            rate,
            utc_offset_s: text(TIMECODE_ZONE).parse().unwrap_or(0),
        });
        let header = Self {
            name: take.to_owned(),
            slate: text("slate"),
            notes: text("notes"),
            started: text("started"),
            start: Some(Timestamp::from_ns(number("start_ns")?)),
            unix_offset_ns: number("unix_offset_ns")?,
            timecode,
            build: text("build"),
            ..Self::default()
        };
        Ok((header, preamble))
    }
}

/// A calibration as its file's text; `None` for one that no file can hold: the inputs have it in any case.
pub(crate) fn calibration_to_text(take: &str, calibration: &Calibration) -> Option<String> {
    let text = calibration_text::to_toml(calibration);
    match calibration_text::from_toml(&text) {
        Ok(_) => Some(text),
        Err(error) => {
            tracing::warn!(take, %error, "the take goes without an attachment `{CALIBRATION}`");
            None
        }
    }
}

/// A calibration from a take's attachment.
pub(crate) fn calibration_from_text(take: &str, text: &str) -> Result<Calibration> {
    calibration_text::from_toml(text)
        .map_err(|error| TakeError::damaged(take, format!("attachment `{CALIBRATION}`: {error}")))
}
