//! What bodies do, as numbers: made by `cargo run --release -p posefuse-fusion --example pose_statistics -- FOLDER TABLE` from
//! recorded motion (which, says `models/training/split.toml`; each recording also mirrored and backwards).
//!
//! A pose is 25 joints x (x, y, z) in the person's frame: origin in the pelvis (`SpineBase`), x to where the person faces (at
//! right angles to the hips and shoulders), z up, lengths in mean bones. It is `mean + basis z`, where `z` has
//! [`LATENT`] numbers, uncorrelated, with variances `variance`; what is left has the variance `rest` per joint and axis. A pose
//! `lag` poses (1/30 s) after one with latents `z` that had changed by `d` within [`CHANGE`] poses is
//! `carry [z; d]` with covariance `spread`. Little-endian f32, matrices by columns, symmetric ones whole; in this order:
//! mean 75, bones 24, basis 75 x LATENT, variance LATENT, rest 25, and for each lag of [`LAGS`]: carry LATENT x 2
//! LATENT, then the upper triangle of spread by columns.

use std::sync::LazyLock;

use nalgebra::{SMatrix, SVector, Vector3};
use posefuse_skeleton::{BONES, JOINT_COUNT};

/// Numbers that describe a pose in the person's frame.
pub(super) const LATENT: usize = 30;
/// Lags in the table, poses.
pub(super) const LAGS: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0];
/// Poses over which a change is taken.
pub(super) const CHANGE: usize = 2;
/// Poses per second of the table.
pub(super) const RATE_HZ: f64 = 30.0;

/// A pose's latents.
pub(super) type Latent = SVector<f64, LATENT>;
/// A covariance of latents, or its inverse.
pub(super) type Square = SMatrix<f64, LATENT, LATENT>;
/// Latents by one joint's axes.
pub(super) type Rows = SMatrix<f64, 3, LATENT>;

const BYTES: &[u8] = include_bytes!("poses.bin");

/// The table, ready for use.
pub(super) static TABLE: LazyLock<Table> = LazyLock::new(|| Table::read(BYTES));

/// From one pose to a later one.
#[derive(Clone, Debug)]
pub(super) struct Carry {
    pub(super) of_pose: Square,
    pub(super) of_change: Square,
    pub(super) spread: Square,
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) mean: [Vector3<f64>; JOINT_COUNT],
    /// Lengths in the order of [`BONES`].
    pub(super) bones: [f64; BONES.len()],
    pub(super) basis: Vec<Rows>,
    /// Each joint's basis times itself.
    pub(super) squares: Vec<Square>,
    pub(super) variance: Latent,
    pub(super) rest: [f64; JOINT_COUNT],
    carries: Vec<Carry>,
}

impl Table {
    /// What is missing reads as zero; a test looks that nothing is.
    fn read(bytes: &[u8]) -> Self {
        let mut numbers = numbers(bytes);
        let mut next = || numbers.next().unwrap_or(0.0);
        let mean = std::array::from_fn(|_| Vector3::from_fn(|_, _| next()));
        let bones = std::array::from_fn(|_| next());
        let columns = SMatrix::<f64, { 3 * JOINT_COUNT }, LATENT>::from_fn_by_columns(&mut next);
        let basis: Vec<Rows> = (0..JOINT_COUNT)
            .map(|joint| columns.fixed_rows::<3>(3 * joint).into_owned())
            .collect();
        let squares = basis.iter().map(|rows| rows.tr_mul(rows)).collect();
        let variance = Latent::from_fn(|_, _| next());
        let rest = std::array::from_fn(|_| next());
        let carries = LAGS
            .iter()
            .map(|_| Carry {
                of_pose: Square::from_fn_by_columns(&mut next),
                of_change: Square::from_fn_by_columns(&mut next),
                spread: symmetric(&mut next),
            })
            .collect();
        Self {
            mean,
            bones,
            basis,
            squares,
            variance,
            rest,
            carries,
        }
    }

    /// How a pose follows from one `lag` poses before it; beyond the longest lag in the table it is forgotten bit by bit.
    pub(super) fn carry(&self, lag: f64) -> Carry {
        let (Some(first), Some(last)) = (self.carries.first(), self.carries.last()) else {
            return self.forgotten();
        };
        let above = LAGS.iter().position(|known| *known >= lag);
        match above {
            Some(0) => first.clone(),
            Some(index) => {
                let share = (lag - LAGS[index - 1]) / (LAGS[index] - LAGS[index - 1]);
                between(&self.carries[index - 1], &self.carries[index], share)
            }
            None => {
                let longest = LAGS[LAGS.len() - 1];
                let share = ((lag - longest) / longest).min(1.0);
                between(last, &self.forgotten(), share)
            }
        }
    }

    /// Nothing follows.
    fn forgotten(&self) -> Carry {
        Carry {
            of_pose: Square::zeros(),
            of_change: Square::zeros(),
            spread: Square::from_diagonal(&self.variance),
        }
    }

    #[cfg(test)]
    pub(super) fn numbers_needed() -> usize {
        let carry = 2 * LATENT * LATENT + LATENT * (LATENT + 1) / 2;
        let pose = 3 * JOINT_COUNT;
        pose + BONES.len() + pose * LATENT + LATENT + JOINT_COUNT + LAGS.len() * carry
    }
}

fn between(a: &Carry, b: &Carry, share: f64) -> Carry {
    let mix = |a: &Square, b: &Square| a * (1.0 - share) + b * share;
    Carry {
        of_pose: mix(&a.of_pose, &b.of_pose),
        of_change: mix(&a.of_change, &b.of_change),
        spread: mix(&a.spread, &b.spread),
    }
}

fn numbers(bytes: &[u8]) -> impl Iterator<Item = f64> {
    let words = bytes.as_chunks::<4>().0.iter();
    words.map(|word| f64::from(f32::from_le_bytes(*word)))
}

/// A matrix filled column after column.
trait ByColumns {
    fn from_fn_by_columns(next: impl FnMut() -> f64) -> Self;
}

impl<const R: usize, const C: usize> ByColumns for SMatrix<f64, R, C> {
    fn from_fn_by_columns(mut next: impl FnMut() -> f64) -> Self {
        let mut matrix = Self::zeros();
        matrix.iter_mut().for_each(|slot| *slot = next());
        matrix
    }
}

fn symmetric(mut next: impl FnMut() -> f64) -> Square {
    let mut matrix = Square::zeros();
    for column in 0..LATENT {
        for row in 0..=column {
            let number = next();
            matrix[(row, column)] = number;
            matrix[(column, row)] = number;
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole_and_can_be_true() {
        assert_eq!(BYTES.len(), 4 * Table::numbers_needed());
        let table = &*TABLE;
        assert!(numbers(BYTES).all(f64::is_finite));
        assert!(table.variance.iter().chain(&table.rest).all(|v| *v > 0.0));
        assert!(table.bones.iter().all(|length| (0.1..3.0).contains(length)));
        for lag in [0.5, 1.0, 5.0, 40.0, 90.0, 1000.0] {
            let carry = table.carry(lag);
            assert!(carry.spread.cholesky().is_some(), "lag {lag}");
        }
    }
}
