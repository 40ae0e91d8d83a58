//! How far a depth sensor's joint may be off once a quadratic went through a few of its frames.
//!
//! White noise across the ray 1.5 px * 0.8 * z / 585, along it 0.0012 + 0.0019 (z - 0.4)^2 metres (Nguyen, Izadi and Lovell
//! 2012), of which seven frames leave a third (of the variance); below that the tracker's own slow errors, which no
//! averaging over neighbouring frames takes away. The solver finds a sensor's and a joint's share of it by itself, so that
//! what counts here is the relation between across and along, and between near and far.

use nalgebra::Vector3;

/// What is left of white noise's variance after the fit.
const WHITE_LEFT: f64 = 0.33;
/// A tracker's slow errors across the ray, and along it per metre of distance.
const SLOW_ACROSS_M: f64 = 0.006;
const SLOW_ALONG_SHARE: f64 = 0.0033;

/// Information (inverse variance, 1/m^2) of a joint at `at`, sensor frame: across its ray, along it.
pub(crate) fn information(at: &Vector3<f64>) -> [f64; 2] {
    let range = at.norm().max(0.4);
    let white_across = 1.5 * 0.8 / 585.0 * range;
    let white_along = 0.0012 + 0.0019 * (range - 0.4).powi(2);
    [
        1.0 / (WHITE_LEFT * white_across.powi(2) + SLOW_ACROSS_M.powi(2)),
        1.0 / (WHITE_LEFT * white_along.powi(2) + (SLOW_ALONG_SHARE * range).powi(2)),
    ]
}

/// The same without a preferred direction, for recordings whose sensor is not where its rays start.
pub(crate) fn without_direction() -> [f64; 2] {
    [SLOW_ACROSS_M.powi(-2); 2]
}
