//! End-to-end, network, golden and third-party-reader tests. Here is what they share.
//!
//! - [`simulated`]: the real server and real agents in a simulated network and simulated time, from a seed.
//! - [`process`]: the real `posefuse` program as processes that can be killed, stopped and started again.
//! - [`account`]: what sensors captured against what a take holds.

// Support of tests: what cannot happen here fails the test that made it happen.
#![allow(clippy::unwrap_used)]

pub mod account;
pub mod process;
pub mod simulated;
