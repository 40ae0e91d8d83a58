//! TOML with refusals a person can act on: an unknown key is answered with the nearest known one.
//!
//! Meant for every crate's part of the configuration; the type only needs `deny_unknown_fields`.

use serde::de::DeserializeOwned;
use thiserror::Error;

/// Why a configuration was refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A key nobody knows.
    #[error("line {line}: unknown {what} `{found}`{}; known here: {}", suggestion(.nearest), .known.join(", "))]
    Unknown {
        /// 1-based line.
        line: usize,
        /// `key` or `value`.
        what: &'static str,
        /// What stands there.
        found: String,
        /// The known one that looks most like it.
        nearest: Option<String>,
        /// All that could stand there.
        known: Vec<String>,
    },
    /// Not TOML, or a value of the wrong type.
    #[error("line {line}: {message}")]
    Syntax {
        /// 1-based line.
        line: usize,
        /// What the parser says.
        message: String,
    },
    /// A value that cannot work.
    #[error("`{key}`: expected {expected}")]
    Value {
        /// Where it stands, e.g. `intake.rate_hz`.
        key: String,
        /// What was expected and what was found.
        expected: String,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map(|name| format!("; did you mean `{name}`?"))
        .unwrap_or_default()
}

/// Reads `T` from TOML.
///
/// ```
/// let error = posefuse_fusion::parse_toml::<posefuse_fusion::Config>("[intake]\nrate_hx = 30").unwrap_err();
/// assert!(error.to_string().contains("did you mean `rate_hz`?"));
/// ```
///
/// # Errors
/// [`ConfigError::Unknown`] with a suggestion for an unknown key or choice, else [`ConfigError::Syntax`].
pub fn parse_toml<T: DeserializeOwned>(text: &str) -> Result<T, ConfigError> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = 1 + text.as_bytes()[..start]
            .iter()
            .filter(|b| **b == b'\n')
            .count();
        explain(error.message(), line)
    })
}

/// Turns serde's wording into one with a suggestion.
fn explain(message: &str, line: usize) -> ConfigError {
    for (prefix, what) in [("unknown field `", "key"), ("unknown variant `", "value")] {
        let Some((found, rest)) = message.strip_prefix(prefix).and_then(|m| m.split_once('`'))
        else {
            continue;
        };
        // What follows is "expected one of `a`, `b`" or "expected `a`": every second piece is a name.
        let known: Vec<String> = rest
            .split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect();
        return ConfigError::Unknown {
            line,
            what,
            found: found.to_owned(),
            nearest: nearest_name(found, known.iter().map(String::as_str)).map(str::to_owned),
            known,
        };
    }
    ConfigError::Syntax {
        line,
        message: message.trim_end().to_owned(),
    }
}

/// The name of `known` that looks most like `found`, if one is near enough to be meant.
///
/// Also for subcommands, joint names and the like.
pub fn nearest_name<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (found.chars().count() / 2).clamp(1, 4);
    known
        .into_iter()
        .map(|name| (edit_distance(found, name), name))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// Insertions, deletions, replacements and exchanges of neighbours that lead from `a` to `b`.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (
        a.to_lowercase().chars().collect(),
        b.to_lowercase().chars().collect(),
    );
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in rows.iter_mut().enumerate() {
        row[0] = i;
    }
    rows[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn an_unknown_key_is_refused_with_the_nearest_one_and_its_line() {
        let error = parse_toml::<Config>("[fuse]\n\nmethud = \"average\"\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 3: unknown key `methud`; did you mean `method`?; known here: method, look_ahead, min_confidence, swaps"
        );
        let error =
            parse_toml::<Config>("[[stages]]\nkind = \"smooth\"\nfiltr = \"holt\"\n").unwrap_err();
        assert!(
            error.to_string().contains("did you mean `filter`?"),
            "{error}"
        );
        let error = parse_toml::<Config>("[fuse]\nmethod = \"wieghted\"\n").unwrap_err();
        assert!(
            error.to_string().contains("did you mean `weighted`?"),
            "{error}"
        );
    }

    #[test]
    fn what_looks_like_nothing_gets_no_suggestion() {
        assert_eq!(nearest_name("zzzzzz", ["rate_hz", "mode"]), None);
        assert_eq!(
            nearest_name("raet_hz", ["rate_hz", "mode"]),
            Some("rate_hz")
        );
    }

    #[test]
    fn broken_toml_names_its_line() {
        let error = parse_toml::<Config>("[intake]\nrate_hz = \"fast\"\n").unwrap_err();
        assert!(
            matches!(error, ConfigError::Syntax { line: 2, .. }),
            "{error:?}"
        );
    }

    #[test]
    fn the_shipped_configuration_survives_toml() {
        let config = Config::default();
        config.validate().unwrap();
        let text = toml::to_string(&config).unwrap();
        assert_eq!(parse_toml::<Config>(&text).unwrap(), config);
        assert_eq!(parse_toml::<Config>("").unwrap(), config);
    }
}
