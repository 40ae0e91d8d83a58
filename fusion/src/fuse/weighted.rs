//! The mean weighted by inverse covariance: each sensor counts by what it can know at that distance, direction,
//! age and confidence.

use nalgebra::{Matrix3, Vector3};

use super::{Fused, Sighting, provenance};
use crate::noise::Noise;

/// `None` without sightings.
pub(super) fn weighted(sightings: &[Sighting], trusted: f64) -> Option<Fused> {
    let first = sightings.first()?;
    // Sums are taken around the first sighting, so that they do not depend on where the room's origin is.
    let centre = first.position;
    let (mut information, mut weighted) = (Matrix3::zeros(), Vector3::zeros());
    let (mut confidence, mut weights) = (0.0, 0.0);
    for s in sightings {
        let own = Noise::of(s.position, s.origin, s.confidence, trusted, s.age_s).information();
        information += own;
        weighted += own * (s.position - centre);
        let weight = own.trace();
        confidence += weight * s.confidence;
        weights += weight;
    }
    let covariance = information.try_inverse()?;
    Some(Fused {
        position: centre + covariance * weighted,
        covariance,
        confidence: confidence / weights,
        provenance: provenance(sightings, trusted),
    })
}
