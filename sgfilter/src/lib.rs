#![doc = include_str!("../README.md")]
//!
//! # Layout
//! [`Spec`] says what to compute, [`Stream`] computes it sample by sample, [`smooth`] over a whole
//! regular signal, and [`coefficients`] gives the bare convolution weights. All of it is a pure
//! function of its input: no clock, no I/O, no randomness.

mod coefficients;
mod error;
mod fit;
#[cfg(feature = "serde")]
mod snapshot;
mod spec;
mod stream;

pub use coefficients::{coefficients, smooth};
pub use error::Error;
pub use spec::{MAX_WINDOW, MIN_WINDOW, Spec};
pub use stream::{DEFAULT_REGULAR_TOLERANCE, Sample, Stream};
