//! A first look at a take: who is in it from when to when, and the instants that an export has.

use std::collections::BTreeMap;

use posefuse_session::{TakeHeader, TakeReader};
use posefuse_skeleton::{Room, Skeleton, Timestamp};

use crate::scan::{Scan, Seeing, Span};
use crate::{ExportError, Options, Progress, Result, Source, Who};

/// Rates that recordings usually have, frames per second. A take whose own rate is near one is exported with it.
pub const USUAL_RATES_HZ: [f64; 10] =
    [15.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0];
/// A rate this near a usual one is meant to be it.
const NEAR: f64 = 0.03;

/// The instants of an export, evenly spaced; frame numbers count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// When frame 0 is, server time.
    pub(crate) start: Timestamp,
    /// Frames per second.
    pub(crate) rate_hz: f64,
}

impl Grid {
    /// When a frame is.
    pub(crate) fn time(&self, frame: u64) -> Timestamp {
        self.start
            .plus_ns((frame as f64 * 1e9 / self.rate_hz).round() as i64)
    }

    /// The first frame at or after `time`.
    fn from(&self, time: Timestamp) -> u64 {
        // Half a microsecond covers the rounding of times to nanoseconds.
        let frames = (time.since_seconds(self.start) - 5e-7) * self.rate_hz;
        frames.ceil().max(0.0) as u64
    }

    /// The last frame at or before `time`; `None` where that is before frame 0.
    fn until(&self, time: Timestamp) -> Option<u64> {
        let frames = (time.since_seconds(self.start) + 5e-7) * self.rate_hz;
        (frames >= 0.0).then_some(frames as u64)
    }
}

/// The frames that a person is there in, both ends included. There may be gaps between.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Presence {
    /// Who.
    pub(crate) who: Who,
    /// The first frame.
    pub(crate) first: u64,
    /// The last frame.
    pub(crate) last: u64,
}

/// What will be exported of a take.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// What the take says of itself.
    pub(crate) header: TakeHeader,
    /// The instants.
    pub(crate) grid: Grid,
    /// Everybody, in order; never empty.
    pub(crate) people: Vec<Presence>,
    /// How many more there are that were seen for too short.
    pub(crate) passers_by: usize,
}

