//! What lies on this machine: configuration, calibration, takes and the space for them.

use std::io::Write;
use std::path::{Path, PathBuf};

use posefuse_server::Config;

use super::Finding;
use crate::failure::in_words;
use crate::output::bytes;
use crate::paths::{self, shown};
use crate::takes_folder::TakesFolder;

/// Free space below which recording is about to stop, and below which it soon will.
const FREE_BAD: u64 = 500_000_000;
const FREE_DOUBTFUL: u64 = 5_000_000_000;

/// With the configuration that would be used. `in_force` is what a running server says of its calibration; without one, the file that it would read counts.
pub(super) fn examine(
    config: Option<&Path>,
    takes: &TakesFolder,
    in_force: Option<Finding>,
) -> (Vec<Finding>, Config) {
    let config_file = config.map_or_else(paths::default_config, Path::to_owned);
    let (config_finding, config) = configuration(&config_file, config.is_some());
    let configured = |pick: fn(Config) -> PathBuf| config.clone().map(pick);
    let folder = takes
        .named()
        .map(Path::to_owned)
        .or_else(|| configured(|c| c.takes.folder));
    let folder = folder.unwrap_or_else(paths::default_takes);
    let calibration = configured(|c| c.calibration.file).unwrap_or_else(paths::default_calibration);
    let findings = vec![
        config_finding,
        takes_folder(&folder),
        free_space(&folder),
        in_force.unwrap_or_else(|| calibration_file(&calibration)),
    ];
    (findings, config.unwrap_or_default())
}

fn configuration(file: &Path, named: bool) -> (Finding, Option<Config>) {
    let what = "configuration";
    if !file.exists() && !named {
        let found = format!(
            "no file, so the defaults hold ({} would be read)",
            shown(file)
        );
        return (Finding::good(what, found), None);
    }
    match crate::commands::server::read_config(file) {
        Ok(config) => (Finding::good(what, shown(file)), Some(config)),
        Err(error) => {
            let remedy = format!(
                "mend {}; `posefuse server --print-config` shows every key",
                shown(file)
            );
            (Finding::bad(what, in_words(&error), remedy), None)
        }
    }
}

fn takes_folder(folder: &Path) -> Finding {
    let what = "takes folder";
    let not_there = !folder.exists();
    // What is not there is made by the server, so it is its nearest parent that must be writable.
    let Some(place) = folder.ancestors().find(|path| path.exists()) else {
        return Finding::bad(
            what,
            format!("{} cannot be made", shown(folder)),
            "name another with --takes DIR",
        );
    };
    let probe = tempfile::Builder::new()
        .prefix(".posefuse-doctor-")
        .tempfile_in(place);
    let written = probe.and_then(|mut file| file.write_all(b"probe"));
    let made = if not_there { " (made when needed)" } else { "" };
    match written {
        Ok(()) => Finding::good(what, format!("{}{made}", shown(folder))),
        Err(error) => Finding::bad(
            what,
            format!("{} is not writable: {error}", shown(place)),
            format!(
                "sudo chown -R $USER {}, or name another with --takes DIR",
                place.display()
            ),
        ),
    }
}

fn free_space(folder: &Path) -> Finding {
    let what = "free space";
    let place = folder
        .ancestors()
        .find(|path| path.exists())
        .map_or_else(|| PathBuf::from("/"), Path::to_owned);
    let Ok(stat) = rustix::fs::statvfs(&place) else {
        return Finding::unknown(what, "not told on this file system");
    };
    let free = stat.f_bavail.saturating_mul(stat.f_frsize);
    let found = format!("{} where takes go", bytes(free));
    let remedy = "delete takes (`posefuse takes` lists them with their sizes), or name another disk with --takes DIR";
    match free {
        0..FREE_BAD => Finding::bad(what, found, remedy),
        FREE_BAD..FREE_DOUBTFUL => Finding::doubtful(what, found, remedy),
        _ => Finding::good(what, found),
    }
}

fn calibration_file(file: &Path) -> Finding {
    let what = "calibration";
    let text = match std::fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Finding::unknown(what, "none yet: `posefuse calibrate` makes one");
        }
        Err(error) => {
            let remedy = format!("make {} readable for this user", shown(file));
            return Finding::bad(what, format!("{}: {error}", shown(file)), remedy);
        }
    };
    match posefuse_calibration::from_toml(&text) {
        Ok(calibration) => {
            let names: Vec<&str> = calibration.sensors.keys().map(String::as_str).collect();
            let made = if calibration.created.is_empty() {
                "at an unknown time"
            } else {
                &calibration.created
            };
            Finding::good(
                what,
                format!("{} of {made}, for {}", shown(file), names.join(", ")),
            )
        }
        Err(error) => {
            let remedy = format!("mend or delete {}, then `posefuse calibrate`", shown(file));
            Finding::bad(what, error.to_string().replace('\n', "; "), remedy)
        }
    }
}
