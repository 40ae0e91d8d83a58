//! NiTE's word that a frame is there: so nobody waits in NiTE for one that never comes.
#![allow(unsafe_code, reason = "NiTE calls this function")]

use std::ffi::c_void;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use super::c::Callbacks;

/// What NiTE holds the address of: the function to call, and what that sets.
pub(super) struct Ready {
    table: Callbacks,
    there: Mutex<bool>,
    changed: Condvar,
}

impl Ready {
    pub(super) fn new() -> Box<Self> {
        Box::new(Self {
            table: Callbacks { ready: Some(ready) },
            there: Mutex::new(false),
            changed: Condvar::new(),
        })
    }

    /// What is given to NiTE: the table and the cookie.
    pub(super) fn parts(&mut self) -> (*mut Callbacks, *mut c_void) {
        let cookie = std::ptr::from_ref(self).cast_mut().cast();
        (&mut self.table, cookie)
    }

    /// Whether a frame was told of since [`clear`](Self::clear), or is within `timeout`.
    pub(super) fn wait(&self, timeout: Duration) -> bool {
        let there = self.there.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self
            .changed
            .wait_timeout_while(there, timeout, |there| !*there);
        let (there, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *there
    }

    pub(super) fn clear(&self) {
        *self.there.lock().unwrap_or_else(PoisonError::into_inner) = false;
    }

    fn set(&self) {
        *self.there.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.changed.notify_all();
    }
}

extern "system" fn ready(cookie: *mut c_void) {
    // SAFETY: the cookie is the box that was registered, which lives until it is unregistered; it is not written to.
    if let Some(ready) = unsafe { cookie.cast::<Ready>().as_ref() } {
        ready.set();
    }
}
