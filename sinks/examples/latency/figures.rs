//! Shares of what was measured.

/// The 50th and 99th percentile, as a row of a table has them.
pub(crate) struct Row<'a>(pub(crate) &'a [f64]);

impl std::fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [p50, p99] = [0.5, 0.99].map(|of| share(self.0, of));
        write!(f, "  p50 {p50:8.1}  p99 {p99:8.1}")
    }
}

/// The value that this share of all does not exceed.
pub(crate) fn share(values: &[f64], of: f64) -> f64 {
    let mut values = values.to_vec();
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    values
        .get((last * of).round() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}
