//! The files: numbers in the machine's (little-endian) order, one record after the other.
//!
//! A crop is 64 x 64 i16: the depth channel times 10000 where the person is seen, [`NOTHING`] where they are not, [`UNKNOWN`] where
//! nobody can tell. Its truth is [`TRUTH`] f32: 25 x 3 joints (crop axes, metres), 25 whether seen, 2 heading (sine, cosine),
//! 2 hands closed, distance of the middle, people in the scene, how upright the trunk is (cosine).

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use nalgebra::Vector3;
use posefuse_bodytrack::crop::{CropFrame, SIZE};
use posefuse_skeleton::{JOINT_COUNT, Joint, JointMap, Position, Sensor};

pub(crate) const NOTHING: i16 = i16::MAX;
pub(crate) const UNKNOWN: i16 = i16::MIN;
/// Numbers of a truth.
pub(crate) const TRUTH: usize = JOINT_COUNT * 4 + 7;
const UNITS: f32 = 10_000.0;

/// What is true of a crop.
pub(crate) struct Truth<'a> {
    pub(crate) frame: CropFrame,
    pub(crate) joints: &'a JointMap<Position<Sensor>>,
    pub(crate) visible: [bool; JOINT_COUNT],
    pub(crate) hands_closed: [bool; 2],
    pub(crate) people: usize,
}

pub(crate) struct Writer {
    crops: BufWriter<File>,
    truths: BufWriter<File>,
    written: usize,
}

impl Writer {
    pub(crate) fn create(out: &Path) -> io::Result<Self> {
        if let Some(folder) = out.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let file =
            |extension: &str| File::create(out.with_extension(extension)).map(BufWriter::new);
        Ok(Self {
            crops: file("crops")?,
            truths: file("truth")?,
            written: 0,
        })
    }

    pub(crate) fn written(&self) -> usize {
        self.written
    }

    pub(crate) fn put(&mut self, crop: &[f32], truth: &Truth<'_>) -> io::Result<()> {
        let Some(numbers) = truth.numbers() else {
            return Ok(());
        };
        let (depths, seen) = crop.split_at(SIZE * SIZE);
        for (depth, seen) in depths.iter().zip(seen) {
            let cell = match *seen {
                1.0 => (depth * UNITS).round() as i16,
                0.0 => NOTHING,
                _ => UNKNOWN,
            };
            self.crops.write_all(&cell.to_le_bytes())?;
        }
        for number in numbers {
            self.truths.write_all(&number.to_le_bytes())?;
        }
        self.written += 1;
        Ok(())
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.crops.flush()?;
        self.truths.flush()
    }
}

impl Truth<'_> {
    fn numbers(&self) -> Option<[f32; TRUTH]> {
        let mut numbers = Vec::with_capacity(TRUTH);
        let mut at = JointMap::<Position<Sensor>>::empty();
        for joint in Joint::ALL {
            let point = self.frame.to_crop(self.joints[joint]?);
            at[joint] = Some(Position::from_vector(Vector3::from(point)));
            numbers.extend(point);
        }
        numbers.extend(self.visible.map(f64::from));
        let way = |a: Joint, b: Joint| Some(at[b]?.vector() - at[a]?.vector());
        let up = way(Joint::SpineBase, Joint::SpineShoulder)?;
        let left =
            way(Joint::ShoulderRight, Joint::ShoulderLeft)? + way(Joint::HipRight, Joint::HipLeft)?;
        let ahead = left.cross(&up);
        let flat = ahead.x.hypot(ahead.z).max(1e-6);
        numbers.extend([ahead.x / flat, -ahead.z / flat]);
        numbers.extend(self.hands_closed.map(f64::from));
        let distance = self.frame.middle().vector().norm();
        numbers.extend([distance, self.people as f64, -up.normalize().y]);
        let numbers: Vec<f32> = numbers.into_iter().map(|n| n as f32).collect();
        numbers.try_into().ok()
    }
}
