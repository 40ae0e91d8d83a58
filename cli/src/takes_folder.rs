//! The folder with takes, and a take in it by name or by file.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;

use posefuse_session::{DiskStorage, TakeError, TakeReader};

use crate::paths;

/// Where takes lie.
#[derive(Clone, Debug, Args)]
pub(crate) struct TakesFolder {
    /// The folder with takes [default: ~/.local/share/posefuse/takes]
    #[arg(
        long = "takes",
        global = true,
        value_name = "DIR",
        env = "POSEFUSE_TAKES"
    )]
    folder: Option<PathBuf>,
}

impl TakesFolder {
    /// The folder that was named, if one was.
    pub(crate) fn named(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// The folder that was named, or the usual one.
    pub(crate) fn path(&self) -> PathBuf {
        self.folder.clone().unwrap_or_else(paths::default_takes)
    }

    /// The folder, made if it is not there, to write takes to.
    pub(crate) fn storage(&self) -> anyhow::Result<DiskStorage> {
        Ok(DiskStorage::new(self.path())?)
    }

    /// Where a take lies: `take` is its file or its name in the folder.
    pub(crate) fn find(&self, take: &Path) -> anyhow::Result<Located> {
        let shown = take.display();
        let name = take
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        let name = name.strip_suffix(".mcap").unwrap_or(name).to_owned();
        if take.is_file() {
            let folder = take
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty());
            return Ok(Located {
                folder: folder.unwrap_or(Path::new(".")).to_owned(),
                name,
            });
        }
        if take.components().count() != 1 {
            bail!(
                "there is no file `{shown}`; give a take's name (`posefuse takes` lists them) or its .mcap file"
            );
        }
        let found = Located {
            folder: self.path(),
            name,
        };
        if !found.file().is_file() {
            let folder = paths::shown(&found.folder);
            bail!(
                "there is no take `{shown}` in {folder}; `posefuse takes` lists them, --takes DIR names another folder"
            );
        }
        Ok(found)
    }
}

/// A take that exists, by its folder and name.
#[derive(Clone, Debug)]
pub(crate) struct Located {
    pub(crate) folder: PathBuf,
    pub(crate) name: String,
}

impl Located {
    /// Its file.
    pub(crate) fn file(&self) -> PathBuf {
        self.folder.join(format!("{}.mcap", self.name))
    }

    /// Opens it for reading.
    pub(crate) fn open(&self) -> anyhow::Result<TakeReader> {
        let storage = DiskStorage::for_reading(&self.folder);
        TakeReader::open(&storage, &self.name).map_err(|error| match error {
            TakeError::Unfinished(_) => {
                anyhow!("{error}, or run `posefuse takes recover`")
            }
            error => error.into(),
        })
    }
}
