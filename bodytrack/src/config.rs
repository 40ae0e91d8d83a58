//! The tracker's settings, and why it cannot work.

use std::path::PathBuf;

use posefuse_models::{Config as ModelsConfig, Refused, RunError};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How depth images are tracked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// The manifest of a network to use instead of the one in the program; empty: that one.
    pub network: PathBuf,
    /// What runs the network.
    pub models: ModelsConfig,
    /// Images are thinned to about so many pixels in a row before anything else.
    pub width: u32,
    /// Most people who are followed.
    pub people: usize,
    /// What is nearer or further is not looked at, metres.
    pub range_m: [f64; 2],
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            network: PathBuf::new(),
            models: ModelsConfig::default(),
            width: 320,
            people: 6,
            range_m: [0.5, 6.0],
        }
    }
}

/// Why an image is not tracked.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TrackerError {
    /// A setting cannot be.
    #[error("bodytrack: expected `{field}` {expected}, found {found}")]
    Config {
        /// Which.
        field: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// A camera that can take no picture.
    #[error(
        "the sensor's camera has {width} x {height} pixels and focal lengths {fx} and {fy}: expected 32 to 4096 pixels to a \
         side and focal lengths above 0; its driver gives no intrinsics, or wrong ones"
    )]
    #[allow(missing_docs)]
    Camera {
        width: u32,
        height: u32,
        fx: f64,
        fy: f64,
    },
    /// An image that is not the camera's.
    #[error(
        "expected a depth image of {expected:?} pixels, found {found:?} with {values} distances: the sensor has changed its mode"
    )]
    Size {
        /// Width and height of the camera.
        expected: [u32; 2],
        /// Width and height that the image states.
        found: [u32; 2],
        /// How many distances it holds.
        values: usize,
    },
    /// The network cannot be used.
    #[error("the body tracker's network: {0}")]
    Refused(#[from] Refused),
    /// The network failed on an image.
    #[error("the body tracker's network: {0}")]
    Run(#[from] RunError),
}
