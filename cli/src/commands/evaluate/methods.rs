//! Which ways of fusing are compared: presets by name, and the user's own configurations.

use std::path::{Path, PathBuf};

use clap::Args;
use posefuse_evaluate::{Method, PRESETS, preset};
use posefuse_fusion::nearest_name;

use crate::commands::server::read_config;
use crate::failure::usage;

/// What is compared.
#[derive(Debug, Args)]
pub(super) struct MethodArgs {
    /// The methods to compare, by name; `posefuse evaluate methods` lists them
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    methods: Vec<String>,
    /// Compare this configuration, too: a server's, whose `[fusion]` part is used. May be given several times
    #[arg(long, value_name = "FILE")]
    config: Vec<PathBuf>,
}

impl MethodArgs {
    /// The methods that were asked for, or `usual`; then the configurations.
    pub(super) fn methods(&self, usual: &[&str]) -> anyhow::Result<Vec<Method>> {
        let named = self.methods.iter().map(String::as_str);
        let names: Vec<&str> = match (self.methods.is_empty(), self.config.is_empty()) {
            (false, _) => named.collect(),
            (true, _) => usual.to_vec(),
        };
        let mut methods: Vec<Method> = Vec::new();
        for name in names {
            let method = preset(name).ok_or_else(|| unknown(name))?;
            if !methods.iter().any(|known| known.name == method.name) {
                methods.push(method);
            }
        }
        for file in &self.config {
            let method = configured(file, &methods)?;
            methods.push(method);
        }
        Ok(methods)
    }
}

fn unknown(name: &str) -> anyhow::Error {
    let known = PRESETS.map(|(name, _)| name);
    let meant = nearest_name(name, known);
    let meant = meant.map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
    usage(format!(
        "there is no method `{name}`; {meant}known: {}; or give a file: --config FILE",
        known.join(", ")
    ))
}

fn configured(file: &Path, others: &[Method]) -> anyhow::Result<Method> {
    let stem = file.file_stem().map(|stem| stem.to_string_lossy());
    let stem = stem.unwrap_or_default().into_owned();
    let taken = |name: &str| others.iter().any(|other| other.name == name);
    let name = match taken(&stem) {
        false => stem,
        true => file.display().to_string(),
    };
    let config = read_config(file)?.fusion;
    let checked = config.validate();
    checked.map_err(|error| usage(format!("the configuration `{}`: {error}", file.display())))?;
    Ok(Method {
        name,
        about: format!("the settings in {}", file.display()),
        config,
        poses_only: false,
        smooth: false,
        repairs: None,
        model: None,
    })
}
