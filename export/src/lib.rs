//! Takes as files that other tools read: the people of a take, as places of joints or as a rig with rotations.
//!
//! [`export`] reads a take twice: once to learn who is in it from when to when (and, for rigs, how they are built), once
//! to write every file at the same time, frame by frame, at a constant rate. Inside, everything has the room's axes
//! (X forward, Y left, Z up) and metres; a writer converts at the edge, to the [`Space`] of its file.
//!
//! ```no_run
//! use std::path::Path;
//! use posefuse_export::{Options, Preset, export};
//! use posefuse_session::{DiskStorage, TakeReader};
//!
//! let take = TakeReader::open(&DiskStorage::for_reading("takes"), "walk")?;
//! let options = Options::of_preset(Preset::Blender);
//! let report = export(&take, &options, Path::new("out"), false, &mut |_| {})?;
//! println!("{}", report.files[0].path.display());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod body;
mod choice;
mod draft;
mod error;
mod euler;
mod format;
mod names;
mod options;
mod plan;
mod preset;
mod report;
mod resample;
mod run;
mod scan;
mod source;
mod space;
mod targets;
mod who;
mod write;

pub use error::{ExportError, Result};
pub use format::Format;
pub use names::Names;
pub use options::Options;
pub use plan::USUAL_RATES_HZ;
pub use posefuse_skeleton::Axes;
pub use preset::Preset;
pub use report::{FileReport, PersonReport, Report};
pub use run::{Phase, Progress, export};
pub use source::Source;
pub use space::{Space, Unit};
pub use who::Who;
