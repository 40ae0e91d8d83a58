//! The filter over a stream of timestamped samples.
//!
//! Time is i64 nanoseconds; values carry `D` components in any one unit; a derivative comes out
//! per second to its power. What is given for a sample depends only on the samples in its window,
//! never on how a regular stretch began, so equal windows always give equal bits.

use std::collections::VecDeque;

use crate::coefficients::unit_weights;
use crate::fit::{Fit, power};
use crate::{Error, Spec};

/// Default of [`Stream::with_regular_tolerance`], as a fraction of the sample spacing.
pub const DEFAULT_REGULAR_TOLERANCE: f64 = 1e-4;

const SECONDS_PER_NANOSECOND: f64 = 1e-9;

/// One filtered sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sample<const D: usize> {
    /// Capture time of the sample this is the filtered value of, exactly as it was pushed.
    pub t_ns: i64,
    /// Filtered value, or its derivative per second to the derivative's power.
    #[cfg_attr(feature = "serde", serde(with = "crate::snapshot::array"))]
    pub value: [f64; D],
    /// Samples in the fit: the window, or fewer during warm-up.
    pub samples: usize,
    /// Degree of the fitted polynomial: the order, or lower during warm-up.
    pub order: usize,
}

/// A sample as it was pushed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Taken<const D: usize> {
    pub(crate) t_ns: i64,
    #[cfg_attr(feature = "serde", serde(with = "crate::snapshot::array"))]
    pub(crate) value: [f64; D],
}

/// What a stream must remember; everything else in it follows from this.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct State<const D: usize> {
    pub(crate) spec: Spec,
    pub(crate) max_gap_ns: Option<i64>,
    pub(crate) regular_tolerance: f64,
    /// The newest samples, oldest first. Those newer than the look-ahead allows are not yet given.
    pub(crate) window: VecDeque<Taken<D>>,
    /// Filtered samples from before a gap, due at the next pushes.
    pub(crate) due: VecDeque<Sample<D>>,
}

/// A Savitzky-Golay filter over a stream of samples with `D` components.
///
/// Every sample that is pushed comes out once, in order, [`look_ahead`](Self::look_ahead) pushes
/// later (sooner if a gap follows soon after the start), with its own capture time. The first ones are fitted with as many samples as there are,
/// and with a lower polynomial order where these are too few; [`Sample::samples`] and
/// [`Sample::order`] say so. Only a derivative that is above that order has no value, and such a
/// sample is not given.
///
/// Where a window's timestamps are regular (see
/// [`with_regular_tolerance`](Self::with_regular_tolerance)), coefficients computed once are used;
/// otherwise each window gets its own least-squares fit. A push allocates nothing.
///
/// A result too large for an `f64` (values near its limits, or high derivatives of samples
/// nanoseconds apart) comes out infinite or NaN.
#[derive(Debug, Clone)]
pub struct Stream<const D: usize> {
    state: State<D>,
    /// Coefficients of a full window for a spacing of 1.
    unit: Vec<f64>,
    fit: Fit,
}

impl<const D: usize> PartialEq for Stream<D> {
    fn eq(&self, other: &Self) -> bool {
        self.state == other.state
    }
}

impl<const D: usize> Stream<D> {
    /// An empty stream that bridges gaps of any length.
    pub fn new(spec: Spec) -> Self {
        Self::from_state(State {
            spec,
            max_gap_ns: None,
            regular_tolerance: DEFAULT_REGULAR_TOLERANCE,
            window: VecDeque::new(),
            due: VecDeque::new(),
        })
    }

    /// Restarts the filter before a sample that comes more than `max_gap_ns` after the newest one.
    /// Samples waiting for their look-ahead are then filtered with what came before the gap, and
    /// come out at the next pushes.
    ///
    /// # Errors
    /// [`Error::MaxGap`] unless it is positive.
    pub fn with_max_gap_ns(mut self, max_gap_ns: i64) -> Result<Self, Error> {
        self.state.max_gap_ns = Some(max_gap_ns);
        check_settings(&self.state)?;
        Ok(self)
    }

