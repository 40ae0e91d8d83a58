//! What a depth sensor sees of a [`World`]: people with flesh and clothes in a room with walls and furniture, as an image of
//! distances with a real sensor's errors.
//!
//! ```
//! use posefuse_simulator::depth::DepthCamera;
//! use posefuse_simulator::{Scenario, World};
//!
//! let world = World::new(&Scenario::default())?;
//! let camera = DepthCamera::structured_light(320, 240);
//! let seen = world.depth_with_owners(0, 2.0, &camera);
//! assert!(seen.owners.contains(&1), "person 1 is in the image");
//! # Ok::<(), posefuse_simulator::WorldError>(())
//! ```

mod body;
mod build;
mod canvas;
mod hand;
mod noise;
mod retarget;
mod room;
mod shape;
#[cfg(test)]
mod tests;

use posefuse_skeleton::{
    DepthImage, Intrinsics, Joint, JointMap, Position, Room, Sensor, Transform,
};
use serde::{Deserialize, Serialize};

use crate::world::World;
use canvas::{Canvas, HAIR};

pub use build::{Build, hands_closed};
pub use noise::DepthNoise;
pub use retarget::retargeted;
pub use room::{Block, Walls};

/// A depth sensor's optics and errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthCamera {
    /// Size and focal lengths.
    pub intrinsics: Intrinsics,
    /// What it gets wrong.
    pub noise: DepthNoise,
}

impl DepthCamera {
    /// Kinect v1's view (57 x 43 degrees) and errors with this many pixels (640 x 480, or 320 x 240).
    pub fn structured_light(width: u32, height: u32) -> Self {
        Self {
            intrinsics: Intrinsics::from_view(
                width,
                height,
                57f64.to_radians(),
                43f64.to_radians(),
            ),
            noise: DepthNoise::structured_light(),
        }
    }

    /// Kinect v2's view (70.6 x 60 degrees) and errors with this many pixels (512 x 424).
    pub fn time_of_flight(width: u32, height: u32) -> Self {
        Self {
            intrinsics: Intrinsics::from_view(
                width,
                height,
                70.6f64.to_radians(),
                60f64.to_radians(),
            ),
            noise: DepthNoise::time_of_flight(),
        }
    }
}

/// Somebody in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Their number in [`DepthView::owners`], 1 to 127.
    pub number: u8,
    /// Their joints, room metres.
    pub joints: JointMap<Position<Room>>,
    /// Their looks.
    pub build: Build,
    /// How far the head is turned left, radians: joints do not tell.
    pub head_turn: f64,
    /// Whether the left and right hand is closed.
    pub hands_closed: [bool; 2],
}

/// People and things to look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The people.
    pub figures: Vec<Figure>,
    /// The room, if they are in one.
    pub walls: Option<Walls>,
    /// Things that stand about.
    pub blocks: Vec<Block>,
}

/// A depth image with what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthView {
    /// What the sensor gives.
    pub image: DepthImage,
    /// For each pixel the number of who is seen there, 0 for the room; also where the sensor has no distance.
    pub owners: Vec<u8>,
    /// For each pixel the exact distance along the optical axis, metres; infinite where nothing is.
    pub exact_m: Vec<f32>,
}

