//! The Lab Streaming Layer: streams of samples that recorders of laboratories find by themselves and put on one clock.
//!
//! Outlets only. liblsl listens on every interface of the machine, on ports from 16572 on: who is in the network can read.
#![allow(unsafe_code, reason = "calls liblsl's C functions")]

mod c;
mod error;

use std::ffi::CString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use self::c::{Api, FLOAT32, OutletHandle, Xml};
use crate::find;

pub use error::{HOW_TO_INSTALL, LslError};

/// Names of the library.
#[cfg(target_os = "windows")]
const NAMES: [&str; 3] = ["lsl.dll", "liblsl.dll", "liblsl64.dll"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 2] = ["liblsl.dylib", "lsl"];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const NAMES: [&str; 3] = ["liblsl.so", "liblsl.so.2", "liblsl64.so"];

/// The variable that names the library file for Python's `pylsl`.
const FILE: &str = "PYLSL_LIB";
/// What a stream without a fixed rate keeps for a reader that is late, hundreds of samples.
const BUFFERED: i32 = 18;

/// What a stream says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// Its name, by which people find it.
    pub name: String,
    /// What kind of data it is, e.g. `MoCap`.
    pub content: String,
    /// By which readers take it up again after it was gone: the same for the same source, and no one else's.
    pub source_id: String,
    /// How many values a sample has.
    pub channels: usize,
    /// Further description.
    pub description: Vec<Node>,
}

/// A piece of a stream's description: XML.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// `<name>text</name>`.
    Text(&'static str, String),
    /// `<name>...</name>`.
    Group(&'static str, Vec<Node>),
}

/// liblsl, loaded.
pub struct Lsl {
    api: Api,
    path: PathBuf,
}

impl fmt::Debug for Lsl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Lsl").field("path", &self.path).finish()
    }
}

impl Lsl {
    /// Loads it: `place` is the library or its folder; without one PYLSL_LIB is, then the system is asked.
    ///
    /// # Errors
    /// [`LslError::Missing`], [`LslError::NotLsl`].
    pub fn load(place: Option<&Path>) -> Result<Arc<Self>, LslError> {
        let named = std::env::var_os(FILE).map(PathBuf::from);
        let place = place.or(named.as_deref());
        let found = find::find(place, &[], &NAMES).map_err(|tried| LslError::Missing { tried })?;
        let api = Api::of(found.library).map_err(|missing| LslError::NotLsl {
            library: found.path.clone(),
            missing,
        })?;
        Ok(Arc::new(Self {
            api,
            path: found.path,
        }))
    }

    /// Its version, e.g. `1.16`.
    pub fn version(&self) -> String {
        // SAFETY: a plain call.
        let version = unsafe { (self.api.version)() };
        format!("{}.{:02}", version / 100, version % 100)
    }

    /// The clock that samples are stamped by: seconds, from some beginning.
    pub fn clock_s(&self) -> f64 {
        // SAFETY: a plain call.
        unsafe { (self.api.clock)() }
    }

    /// Opens a stream of 32 bit floats that come at no fixed rate.
    ///
    /// # Errors
    /// [`LslError::Text`], [`LslError::Call`].
    pub fn outlet(self: &Arc<Self>, stream: &Stream) -> Result<Outlet, LslError> {
        let [name, content, source] =
            [&stream.name, &stream.content, &stream.source_id].map(|text| c_text(text));
        let (name, content, source) = (name?, content?, source?);
        let channels = i32::try_from(stream.channels).map_err(|_| LslError::Call {
            doing: "make a stream of so many channels",
        })?;
        // SAFETY: the texts outlive the call, which copies them. 0 is "no fixed rate".
        let info = unsafe {
            (self.api.create_info)(
                name.as_ptr(),
                content.as_ptr(),
                channels,
                0.0,
                FLOAT32,
                source.as_ptr(),
            )
        };
        if info.is_null() {
            return Err(LslError::Call {
                doing: "describe a stream",
            });
        }
        // SAFETY: the description belongs to the stream's, which was just made.
        let described = self.describe(unsafe { (self.api.description)(info) }, &stream.description);
        // SAFETY: as above; the outlet copies the description, which is destroyed in every case, and once.
        let handle = unsafe {
            let handle = (self.api.create_outlet)(info, 0, BUFFERED);
            (self.api.destroy_info)(info);
            handle
        };
        if handle.is_null() {
            return Err(LslError::Call {
                doing: "open a stream",
            });
        }
        let outlet = Outlet {
            library: Arc::clone(self),
            handle,
            channels: stream.channels,
        };
        described.map(|()| outlet)
    }

    fn describe(&self, parent: Xml, nodes: &[Node]) -> Result<(), LslError> {
        for node in nodes {
            match node {
                Node::Text(name, text) => {
                    let (name, text) = (c_text(name)?, c_text(text)?);
                    // SAFETY: `parent` is of a stream's description that is alive; the texts are copied.
                    unsafe { (self.api.append_value)(parent, name.as_ptr(), text.as_ptr()) };
                }
                Node::Group(name, nodes) => {
                    let name = c_text(name)?;
                    // SAFETY: as above.
                    let child = unsafe { (self.api.append_child)(parent, name.as_ptr()) };
                    self.describe(child, nodes)?;
                }
            }
        }
        Ok(())
    }
}

fn c_text(text: &str) -> Result<CString, LslError> {
    CString::new(text).map_err(|_| LslError::Text(text.replace('\0', "")))
}

/// A stream that is open. Dropping it closes it, which may wait for its threads.
#[derive(Debug)]
pub struct Outlet {
    library: Arc<Lsl>,
    handle: OutletHandle,
    channels: usize,
}

// SAFETY: liblsl's outlets may be used by any thread; this one is by one at a time, for pushing takes it mutably.
unsafe impl Send for Outlet {}

impl Outlet {
    /// Hands out a sample of the instant `at_s` of [`Lsl::clock_s`]. Never waits for readers: who is late loses the oldest.
    ///
    /// # Errors
    /// [`LslError::Sample`], [`LslError::Call`].
    pub fn push(&mut self, values: &[f32], at_s: f64) -> Result<(), LslError> {
        if values.len() != self.channels {
            return Err(LslError::Sample {
                expected: self.channels,
                found: values.len(),
            });
        }
        // SAFETY: the outlet is open, and there are as many values as it has channels; they are copied. 1: at once.
        let code = unsafe { (self.library.api.push)(self.handle, values.as_ptr(), at_s, 1) };
        match code {
            0 => Ok(()),
            _ => Err(LslError::Call {
                doing: "hand out a sample",
            }),
        }
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        // SAFETY: the outlet is open, and nobody can use it after this.
        unsafe { (self.library.api.destroy_outlet)(self.handle) };
    }
}
