//! The room stage `smooth`: one filter per person and joint.
//!
//! A filter starts afresh after a gap, and a joint that goes missing gives out what it held back. With a look-ahead
//! whole frames are held back until their last joint is ready.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint, Position, RoomFrame, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

use super::JointFilter;
use super::holt::Holt;
use super::one_euro::OneEuro;
use super::savitzky_golay::SavitzkyGolay;
use crate::config::ms_to_ns;
use crate::config_check::Checker;

/// Which filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SmoothFilter {
    /// A polynomial through a window of samples.
    SavitzkyGolay,
    /// Low-pass with a cut-off that rises with speed (Casiez, Roussel and Vogel 2012).
    OneEuro,
    /// Double exponential smoothing of place and trend.
    Holt,
}

/// `kind = "smooth"`: smooths each joint over time. Only the settings of the chosen filter matter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SmoothConfig {
    /// Whether it runs.
    pub enabled: bool,
    /// `savitzky-golay`, `one-euro` or `holt`.
    pub filter: SmoothFilter,
    /// Savitzky-Golay: samples per fit.
    pub window: usize,
    /// Savitzky-Golay: degree of the polynomial.
    pub order: usize,
    /// Savitzky-Golay: newer frames waited for.
    pub look_ahead: usize,
    /// One-Euro: cut-off at rest.
    pub min_cutoff_hz: f64,
    /// One-Euro: how fast the cut-off rises, Hz per m/s.
    pub beta: f64,
    /// Holt: weight of a new place, 0 to 1.
    pub alpha: f64,
    /// Holt: weight of a new trend, 0 to 1.
    pub gamma: f64,
    /// After a gap this long a filter starts afresh.
    pub max_gap_ms: f64,
}

impl Default for SmoothConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            filter: SmoothFilter::SavitzkyGolay,
            window: 7,
            order: 2,
            look_ahead: 1,
            min_cutoff_hz: 2.5,
            beta: 4.0,
            alpha: 0.5,
            gamma: 0.25,
            max_gap_ms: 150.0,
        }
    }
}

impl SmoothConfig {
    pub(super) fn look_ahead_frames(&self) -> usize {
        match self.filter {
            SmoothFilter::SavitzkyGolay => self.look_ahead,
            SmoothFilter::OneEuro | SmoothFilter::Holt => 0,
        }
    }

    pub(super) fn check(&self, at: &str, check: &mut Checker) {
        if self.filter == SmoothFilter::SavitzkyGolay {
            let spec = sgfilter::Spec::new(self.window, self.order, self.look_ahead, 0);
            let reason = spec.err().map(|error| error.to_string());
            check.that(at, reason.is_none(), || {
                format!(
                    "a Savitzky-Golay filter that can be: {}",
                    reason.unwrap_or_default()
                )
            });
        }
        check.within(
            &format!("{at}.min_cutoff_hz"),
            self.min_cutoff_hz,
            0.01,
            1000.0,
        );
        check.within(&format!("{at}.beta"), self.beta, 0.0, 1000.0);
        check.within(&format!("{at}.alpha"), self.alpha, 0.01, 1.0);
        check.within(&format!("{at}.gamma"), self.gamma, 0.0, 1.0);
        check.within(&format!("{at}.max_gap_ms"), self.max_gap_ms, 1.0, 10_000.0);
    }

    /// A fresh filter; `None` where the settings allow none.
    fn filter(&self) -> Option<Filter> {
        Some(match self.filter {
            SmoothFilter::SavitzkyGolay => Filter::SavitzkyGolay(SavitzkyGolay::new(
                self.window,
                self.order,
                self.look_ahead,
            )?),
            SmoothFilter::OneEuro => Filter::OneEuro(OneEuro::new(self.min_cutoff_hz, self.beta)),
            SmoothFilter::Holt => Filter::Holt(Holt::new(self.alpha, self.gamma)),
        })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Filter {
    SavitzkyGolay(SavitzkyGolay),
    OneEuro(OneEuro),
    Holt(Holt),
}

impl Filter {
    fn push(
        &mut self,
        time: Timestamp,
        position: Vector3<f64>,
    ) -> Option<(Timestamp, Vector3<f64>)> {
        match self {
            Self::SavitzkyGolay(filter) => filter.push(time, position),
            Self::OneEuro(filter) => filter.push(time, position),
            Self::Holt(filter) => filter.push(time, position),
        }
    }

    /// Starts afresh; what was held back goes to `give`.
    fn restart(&mut self, give: &mut dyn FnMut(Timestamp, Vector3<f64>)) {
        match self {
            Self::SavitzkyGolay(filter) => filter.flush(give),
            Self::OneEuro(filter) => filter.restart(),
            Self::Holt(filter) => filter.restart(),
        }
    }
}

/// The stage with its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Smooth {
    config: SmoothConfig,
    /// Held back, oldest first.
    pending: VecDeque<RoomFrame>,
    newest: Option<Timestamp>,
    /// One filter per joint, made when the joint is first seen.
    people: BTreeMap<TrackId, Vec<Option<Filter>>>,
}

impl Smooth {
    pub(super) fn new(config: SmoothConfig) -> Self {
        Self {
            config,
            pending: VecDeque::new(),
            newest: None,
            people: BTreeMap::new(),
        }
    }

