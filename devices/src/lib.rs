//! C libraries of depth sensors, of the body trackers that come with them, and of the Lab Streaming Layer, loaded when the
//! program runs.
//!
//! Nothing is linked: the program starts without any of them and says how to install what is missing. Each library has
//! one module, which alone talks to it; what leaves this crate is safe and in the words of [`posefuse_skeleton`].

pub mod azure;
mod find;
pub mod lsl;
pub mod nite;
pub mod openni;
