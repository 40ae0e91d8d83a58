//! Where things lie unless told otherwise, after the XDG base directory specification.

use std::path::{Path, PathBuf};

/// The folder for takes: `$XDG_DATA_HOME/posefuse/takes`, usually `~/.local/share/posefuse/takes`.
pub(crate) fn default_takes() -> PathBuf {
    data_home().join("takes")
}

/// The configuration file that is read when none is named, if it exists: `~/.config/posefuse/server.toml`.
pub(crate) fn default_config() -> PathBuf {
    base("XDG_CONFIG_HOME", ".config").join("server.toml")
}

/// The calibration file of this machine's room: `~/.local/share/posefuse/calibration.toml`.
pub(crate) fn default_calibration() -> PathBuf {
    data_home().join("calibration.toml")
}

/// `path` as a person would type it: with `~` for the home folder.
pub(crate) fn shown(path: &Path) -> String {
    let home = std::env::var_os("HOME")
        .map(PathBuf::from)
        .filter(|h| h.is_absolute());
    match home.and_then(|home| Some(path.strip_prefix(home).ok()?.to_owned())) {
        Some(rest) => format!("~/{}", rest.display()),
        None => path.display().to_string(),
    }
}

fn data_home() -> PathBuf {
    base("XDG_DATA_HOME", ".local/share")
}

/// `$variable/posefuse`, or below the home folder; the specification has relative values ignored.
fn base(variable: &str, below_home: &str) -> PathBuf {
    let absolute = |name: &str| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let base = absolute(variable)
        .or_else(|| Some(absolute("HOME")?.join(below_home)))
        .unwrap_or_else(|| PathBuf::from("."));
    base.join("posefuse")
}