    pub(super) fn push(&mut self, frame: RoomFrame, give: &mut dyn FnMut(RoomFrame)) {
        let time = frame.time;
        let max_gap_ns = ms_to_ns(self.config.max_gap_ms);
        if self
            .newest
            .is_some_and(|newest| time.since_ns(newest) > max_gap_ns)
        {
            self.flush(give);
        }
        self.newest = Some(time);
        let gone = |id: &&TrackId| frame.tracks.iter().all(|track| track.id != **id);
        while let Some(id) = self.people.keys().find(gone).copied() {
            self.restart(id);
            self.people.remove(&id);
        }
        let people = frame.tracks.len();
        self.pending.push_back(frame);
        for index in 0..people {
            // Read first: a filter may write to this very frame.
            let raw = self.pending.back().map(|frame| {
                let track = &frame.tracks[index];
                let position = |joint| track.skeleton.position(joint).map(Position::vector);
                (track.id, Joint::ALL.map(position))
            });
            if let Some((id, joints)) = raw {
                self.filter_person(id, time, &joints);
            }
        }
        while self.pending.len() > self.config.look_ahead_frames() {
            match self.pending.pop_front() {
                Some(ready) => give(ready),
                None => break,
            }
        }
    }

    /// Gives every frame held back and starts everything afresh.
    pub(super) fn flush(&mut self, give: &mut dyn FnMut(RoomFrame)) {
        self.restart_all();
        self.pending.drain(..).for_each(give);
    }

    pub(super) fn restart_all(&mut self) {
        let everybody: Vec<TrackId> = self.people.keys().copied().collect();
        everybody.into_iter().for_each(|id| self.restart(id));
    }

    /// Starts this person's filters afresh.
    pub(super) fn restart(&mut self, id: TrackId) {
        let Self {
            people, pending, ..
        } = self;
        for (joint, filter) in Joint::ALL
            .into_iter()
            .zip(people.get_mut(&id).into_iter().flatten())
        {
            if let Some(filter) = filter {
                filter.restart(&mut |time, position| write(pending, time, id, joint, position));
            }
        }
    }

    #[cfg(test)]
    pub(super) fn people(&self) -> usize {
        self.people.len()
    }

    fn filter_person(
        &mut self,
        id: TrackId,
        time: Timestamp,
        joints: &[Option<Vector3<f64>>; JOINT_COUNT],
    ) {
        let Self {
            people,
            pending,
            config,
            ..
        } = self;
        let filters = people.entry(id).or_insert_with(|| vec![None; JOINT_COUNT]);
        for ((joint, filter), position) in Joint::ALL.into_iter().zip(filters).zip(joints) {
            match position {
                Some(position) => {
                    if filter.is_none() {
                        *filter = config.filter();
                    }
                    let due = filter
                        .as_mut()
                        .and_then(|filter| filter.push(time, *position));
                    if let Some((time, position)) = due {
                        write(pending, time, id, joint, position);
                    }
                }
                None => {
                    if let Some(filter) = filter {
                        filter.restart(&mut |time, position| {
                            write(pending, time, id, joint, position)
                        });
                    }
                }
            }
        }
    }
}

/// Puts a filtered place into the frame it belongs to.
fn write(
    pending: &mut VecDeque<RoomFrame>,
    time: Timestamp,
    id: TrackId,
    joint: Joint,
    position: Vector3<f64>,
) {
    let frame = pending.iter_mut().find(|frame| frame.time == time);
    let track = frame.and_then(|frame| frame.tracks.iter_mut().find(|track| track.id == id));
    if let Some(state) = track.and_then(|track| track.skeleton[joint].as_mut())
        && position.iter().all(|c| c.is_finite())
    {
        state.position = Position::from_vector(position);
    }
}
