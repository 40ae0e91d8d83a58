//! The robust mean weighted by inverse covariance: each sensor counts by what it can know at that distance,
//! direction, age and confidence, and less the further it stands from what all say together.
//!
//! Re-weighting after Cauchy, w = 1/(1 + d^2/c^2) with the squared Mahalanobis distance d^2: it never casts a sighting
//! out for good, so that the result does not leap between two camps when a sensor dies.

use nalgebra::{Matrix3, Vector3};

use super::{Fused, Sighting, provenance};
use crate::noise::Noise;

/// Rounds of re-weighting.
const ROUNDS: usize = 3;
/// c^2 of the re-weighting.
const SCALE: f64 = 6.0;
/// Most sightings that are re-weighted; all of a room's sensors.
const MAX_SIGHTINGS: usize = posefuse_skeleton::SensorId::MAX_SENSORS;

/// `None` without sightings.
pub(super) fn weighted(sightings: &[Sighting], trusted: f64) -> Option<Fused> {
    // Sums are taken around the first sighting, so that they do not depend on where the room's origin is.
    let centre = sightings.first()?.position;
    let mut weight = [1.0; MAX_SIGHTINGS];
    let mut information = [Matrix3::zeros(); MAX_SIGHTINGS];
    for (own, s) in information.iter_mut().zip(sightings) {
        *own = Noise::of(s.position, s.origin, s.confidence, trusted, s.age_s).information();
    }
    let used = || sightings.iter().zip(&information);
    let (mut mean, mut covariance) = solve(used(), &weight, centre)?;
    let rounds = if sightings.len() > 1 { ROUNDS } else { 0 };
    for _ in 0..rounds {
        for (weight, (s, own)) in weight.iter_mut().zip(used()) {
            let off = s.position - centre - mean;
            let odd = 1.0 + (off.transpose() * own * off)[0] / SCALE;
            *weight = 1.0 / odd;
        }
        (mean, covariance) = solve(used(), &weight, centre)?;
    }
    let shares = used()
        .zip(&weight)
        .map(|((s, own), weight)| (weight * own.trace(), s.confidence));
    let (confidence, shares) = shares.fold((0.0, 0.0), |(c, w), (share, confidence)| {
        (c + share * confidence, w + share)
    });
    Some(Fused {
        position: centre + mean,
        covariance,
        confidence: confidence / shares,
        provenance: provenance(sightings, trusted),
    })
}

/// Weighted mean relative to `centre`, and its covariance.
fn solve<'a>(
    used: impl Iterator<Item = (&'a Sighting, &'a Matrix3<f64>)>,
    weight: &[f64; MAX_SIGHTINGS],
    centre: Vector3<f64>,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let (mut total, mut sum) = (Matrix3::zeros(), Vector3::zeros());
    for ((s, own), weight) in used.zip(weight) {
        let own = own * *weight;
        total += own;
        sum += own * (s.position - centre);
    }
    let covariance = total.try_inverse()?;
    Some((covariance * sum, covariance))
}
