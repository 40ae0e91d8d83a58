//! Points in time, in nanoseconds, typed by the clock that counts them.
//!
//! Agents stamp frames with a monotonic clock of their own ([`AgentTime`]); the server maps them to its
//! monotonic clock ([`Timestamp`]). The two never mix without a mapping.

use std::fmt;
use std::marker::PhantomData;

use serde::{Deserialize, Serialize};

/// A clock that times can be counted by.
pub trait Clock: Copy + fmt::Debug + Eq + Ord + Send + Sync + 'static {}

/// The clock of one agent (monotonic, epoch unknown).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SensorClock {}

/// The clock of the server (monotonic; the session notes what civil time it started at).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ServerClock {}

impl Clock for SensorClock {}
impl Clock for ServerClock {}

/// A point in time on clock `C`, nanoseconds since that clock's epoch.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(bound = "", transparent)]
pub struct Time<C: Clock> {
    ns: i64,
    #[serde(skip)]
    clock: PhantomData<C>,
}

/// When something happened, in the server's clock.
pub type Timestamp = Time<ServerClock>;

/// When something happened, in the clock of the agent that says so.
pub type AgentTime = Time<SensorClock>;

impl<C: Clock> Time<C> {
    /// The clock's epoch.
    pub const ZERO: Self = Self {
        ns: 0,
        clock: PhantomData,
    };

    /// The point `ns` nanoseconds after the clock's epoch.
    pub const fn from_ns(ns: i64) -> Self {
        Self {
            ns,
            clock: PhantomData,
        }
    }

    /// The point `seconds` after the clock's epoch, rounded to a nanosecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Self::from_ns((seconds * 1e9).round() as i64)
    }

    /// Nanoseconds since the clock's epoch.
    pub const fn ns(self) -> i64 {
        self.ns
    }

    /// Seconds since the clock's epoch.
    pub fn seconds(self) -> f64 {
        self.ns as f64 * 1e-9
    }

    /// How much later this is than `earlier`, nanoseconds; negative if it is earlier. Saturates.
    pub const fn since_ns(self, earlier: Self) -> i64 {
        self.ns.saturating_sub(earlier.ns)
    }

    /// How much later this is than `earlier`, seconds.
    pub fn since_seconds(self, earlier: Self) -> f64 {
        self.since_ns(earlier) as f64 * 1e-9
    }

    /// The point `ns` nanoseconds later (earlier if negative). Saturates.
    pub const fn plus_ns(self, ns: i64) -> Self {
        Self::from_ns(self.ns.saturating_add(ns))
    }
}

impl<C: Clock> fmt::Debug for Time<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.6}s", self.seconds())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_do_not_overflow() {
        let far = Timestamp::from_ns(i64::MAX);
        assert_eq!(far.since_ns(Timestamp::from_ns(i64::MIN)), i64::MAX);
        assert_eq!(far.plus_ns(1), far);
        assert_eq!(Timestamp::from_seconds(1.5).ns(), 1_500_000_000);
    }
}
