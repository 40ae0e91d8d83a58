//! The plain mean (Menard 2014): drop what is below the trusted confidence; if nothing is left, the mean of all.

use nalgebra::{Matrix3, Vector3};

use super::{Fused, Sighting, provenance};
use crate::noise::Noise;

/// `None` without sightings.
pub(super) fn average(sightings: &[Sighting], trusted: f64) -> Option<Fused> {
    let any = sightings.iter().any(|s| s.confidence >= trusted);
    let used = || sightings.iter().filter(|s| !any || s.confidence >= trusted);
    let (mut position, mut covariance) = (Vector3::zeros(), Matrix3::zeros());
    let (mut confidence, mut count) = (0.0, 0.0);
    for s in used() {
        position += s.position;
        covariance += Noise::of(s.position, s.origin, s.confidence, trusted, s.age_s).covariance();
        confidence += s.confidence;
        count += 1.0;
    }
    (count > 0.0).then(|| Fused {
        position: position / count,
        covariance: covariance / (count * count),
        confidence: confidence / count,
        provenance: provenance(sightings, trusted),
    })
}
