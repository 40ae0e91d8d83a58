//! Convolution coefficients for regular samples, and filtering of a whole regular signal.

use crate::fit::Fit;
use crate::{Error, Spec};

/// The weights whose dot product with `window` regular samples, oldest first, is the wanted
/// `derivative` of the least-squares polynomial of degree `order` at `position`.
///
/// `position` counts samples after the oldest one and may lie between two: 0 is the oldest,
/// `window - 1` the newest. `delta` is the sample spacing; the weights have unit
/// `1 / delta^derivative`. These are the numbers of
/// `scipy.signal.savgol_coeffs(window, order, derivative, delta, pos=position, use="dot")`
/// (Savitzky & Golay, Analytical Chemistry 36, 1964, with the corrections of Steinier et al., 1972).
///
/// ```
/// let c = sgfilter::coefficients(5, 2, 0, 2.0, 1.0)?;
/// let printed = [-3.0, 12.0, 17.0, 12.0, -3.0].map(|v| v / 35.0);
/// assert!(c.iter().zip(printed).all(|(c, p)| (c - p).abs() < 1e-15));
/// # Ok::<(), sgfilter::Error>(())
/// ```
///
/// # Errors
/// What [`Spec::new`] refuses, [`Error::Position`] and [`Error::Delta`].
pub fn coefficients(
    window: usize,
    order: usize,
    derivative: usize,
    position: f64,
    delta: f64,
) -> Result<Vec<f64>, Error> {
    Spec::new(window, order, 0, derivative)?;
    if !(0.0..=(window - 1) as f64).contains(&position) {
        return Err(Error::Position { position, window });
    }
    if !(delta.is_finite() && delta > 0.0) {
        return Err(Error::Delta { delta });
    }
    let mut weights = unit_weights(window, order, derivative, position);
    for weight in &mut weights {
        for _ in 0..derivative {
            *weight /= delta;
        }
    }
    if weights.iter().all(|w| w.is_finite()) {
        Ok(weights)
    } else {
        Err(Error::Delta { delta })
    }
}

/// Coefficients for a spacing of 1, of numbers that [`Spec::new`] accepts.
pub(crate) fn unit_weights(
    window: usize,
    order: usize,
    derivative: usize,
    position: f64,
) -> Vec<f64> {
    let mut fit = Fit::new(window, order, derivative);
    let places = (0..window).map(|i| i as f64);
    match fit.solve(places, position, order, derivative) {
        Some((weights, _)) => weights.to_vec(),
        // Integers below 256 are distinct, so every order below the window can be borne.
        None => vec![0.0; window],
    }
}

/// Filters a whole regular signal of spacing `delta`; gives as many samples as it was given.
///
/// Where the window of a sample would reach over an end, the polynomial of the first or last
/// whole window is evaluated at the sample instead. With an odd window and a look-ahead of
/// `(window - 1) / 2` this is `scipy.signal.savgol_filter(values, ..., mode="interp")`. For an
/// even window SciPy evaluates between two samples; here it is always a sample's own place.
///
/// # Errors
/// [`Error::TooShort`] if the signal is shorter than the window, [`Error::NotFinite`] with the
/// index of a NaN or infinite value, [`Error::Delta`].
pub fn smooth(spec: &Spec, values: &[f64], delta: f64) -> Result<Vec<f64>, Error> {
    let (window, samples) = (spec.window(), values.len());
    if samples < window {
        return Err(Error::TooShort { samples, window });
    }
    if let Some((index, &value)) = values.iter().enumerate().find(|(_, v)| !v.is_finite()) {
        return Err(Error::NotFinite {
            at: index as i64,
            component: 0,
            value,
        });
    }
    let weights_at = |position: usize| {
        coefficients(
            window,
            spec.order(),
            spec.derivative(),
            position as f64,
            delta,
        )
    };
    let inner = weights_at(spec.position())?;
    (0..samples)
        .map(|i| {
            let start = i.saturating_sub(spec.position()).min(samples - window);
            let position = i - start;
            let seen = &values[start..start + window];
            if position == spec.position() {
                Ok(dot(&inner, seen))
            } else {
                Ok(dot(&weights_at(position)?, seen))
            }
        })
        .collect()
}

fn dot(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().zip(values).map(|(w, v)| w * v).sum()
}
