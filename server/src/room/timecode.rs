//! The room's timecode: the setting, and how civil time becomes it.

use posefuse_proto::v1;
use posefuse_skeleton::{TimecodeRate, TimecodeZone};
use serde::{Deserialize, Serialize};

/// How the time of day is counted. Section `[timecode]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Frames a second.
    pub rate: TimecodeRate,
    /// Whose midnight it counts from.
    pub zone: Zone,
}

/// Whose midnight timecode counts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Zone {
    /// Greenwich's, as all other times of a take.
    #[default]
    Utc,
    /// That of the server's machine.
    Local,
}

impl Config {
    /// Rate and zone as they are at this civil time, nanoseconds since 1970: summers have another distance from UTC.
    pub(crate) fn at(&self, unix_ns: i64) -> TimecodeZone {
        let utc_offset_s = match self.zone {
            Zone::Utc => 0,
            Zone::Local => local_offset_s(unix_ns),
        };
        TimecodeZone {
            rate: self.rate,
            utc_offset_s,
        }
    }
}

fn local_offset_s(unix_ns: i64) -> i32 {
    let seconds = unix_ns.div_euclid(1_000_000_000);
    jiff::Timestamp::from_second(seconds).map_or(0, |time| {
        jiff::tz::TimeZone::system().to_offset(time).seconds()
    })
}

/// Writes civil time, nanoseconds since 1970, and timecode into a frame.
pub(crate) fn stamp(frame: &mut v1::RoomFrame, unix_ns: i64, zone: Option<TimecodeZone>) {
    frame.unix_ns = unix_ns;
    frame.timecode = zone.map_or_else(String::new, |zone| zone.at(unix_ns).to_string());
}
