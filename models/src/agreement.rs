//! How near a runtime comes to what the training framework gave.

use crate::tensors::{JOINTS, Tensors};
use crate::trial::choose;
use crate::{Batch, Config, GoldenOutputs, ModelFile, Refused, Runtime};

/// The largest differences between a runtime and the stored outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Which runtime.
    pub runtime: Runtime,
    /// Of positions, along one axis, metres.
    pub filled_m: f32,
    /// Of standard deviations, metres.
    pub sigma_m: f32,
    /// One call for one window, median, seconds.
    pub latency_s: f64,
}

/// Runs the model's stored windows with the configured runtime; `None` where none are stored.
///
/// # Errors
/// The model or the runtime cannot be used.
pub fn agreement(file: &ModelFile, config: &Config) -> Result<Option<Agreement>, Refused> {
    let Some(golden) = file.golden()? else {
        return Ok(None);
    };
    let mut chosen = choose(file, config)?;
    let mut tensors = Tensors::of(&file.manifest);
    let at_once = match file.manifest.batch {
        Batch::Fixed(count) => count.max(1),
        Batch::Any(_) => golden.windows,
    };
    let (mut filled, mut sigma) = (Vec::new(), Vec::new());
    for first in (0..golden.windows).step_by(at_once) {
        let count = at_once.min(golden.windows - first);
        load(&mut tensors, &golden, first, count);
        let ran = tensors.run(&mut *chosen.session, count);
        ran.map_err(|problem| Refused::Network {
            place: file.place.clone(),
            runtime: chosen.runtime.to_string(),
            problem,
        })?;
        filled.extend_from_slice(&tensors.filled);
        sigma.extend_from_slice(&tensors.sigma);
    }
    Ok(Some(Agreement {
        runtime: chosen.runtime,
        filled_m: difference(&filled, &golden.filled),
        sigma_m: difference(&sigma, &golden.sigma),
        latency_s: chosen.latency.as_secs_f64(),
    }))
}

fn load(tensors: &mut Tensors, golden: &GoldenOutputs, first: usize, count: usize) {
    tensors.clear();
    let each = tensors.poses * JOINTS;
    let part = |values: &[f32], each: usize| values[first * each..(first + count) * each].to_vec();
    tensors.pose = part(&golden.pose, 3 * each);
    tensors.mask = part(&golden.mask, each);
    tensors.age = part(&golden.age, each);
}

/// The largest; not a number counts as infinitely far.
fn difference(found: &[f32], expected: &[f32]) -> f32 {
    let far = |(found, expected): (&f32, &f32)| match (found - expected).abs() {
        far if far.is_nan() => f32::INFINITY,
        far => far,
    };
    found.iter().zip(expected).map(far).fold(0.0, f32::max)
}
