//! Where a library of ONNX Runtime may lie.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::NoRuntime;

/// Where systems and people put libraries.
const SYSTEM: [&str; 7] = [
    "/usr/local/lib",
    "/usr/local/lib64",
    "/usr/lib",
    "/usr/lib64",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/opt/homebrew/lib",
];
/// Where programs are put whole.
const WHOLE: [&str; 2] = ["/opt/onnxruntime/lib", "/usr/local/onnxruntime/lib"];

/// The libraries to try, best first: the configured one alone, else that of `ORT_DYLIB_PATH`, else those in the usual
/// places.
pub(super) fn candidates(configured: &Path) -> Result<Vec<PathBuf>, NoRuntime> {
    let named = match configured.as_os_str().is_empty() {
        false => Some(configured.to_owned()),
        true => env::var_os("ORT_DYLIB_PATH")
            .filter(|path| !path.is_empty())
            .map(PathBuf::from),
    };
    if let Some(named) = named {
        let found = if named.is_dir() {
            in_folder(&named)
        } else {
            Some(named.clone())
        };
        return match found.filter(|file| file.is_file()) {
            Some(file) => Ok(vec![file]),
            None => Err(NoRuntime::NotThere(named)),
        };
    }
    let found: Vec<PathBuf> = folders()
        .iter()
        .filter_map(|folder| in_folder(folder))
        .collect();
    if found.is_empty() {
        return Err(NoRuntime::NotFound {
            library: file_name(),
        });
    }
    Ok(found)
}

fn file_name() -> String {
    format!(
        "{}onnxruntime{}",
        env::consts::DLL_PREFIX,
        env::consts::DLL_SUFFIX
    )
}

/// The library in `folder`; with a version behind its name where the plain name is not there, the highest name.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    let plain = folder.join(file_name());
    if plain.is_file() {
        return Some(plain);
    }
    let start = format!("{}onnxruntime.", env::consts::DLL_PREFIX);
    let is_one = |path: &PathBuf| {
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        let library = name.contains(env::consts::DLL_SUFFIX);
        name.starts_with(&start) && library && path.is_file()
    };
    let files = fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|entry| entry.path());
    files.filter(is_one).max()
}

fn folders() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    if let Some(own) = env::current_exe().ok().as_deref().and_then(Path::parent) {
        folders.push(own.to_owned());
        folders.push(own.join("../lib"));
    }
    if let Some(paths) = env::var_os("LD_LIBRARY_PATH") {
        folders.extend(env::split_paths(&paths).filter(|path| path.is_absolute()));
    }
    for variable in ["VIRTUAL_ENV", "CONDA_PREFIX"] {
        if let Some(environment) = env::var_os(variable) {
            python(&PathBuf::from(environment).join("lib"), &mut folders);
        }
    }
    if let Some(home) = env::home_dir() {
        folders.push(home.join(".local/lib"));
        python(&home.join(".local/lib"), &mut folders);
    }
    folders.extend(WHOLE.into_iter().chain(SYSTEM).map(PathBuf::from));
    python(Path::new("/usr/local/lib"), &mut folders);
    python(Path::new("/usr/lib"), &mut folders);
    folders
}

/// The folders of the Python package `onnxruntime` below `lib`.
fn python(lib: &Path, folders: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(lib).into_iter().flatten().flatten();
    let is_python =
        |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with("python3");
    let mut pythons: Vec<PathBuf> = entries
        .filter(is_python)
        .map(|entry| entry.path())
        .collect();
    pythons.sort();
    for python in pythons.into_iter().rev() {
        for packages in ["site-packages", "dist-packages"] {
            folders.push(python.join(packages).join("onnxruntime/capi"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_named_folder_gives_its_library_and_the_highest_version_where_there_is_no_plain_name() {
        let folder = tempfile::tempdir().unwrap();
        let missing = candidates(folder.path()).unwrap_err();
        assert_eq!(missing, NoRuntime::NotThere(folder.path().to_owned()));
        let base = file_name();
        for version in ["1.20.0", "1.31.1"] {
            fs::write(folder.path().join(format!("{base}.{version}")), "").unwrap();
        }
        fs::write(folder.path().join("libonnxruntime_providers_shared.so"), "").unwrap();
        let found = candidates(folder.path()).unwrap();
        assert_eq!(found, [folder.path().join(format!("{base}.1.31.1"))]);
        fs::write(folder.path().join(&base), "").unwrap();
        assert_eq!(
            candidates(folder.path()).unwrap(),
            [folder.path().join(base)]
        );
    }
}