impl Plan {
    /// Reads the take once; `learn` is shown everybody, and told who is seen in the span that is asked for.
    ///
    /// # Errors
    /// [`ExportError::Nobody`] where nobody of those that are asked for is there long enough; a take that cannot be read.
    pub(crate) fn of(
        take: &TakeReader,
        options: &Options,
        learn: &mut dyn FnMut(&Who, &Skeleton<Room>, bool),
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self> {
        let header = take.header().clone();
        let (from, to) = span_of(&header, options);
        let Scan { mut people, steps } = Scan::of(take, options, (from, to), learn, progress)?;
        let calibrated = header.calibration.is_some();
        let nobody = |reason: String| ExportError::Nobody {
            take: header.name.clone(),
            reason,
        };
        people.retain(|_, person| person.asked.is_some());
        let found: Vec<String> = people.keys().map(Who::to_string).collect();
        let (people, passers_by) = chosen(people, options);
        let Some(first) = people.iter().map(|(_, span)| span.first).min() else {
            return Err(nobody(why_nobody(&found, passers_by, calibrated, options)));
        };
        let grid = Grid {
            start: from.unwrap_or(first),
            rate_hz: options.rate_hz.unwrap_or_else(|| usual_rate(&steps)),
        };
        let present = |(who, span): (Who, Span)| {
            let end = to.map_or(span.last, |to| to.min(span.last));
            let (first, last) = (grid.from(span.first), grid.until(end)?);
            (first <= last).then_some(Presence { who, first, last })
        };
        let people: Vec<Presence> = people.into_iter().filter_map(present).collect();
        if people.is_empty() {
            return Err(nobody(why_nobody(&found, found.len(), calibrated, options)));
        }
        Ok(Self {
            header,
            grid,
            people,
            passers_by,
        })
    }

    /// Those who were asked for and are not in it.
    pub(crate) fn absent(&self, options: &Options) -> Vec<u64> {
        let is_there = |number| {
            self.people
                .iter()
                .any(|person| person.who.number() == number)
        };
        let asked = options.people.iter().copied();
        asked.filter(|number| !is_there(*number)).collect()
    }

    /// The frames from the first person's first to the last person's last.
    pub(crate) fn frames(&self) -> (u64, u64) {
        let first = self.people.iter().map(|person| person.first).min();
        let last = self.people.iter().map(|person| person.last).max();
        (first.unwrap_or(0), last.unwrap_or(0))
    }

    /// When a frame is, seconds since the take's start.
    pub(crate) fn seconds(&self, frame: u64) -> f64 {
        let start = self.header.start.unwrap_or(self.grid.start);
        self.grid.time(frame).since_seconds(start)
    }

    /// When a frame is, nanoseconds since 1970.
    pub(crate) fn unix_ns(&self, frame: u64) -> i64 {
        self.grid
            .time(frame)
            .ns()
            .saturating_add(self.header.unix_offset_ns)
    }

    /// The room's timecode of a frame, and its rate; empty where the take has none.
    pub(crate) fn timecode(&self, frame: u64) -> [String; 2] {
        self.header.timecode(self.grid.time(frame))
    }

    /// When a frame is, civil time (UTC), RFC 3339.
    pub(crate) fn civil(&self, frame: u64) -> String {
        let time = self.civil_time(frame);
        time.map_or_else(|| self.header.started.clone(), |time| format!("{time:.6}"))
    }

    /// The same as year, month, day, hour, minute, second and millisecond.
    pub(crate) fn civil_parts(&self, frame: u64) -> Option<[i32; 7]> {
        let at = jiff::tz::TimeZone::UTC.to_datetime(self.civil_time(frame)?);
        let day = [i32::from(at.year()), at.month().into(), at.day().into()];
        let time = [at.hour(), at.minute(), at.second()].map(i32::from);
        let ([year, month, day], [hour, minute, second]) = (day, time);
        Some([
            year,
            month,
            day,
            hour,
            minute,
            second,
            at.millisecond().into(),
        ])
    }

    fn civil_time(&self, frame: u64) -> Option<jiff::Timestamp> {
        jiff::Timestamp::from_nanosecond(i128::from(self.unix_ns(frame))).ok()
    }
}

/// The server times between which people are exported.
fn span_of(header: &TakeHeader, options: &Options) -> (Option<Timestamp>, Option<Timestamp>) {
    let start = header.start.unwrap_or(Timestamp::ZERO);
    let at = |seconds: f64| start.plus_ns((seconds * 1e9).round() as i64);
    (options.from_s.map(at), options.to_s.map(at))
}

/// Those who are asked for and were there long enough, and how many were not there long enough.
fn chosen(people: BTreeMap<Who, Seeing>, options: &Options) -> (Vec<(Who, Span)>, usize) {
    let asked = |who: &Who| options.people.is_empty() || options.people.contains(&who.number());
    let (chosen, passers_by): (Vec<_>, Vec<_>) = people
        .into_iter()
        .filter(|(who, _)| asked(who))
        .partition(|(_, Seeing { whole, .. })| {
            whole.last.since_seconds(whole.first) >= options.least_s
        });
    let span = |(who, person): (Who, Seeing)| Some((who, person.asked?));
    (
        chosen.into_iter().filter_map(span).collect(),
        passers_by.len(),
    )
}

fn why_nobody(found: &[String], passers_by: usize, calibrated: bool, options: &Options) -> String {
    if found.is_empty() {
        let span = match (options.from_s, options.to_s) {
            (None, None) => "",
            _ => " in the span that was asked for",
        };
        let remedy = match (calibrated, options.source) {
            (false, Source::Fused) => {
                "it was recorded without a calibration, so nothing was fused: `posefuse calibrate --from` finds one in it, and \
                 `posefuse refuse --calibration` fuses it into a take that can be exported"
            }
            _ => "`posefuse takes show` says what is in it",
        };
        return format!(
            "no frame of the source `{}` shows anybody{span}; {remedy}",
            options.source
        );
    }
    if passers_by > 0 {
        return format!(
            "nobody is there for {} s or longer (there are {}); ask for shorter ones with --least",
            options.least_s,
            found.join(", ")
        );
    }
    format!(
        "none of the people asked for is in it; there are {}",
        found.join(", ")
    )
}

/// The rate that fits the median step best. `steps` counts tenths of a millisecond.
fn usual_rate(steps: &BTreeMap<i64, u64>) -> f64 {
    let total: u64 = steps.values().sum();
    let mut seen = 0;
    let median = steps.iter().find(|(_, count)| {
        seen += **count;
        2 * seen >= total
    });
    let Some((step, _)) = median.filter(|(step, _)| **step > 0) else {
        return 30.0;
    };
    // Steps are cut to whole tenths; the middle of the tenth is the best guess.
    let rate = 10_000.0 / (*step as f64 + 0.5);
    let off = |usual: &f64| (rate / usual - 1.0).abs();
    let nearest = USUAL_RATES_HZ
        .into_iter()
        .min_by(|a, b| off(a).total_cmp(&off(b)));
    let usual = nearest.filter(|usual| off(usual) < NEAR);
    usual.unwrap_or_else(|| (rate.round()).clamp(1.0, 1000.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_the_usual_ones() {
        for (step_us, rate) in [
            (33_333, 30.0),
            (33_367, 30.0),
            (16_683, 60.0),
            (8_333, 120.0),
            (41_708, 24.0),
            (20_300, 50.0),
            (40_500, 25.0),
            (200_000, 5.0),
        ] {
            let steps = BTreeMap::from([(step_us / 100, 10), (1000, 1)]);
            assert_eq!(usual_rate(&steps), rate, "{step_us}");
        }
        assert_eq!(usual_rate(&BTreeMap::new()), 30.0);
    }

    #[test]
    fn a_person_is_in_the_frames_between_their_ends_only() {
        let start = Timestamp::from_seconds(100.0);
        let grid = Grid {
            start,
            rate_hz: 30.0,
        };
        assert_eq!(grid.from(grid.time(17)), 17);
        assert_eq!(grid.until(grid.time(17)), Some(17));
        assert_eq!(grid.from(grid.time(17).plus_ns(1_000_000)), 18);
        assert_eq!(grid.until(grid.time(17).plus_ns(-1_000_000)), Some(16));
        assert_eq!(grid.from(start.plus_ns(-1_000_000_000)), 0);
        assert_eq!(grid.until(start.plus_ns(-1_000_000_000)), None);
    }
}
