//! Names of takes. They become file names, so they hold nothing that could lead out of the folder.

use crate::{Result, TakeError};

/// The ending of a take's file.
pub(crate) const EXTENSION: &str = ".mcap";
/// The ending of a take that is being rewritten.
pub(crate) const REWRITTEN: &str = ".mcap.new";

const MAX_TAKE_NAME: usize = 100;
const MAX_FILE_NAME: usize = 128;

/// Checks that `name` may name a take: 1 to 100 of `a-z A-Z 0-9 . _ -`, not starting with `.`.
pub fn check_take_name(name: &str) -> Result<()> {
    if is_plain(name, MAX_TAKE_NAME) {
        Ok(())
    } else {
        Err(TakeError::Name(name.chars().take(120).collect()))
    }
}

/// Whether `name` may name a file of the take folder.
pub(crate) fn is_file_name(name: &str) -> bool {
    is_plain(name, MAX_FILE_NAME)
}

pub(crate) fn file_of(take: &str) -> Result<String> {
    check_take_name(take)?;
    Ok(format!("{take}{EXTENSION}"))
}

fn is_plain(name: &str, longest: usize) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    (1..=longest).contains(&name.len()) && name.chars().all(allowed) && !name.starts_with('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_could_lead_out_of_the_folder_are_refused() {
        for bad in [
            "", ".", "..", "../x", "a/b", "a\\b", "a b", "a\0", "ä", ".hidden",
        ] {
            assert!(check_take_name(bad).is_err(), "{bad:?} was taken");
        }
        assert!(check_take_name(&"x".repeat(101)).is_err());
        assert!(check_take_name("2026-03-01_walk.2").is_ok());
    }
}