    /// How far, as a fraction of the mean spacing, a timestamp may lie from the regular grid
    /// through the window's first and last one for the window still to count as regular; 0 to 0.5.
    ///
    /// The price is treating a value as taken at its grid time: an error per sample of at most
    /// `tolerance * spacing * rate of change`. The default of 1e-4 is 3.3 us at 30 Hz, 7 um for
    /// something that moves at 2 m/s: it accepts timestamps rounded to microseconds, and sends
    /// those rounded to milliseconds to the fit. 0 accepts only exact grids.
    ///
    /// # Errors
    /// [`Error::Tolerance`] if it is not 0 to 0.5.
    pub fn with_regular_tolerance(mut self, tolerance: f64) -> Result<Self, Error> {
        self.state.regular_tolerance = tolerance;
        check_settings(&self.state)?;
        Ok(self)
    }

    /// What this stream computes.
    pub fn spec(&self) -> &Spec {
        &self.state.spec
    }

    /// How many pushes later a sample comes out, in samples.
    pub fn look_ahead(&self) -> usize {
        self.state.spec.look_ahead()
    }

    /// Capture time of the newest sample taken since the last restart.
    pub fn newest_ns(&self) -> Option<i64> {
        self.state.window.back().map(|taken| taken.t_ns)
    }

    /// Takes the sample captured at `t_ns` and gives the filtered one that became due by it.
    ///
    /// # Errors
    /// [`Error::NotAfter`] for a timestamp that is not after the newest one, [`Error::NotFinite`]
    /// for a NaN or infinite component. The sample is not taken and the stream is as before.
    pub fn push(&mut self, t_ns: i64, value: [f64; D]) -> Result<Option<Sample<D>>, Error> {
        check_finite(t_ns, &value)?;
        if let Some(newest_ns) = self.newest_ns() {
            if t_ns <= newest_ns {
                return Err(Error::NotAfter { t_ns, newest_ns });
            }
            let gap_ns = t_ns.abs_diff(newest_ns);
            if self
                .state
                .max_gap_ns
                .is_some_and(|max| gap_ns > max.unsigned_abs())
            {
                self.finish_waiting();
            }
        }
        if self.state.window.len() == self.state.spec.window() {
            self.state.window.pop_front();
        }
        self.state.window.push_back(Taken { t_ns, value });

        if let Some(due) = self.state.due.pop_front() {
            return Ok(Some(due));
        }
        let newest = self.state.window.len() - 1;
        Ok(newest
            .checked_sub(self.look_ahead())
            .and_then(|index| self.evaluate(index)))
    }

    /// Ends the stream: gives every sample not yet given, the waiting ones filtered with the
    /// look-ahead there is, and leaves the stream as after [`restart`](Self::restart).
    pub fn flush(&mut self) -> impl Iterator<Item = Sample<D>> + '_ {
        self.finish_waiting();
        self.state.due.drain(..)
    }

    /// Forgets all samples, also those not yet given; call [`flush`](Self::flush) to have them.
    pub fn restart(&mut self) {
        self.state.window.clear();
        self.state.due.clear();
    }

    /// Filters the samples that wait for their look-ahead and empties the window.
    fn finish_waiting(&mut self) {
        let len = self.state.window.len();
        for index in len.saturating_sub(self.look_ahead())..len {
            if let Some(sample) = self.evaluate(index) {
                self.state.due.push_back(sample);
            }
        }
        self.state.window.clear();
    }

    /// The fit through the present window at its sample `index`.
    fn evaluate(&mut self, index: usize) -> Option<Sample<D>> {
        let State { spec, window, .. } = &self.state;
        let full = window.len() == spec.window();
        if full
            && index == spec.position()
            && let Some(spacing_ns) = self.regular_spacing_ns()
        {
            let scale = power(spacing_ns * SECONDS_PER_NANOSECOND, spec.derivative());
            return Some(Sample {
                t_ns: window[index].t_ns,
                value: weigh(&self.unit, window).map(|v| v / scale),
                samples: window.len(),
                order: spec.order(),
            });
        }
        self.evaluate_by_fit(index)
    }

    /// As [`evaluate`](Self::evaluate), for any timestamps and any number of samples.
    fn evaluate_by_fit(&mut self, index: usize) -> Option<Sample<D>> {
        let State { spec, window, .. } = &self.state;
        let (first_ns, t_ns) = (window.front()?.t_ns, window.get(index)?.t_ns);
        let seconds = |t_ns: i64| t_ns.abs_diff(first_ns) as f64 * SECONDS_PER_NANOSECOND;
        let places = window.iter().map(|taken| seconds(taken.t_ns));
        let (weights, order) =
            self.fit
                .solve(places, seconds(t_ns), spec.order(), spec.derivative())?;
        Some(Sample {
            t_ns,
            value: weigh(weights, window),
            samples: window.len(),
            order,
        })
    }

    /// The window's mean spacing, if all its timestamps lie on that grid within the tolerance.
    fn regular_spacing_ns(&self) -> Option<f64> {
        let window = &self.state.window;
        let first_ns = window.front()?.t_ns;
        let since_first = |taken: &Taken<D>| taken.t_ns.abs_diff(first_ns) as f64;
        let spacing = since_first(window.back()?) / (window.len() - 1) as f64;
        let limit = self.state.regular_tolerance * spacing;
        window
            .iter()
            .enumerate()
            .all(|(i, taken)| (since_first(taken) - i as f64 * spacing).abs() <= limit)
            .then_some(spacing)
    }

    /// The stored state.
    #[cfg(feature = "serde")]
    pub(crate) fn state(&self) -> &State<D> {
        &self.state
    }

    /// Adds what follows from the state, and room for all it can grow to.
    fn from_state(mut state: State<D>) -> Self {
        let spec = state.spec;
        let (window, order, derivative) = (spec.window(), spec.order(), spec.derivative());
        state.window.reserve_exact(window - state.window.len());
        state.due.reserve_exact(spec.look_ahead() - state.due.len());
        Self {
            state,
            unit: unit_weights(window, order, derivative, spec.position() as f64),
            fit: Fit::new(window, order, derivative),
        }
    }
}

