//! Who may know whom. Development dependencies are free: tests may know anybody.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

/// Each crate of ours and the crates of ours that it may depend on.
const MAY_KNOW: &[(&str, &[&str])] = &[
    ("skeleton", &[]),
    ("sgfilter", &[]),
    ("calibration", &["skeleton"]),
    ("planning", &["skeleton"]),
    ("simulator", &["skeleton"]),
    ("proto", &["skeleton"]),
    ("fusion", &["skeleton", "sgfilter"]),
    ("models", &["skeleton", "fusion"]),
    ("kinematics", &["skeleton"]),
    ("export", &["skeleton", "session", "kinematics"]),
    ("sinks", &["skeleton", "kinematics", "devices", "proto"]),
    ("bodytrack", &["skeleton", "models"]),
    ("devices", &["skeleton"]),
    ("openni-driver", &["skeleton", "simulator", "devices"]),
    (
        "evaluate",
        &["skeleton", "fusion", "simulator", "bodytrack", "kinematics"],
    ),
    ("session", &["skeleton", "fusion", "proto"]),
    (
        "agent",
        &[
            "skeleton",
            "proto",
            "simulator",
            "session",
            "bodytrack",
            "devices",
        ],
    ),
    (
        "server",
        &[
            "skeleton",
            "proto",
            "fusion",
            "models",
            "calibration",
            "planning",
            "session",
            "sinks",
        ],
    ),
    ("cli", ALL),
    ("tests", ALL),
    ("xtask", &[]),
];

/// Every library of ours.
const ALL: &[&str] = &[
    "skeleton",
    "sgfilter",
    "calibration",
    "planning",
    "fusion",
    "models",
    "bodytrack",
    "devices",
    "kinematics",
    "export",
    "sinks",
    "simulator",
    "evaluate",
    "session",
    "proto",
    "agent",
    "server",
];

/// Crates that stay pure, and the outside crates that they must not depend on.
const PURE: [&str; 5] = [
    "skeleton",
    "calibration",
    "fusion",
    "sgfilter",
    "kinematics",
];
const IMPURE: [&str; 10] = [
    "tokio",
    "tonic",
    "mcap",
    "ort",
    "rten",
    "axum",
    "hyper",
    "rand",
    "tracing-subscriber",
    "rustix",
];

/// Every breach of the rules above.
pub(crate) fn check(root: &Path) -> Result<Vec<String>> {
    let workspace = read(&root.join("Cargo.toml"))?;
    let members = workspace["workspace"]["members"]
        .as_array()
        .context("workspace members")?;
    let mut findings = Vec::new();
    for member in members.iter().filter_map(|member| member.as_str()) {
        let Some((_, may_know)) = MAY_KNOW.iter().find(|(name, _)| *name == member) else {
            findings.push(format!(
                "{member}: no rule says whom it may know; add it to xtask/src/tidy"
            ));
            continue;
        };
        let manifest = read(&root.join(member).join("Cargo.toml"))?;
        for dependency in dependencies(&manifest) {
            let ours = dependency.strip_prefix("posefuse-").unwrap_or(&dependency);
            let is_ours = MAY_KNOW.iter().any(|(name, _)| *name == ours);
            if is_ours && !may_know.contains(&ours) {
                findings.push(format!(
                    "{member}/Cargo.toml: {member} must not know {ours}"
                ));
            }
            if PURE.contains(&member) && IMPURE.contains(&dependency.as_str()) {
                findings.push(format!(
                    "{member}/Cargo.toml: {member} is pure and must not use {dependency}"
                ));
            }
        }
    }
    Ok(findings)
}

fn read(path: &Path) -> Result<toml::Table> {
    let text =
        fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    text.parse()
        .with_context(|| format!("{} is not TOML", path.display()))
}

fn dependencies(manifest: &toml::Table) -> Vec<String> {
    let sections = ["dependencies", "build-dependencies"];
    let tables = sections
        .iter()
        .filter_map(|section| manifest.get(*section)?.as_table());
    tables.flat_map(|table| table.keys().cloned()).collect()
}
