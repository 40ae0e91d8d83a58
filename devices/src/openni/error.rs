//! What goes wrong with OpenNI2, and what to do about it.

use std::path::PathBuf;

use thiserror::Error;

use super::c::{
    OniStatus, STATUS_BAD_PARAMETER, STATUS_ERROR, STATUS_NO_DEVICE, STATUS_NOT_IMPLEMENTED,
    STATUS_NOT_SUPPORTED, STATUS_OUT_OF_FLOW, STATUS_TIME_OUT,
};
use super::mode::Mode;

/// How one gets OpenNI2, for messages.
pub const HOW_TO_INSTALL: &str = "install OpenNI2: on Debian and Ubuntu `apt install libopenni2-0`; elsewhere the \
    sensor maker's OpenNI2 package (Orbbec) or the one of structure.io/openni. If it stands in a folder of its own, \
    name that in OPENNI2_REDIST";

/// What went wrong.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OpenNiError {
    /// There is no library.
    #[error("OpenNI2 is not installed (looked for {}); {HOW_TO_INSTALL}", tried.join(", "))]
    Missing {
        /// What was tried, in this order, each with why it did not do.
        tried: Vec<String>,
    },
    /// It is there, and is not OpenNI2 2.2 or one like it.
    #[error("{} is not a usable OpenNI2: it has no function {missing}; {HOW_TO_INSTALL}", library.display())]
    NotOpenNi {
        /// The file, or the name that the system found it by.
        library: PathBuf,
        /// A function that is not there.
        missing: &'static str,
    },
    /// A call failed.
    #[error("OpenNI2 could not {doing}: {}", reason(*status, text))]
    Call {
        /// What was to be done.
        doing: String,
        /// An `ONI_STATUS_...`.
        status: OniStatus,
        /// OpenNI2's own words, often none.
        text: String,
    },
    /// The device that was asked for is not there.
    #[error("no device `{wanted}`; OpenNI2 sees {}", seen(present))]
    NoDevice {
        /// A URI or a serial number; "any" for the first one.
        wanted: String,
        /// The URIs of those that are there.
        present: Vec<String>,
    },
    /// It gives no depth.
    #[error("the device {uri} gives no depth in millimetres")]
    NoDepth {
        /// Which device.
        uri: String,
    },
    /// It has no such mode.
    #[error(
        "the device {uri} has no depth mode {wanted}; it has {}",
        list(offered)
    )]
    NoMode {
        /// Which device.
        uri: String,
        /// What was asked for.
        wanted: String,
        /// What there is.
        offered: Vec<Mode>,
    },
    /// A text with a zero in it cannot be given to C.
    #[error("`{0}` has a zero byte in it")]
    ZeroByte(String),
}

impl OpenNiError {
    /// Whether the device has gone away, or never was there.
    pub fn no_device(&self) -> bool {
        match self {
            Self::NoDevice { .. } => true,
            Self::Call { status, .. } => *status == STATUS_NO_DEVICE,
            _ => false,
        }
    }
}

fn reason(status: OniStatus, text: &str) -> String {
    let status = match status {
        STATUS_ERROR => "it failed".to_owned(),
        STATUS_NOT_IMPLEMENTED => "the driver does not have that".to_owned(),
        STATUS_NOT_SUPPORTED => "the device does not have that".to_owned(),
        STATUS_BAD_PARAMETER => "a value is not allowed".to_owned(),
        STATUS_OUT_OF_FLOW => "not now".to_owned(),
        STATUS_NO_DEVICE => "the device is not there".to_owned(),
        STATUS_TIME_OUT => "it took too long".to_owned(),
        other => format!("status {other}"),
    };
    match text.trim() {
        "" => status,
        text => format!("{status} ({})", text.replace('\n', "; ")),
    }
}

fn seen(present: &[String]) -> String {
    match present {
        [] => "no device".to_owned(),
        present => present.join(", "),
    }
}

fn list(modes: &[Mode]) -> String {
    let modes: Vec<String> = modes.iter().map(Mode::to_string).collect();
    modes.join(", ")
}
