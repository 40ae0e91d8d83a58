//! What NiTE 2.2's C interface (`NiteCAPI.h`, `NiteCTypes.h`) passes over, as far as it is used here.
#![allow(
    unsafe_code,
    reason = "the addresses of C functions are given their types here"
)]

use std::ffi::{c_float, c_int, c_short, c_void};

use crate::find::functions;

/// `NiteStatus`: 0 is good.
pub(super) type Status = c_int;
/// A `NiteUserTrackerHandle`.
pub(super) type Tracker = *mut c_void;

/// How many joints a skeleton has, in the order of the joint set `nite`.
pub(super) const JOINTS: usize = 15;
/// `NITE_SKELETON_NONE`: nobody asked for it, or NiTE gave it up.
pub(super) const SKELETON_NONE: c_int = 0;
/// `NITE_SKELETON_TRACKED`.
pub(super) const SKELETON_TRACKED: c_int = 2;
/// Bits of a user's state.
pub(super) const USER_VISIBLE: c_int = 1;
pub(super) const USER_NEW: c_int = 2;
pub(super) const USER_LOST: c_int = 4;

#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Version {
    pub(super) major: c_int,
    pub(super) minor: c_int,
    pub(super) maintenance: c_int,
    pub(super) build: c_int,
}

#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Joint {
    pub(super) kind: c_int,
    /// Millimetres.
    pub(super) position: [c_float; 3],
    pub(super) confidence: c_float,
    pub(super) orientation: [c_float; 4],
    pub(super) orientation_confidence: c_float,
}

#[repr(C)]
pub(super) struct User {
    pub(super) id: c_short,
    pub(super) bounding_box: [[c_float; 3]; 2],
    pub(super) centre: [c_float; 3],
    pub(super) state: c_int,
    pub(super) joints: [Joint; JOINTS],
    pub(super) skeleton: c_int,
    pub(super) poses: [[c_int; 2]; 2],
}

#[repr(C)]
pub(super) struct Frame {
    pub(super) user_count: c_int,
    pub(super) users: *const User,
    pub(super) map: *const c_short,
    pub(super) map_size: [c_int; 3],
    pub(super) depth: *mut c_void,
    /// Microseconds, the device's clock.
    pub(super) timestamp: u64,
    pub(super) index: c_int,
    pub(super) floor_confidence: c_float,
    pub(super) floor: [[c_float; 3]; 2],
}

/// `NiteUserTrackerCallbacks`.
#[repr(C)]
pub(super) struct Callbacks {
    /// An `OniGeneralCallback`: called with the cookie when there is a frame.
    pub(super) ready: Option<extern "system" fn(*mut c_void)>,
}

functions! {
    "NiteCAPI.h";
    initialize = "niteInitialize": () -> Status;
    shutdown = "niteShutdown": ();
    version = "niteGetVersion": () -> Version;
    create = "niteInitializeUserTracker": (*mut Tracker) -> Status;
    create_by_device = "niteInitializeUserTrackerByDevice": (*mut c_void, *mut Tracker) -> Status;
    destroy = "niteShutdownUserTracker": (Tracker) -> Status;
    start_skeleton = "niteStartSkeletonTracking": (Tracker, c_short) -> Status;
    set_smoothing = "niteSetSkeletonSmoothing": (Tracker, c_float) -> Status;
    register = "niteRegisterUserTrackerCallbacks": (Tracker, *mut Callbacks, *mut c_void) -> Status;
    unregister = "niteUnregisterUserTrackerCallbacks": (Tracker, *mut Callbacks);
    read = "niteReadUserTrackerFrame": (Tracker, *mut *mut Frame) -> Status;
    release = "niteUserTrackerFrameRelease": (Tracker, *mut Frame) -> Status;
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;

    /// As a C compiler of a 64-bit computer lays them out.
    #[test]
    #[cfg(target_pointer_width = "64")]
    fn structures_have_the_layout_of_c() {
        assert_eq!((size_of::<Joint>(), size_of::<User>()), (40, 664));
        assert_eq!(offset_of!(User, joints), 44);
        assert_eq!(offset_of!(User, skeleton), 644);
        assert_eq!(offset_of!(Frame, timestamp), 48);
        assert_eq!(size_of::<Frame>(), 88);
    }
}
