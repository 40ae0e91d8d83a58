//! Timecode: the time of day as film and television count it, `HH:MM:SS:FF`.
//!
//! A frame has the label of the frame interval its capture falls into, counted from midnight, so that one room's poses and
//! another device's pictures with the same label belong together to within a frame. Labels follow SMPTE ST 12-1.
//!
//! Drop-frame at 30000/1001 frames a second skips the labels 00 and 01 in the first second of each minute but every tenth:
//! 107892 labels an hour, which are 3.6 ms shorter than it. A day is 2.6 frames longer than its labels; the last label
//! is held for them, so that no label names the next day before midnight.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

const DAY_NS: i64 = 86_400 * 1_000_000_000;
/// An instant so little before a frame counts as in it: times of evenly spaced frames are rounded to nanoseconds, and must
/// have evenly spaced labels.
const EARLY_NS: i64 = 1000;
/// Labels that a drop-frame minute skips.
const SKIPPED: u64 = 2;
/// Drop-frame labels of one minute that skips some, and of ten minutes.
const SHORT_MINUTE: u64 = 60 * 30 - SKIPPED;
const TEN_MINUTES: u64 = 10 * SHORT_MINUTE + SKIPPED;

/// How many frames a second has, and how they are labelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub enum TimecodeRate {
    /// Film.
    #[serde(rename = "24")]
    Fps24,
    /// PAL.
    #[serde(rename = "25")]
    Fps25,
    /// NTSC, 30000/1001 frames a second, drop-frame.
    #[serde(rename = "29.97df")]
    Fps29Drop,
    /// Thirty.
    #[default]
    #[serde(rename = "30")]
    Fps30,
    /// Fifty.
    #[serde(rename = "50")]
    Fps50,
    /// Sixty.
    #[serde(rename = "60")]
    Fps60,
}

/// A rate as people write it: `"29.97df"`, `"25"` or 25.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Word(String),
    Whole(u32),
    Fraction(f64),
}

impl TryFrom<Written> for TimecodeRate {
    type Error = TimecodeError;

    fn try_from(written: Written) -> Result<Self, TimecodeError> {
        match written {
            Written::Word(word) => word.parse(),
            Written::Whole(rate) => rate.to_string().parse(),
            Written::Fraction(rate) => rate.to_string().parse(),
        }
    }
}

impl TimecodeRate {
    /// Every rate.
    pub const ALL: [Self; 6] = [
        Self::Fps24,
        Self::Fps25,
        Self::Fps29Drop,
        Self::Fps30,
        Self::Fps50,
        Self::Fps60,
    ];

    /// Its word, as configurations and takes have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fps24 => "24",
            Self::Fps25 => "25",
            Self::Fps29Drop => "29.97df",
            Self::Fps30 => "30",
            Self::Fps50 => "50",
            Self::Fps60 => "60",
        }
    }

    /// Labels of a second: one more than the largest `FF`.
    pub fn labels(self) -> u8 {
        match self {
            Self::Fps24 => 24,
            Self::Fps25 => 25,
            Self::Fps29Drop | Self::Fps30 => 30,
            Self::Fps50 => 50,
            Self::Fps60 => 60,
        }
    }

    /// Frames a second as a fraction.
    pub fn fraction(self) -> (u32, u32) {
        match self {
            Self::Fps29Drop => (30_000, 1001),
            _ => (u32::from(self.labels()), 1),
        }
    }

    /// Whether labels are skipped.
    pub fn is_drop(self) -> bool {
        self == Self::Fps29Drop
    }

    /// Labels of a day.
    fn labels_a_day(self) -> u64 {
        if self.is_drop() {
            24 * 6 * TEN_MINUTES
        } else {
            86_400 * u64::from(self.labels())
        }
    }
}

impl fmt::Display for TimecodeRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for TimecodeRate {
    type Err = TimecodeError;

    fn from_str(text: &str) -> Result<Self, TimecodeError> {
        let found = Self::ALL.into_iter().find(|rate| rate.name() == text);
        found.ok_or_else(|| TimecodeError::Rate(text.to_owned()))
    }
}

/// The label of one frame of a day.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Timecode {
    rate: TimecodeRate,
    /// Labels before it since midnight, the skipped ones left out.
    number: u64,
}

/// What is no timecode.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TimecodeError {
    /// An unknown rate.
    #[error("`{0}` is no timecode rate: choose 24, 25, 29.97df, 30, 50 or 60")]
    Rate(String),
    /// Not of the form.
    #[error(
        "`{found}` is no timecode at {rate} frames a second: expected HH:MM:SS{separator}FF, up to 23:59:59{separator}{last}",
        separator = if .rate.is_drop() { ';' } else { ':' }, last = .rate.labels() - 1
    )]
    Form {
        /// What was found.
        found: String,
        /// At which rate.
        rate: TimecodeRate,
    },
    /// A label that drop-frame skips.
    #[error(
        "there is no `{0}`: drop-frame skips frames 00 and 01 in the first second of each minute but every tenth"
    )]
    Skipped(String),
}

