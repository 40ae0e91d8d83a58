//! Runs the network on the people of an image.

use std::path::Path;

use posefuse_models::{Network, NetworkFile, Refused, RunError};
use posefuse_skeleton::{DepthImage, Intrinsics, JOINT_COUNT};

use crate::TrackerConfig;
use crate::crop::{CHANNELS, CropFrame, Cropper, SIZE};
use crate::estimate::Estimate;
use crate::lens::V3;

/// The network that is part of the program.
const MANIFEST: &str = include_str!("../data/depth-joints.toml");
const ONNX: &[u8] = include_bytes!("../data/depth-joints.onnx");
/// Further from the crop's middle than this no joint can be, metres.
const FAR_M: f32 = 2.5;
/// A deviation beyond this is none, metres.
const VAGUE_M: f32 = 5.0;

/// The network with its memory.
pub(crate) struct Sight {
    network: Network,
    cropper: Cropper,
    crops: Vec<f32>,
}

/// The pixels of somebody: columns and rows that hold them all (from, to before).
pub(crate) type Extent = [[usize; 2]; 2];

impl Sight {
    pub(crate) fn open(config: &TrackerConfig) -> Result<Self, Refused> {
        let file = match config.network.as_os_str().is_empty() {
            true => NetworkFile::from_parts(MANIFEST, "depth-joints.toml (in the program)", ONNX)?,
            false => NetworkFile::read(&config.network)?,
        };
        check(&file, &config.network)?;
        Ok(Self {
            network: Network::open(&file, &config.models)?,
            cropper: Cropper::default(),
            crops: Vec::new(),
        })
    }

    /// What runs the network.
    pub(crate) fn network(&self) -> &Network {
        &self.network
    }

    /// Cuts one more person out for the next run; `None` if too little is seen of them.
    pub(crate) fn cut(
        &mut self,
        image: &DepthImage,
        camera: &Intrinsics,
        extent: Extent,
        belongs: impl Fn(usize) -> bool,
    ) -> Option<CropFrame> {
        self.cropper
            .cut(image, camera, extent, belongs, &mut self.crops)
    }

    /// What the network says of those who were cut out since the last run, in this order; `None` where that is nonsense.
    ///
    /// # Errors
    /// The runtime fails.
    pub(crate) fn run(&mut self, frames: &[CropFrame]) -> Result<Vec<Option<Estimate>>, RunError> {
        if let Some(input) = self.network.input("crop") {
            std::mem::swap(input, &mut self.crops);
        }
        self.crops.clear();
        if frames.is_empty() {
            return Ok(Vec::new());
        }
        self.network.run(frames.len())?;
        let one = |(number, frame)| self.estimate(number, frame);
        Ok(frames.iter().enumerate().map(one).collect())
    }

    fn estimate(&self, number: usize, frame: &CropFrame) -> Option<Estimate> {
        let part = |name: &str, each: usize| {
            let values = self.network.output(name);
            values.get(number * each..(number + 1) * each)
        };
        let joints = part("joints", 3 * JOINT_COUNT)?;
        if joints.iter().any(|value| value.abs() > FAR_M) {
            return None;
        }
        let joint = |index: usize| {
            let at = [0, 1, 2].map(|axis| f64::from(joints[3 * index + axis]));
            frame.to_sensor(at).vector().cast::<f32>()
        };
        let joints: [V3; JOINT_COUNT] = std::array::from_fn(joint);
        let sigma_m: [f32; JOINT_COUNT] = part("sigma", JOINT_COUNT)?.try_into().ok()?;
        let sensible = |sigma: &f32| (1e-4..VAGUE_M).contains(sigma);
        sigma_m.iter().all(sensible).then_some(())?;
        Some(Estimate {
            joints,
            sigma_m,
            visible: part("visible", JOINT_COUNT)?.try_into().ok()?,
            heading: part("heading", 2)?.try_into().ok()?,
        })
    }
}

/// Whether the network takes what [`crate::crop`] gives and says what a tracker needs.
fn check(file: &NetworkFile, path: &Path) -> Result<(), Refused> {
    let manifest = &file.manifest;
    let n = JOINT_COUNT;
    let expected: [(&str, bool, &[usize]); 5] = [
        ("crop", true, &[CHANNELS, SIZE, SIZE]),
        ("joints", false, &[n, 3]),
        ("sigma", false, &[n]),
        ("visible", false, &[n]),
        ("heading", false, &[2]),
    ];
    let wrong = |problem| Refused::Manifest {
        place: match path.as_os_str().is_empty() {
            true => file.place.clone(),
            false => path.display().to_string(),
        },
        problem,
    };
    if manifest.inputs.len() != 1 {
        return Err(wrong("expected one input, `crop`".to_owned()));
    }
    for (name, is_input, shape) in expected {
        let ports = if is_input {
            &manifest.inputs
        } else {
            &manifest.outputs
        };
        let found = ports.get(name).and_then(|port| port.item_shape());
        if found.as_deref() != Some(shape) {
            let side = if is_input { "input" } else { "output" };
            return Err(wrong(format!(
                "expected {side} `{name}` of N x {shape:?}, found {found:?}; the network is not one of a body tracker"
            )));
        }
    }
    Ok(())
}
