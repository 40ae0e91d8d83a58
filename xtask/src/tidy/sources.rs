//! What source files must not contain: impure calls in pure crates, overlong files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;

/// Crates in which time, randomness, files and sockets come from outside or not at all.
const PURE: [&str; 5] = [
    "skeleton",
    "calibration",
    "fusion",
    "sgfilter",
    "kinematics",
];

/// What may not stand in a pure crate, and why.
const IMPURE: [(&str, &str); 8] = [
    ("Instant::now", "time enters as data"),
    ("SystemTime", "time enters as data"),
    ("std::fs", "no files here"),
    ("std::net", "no sockets here"),
    ("std::thread", "no threads here"),
    ("HashMap", "iteration order is random; use BTreeMap or Vec"),
    ("HashSet", "iteration order is random; use BTreeSet or Vec"),
    ("std::env", "configuration enters as data"),
];

/// The server gets clock, files and randomness handed in, so that a simulated network can run it.
/// `server/src/parts.rs` holds the real ones.
const SERVER_IMPURE: [(&str, &str); 3] = [
    ("Instant::now", "use the clock of `Parts`"),
    ("SystemTime::now", "use the clock of `Parts`"),
    ("std::fs::", "use the storage of `Parts`"),
];

const LONGEST_FILE: usize = 500;

/// Every breach of the rules above.
pub(crate) fn check(root: &Path) -> Result<Vec<String>> {
    let mut findings = Vec::new();
    for file in rust_files(root)? {
        let text = fs::read_to_string(&file)?;
        let path = file.strip_prefix(root).unwrap_or(&file);
        let code = before_tests(&text);
        let top = path
            .iter()
            .next()
            .and_then(|part| part.to_str())
            .unwrap_or_default();
        if PURE.contains(&top) {
            findings.extend(forbidden(path, code, &IMPURE));
        }
        if top == "server" && !path.ends_with("parts.rs") {
            findings.extend(forbidden(path, code, &SERVER_IMPURE));
        }
        let lines = code.lines().count();
        if lines > LONGEST_FILE
            && !code
                .lines()
                .take(10)
                .any(|line| line.contains("Long because"))
        {
            findings.push(format!(
                "{}: {lines} lines; split it, or say `Long because ...` at its top",
                path.display()
            ));
        }
        if !text.starts_with("//!")
            && !text.starts_with("#![doc = include_str!")
            && path.components().any(|part| part.as_os_str() == "src")
        {
            findings.push(format!(
                "{}: its first line does not say what it is for (`//! ...`)",
                path.display()
            ));
        }
    }
    Ok(findings)
}

fn forbidden(path: &Path, code: &str, list: &[(&str, &str)]) -> Vec<String> {
    let mut findings = Vec::new();
    for (number, line) in code
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
    {
        for (word, why) in list.iter().filter(|(word, _)| line.contains(word)) {
            findings.push(format!(
                "{}:{}: `{word}`: {why}",
                path.display(),
                number + 1
            ));
        }
    }
    findings
}

/// The part of a file in front of its unit tests.
fn before_tests(text: &str) -> &str {
    let tests = text.find("#[cfg(test)]\nmod tests");
    tests.map_or(text, |start| &text[..start])
}

/// The non-test, non-generated Rust files of the crates.
fn rust_files(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(root)? {
        let source = entry?.path().join("src");
        if source.is_dir() {
            collect(&source, &mut files)?;
        }
    }
    files.sort();
    Ok(files)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        if path.is_dir() && name != "generated" && name != "tests" {
            collect(&path, files)?;
        } else if name.ends_with(".rs") && name != "tests.rs" {
            files.push(path);
        }
    }
    Ok(())
}
