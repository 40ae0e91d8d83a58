//! What goes wrong with an Azure Kinect, and what to do about it.

use std::path::PathBuf;

use thiserror::Error;

/// How one gets the libraries, for messages.
pub const HOW_TO_INSTALL: &str = "install the Azure Kinect Sensor SDK (libk4a1.4) and Body Tracking SDK 1.1 (libk4abt1.1) \
    from packages.microsoft.com, for an Orbbec Femto Orbbec's K4A wrapper instead of the former; if they stand in folders \
    of their own, name those in K4A_LIBRARY_PATH and K4ABT_LIBRARY_PATH or with --library";

/// What goes wrong, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AzureError {
    /// A library is not there.
    #[error("{what} is not installed (looked for {}); {HOW_TO_INSTALL}", tried.join(", "))]
    Missing {
        /// Which SDK.
        what: &'static str,
        /// What was tried, each with why it did not do.
        tried: Vec<String>,
    },
    /// A library lacks a function.
    #[error("{} is not usable: it has no function {missing}; {HOW_TO_INSTALL}", library.display())]
    NotIt {
        /// The file, or the name that the system found it by.
        library: PathBuf,
        /// A function that is not there.
        missing: &'static str,
    },
    /// The device that was asked for is not there.
    #[error(
        "no Azure Kinect `{wanted}`; there are {present}; plug it into USB 3 with its own power supply"
    )]
    NoDevice {
        /// A number or a serial number.
        wanted: String,
        /// What there is.
        present: String,
    },
    /// A call failed.
    #[error("the Azure Kinect's library could not {doing}; {advice}")]
    Call {
        /// What was to be done.
        doing: &'static str,
        /// What to look after.
        advice: &'static str,
    },
}
