//! Faults of processes, disks and clients against the real `posefuse` program.
//!
//! Times here are real ones on machines that also do other things: bounds are looser than what is promised where the
//! clock is tight; `simulated_network` holds the exact ones.

mod clients;
mod disk;
mod input;
mod killed;
