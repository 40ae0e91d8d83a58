//! Why a model is not used, in words that say what to do.

use std::path::PathBuf;

/// A model was refused. Nothing of it is used; the simple models go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// No model has this name.
    #[error("there is no model `{name}`{}; there are: {}. Or give a manifest's path: path/to/NAME.toml", meant(.nearest), listed(.known))]
    Unknown {
        /// What was asked for.
        name: String,
        /// The one that looks most like it.
        nearest: Option<String>,
        /// Those that are there.
        known: Vec<String>,
    },
    /// A file is missing or cannot be read.
    #[error("{file} cannot be read ({problem}): a model is NAME.toml and NAME.onnx in one folder")]
    Unreadable {
        /// Which file.
        file: String,
        /// What the system says.
        problem: String,
    },
    /// The manifest is of a newer format.
    #[error(
        "{place} is a manifest of version {found}, this program knows {known}: use a newer posefuse, or the model's older release"
    )]
    Newer {
        /// Which manifest.
        place: String,
        /// Its version.
        found: i64,
        /// What this program knows.
        known: i64,
    },
    /// The manifest says something that cannot be.
    #[error("{place}: {problem}; models/data/README.md says what a manifest holds")]
    Manifest {
        /// Which manifest.
        place: String,
        /// What was expected and what was found.
        problem: String,
    },
    /// A file is not the one that the manifest describes.
    #[error(
        "{file} is not the file that {place} describes ({bytes} bytes, sha256 {found}, expected {expected}): it is damaged, cut off or of another release; fetch both again"
    )]
    Damaged {
        /// Which file.
        file: String,
        /// Which manifest.
        place: String,
        /// How long the file is.
        bytes: usize,
        /// The hash of what is there.
        found: String,
        /// The hash in the manifest.
        expected: String,
    },
    /// A runtime cannot read or run the network.
    #[error(
        "{place}: {runtime} cannot use the network: {problem}; export it anew as models/data/README.md says, or try the other runtime (models.backend)"
    )]
    Network {
        /// Which model.
        place: String,
        /// Which runtime.
        runtime: String,
        /// What it says.
        problem: String,
    },
    /// The network's inputs or outputs are not those of the manifest.
    #[error("{place}: {problem}: manifest and network do not belong together; export both anew")]
    Ports {
        /// Which model.
        place: String,
        /// What was expected and what was found.
        problem: String,
    },
    /// The network gave nonsense on something known.
    #[error(
        "{place}: tried on {tried_on}, {problem}: the network is broken or was exported wrongly"
    )]
    Nonsense {
        /// Which model.
        place: String,
        /// What it was given.
        tried_on: &'static str,
        /// What it gave.
        problem: String,
    },
    /// ONNX Runtime was asked for and is not to be had.
    #[error("ONNX Runtime cannot be used: {0}")]
    NoRuntime(#[from] NoRuntime),
}

/// Why ONNX Runtime is not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoRuntime {
    /// This build cannot load it.
    #[error("this program was built without the feature `ort`")]
    NotBuilt,
    /// No library was found.
    #[error(
        "no {library} was found; install it (`pip install onnxruntime`), and name it if it is in no usual place (ORT_DYLIB_PATH or models.onnxruntime)"
    )]
    NotFound {
        /// The library's usual name.
        library: String,
    },
    /// The configured path is not a library.
    #[error("`{}` is no ONNX Runtime library and no folder with one in it; correct models.onnxruntime or ORT_DYLIB_PATH", .0.display())]
    NotThere(PathBuf),
    /// The library was found but does not work.
    #[error("`{}` does not load: {problem}", .path.display())]
    NotLoaded {
        /// Which library.
        path: PathBuf,
        /// What went wrong.
        problem: String,
    },
}

fn meant(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map(|name| format!("; did you mean `{name}`?"))
        .unwrap_or_default()
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "none yet".to_owned(),
        names => names.join(", "),
    }
}
