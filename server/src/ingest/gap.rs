//! How an agent's frames follow each other by their numbers.

/// Frames that may be missing at once: a year at 30 Hz. A number further away is none.
const MAX_GAP: u64 = 1_000_000_000;
/// The highest number an agent may begin with.
const MAX_FIRST: u64 = i64::MAX as u64;

/// How a frame's number follows the last one.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Gap {
    /// So many frames are missing between them.
    Frames(u64),
    /// It was here already.
    Duplicate,
    /// Out of reach.
    TooWide,
}

pub(super) fn gap(last: Option<u64>, sequence: u64) -> Gap {
    match last {
        // An agent that began near the end of the numbers could not count on.
        None if sequence > MAX_FIRST => Gap::TooWide,
        None => Gap::Frames(0),
        Some(last) => match sequence.checked_sub(last) {
            None | Some(0) => Gap::Duplicate,
            Some(step) if step - 1 > MAX_GAP => Gap::TooWide,
            Some(step) => Gap::Frames(step - 1),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_out_of_reach_is_none() {
        assert_eq!(gap(None, 17), Gap::Frames(0));
        assert_eq!(gap(Some(17), 18), Gap::Frames(0));
        assert_eq!(gap(Some(17), 20), Gap::Frames(2));
        assert_eq!(gap(Some(17), 17), Gap::Duplicate);
        assert_eq!(gap(Some(17), 3), Gap::Duplicate);
        assert_eq!(gap(Some(0), MAX_GAP + 1), Gap::Frames(MAX_GAP));
        assert_eq!(gap(Some(0), MAX_GAP + 2), Gap::TooWide);
        assert_eq!(gap(Some(17), u64::MAX), Gap::TooWide);
        assert_eq!(gap(None, u64::MAX), Gap::TooWide);
    }
}