impl Scene {
    /// What the camera sees from where it is. `seed` chooses the errors of this one image.
    pub fn view(
        &self,
        room_from_sensor: &Transform<Room, Sensor>,
        camera: &DepthCamera,
        seed: u64,
    ) -> DepthView {
        let intrinsics = &camera.intrinsics;
        let mut canvas = Canvas::new(intrinsics);
        let sensor_from_room = room_from_sensor.inverse();
        if let Some(walls) = &self.walls {
            room::draw_walls(&mut canvas, walls, room_from_sensor);
        }
        for block in &self.blocks {
            room::draw_block(&mut canvas, block, &sensor_from_room);
        }
        let mut hair_holes = vec![0.0; usize::from(HAIR)];
        for figure in &self.figures {
            let owner = figure.number.clamp(1, HAIR - 1);
            hair_holes[usize::from(owner)] = figure.build.hair_holes as f32;
            let here = figure.joints.map(|_, p| sensor_from_room.apply(*p));
            let shapes = body::flesh(&here, &figure.build, figure.head_turn, figure.hands_closed);
            for (shape, flags) in shapes {
                canvas.draw(&shape, owner | flags);
            }
        }
        let millimetres = noise::measured(&canvas, &camera.noise, &hair_holes, seed);
        DepthView {
            image: DepthImage {
                width: intrinsics.width,
                height: intrinsics.height,
                millimetres,
            },
            owners: canvas.tags.iter().map(|tag| tag & !HAIR).collect(),
            exact_m: canvas.depth,
        }
    }
}

impl World {
    /// Everything there is to see at `seconds`. Who is who is as in [`World::truth`].
    pub fn scene(&self, seconds: f64) -> Scene {
        let seed = self.scenario().seed;
        let figure = |person: crate::TruePerson| {
            let index = person.id as usize - 1;
            Figure {
                number: person.id as u8,
                joints: person.joints,
                build: Build::seeded(seed, index),
                head_turn: build::head_turn(seed, index, seconds),
                hands_closed: hands_closed(seed, index, seconds),
            }
        };
        let (walls, blocks) = room::of_world(self);
        Scene {
            figures: self.truth(seconds).into_iter().map(figure).collect(),
            walls: Some(walls),
            blocks,
        }
    }

    /// What sensor `index` sees at `seconds` if it is such a camera.
    ///
    /// # Panics
    /// Here and below if `index` is not below [`World::sensor_count`].
    pub fn depth(&self, index: usize, seconds: f64, camera: &DepthCamera) -> DepthImage {
        self.depth_with_owners(index, seconds, camera).image
    }

    /// The same with what is true of each pixel.
    pub fn depth_with_owners(&self, index: usize, seconds: f64, camera: &DepthCamera) -> DepthView {
        let moment = (seconds * 1e9).round() as i64 as u64;
        let seed = self.scenario().seed ^ moment.rotate_left(20) ^ (index as u64) << 56;
        let pose = self.room_from_sensor(index);
        self.scene(seconds).view(&pose, camera, seed)
    }
}

impl DepthView {
    /// Whether the surface around a joint of person `number` is seen: at its place in the image, or right beside it, is this
    /// person's flesh, not further in front of the joint than flesh is thick there.
    ///
    /// `None` if the joint is out of the image.
    pub fn sees(
        &self,
        camera: &Intrinsics,
        number: u8,
        joint: Joint,
        at: &Position<Sensor>,
    ) -> Option<bool> {
        let [u, v] = camera.pixel(at)?.map(|pixel| pixel.round());
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        if !(0.0..width).contains(&u) || !(0.0..height).contains(&v) {
            return None;
        }
        let z = at.vector().z as f32;
        let near = (0.02 * camera.fx / f64::from(z)).clamp(0.0, 3.0);
        let mut seen = 0;
        for [du, dv] in [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let u = (u + du * near).clamp(0.0, width - 1.0) as usize;
            let v = (v + dv * near).clamp(0.0, height - 1.0) as usize;
            let pixel = v * camera.width as usize + u;
            let before = z - self.exact_m[pixel];
            if self.owners[pixel] == number && before < thickness_m(joint) {
                seen += 1;
            }
        }
        Some(seen >= 2)
    }
}

/// How far in front of a joint its own surface may be, metres.
fn thickness_m(joint: Joint) -> f32 {
    use Joint::*;
    match joint {
        SpineBase | SpineMid => 0.23,
        SpineShoulder | HipLeft | HipRight => 0.20,
        Head | Neck => 0.16,
        ShoulderLeft | ShoulderRight | KneeLeft | KneeRight => 0.13,
        _ => 0.10,
    }
}
