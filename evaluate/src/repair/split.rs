//! Which recordings teach models, which test them on people they know, and which on people they do not.

use posefuse_fusion::{ConfigError, parse_toml};
use serde::{Deserialize, Serialize};

/// The split that the project's own models were trained by.
const SHIPPED: &str = include_str!("../../../models/training/split.toml");

/// What recordings that did not teach are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tests {
    /// The same people and actions as in training, other recordings.
    HeldOut,
    /// Other people, doing other things.
    Unseen,
}

impl Tests {
    /// Both.
    pub const ALL: [Self; 2] = [Self::HeldOut, Self::Unseen];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeldOut => "held-out clips",
            Self::Unseen => "unseen subjects",
        }
    }
}

/// Patterns as in a shell (`*`, `?`, `[3-9]`), against a file's path below the folder of recordings. What matches none
/// trains.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Split {
    held_out: Vec<String>,
    unseen: Vec<String>,
}

impl Split {
    /// From TOML.
    ///
    /// # Errors
    /// Which line is wrong, and why.
    pub fn parse(text: &str) -> Result<Self, ConfigError> {
        parse_toml(text)
    }

    /// The one that the project's own models were trained by.
    ///
    /// # Errors
    /// Never, unless the program was built from a broken one.
    pub fn shipped() -> Result<Self, ConfigError> {
        Self::parse(SHIPPED)
    }

    /// What the recording at `place` (with `/` between folders) tests; `None` where it trains.
    pub fn tests(&self, place: &str) -> Option<Tests> {
        let any = |patterns: &[String]| patterns.iter().any(|pattern| matches(pattern, place));
        match (any(&self.unseen), any(&self.held_out)) {
            (true, _) => Some(Tests::Unseen),
            (_, true) => Some(Tests::HeldOut),
            _ => None,
        }
    }
}

/// Whether `text` is what the shell pattern says; `*` and `?` match `/`, too.
fn matches(pattern: &str, text: &str) -> bool {
    let (pattern, text): (Vec<char>, Vec<char>) =
        (pattern.chars().collect(), text.chars().collect());
    let (mut p, mut t) = (0, 0);
    // Where the last `*` stands, and how far the text was when it last took one character more.
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        if pattern.get(p) == Some(&'*') {
            star = Some((p, t));
            p += 1;
        } else if let Some(next) = matches_one(&pattern, p, text[t]) {
            p = next;
            t += 1;
        } else if let Some((at, taken)) = star {
            star = Some((at, taken + 1));
            p = at + 1;
            t = taken + 1;
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// Where the pattern goes on if its element at `p` is `c`.
fn matches_one(pattern: &[char], p: usize, c: char) -> Option<usize> {
    let close = || pattern[p + 1..].iter().position(|c| *c == ']');
    match pattern.get(p)? {
        '?' => Some(p + 1),
        '[' if close().is_some() => {
            let end = p + 1 + close()?;
            let set = &pattern[p + 1..end];
            let (set, inverted) = match set.first() {
                Some('!') => (&set[1..], true),
                _ => (set, false),
            };
            (is_in(set, c) != inverted).then_some(end + 1)
        }
        own => (*own == c).then_some(p + 1),
    }
}

fn is_in(set: &[char], c: char) -> bool {
    let mut rest = set;
    while let Some(first) = rest.first() {
        if let [from, '-', to, ..] = rest {
            if (*from..=*to).contains(&c) {
                return true;
            }
            rest = &rest[3..];
        } else {
            if *first == c {
                return true;
            }
            rest = &rest[1..];
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_those_of_a_shell() {
        for (pattern, text, expected) in [
            ("*/salsa/03.*", "cmu_bvh/salsa/03.bvh", true),
            ("*/salsa/03.*", "cmu_bvh/salsa/030.bvh", false),
            ("*/walking_1[3-9].*", "a/b/walking_14.txt", true),
            ("*/walking_1[3-9].*", "a/b/walking_12.txt", false),
            ("*/35/*", "asf/35/35_01.amc", true),
            ("[!a]?c*", "bbc", true),
            ("[!a]?c*", "abc", false),
            ("*", "", true),
        ] {
            assert_eq!(matches(pattern, text), expected, "{pattern} {text}");
        }
    }

    #[test]
    fn the_shipped_split_tells_teachers_from_tests() {
        let split = Split::shipped().unwrap();
        assert_eq!(split.tests("x/salsa/03.bvh"), Some(Tests::HeldOut));
        assert_eq!(split.tests("x/indian/01.bvh"), Some(Tests::Unseen));
        assert_eq!(split.tests("x/salsa/01.bvh"), None);
        assert!(Split::parse("held_out = []\nunsen = []").is_err());
    }
}
