//! Records a depth stream to an `.oni` file, with OpenNI2's own recorder.
#![allow(unsafe_code, reason = "calls OpenNI2's C functions")]

use std::path::Path;
use std::ptr;

use super::api::Handle;
use super::library::c_text;
use super::{DepthStream, OpenNiError};

/// A recorder that runs. It is ended, and the file whole, when this is dropped.
#[derive(Debug)]
pub struct Recorder<'a> {
    stream: &'a DepthStream,
    handle: Handle,
}

impl<'a> Recorder<'a> {
    /// Records what the stream gives from now on. An existing file is written over.
    ///
    /// A frame of the stream goes into the file whether or not anybody reads it.
    pub fn start(stream: &'a DepthStream, file: &Path) -> Result<Self, OpenNiError> {
        let openni = stream.device().openni();
        let name = c_text(&file.to_string_lossy())?;
        let mut handle: Handle = ptr::null_mut();
        // SAFETY: a text that ends with zero, and a variable for the handle.
        let status = unsafe { (openni.api.create_recorder)(name.as_ptr(), &mut handle) };
        let doing = || format!("record to {}", file.display());
        openni.check(status, doing)?;
        let this = Self { stream, handle };
        // SAFETY: a recorder and a stream that are ours; depth is to be kept as it is (no lossy compression).
        let status = unsafe { (openni.api.recorder_attach_stream)(handle, stream.handle, 0) };
        openni.check(status, doing)?;
        // SAFETY: as above.
        let status = unsafe { (openni.api.recorder_start)(handle) };
        openni.check(status, doing)?;
        Ok(this)
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        let api = &self.stream.device().openni().api;
        // SAFETY: made in `start`, ended once; the stream that it was attached to is still there.
        unsafe {
            (api.recorder_stop)(self.handle);
            (api.recorder_destroy)(&mut self.handle);
        }
    }
}
