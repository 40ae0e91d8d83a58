//! Distances counted in bins, so that runs can be pooled in bounded memory.

/// Width of a bin, metres.
const BIN_M: f64 = 0.000_5;
/// Distances of this many bins and more share the last one.
const BINS: usize = 3000;

/// How often which distance was found; mean and root mean square are exact, percentiles to half a millimetre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    bins: Vec<u64>,
    count: u64,
    sum: f64,
    squares: f64,
    largest: f64,
}

impl Histogram {
    /// Counts one distance, metres. What is not finite is not counted.
    pub fn add(&mut self, distance_m: f64) {
        if !distance_m.is_finite() {
            return;
        }
        let bin = ((distance_m / BIN_M) as usize).min(BINS - 1);
        if self.bins.len() <= bin {
            self.bins.resize(bin + 1, 0);
        }
        self.bins[bin] += 1;
        self.count += 1;
        self.sum += distance_m;
        self.squares += distance_m * distance_m;
        self.largest = self.largest.max(distance_m);
    }

    /// Counts all that `other` has counted, too.
    pub fn merge(&mut self, other: &Self) {
        if self.bins.len() < other.bins.len() {
            self.bins.resize(other.bins.len(), 0);
        }
        for (bin, more) in self.bins.iter_mut().zip(&other.bins) {
            *bin += more;
        }
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
        self.largest = self.largest.max(other.largest);
    }

    /// How many distances were counted.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean, metres; `None` if there are none, as everywhere below.
    pub fn mean_m(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// Root of their mean square, metres.
    pub fn rms_m(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    /// The distance that `share` (0 to 1) of them do not exceed, metres.
    pub fn quantile_m(&self, share: f64) -> Option<f64> {
        if self.count == 0 {
            return None;
        }
        let wanted = (share.clamp(0.0, 1.0) * self.count as f64).max(1.0);
        let mut below = 0;
        for (bin, count) in self.bins.iter().enumerate() {
            let next = below + count;
            if next as f64 >= wanted && *count > 0 {
                let into = (wanted - below as f64) / *count as f64;
                return Some(((bin as f64 + into) * BIN_M).min(self.largest));
            }
            below = next;
        }
        Some(self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_right_to_a_bin_and_pooling_changes_nothing() {
        let (mut all, mut odd, mut even) = (
            Histogram::default(),
            Histogram::default(),
            Histogram::default(),
        );
        for i in 0..1000 {
            let distance = f64::from(i) * 1e-4;
            all.add(distance);
            if i % 2 == 0 { &mut even } else { &mut odd }.add(distance);
        }
        odd.merge(&even);
        for share in [0.0, 0.05, 0.5, 0.95, 1.0] {
            let found = all.quantile_m(share).unwrap();
            assert!((found - share * 0.1).abs() < 6e-4, "{share}: {found}");
            assert_eq!(all.quantile_m(share), odd.quantile_m(share));
        }
        assert!((all.mean_m().unwrap() - odd.mean_m().unwrap()).abs() < 1e-12);
        assert!((all.rms_m().unwrap() - 0.0577).abs() < 1e-3);
        assert_eq!(Histogram::default().quantile_m(0.5), None);
        all.add(99.0);
        assert_eq!(all.quantile_m(1.0), Some(1.5), "beyond the last bin");
    }
}