impl<const D: usize> TryFrom<State<D>> for Stream<D> {
    type Error = Error;

    fn try_from(state: State<D>) -> Result<Self, Error> {
        check_settings(&state)?;
        check_samples(&state)?;
        Ok(Self::from_state(state))
    }
}

fn check_settings<const D: usize>(state: &State<D>) -> Result<(), Error> {
    if let Some(max_gap_ns) = state.max_gap_ns.filter(|gap| *gap <= 0) {
        return Err(Error::MaxGap { max_gap_ns });
    }
    let tolerance = state.regular_tolerance;
    if !(0.0..=0.5).contains(&tolerance) {
        return Err(Error::Tolerance { tolerance });
    }
    Ok(())
}

fn check_samples<const D: usize>(state: &State<D>) -> Result<(), Error> {
    let State {
        spec, window, due, ..
    } = state;
    let wrong = |reason| Err(Error::State { reason });
    if window.len() > spec.window() {
        return wrong("more samples than the window holds");
    }
    if due.len() + window.len().min(spec.look_ahead()) > spec.look_ahead() {
        return wrong("more samples due than the look-ahead holds back");
    }
    let times = || {
        let due = due.iter().map(|sample| sample.t_ns);
        due.chain(window.iter().map(|taken| taken.t_ns))
    };
    if times().zip(times().skip(1)).any(|(a, b)| a >= b) {
        return wrong("timestamps that do not increase");
    }
    window
        .iter()
        .try_for_each(|taken| check_finite(taken.t_ns, &taken.value))
}

fn check_finite(t_ns: i64, value: &[f64]) -> Result<(), Error> {
    match value.iter().enumerate().find(|(_, v)| !v.is_finite()) {
        None => Ok(()),
        Some((component, &value)) => Err(Error::NotFinite {
            at: t_ns,
            component,
            value,
        }),
    }
}

/// The weighted sum of the window's values, component by component.
fn weigh<const D: usize>(weights: &[f64], window: &VecDeque<Taken<D>>) -> [f64; D] {
    let (older, newer) = window.as_slices();
    let (older_weights, newer_weights) = weights.split_at(older.len());
    let mut sum = [0.0; D];
    for (weights, part) in [(older_weights, older), (newer_weights, newer)] {
        for (weight, taken) in weights.iter().zip(part) {
            for (sum, value) in sum.iter_mut().zip(&taken.value) {
                *sum += weight * value;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests;
