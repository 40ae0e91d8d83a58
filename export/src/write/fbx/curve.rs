//! Animation curves: a key for every frame, and slopes that make the cubic between keys smooth.

use std::io;

use super::document::{Attribute::*, Document};

/// FBX's ticks of a second.
pub(super) const TICKS_PER_S: f64 = 46_186_158_000.0;
/// Cubic, and the slopes are those that the file says.
const CUBIC_WITH_SLOPES: i32 = 0x0008 | 0x0400;
/// A channel that moves by no more than this is one key: file units or degrees.
const STILL: f32 = 1e-6;
/// Two weights of a third each, as the format packs them: they are not used.
const WEIGHTS: u32 = 0x0d05_0d05;

/// The tick of frame number `frame`.
pub(super) fn tick(frame: u64, rate_hz: f64) -> i64 {
    (frame as f64 * TICKS_PER_S / rate_hz).round() as i64
}

/// Writes an `AnimationCurve`: `values` are one a frame. Gives its id.
pub(super) fn curve(document: &mut Document, rate_hz: f64, values: &[f32]) -> io::Result<i64> {
    let id = document.id();
    let still = values
        .iter()
        .all(|value| (value - values[0]).abs() <= STILL);
    let values = if still { &values[..1] } else { values };
    let times: Vec<i64> = (0..values.len() as u64)
        .map(|frame| tick(frame, rate_hz))
        .collect();
    let slopes = slopes(values, rate_hz as f32);
    // For each key: the slope after it, the slope before the next one, weights, velocities.
    let shapes = (0..values.len()).flat_map(|key| {
        let next = slopes.get(key + 1).copied().unwrap_or(0.0);
        [slopes[key], next, f32::from_bits(WEIGHTS), 0.0]
    });
    let shapes: Vec<f32> = shapes.collect();
    document.object("AnimationCurve", (id, "", "AnimCurve", ""), |document| {
        document.leaf("Default", &[Double(f64::from(values[0]))])?;
        document.leaf("KeyVer", &[Int(4008)])?;
        document.longs("KeyTime", &times)?;
        document.floats("KeyValueFloat", values)?;
        document.ints("KeyAttrFlags", &vec![CUBIC_WITH_SLOPES; values.len()])?;
        document.floats("KeyAttrDataFloat", &shapes)?;
        document.ints("KeyAttrRefCount", &vec![1; values.len()])
    })?;
    Ok(id)
}

/// At each key the slope through its neighbours, per second.
fn slopes(values: &[f32], rate_hz: f32) -> Vec<f32> {
    let last = values.len() - 1;
    let slope = |key: usize| {
        let (before, after) = (key.saturating_sub(1), (key + 1).min(last));
        match after - before {
            0 => 0.0,
            steps => (values[after] - values[before]) * rate_hz / steps as f32,
        }
    };
    (0..values.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_a_straight_way_per_second() {
        assert_eq!(slopes(&[1.0, 3.0, 5.0], 30.0), [60.0; 3]);
        assert_eq!(slopes(&[7.0], 30.0), [0.0]);
        assert_eq!(tick(30, 30.0), 46_186_158_000);
    }
}
