//! Functions of liblsl's C interface (`lsl_c.h`, 1.13 and later), as far as they are used here.
#![allow(
    unsafe_code,
    reason = "the addresses of C functions are given their types here"
)]

use std::ffi::{c_char, c_double, c_float, c_int, c_void};

use crate::find::functions;

/// An `lsl_streaminfo`.
pub(super) type Info = *mut c_void;
/// An `lsl_outlet`.
pub(super) type OutletHandle = *mut c_void;
/// An `lsl_xml_ptr`.
pub(super) type Xml = *mut c_void;

/// `cft_float32`.
pub(super) const FLOAT32: c_int = 1;

functions! {
    "lsl_c.h";
    version = "lsl_library_version": () -> c_int;
    clock = "lsl_local_clock": () -> c_double;
    create_info = "lsl_create_streaminfo":
        (*const c_char, *const c_char, c_int, c_double, c_int, *const c_char) -> Info;
    destroy_info = "lsl_destroy_streaminfo": (Info);
    description = "lsl_get_desc": (Info) -> Xml;
    append_child = "lsl_append_child": (Xml, *const c_char) -> Xml;
    append_value = "lsl_append_child_value": (Xml, *const c_char, *const c_char) -> Xml;
    create_outlet = "lsl_create_outlet": (Info, c_int, c_int) -> OutletHandle;
    destroy_outlet = "lsl_destroy_outlet": (OutletHandle);
    push = "lsl_push_sample_ftp": (OutletHandle, *const c_float, c_double, c_int) -> c_int;
}
