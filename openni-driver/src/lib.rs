//! A driver for OpenNI2 that shows simulated depth sensors as real devices, `posefuse://0`, `posefuse://1` ...
//!
//! Any OpenNI2 program reads them through the real library, once the built `libPosefuseVirtual.so` lies among OpenNI2's
//! drivers (`docs/OPENNI.md` says how). POSEFUSE_VIRTUAL names a control file (`control.rs`), which says what there
//! is to see and which sensors are plugged in; without one there is one sensor and one person.
//!
//! `exports.rs` is the C interface and the only place, with `outward.rs`, where code is unsafe; what it hands to is safe.

#![allow(
    non_snake_case,
    reason = "OpenNI2's drivers are called so: libPosefuseVirtual.so"
)]

mod control;
mod device;
mod driver;
mod exports;
mod outward;
mod render;
mod sensor;
mod stream;
