//! Order statistics and moments that the solvers share.

use nalgebra::{Matrix3, Vector3};

/// The middle value; `None` of nothing. Sorts `values`.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which `share` (0..=1) of the values lie, the nearest one; `None` of nothing. Reorders `values`.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let index = ((values.len() - 1) as f64 * share).round() as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    Some(*value)
}

/// Root mean square; 0 of nothing.
pub(crate) fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|v| v * v).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

/// Mean of the points and mean outer product of their distances to it; zeros of nothing.
pub(crate) fn moments(points: &[Vector3<f64>]) -> (Vector3<f64>, Matrix3<f64>) {
    let count = points.len().max(1) as f64;
    let mean = points.iter().sum::<Vector3<f64>>() / count;
    let cloud = points
        .iter()
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum::<Matrix3<f64>>();
    (mean, cloud / count)
}
