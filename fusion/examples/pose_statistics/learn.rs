//! The table of `fusion/src/repair/gaussian/table.rs` from recordings.

use std::error::Error;
use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use posefuse_skeleton::{BONES, JOINT_COUNT, Joint};

use crate::recordings::{Pose, pieces};

/// As in `table.rs`.
const LATENT: usize = 30;
const LAGS: [usize; 7] = [1, 2, 4, 8, 15, 30, 60];
const CHANGE: usize = 2;

const NUMBERS: usize = 3 * JOINT_COUNT;
/// Added to squares, so that they can be inverted.
const RIDGE: f64 = 1e-6;
/// No joint is described better than this, mean bones squared.
const LEAST_REST: f64 = 1e-5;

pub(crate) fn learn(folder: &Path, table: &Path) -> Result<(), Box<dyn Error>> {
    let mut recorded = pieces(folder)?;
    recorded.retain(|piece| piece.len() > CHANGE);
    let mut bodies: Vec<Vec<DVector<f64>>> = Vec::new();
    let mut lengths = [0.0; BONES.len()];
    for piece in &recorded {
        let (scale, own) = bones(piece);
        for (sum, length) in lengths.iter_mut().zip(own) {
            *sum += length / scale / recorded.len() as f64;
        }
        let seen: Vec<Pose> = piece.iter().map(|pose| in_person(pose, scale)).collect();
        bodies.push(seen.iter().map(flat).collect());
        bodies.push(seen.iter().map(|pose| flat(&mirrored(pose))).collect());
    }
    let poses = || bodies.iter().flatten();
    let count = poses().count() as f64;
    let mean = poses().fold(DVector::zeros(NUMBERS), |sum, pose| sum + pose) / count;
    let mut covariance = DMatrix::zeros(NUMBERS, NUMBERS);
    for pose in poses() {
        let off = pose - &mean;
        covariance.ger(1.0 / count, &off, &off, 1.0);
    }
    let (basis, variance) = principal(&covariance);
    let rest: Vec<f64> = (0..JOINT_COUNT)
        .map(|joint| {
            let rows = 3 * joint..3 * joint + 3;
            let all: f64 = rows.clone().map(|row| covariance[(row, row)]).sum();
            let told = rows.map(|row| {
                let of = |k: usize| basis[(row, k)].powi(2) * variance[k];
                (0..LATENT).map(of).sum::<f64>()
            });
            ((all - told.sum::<f64>()) / 3.0).max(LEAST_REST)
        })
        .collect();
    let mut latents: Vec<Vec<DVector<f64>>> = bodies
        .iter()
        .map(|piece| {
            piece
                .iter()
                .map(|pose| basis.tr_mul(&(pose - &mean)))
                .collect()
        })
        .collect();
    let backwards: Vec<_> = latents
        .iter()
        .map(|piece| piece.iter().rev().cloned().collect())
        .collect();
    latents.extend(backwards);
    let mut numbers: Vec<f64> = mean.iter().copied().chain(lengths).collect();
    numbers.extend(basis.iter().chain(variance.iter()).copied());
    numbers.extend(&rest);
    for lag in LAGS {
        let (carry, spread) = carry(&latents, lag)?;
        numbers.extend(carry.iter());
        for column in 0..LATENT {
            numbers.extend((0..=column).map(|row| spread[(row, column)]));
        }
    }
    let bytes: Vec<u8> = numbers
        .iter()
        .flat_map(|n| (*n as f32).to_le_bytes())
        .collect();
    fs::write(table, &bytes)?;
    let kept = 100.0 * variance.iter().sum::<f64>() / covariance.trace();
    eprintln!(
        "{count} poses, {LATENT} latents keep {kept:.2} % of the variance, {} bytes",
        bytes.len()
    );
    Ok(())
}

/// The mean length of a bone of the body, and each bone's, metres: medians over the piece.
fn bones(piece: &[Pose]) -> (f64, [f64; BONES.len()]) {
    let own = BONES.map(|bone| {
        let length = |pose: &Pose| (pose[bone.parent as usize] - pose[bone.child as usize]).norm();
        let mut all: Vec<f64> = piece.iter().map(length).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    });
    (own.iter().sum::<f64>() / own.len() as f64, own)
}

/// From the pelvis, facing x, in mean bones.
fn in_person(pose: &Pose, scale: f64) -> Pose {
    use Joint::{HipLeft, HipRight, ShoulderLeft, ShoulderRight, SpineBase};
    let at = |joint: Joint| pose[joint as usize];
    let left = at(HipLeft) - at(HipRight) + at(ShoulderLeft) - at(ShoulderRight);
    let yaw = f64::atan2(-left.x, left.y);
    let (sin, cos) = yaw.sin_cos();
    let origin = at(SpineBase);
    pose.map(|place| {
        let off = (place - origin) / scale;
        Vector3::new(cos * off.x + sin * off.y, cos * off.y - sin * off.x, off.z)
    })
}

fn mirrored(pose: &Pose) -> Pose {
    Joint::ALL.map(|joint| {
        let other = pose[joint.mirrored() as usize];
        Vector3::new(other.x, -other.y, other.z)
    })
}

fn flat(pose: &Pose) -> DVector<f64> {
    DVector::from_iterator(
        NUMBERS,
        pose.iter().flat_map(|place| [place.x, place.y, place.z]),
    )
}

/// The directions that vary most, as columns, and their variances.
fn principal(covariance: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let eigen = SymmetricEigen::new(covariance.clone());
    let mut order: Vec<usize> = (0..NUMBERS).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let columns: Vec<_> = order[..LATENT]
        .iter()
        .map(|index| eigen.eigenvectors.column(*index).into_owned())
        .collect();
    let variance = order[..LATENT]
        .iter()
        .map(|index| eigen.eigenvalues[*index])
        .collect();
    (DMatrix::from_columns(&columns), variance)
}

/// How latents follow from those `lag` poses before and their change (LATENT x 2 LATENT), and with what covariance.
fn carry(
    pieces: &[Vec<DVector<f64>>],
    lag: usize,
) -> Result<(DMatrix<f64>, DMatrix<f64>), Box<dyn Error>> {
    let mut squares = DMatrix::zeros(2 * LATENT, 2 * LATENT);
    let mut products = DMatrix::zeros(2 * LATENT, LATENT);
    let mut later = DMatrix::zeros(LATENT, LATENT);
    let mut count = 0.0;
    for piece in pieces {
        for now in lag + CHANGE..piece.len() {
            let before = &piece[now - lag];
            let change = before - &piece[now - lag - CHANGE];
            let given =
                DVector::from_iterator(2 * LATENT, before.iter().chain(change.iter()).copied());
            squares.ger(1.0, &given, &given, 1.0);
            products.ger(1.0, &given, &piece[now], 1.0);
            later.ger(1.0, &piece[now], &piece[now], 1.0);
            count += 1.0;
        }
    }
    let ridge = DMatrix::identity(2 * LATENT, 2 * LATENT) * (RIDGE * count);
    let carry = (&squares + ridge)
        .cholesky()
        .ok_or("too little motion")?
        .solve(&products)
        .transpose();
    let told = &carry * &products;
    let both = &told + told.transpose() - &carry * squares * carry.transpose();
    let spread = (later - both) / count + DMatrix::identity(LATENT, LATENT) * RIDGE;
    Ok((carry, (&spread + spread.transpose()) * 0.5))
}
