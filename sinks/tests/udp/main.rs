//! What arrives by UDP of a room whose sinks are on.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod osc;
mod room;
mod vmc;
