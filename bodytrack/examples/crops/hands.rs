//! Crops of hands, as the tracker cuts them out: where the body's network says that they are, with all its errors.
//!
//! OUT.hands: 2 x 32 x 32 i8 a hand, the crop's numbers times 100. OUT.grips: [`TRUTH`] f32 a hand: closed, distance (m), pixels to a
//! cell's side, whether the network says that it is in sight, the sigma of its place (m), whether it is in sight, how far the tracked hand is
//! from the true one and how far the crop's middle is (m), camera (0: 640 wide, 1: 320, 2: time of flight), whether its edges are
//! smeared as correlation windows do.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use posefuse_bodytrack::crop::Cropper;
use posefuse_bodytrack::hand::{self, Arm};
use posefuse_models::{Config, Network, NetworkFile};
use posefuse_simulator::depth::{DepthCamera, DepthView};
use posefuse_skeleton::{
    ARMS, DepthImage, Intrinsics, JOINT_COUNT, Joint, JointMap, Position, Sensor,
};

use crate::chance::Chance;
use crate::mask::Mask;
use crate::scene::Staged;

/// Numbers of a truth.
const TRUTH: usize = 10;
const UNITS: f32 = 100.0;
/// Bodies are tracked in images about so wide.
const THIN_WIDTH: u32 = 320;
/// Kinect v1 correlates windows of about so many pixels of an image 640 wide.
const WINDOW_PX: f64 = 5.0;

/// A camera whose hands are told apart, with its number.
pub(crate) fn camera(chance: &mut Chance) -> (DepthCamera, u8) {
    let (mut camera, kind) = match chance.below(8) {
        0..=3 => (DepthCamera::structured_light(640, 480), 0),
        4..=6 => (DepthCamera::structured_light(320, 240), 1),
        _ => (DepthCamera::time_of_flight(512, 424), 2),
    };
    camera.noise.along *= chance.between(0.5, 1.5);
    camera.noise.across_px *= chance.between(0.5, 1.4);
    camera.noise.holes *= chance.between(0.3, 1.5);
    camera.noise.range_m[0] = 0.4;
    if chance.with(0.5) {
        camera.noise.baseline_m = -camera.noise.baseline_m;
    }
    (camera, kind)
}

pub(crate) struct Hands {
    bodies: Network,
    crops: BufWriter<File>,
    truths: BufWriter<File>,
    written: usize,
}

impl Hands {
    pub(crate) fn create(out: &Path) -> Result<Self, Box<dyn Error>> {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/depth-joints.toml");
        if let Some(folder) = out.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let file =
            |extension: &str| File::create(out.with_extension(extension)).map(BufWriter::new);
        Ok(Self {
            bodies: Network::open(&NetworkFile::read(&shipped)?, &Config::default())?,
            crops: file("hands")?,
            truths: file("grips")?,
            written: 0,
        })
    }

    pub(crate) fn written(&self) -> usize {
        self.written
    }

    pub(crate) fn finish(mut self) -> std::io::Result<()> {
        self.crops.flush()?;
        self.truths.flush()
    }

    /// Renders a scene and writes the hands of everybody in it whom the body's network finds.
    pub(crate) fn put(
        &mut self,
        staged: &Staged,
        kind: u8,
        chance: &mut Chance,
    ) -> Result<(), Box<dyn Error>> {
        let view = staged.view();
        let camera = &staged.camera.intrinsics;
        let step = ((f64::from(camera.width) / f64::from(THIN_WIDTH)).round() as u32).max(1);
        let (thin, thin_camera) = (
            thinned(&view, step),
            DepthCamera {
                intrinsics: camera.every(step),
                ..staged.camera
            },
        );
        for figure in &staged.scene.figures {
            let mask = Mask::of(&thin, figure.number);
            if mask.measured(&thin.image) < 200 {
                continue;
            }
            let mask = mask.spoiled(&thin, &thin_camera, &staged.room_from_sensor, chance);
            let Some(found) = self.body(&thin.image, &thin_camera.intrinsics, &mask)? else {
                continue;
            };
            let truth = staged.here(figure);
            for (side, arm) in ARMS.into_iter().enumerate() {
                let smeared = kind < 2 && chance.with(0.5);
                let hand = Hand {
                    view: &view,
                    camera,
                    number: figure.number,
                    joints: [arm[1], arm[2], arm[3]],
                    is_left: side == 0,
                    closed: figure.hands_closed[side],
                    kind,
                    smeared,
                };
                self.hand(&hand, &found, &truth)?;
            }
        }
        Ok(())
    }

