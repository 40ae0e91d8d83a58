//! Which models there are: those in the program, and those in the user's folder.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use posefuse_fusion::{SimpleModel, nearest_name};
use serde::Deserialize;

use crate::{Config, Kind, ModelFile, Refused};

/// The models in the program: file name and contents, in order.
const SHIPPED: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/shipped.rs"));

/// Where it is said what `auto` means.
const DEFAULTS: &str = "default.toml";

/// Every model there is.
#[derive(Clone, Debug, Default)]
pub struct Library {
    folder: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Defaults {
    live: String,
    offline: String,
}

impl Library {
    /// The models in the program and those in the configured folder.
    pub fn new(config: &Config) -> Self {
        let folder = &config.folder;
        Self {
            folder: (!folder.as_os_str().is_empty()).then(|| folder.clone()),
        }
    }

    /// The models' names, in order.
    pub fn names(&self) -> Vec<String> {
        let is_manifest = |name: &String| name != "default";
        let shipped = SHIPPED.iter().map(|(file, _)| *file);
        let shipped = shipped.filter_map(|file| Some(file.strip_suffix(".toml")?.to_owned()));
        let names: BTreeSet<String> = shipped.chain(self.own()).filter(is_manifest).collect();
        names.into_iter().collect()
    }

    /// What `auto` means, if that is a model and not a simple method.
    pub fn default_model(&self, kind: Kind) -> Option<String> {
        let defaults: Defaults = toml::from_slice(part(DEFAULTS)?).ok()?;
        let name = match kind {
            Kind::Live => defaults.live,
            Kind::Offline => defaults.offline,
        };
        (!name.is_empty()).then_some(name)
    }

    /// Reads a model: by its name, one's own before one in the program, or by its manifest's path.
    ///
    /// # Errors
    /// There is none of this name, or what is wrong with its files.
    pub fn read(&self, name: &str) -> Result<ModelFile, Refused> {
        if is_path(name) {
            return ModelFile::read(Path::new(name));
        }
        if let Some(folder) = &self.folder {
            let path = folder.join(format!("{name}.toml"));
            if path.is_file() {
                return ModelFile::read(&path);
            }
        }
        match shipped(name) {
            Some(file) => file,
            None => Err(self.unknown(name)),
        }
    }

    /// Every model with what became of reading it, in the order of the names.
    pub fn all(&self) -> Vec<(String, Result<ModelFile, Refused>)> {
        let read = |name: String| {
            let file = self.read(&name);
            (name, file)
        };
        self.names().into_iter().map(read).collect()
    }

    fn unknown(&self, name: &str) -> Refused {
        let simple = SimpleModel::ALL
            .into_iter()
            .map(|model| model.label().to_owned());
        let known: Vec<String> = simple.chain(self.names()).collect();
        Refused::Unknown {
            name: name.to_owned(),
            nearest: nearest_name(name, known.iter().map(String::as_str)).map(str::to_owned),
            known,
        }
    }

    /// Names of manifests in the user's folder; none while it cannot be read.
    fn own(&self) -> Vec<String> {
        let Some(entries) = self
            .folder
            .as_ref()
            .and_then(|folder| fs::read_dir(folder).ok())
        else {
            return Vec::new();
        };
        let name = |entry: fs::DirEntry| {
            let name = entry.file_name();
            Some(name.to_str()?.strip_suffix(".toml")?.to_owned())
        };
        entries.flatten().filter_map(name).collect()
    }
}

/// Whether a model is named by the path of its manifest.
pub fn is_path(name: &str) -> bool {
    name.ends_with(".toml") || name.contains(['/', '\\'])
}

fn shipped(name: &str) -> Option<Result<ModelFile, Refused>> {
    if name == "default" {
        return None;
    }
    let manifest = format!("{name}.toml");
    let text = std::str::from_utf8(part(&manifest)?).ok()?;
    let place = format!("{manifest} (in the program)");
    let Some(onnx) = part(&format!("{name}.onnx")) else {
        return Some(Err(Refused::Unreadable {
            file: format!("{name}.onnx (in the program)"),
            problem: "it was not there when the program was built".to_owned(),
        }));
    };
    Some(ModelFile::from_parts(
        text,
        place,
        Cow::Borrowed(onnx),
        None,
    ))
}

fn part(name: &str) -> Option<&'static [u8]> {
    let (_, bytes) = SHIPPED.iter().find(|(file, _)| *file == name)?;
    Some(bytes)
}

/// Bytes of models in the program.
pub fn shipped_bytes() -> usize {
    SHIPPED.iter().map(|(_, bytes)| bytes.len()).sum()
}