impl Timecode {
    /// The label of the frame that `ns` nanoseconds after midnight fall into. What lies before the day or after it counts as
    /// its first or last instant.
    pub fn of_day(rate: TimecodeRate, ns: i64) -> Self {
        let ns = ns.clamp(0, DAY_NS - 1);
        let (frames, seconds) = rate.fraction();
        let number =
            i128::from(ns + EARLY_NS) * i128::from(frames) / (i128::from(seconds) * 1_000_000_000);
        let number = u64::try_from(number).unwrap_or(0);
        Self {
            rate,
            number: number.min(rate.labels_a_day() - 1),
        }
    }

    /// At which rate it counts.
    pub fn rate(self) -> TimecodeRate {
        self.rate
    }

    /// Hours, minutes, seconds, frame.
    pub fn fields(self) -> [u8; 4] {
        let labels = u64::from(self.rate.labels());
        let shown = match self.rate.is_drop() {
            true => self.number + skipped_before(self.number),
            false => self.number,
        };
        let seconds = shown / labels;
        [
            seconds / 3600,
            seconds / 60 % 60,
            seconds % 60,
            shown % labels,
        ]
        .map(|field| field as u8)
    }

    /// When its frame begins, nanoseconds after midnight, rounded up so that this instant is within the frame.
    pub fn day_ns(self) -> i64 {
        let (frames, seconds) = self.rate.fraction();
        let ns = i128::from(self.number) * i128::from(seconds) * 1_000_000_000;
        let frames = i128::from(frames);
        ((ns + frames - 1) / frames) as i64
    }

    /// Reads `HH:MM:SS:FF`; drop-frame has `;` before the frame, where `:` and `.` do too.
    ///
    /// # Errors
    /// Another form, a field that is too large, a label that drop-frame skips.
    pub fn parse(rate: TimecodeRate, text: &str) -> Result<Self, TimecodeError> {
        let wrong = || TimecodeError::Form {
            found: text.to_owned(),
            rate,
        };
        let separators = [':', ':', if rate.is_drop() { ';' } else { ':' }];
        if text.len() != 11 || !text.is_ascii() {
            return Err(wrong());
        }
        let mut fields = [0_u64; 4];
        for (index, field) in fields.iter_mut().enumerate() {
            let digits = &text[3 * index..3 * index + 2];
            if !digits.bytes().all(|digit| digit.is_ascii_digit()) {
                return Err(wrong());
            }
            *field = digits.parse().map_err(|_| wrong())?;
        }
        for (index, expected) in separators.into_iter().enumerate() {
            let found = text.as_bytes()[3 * index + 2] as char;
            let lenient = rate.is_drop() && index == 2 && matches!(found, ':' | '.');
            if found != expected && !lenient {
                return Err(wrong());
            }
        }
        let [hours, minutes, seconds, frame] = fields;
        let labels = u64::from(rate.labels());
        if hours > 23 || minutes > 59 || seconds > 59 || frame >= labels {
            return Err(wrong());
        }
        let mut number = ((hours * 60 + minutes) * 60 + seconds) * labels + frame;
        if rate.is_drop() {
            if seconds == 0 && frame < SKIPPED && minutes % 10 != 0 {
                return Err(TimecodeError::Skipped(text.to_owned()));
            }
            let minutes = hours * 60 + minutes;
            number -= SKIPPED * (minutes - minutes / 10);
        }
        Ok(Self { rate, number })
    }
}

/// How many labels drop-frame has skipped before the frame of this number.
fn skipped_before(number: u64) -> u64 {
    let (tens, rest) = (number / TEN_MINUTES, number % TEN_MINUTES);
    // The first of ten minutes skips none, and is so much longer.
    let minutes = rest.saturating_sub(SKIPPED) / SHORT_MINUTE;
    SKIPPED * (9 * tens + minutes)
}

impl fmt::Display for Timecode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [hours, minutes, seconds, frame] = self.fields();
        let separator = if self.rate.is_drop() { ';' } else { ':' };
        write!(
            f,
            "{hours:02}:{minutes:02}:{seconds:02}{separator}{frame:02}"
        )
    }
}

/// How a room's civil time becomes timecode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimecodeZone {
    /// At which rate.
    pub rate: TimecodeRate,
    /// The room's midnight: its zone's distance from UTC, seconds, positive east of Greenwich.
    pub utc_offset_s: i32,
}

impl TimecodeZone {
    /// The label of civil time, nanoseconds since 1970, UTC.
    pub fn at(self, unix_ns: i64) -> Timecode {
        let local = unix_ns.saturating_add(i64::from(self.utc_offset_s) * 1_000_000_000);
        Timecode::of_day(self.rate, local.rem_euclid(DAY_NS))
    }
}

#[cfg(test)]
mod tests;
