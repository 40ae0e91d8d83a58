//! What arrives by UDP of a room whose sinks are on.

mod osc;
mod room;
mod vmc;
