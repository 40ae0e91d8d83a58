//! What the commands without a server share: a walk out of a take, and a simulated room as a stream of engine inputs.

mod simulated;
mod walk;

pub(crate) use simulated::SimulatedRoom;
pub(crate) use walk::{WalkTap, walk_of};

/// Civil time, RFC 3339, UTC, to the second.
pub(crate) fn now_rfc3339() -> String {
    let now = jiff::Timestamp::now().as_second();
    jiff::Timestamp::from_second(now).map_or_else(|_| String::new(), |time| time.to_string())
}
