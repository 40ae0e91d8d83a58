//! What the commands without a server share: a walk out of a take, and one in a simulated room.

mod simulated_walk;
mod walk;

pub(crate) use simulated_walk::from_simulated_walk;
pub(crate) use walk::{WalkTap, walk_of};

/// Civil time, RFC 3339, UTC, to the second.
pub(crate) fn now_rfc3339() -> String {
    let now = jiff::Timestamp::now().as_second();
    jiff::Timestamp::from_second(now).map_or_else(|_| String::new(), |time| time.to_string())
}
