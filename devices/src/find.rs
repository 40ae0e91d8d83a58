//! Finds a C library: where somebody says it is, in the folders that variables name, then where the system looks.
#![allow(unsafe_code, reason = "loading a library runs its code")]

use std::path::{Path, PathBuf};

use libloading::Library;

/// A library that was loaded, never to be unloaded: these libraries start threads and keep them.
pub(crate) struct Found {
    pub(crate) library: &'static Library,
    /// The file, or the name that the system found it by.
    pub(crate) path: PathBuf,
}

/// Loads the first of `names` that can be loaded. `place` is the library or its folder, and then the only place; without
/// one the `variables` of the environment name folders, and then the system is asked. The error is what was tried, each
/// with why it did not do.
pub(crate) fn find(
    place: Option<&Path>,
    variables: &[&str],
    names: &[&str],
) -> Result<Found, Vec<String>> {
    let mut tried = Vec::new();
    for candidate in candidates(place, variables, names) {
        // SAFETY: these libraries do nothing but set up their own variables when they are loaded; that the file is the
        // one that is meant is what whoever named it, or installed it under this name, says.
        match unsafe { Library::new(&candidate) } {
            Ok(library) => {
                return Ok(Found {
                    library: Box::leak(Box::new(library)),
                    path: candidate,
                });
            }
            Err(why) => {
                let why =
                    std::error::Error::source(&why).map_or(why.to_string(), |why| why.to_string());
                tried.push(match candidate.exists() {
                    true => format!("{}: {why}", candidate.display()),
                    false => candidate.display().to_string(),
                });
            }
        }
    }
    Err(tried)
}

fn candidates(place: Option<&Path>, variables: &[&str], names: &[&str]) -> Vec<PathBuf> {
    let within = |folder: &Path| {
        names
            .iter()
            .map(|name| folder.join(name))
            .collect::<Vec<_>>()
    };
    match place {
        Some(place) if place.is_dir() => within(place),
        Some(place) => vec![place.to_owned()],
        None => {
            let folders = variables.iter().filter_map(std::env::var_os);
            let named = folders.flat_map(|folder| within(Path::new(&folder)));
            named.chain(names.iter().map(PathBuf::from)).collect()
        }
    }
}

/// Declares the functions of a C interface, and how they are found in a library that was loaded.
macro_rules! functions {
    ($header:literal; $($field:ident = $symbol:literal: ($($arg:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions that this crate uses.
        pub(crate) struct Api {
            $(pub(crate) $field: unsafe extern "C" fn($($arg),*) $(-> $result)?,)*
        }

        impl Api {
            #[doc = concat!("Finds every function of ", $header, ", or says which is missing.")]
            pub(crate) fn of(library: &'static libloading::Library) -> Result<Self, &'static str> {
                // SAFETY: each type is the one that the header gives the function of this name, and the pointers do
                // not outlive the library, which is never unloaded.
                unsafe {
                    Ok(Self { $($field: *library.get($symbol).map_err(|_| $symbol)?,)* })
                }
            }
        }
    };
}
pub(crate) use functions;
