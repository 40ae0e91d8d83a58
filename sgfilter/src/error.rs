//! What can be wrong with a filter's settings or with a sample offered to it.

use crate::spec::{MAX_WINDOW, MIN_WINDOW};

/// Why settings or a sample were refused. Whoever refuses leaves its state as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The window length is outside `MIN_WINDOW..=MAX_WINDOW`.
    #[error("window of {window} samples; expected {MIN_WINDOW} to {MAX_WINDOW}")]
    Window {
        /// Window length asked for, in samples.
        window: usize,
    },
    /// The polynomial order is not below the window length.
    #[error(
        "polynomial order {order} needs a window of at least {} samples, found {window}; \
         lower the order or lengthen the window",
        order.saturating_add(1)
    )]
    Order {
        /// Polynomial order asked for.
        order: usize,
        /// Window length, in samples.
        window: usize,
    },
    /// The look-ahead does not fit into the window.
    #[error("look-ahead of {look_ahead} samples; expected at most {} in a window of {window}", window - 1)]
    LookAhead {
        /// Look-ahead asked for, in samples.
        look_ahead: usize,
        /// Window length, in samples.
        window: usize,
    },
    /// The derivative of a polynomial above its order is zero everywhere, so nobody wants it.
    #[error(
        "derivative {derivative} of a polynomial of order {order} is always zero; raise the order"
    )]
    Derivative {
        /// Derivative asked for.
        derivative: usize,
        /// Polynomial order.
        order: usize,
    },
    /// The place to evaluate lies outside the window.
    #[error("position {position}; expected 0 to {} in a window of {window}", window - 1)]
    Position {
        /// Position asked for, in samples after the oldest one.
        position: f64,
        /// Window length, in samples.
        window: usize,
    },
    /// The sample spacing is not a positive number, or so extreme that the weights overflow.
    #[error(
        "sample spacing {delta}; expected a positive number whose power of the derivative is finite"
    )]
    Delta {
        /// Spacing given.
        delta: f64,
    },
    /// The longest bridged gap is not positive.
    #[error("longest gap of {max_gap_ns} ns; expected more than 0")]
    MaxGap {
        /// Gap asked for, in nanoseconds.
        max_gap_ns: i64,
    },
    /// The tolerance for regular timestamps is not a fraction of the spacing.
    #[error(
        "tolerance {tolerance} for regular timestamps; expected 0 to 0.5 of the sample spacing"
    )]
    Tolerance {
        /// Tolerance asked for, as a fraction of the spacing.
        tolerance: f64,
    },
    /// A whole signal is shorter than the window.
    #[error(
        "signal of {samples} samples is shorter than the window of {window}; shorten the window"
    )]
    TooShort {
        /// Length of the signal.
        samples: usize,
        /// Window length, in samples.
        window: usize,
    },
    /// A value is NaN or infinite.
    #[error(
        "component {component} of the sample at {at} is {value}; expected a finite number; leave the sample out"
    )]
    NotFinite {
        /// Time of the sample in nanoseconds, or its index in a whole signal.
        at: i64,
        /// Which component of the value.
        component: usize,
        /// The offending value.
        value: f64,
    },
    /// A timestamp is not later than the newest one taken.
    #[error(
        "sample at {t_ns} ns is not after the newest one at {newest_ns} ns; \
         leave it out, or restart the stream if its clock was set back"
    )]
    NotAfter {
        /// Time of the refused sample, in nanoseconds.
        t_ns: i64,
        /// Time of the newest sample taken, in nanoseconds.
        newest_ns: i64,
    },
    /// A stored state contradicts itself.
    #[error("stored filter state is not one a stream can be in: {reason}; start a new stream")]
    State {
        /// What contradicts.
        reason: &'static str,
    },
}
