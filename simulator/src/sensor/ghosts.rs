//! False people: furniture that is taken for somebody who sits, and what is seen in a mirror.

use nalgebra::Vector3;
use posefuse_skeleton::{JointMap, Position, Room, Sensor, Transform};

use super::spell::Spells;
use crate::motion::{BodyShape, sitting_still};
use crate::random::{Purpose, Stream};
use crate::scenario::{Layout, Scenario};

/// How long furniture is taken for a person, seconds.
const FURNITURE_S: [f64; 2] = [2.0, 5.0];
/// The piece of furniture stands this far within the area's edge, metres.
const FURNITURE_WITHIN_M: f64 = 0.15;
/// The mirror hangs this far outside of the area, opposite an arc, and between two sensors of a ring so that neither is
/// behind it; half its width, its height, metres.
const MIRROR_OUTSIDE_M: [f64; 2] = [0.9, 1.3];
const MIRROR_HALF_M: f64 = 0.6;
const MIRROR_HEIGHT_M: f64 = 2.0;

/// The piece of furniture that one sensor mistakes.
pub(crate) struct Furniture {
    spells: Spells,
    joints: JointMap<Position<Sensor>>,
}

impl Furniture {
    pub(crate) fn new(
        scenario: &Scenario,
        sensor: usize,
        sensor_from_room: &Transform<Sensor, Room>,
    ) -> Self {
        let tags = [sensor as u64];
        let mut stream = Stream::new(scenario.seed, Purpose::Furniture, &tags);
        // Across the room from the sensor, where it sees all of it.
        let from = sensor_from_room.inverse().origin().vector();
        let angle = from.y.atan2(from.x) + std::f64::consts::PI + stream.between(-0.9, 0.9);
        let radius = 0.5 * scenario.area_m - FURNITURE_WITHIN_M;
        let place = [radius * angle.cos(), radius * angle.sin(), angle + 3.1];
        let shape = BodyShape::of_height(stream.between(1.3, 1.8));
        Self {
            spells: Spells {
                seed: scenario.seed,
                purpose: Purpose::FurnitureSeen,
                sensor: sensor as u64,
                per_min: scenario.errors.furniture_per_min,
                length_s: FURNITURE_S,
            },
            joints: sitting_still(&shape, place).map(|_, p| sensor_from_room.apply(*p)),
        }
    }

    /// The number of the false sighting at `seconds` and where its joints are, if there is one.
    pub(crate) fn at(&self, seconds: f64) -> Option<(u64, &JointMap<Position<Sensor>>)> {
        let (number, _) = self.spells.at(seconds)?;
        Some((number, &self.joints))
    }
}

/// A flat mirror on a wall.
pub(crate) struct Mirror {
    centre: Vector3<f64>,
    /// Into the room, unit vector.
    normal: Vector3<f64>,
    eye: Vector3<f64>,
}

impl Mirror {
    /// The room's mirror as the sensor sees it: where no sensor stands, opposite an arc, between two of a ring.
    pub(crate) fn new(scenario: &Scenario, sensor_from_room: &Transform<Sensor, Room>) -> Self {
        let [opposite, between] = MIRROR_OUTSIDE_M;
        let (angle, outside_m) = match scenario.layout {
            Layout::Arc => (std::f64::consts::PI, opposite),
            Layout::Ring => (
                std::f64::consts::PI / scenario.sensors.max(2) as f64,
                between,
            ),
        };
        let outwards = Vector3::new(angle.cos(), angle.sin(), 0.0);
        Self {
            centre: outwards * (0.5 * scenario.area_m + outside_m),
            normal: -outwards,
            eye: sensor_from_room.inverse().origin().vector(),
        }
    }

    /// The joints' images, room metres: those that the sensor sees in the mirror. Left and right are as a tracker
    /// names them that believes in the image: its left hand is the left one of who would stand there.
    pub(crate) fn image(&self, joints: &JointMap<Position<Room>>) -> JointMap<Position<Room>> {
        let before = |p: Vector3<f64>| (p - self.centre).dot(&self.normal);
        if before(self.eye) <= 0.0 {
            return JointMap::empty();
        }
        joints.filter_map(|joint, _| {
            let position = joints[joint.mirrored()]?.vector();
            let depth = before(position);
            let image = position - self.normal * (2.0 * depth);
            let share = before(self.eye) / (before(self.eye) + depth);
            let crossing = self.eye + (image - self.eye) * share;
            let aside = Vector3::z()
                .cross(&self.normal)
                .dot(&(crossing - self.centre));
            let seen = depth > 0.0
                && aside.abs() <= MIRROR_HALF_M
                && (0.0..=MIRROR_HEIGHT_M).contains(&crossing.z);
            seen.then(|| Position::from_vector(image))
        })
    }
}
