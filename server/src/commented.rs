//! The configuration as TOML with a comment above each key. The comments live in one file, which is the default
//! configuration.

use std::collections::HashMap;

/// The default configuration, with comments.
const COMMENTED_DEFAULTS: &str = include_str!("../default.toml");

/// Puts the default file's comment above each section and key of `plain`, a configuration as serde writes it.
pub(crate) fn commented(plain: &str) -> String {
    let mut comments = comments();
    let mut place = Place::default();
    let mut text = String::new();
    for line in plain.lines() {
        let comment = place.of(line).and_then(|name| comments.remove(&name));
        text.push_str(&comment.unwrap_or_default());
        text.push_str(line);
        text.push('\n');
    }
    text
}

/// Each section's and key's comment, by name.
fn comments() -> HashMap<String, String> {
    let mut comments = HashMap::new();
    let mut comment = String::new();
    let mut place = Place::default();
    for line in COMMENTED_DEFAULTS.lines() {
        if line.starts_with('#') {
            comment.push_str(line);
            comment.push('\n');
        } else if let Some(name) = place.of(line) {
            comments.entry(name).or_insert(std::mem::take(&mut comment));
        }
    }
    comments
}

/// The section that lines belong to.
#[derive(Default)]
struct Place(String);

impl Place {
    /// The name of what the line sets or begins, unique in the file; `None`: nothing.
    fn of(&mut self, line: &str) -> Option<String> {
        let (key, _) = line.split_once(" = ").unwrap_or((line, ""));
        if line.starts_with('[') {
            self.0 = line.to_owned();
        } else if key == "kind" {
            // The members of a list differ by their first key.
            self.0 += line;
        } else {
            return (!key.is_empty()).then(|| format!("{} {key}", self.0));
        }
        Some(self.0.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn the_file_is_the_default_configuration_with_every_key_and_a_comment_for_each() {
        assert_eq!(
            Config::from_toml(COMMENTED_DEFAULTS).unwrap(),
            Config::default()
        );
        assert_eq!(Config::default().to_toml(), COMMENTED_DEFAULTS);
        let comments = comments();
        let mut place = Place::default();
        for line in COMMENTED_DEFAULTS
            .lines()
            .filter(|line| !line.starts_with('#'))
        {
            let Some(name) = place.of(line) else { continue };
            assert!(!comments[&name].is_empty(), "`{name}` has no comment");
        }
    }

    #[test]
    fn another_configuration_keeps_the_comments() {
        let mut config = Config::default();
        config.listen.set_port(7500);
        config.fusion.stages.remove(0);
        let text = config.to_toml();
        assert!(text.starts_with("# Address and port"), "{text}");
        assert!(text.contains("\n# What is done with frames") && !text.contains("min_range_m"));
        assert_eq!(Config::from_toml(&text).unwrap(), config);
    }
}
