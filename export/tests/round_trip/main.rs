//! Two simulated people go into a take and out of it as files; what readers find in the files is what was in the take.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod files;
mod joints;
mod rigs;
mod sensors;
mod take;