    /// What the network says of somebody: joints, their sigma and whether they are in sight.
    fn body(
        &mut self,
        image: &DepthImage,
        camera: &Intrinsics,
        mask: &Mask,
    ) -> Result<Option<Found>, Box<dyn Error>> {
        let mut crop = Vec::new();
        let belongs = |at: usize| mask.holds(at);
        let frame = Cropper::default().cut(image, camera, mask.extent(), belongs, &mut crop);
        let (Some(frame), Some(input)) = (frame, self.bodies.input("crop")) else {
            return Ok(None);
        };
        *input = crop;
        self.bodies.run(1)?;
        let joints = self.bodies.output("joints");
        let place =
            |at: usize| frame.to_sensor([0, 1, 2].map(|axis| f64::from(joints[3 * at + axis])));
        let (sigma, visible) = (self.bodies.output("sigma"), self.bodies.output("visible"));
        let each = |at: usize| (place(at), sigma[at], visible[at]);
        Ok(Some((0..JOINT_COUNT).map(each).collect()))
    }

    fn hand(
        &mut self,
        hand: &Hand<'_>,
        found: &[(Position<Sensor>, f32, f32)],
        truth: &JointMap<Position<Sensor>>,
    ) -> std::io::Result<()> {
        let [elbow, wrist, palm] = hand.joints.map(|joint| found[joint as usize]);
        let Some(true_hand) = truth[hand.joints[2]] else {
            return Ok(());
        };
        let arm = Arm {
            joints: [elbow.0, wrist.0, palm.0],
            is_left: hand.is_left,
        };
        let smeared = hand.smeared.then(|| hand.smear(&palm.0));
        let image = smeared.as_ref().unwrap_or(&hand.view.image);
        let mut crop = Vec::new();
        let Some(cut) = hand::cut(image, hand.camera, &arm, &mut crop) else {
            return Ok(());
        };
        let sees = hand
            .view
            .sees(hand.camera, hand.number, hand.joints[2], &true_hand);
        let numbers: [f32; TRUTH] = [
            f32::from(u8::from(hand.closed)),
            true_hand.vector().z as f32,
            cut.sharp,
            palm.2,
            palm.1,
            f32::from(u8::from(sees == Some(true))),
            palm.0.distance(true_hand) as f32,
            cut.middle.distance(true_hand) as f32,
            f32::from(hand.kind),
            f32::from(u8::from(hand.smeared)),
        ];
        let cells: Vec<u8> = crop
            .iter()
            .map(|number| (number * UNITS).round() as i8 as u8)
            .collect();
        self.crops.write_all(&cells)?;
        for number in numbers {
            self.truths.write_all(&number.to_le_bytes())?;
        }
        self.written += 1;
        Ok(())
    }
}

type Found = Vec<(Position<Sensor>, f32, f32)>;

/// A hand in an image.
struct Hand<'a> {
    view: &'a DepthView,
    camera: &'a Intrinsics,
    number: u8,
    /// Elbow, wrist, hand.
    joints: [Joint; 3],
    is_left: bool,
    closed: bool,
    kind: u8,
    smeared: bool,
}

impl Hand<'_> {
    /// The image with what is around `at` as a sensor that correlates windows gives it: each distance is the median of a window.
    fn smear(&self, at: &Position<Sensor>) -> DepthImage {
        let mut image = self.view.image.clone();
        let (width, height) = (image.width as i64, image.height as i64);
        let half = (WINDOW_PX * f64::from(image.width) / 640.0 / 2.0) as i64;
        let z = at.vector().z.max(0.3);
        let reach = (0.28 * self.camera.fx / z) as i64;
        let Some([u, v]) = self.camera.pixel(at).map(|pixel| pixel.map(|p| p as i64)) else {
            return image;
        };
        let mut window = Vec::with_capacity(25);
        for row in (v - reach).max(0)..(v + reach).min(height) {
            for column in (u - reach).max(0)..(u + reach).min(width) {
                window.clear();
                for y in (row - half).max(0)..=(row + half).min(height - 1) {
                    let line = (y * width) as usize;
                    let from = line + (column - half).max(0) as usize;
                    let to = line + (column + half).min(width - 1) as usize;
                    let known = self.view.image.millimetres[from..=to].iter();
                    window.extend(known.copied().filter(|mm| *mm > 0));
                }
                let place = (row * width + column) as usize;
                if image.millimetres[place] > 0 && !window.is_empty() {
                    let middle = window.len() / 2;
                    image.millimetres[place] = *window.select_nth_unstable(middle).1;
                }
            }
        }
        image
    }
}

/// Every `step`th pixel and row of a view.
fn thinned(view: &DepthView, step: u32) -> DepthView {
    let width = view.image.width as usize;
    let kept = |at: &usize| {
        (at % width).is_multiple_of(step as usize) && (at / width).is_multiple_of(step as usize)
    };
    let pixels: Vec<usize> = (0..view.owners.len()).filter(kept).collect();
    DepthView {
        image: view.image.every(step),
        owners: pixels.iter().map(|at| view.owners[*at]).collect(),
        exact_m: pixels.iter().map(|at| view.exact_m[*at]).collect(),
    }
}
