//! What is known of depth sensors: field of view, range, and how they measure.

/// How a sensor gets its depth, which decides what its neighbours do to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// A fixed pattern of dots: a second pattern on the same surface makes holes and wrong depth.
    Structured,
    /// The travel time of modulated light: a second source adds noise now and then.
    TimeOfFlight,
    /// Two cameras: more light helps.
    Stereo,
    /// Not known.
    Unknown,
}

impl Light {
    /// Its name, as on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Structured => "structured-light",
            Self::TimeOfFlight => "time-of-flight",
            Self::Stereo => "stereo",
            Self::Unknown => "unknown",
        }
    }
}

/// One kind of sensor, in the mode that people are tracked in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// What it is called.
    pub name: &'static str,
    /// Part of a device's name, in lower case and with spaces for hyphens, by which it is known.
    part: &'static str,
    /// Whole horizontal and vertical field of view, degrees.
    pub view_deg: [f64; 2],
    /// From where to where it measures, metres along the optical axis.
    pub range_m: [f64; 2],
    /// How it measures.
    pub light: Light,
}

/// The sensors whose view is known, from their makers' data sheets: Kinect v1 in its default range, Azure Kinect and
/// Femto in NFOV unbinned, RealSense in the range that their maker calls ideal.
pub const MODELS: [Model; 9] = [
    model(
        "Kinect v2",
        "kinect v2",
        [70.6, 60.0],
        [0.5, 4.5],
        Light::TimeOfFlight,
    ),
    model(
        "Kinect v1",
        "kinect v1",
        [57.5, 43.5],
        [0.8, 4.0],
        Light::Structured,
    ),
    model(
        "Azure Kinect",
        "azure",
        [75.0, 65.0],
        [0.5, 3.86],
        Light::TimeOfFlight,
    ),
    model(
        "Femto",
        "femto",
        [75.0, 65.0],
        [0.5, 3.86],
        Light::TimeOfFlight,
    ),
    model(
        "RealSense D455",
        "d455",
        [87.0, 58.0],
        [0.6, 6.0],
        Light::Stereo,
    ),
    model(
        "RealSense D435",
        "realsense",
        [87.0, 58.0],
        [0.3, 3.0],
        Light::Stereo,
    ),
    model(
        "Astra",
        "astra",
        [60.0, 49.5],
        [0.6, 5.0],
        Light::Structured,
    ),
    model(
        "Xtion",
        "xtion",
        [58.0, 45.0],
        [0.8, 3.5],
        Light::Structured,
    ),
    model(
        "PrimeSense",
        "primesense",
        [57.5, 45.0],
        [0.8, 3.5],
        Light::Structured,
    ),
];

/// For a sensor that is not among them.
pub const USUAL: Model = model("unknown", "", [70.0, 60.0], [0.5, 4.5], Light::Unknown);

const fn model(
    name: &'static str,
    part: &'static str,
    view_deg: [f64; 2],
    range_m: [f64; 2],
    light: Light,
) -> Model {
    Model {
        name,
        part,
        view_deg,
        range_m,
        light,
    }
}

impl Model {
    /// The model that a device's name speaks of, e.g. "Microsoft Kinect-v2 (simulated)".
    pub fn of(device: &str) -> Option<&'static Self> {
        let device = device.to_ascii_lowercase().replace(['-', '_'], " ");
        MODELS.iter().find(|model| device.contains(model.part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_is_found_however_its_name_is_written() {
        let found = |device: &str| Model::of(device).map(|model| model.name);
        assert_eq!(found("Microsoft Kinect-v2 (simulated)"), Some("Kinect v2"));
        assert_eq!(found("Orbbec Femto Bolt"), Some("Femto"));
        assert_eq!(found("Intel RealSense D455"), Some("RealSense D455"));
        assert_eq!(found("Intel RealSense D415"), Some("RealSense D435"));
        assert_eq!(found(""), None);
        for model in MODELS {
            assert_eq!(found(model.name), Some(model.name), "each finds itself");
        }
    }
}
