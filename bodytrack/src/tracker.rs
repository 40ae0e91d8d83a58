//! The tracker: from one depth image to the next.

use posefuse_models::{RunError, Runtime};
use posefuse_skeleton::{DepthImage, Intrinsics, Joint, Position};

use crate::background::Background;
use crate::checks::{check_camera, check_config, check_image};
use crate::claims::Claims;
use crate::confidence::confidence;
use crate::crop::CropFrame;
use crate::estimate::Estimate;
use crate::flesh::Flesh;
use crate::floor::{Floor, Level};
use crate::grip::Grips;
use crate::lens::{Lens, V3};
use crate::looks::{fits, is_convincing, is_dull, is_sure, measured, torso};
use crate::people::{People, candidates};
use crate::segments::Segments;
use crate::sight::Sight;
use crate::steps::{Step, Steps};
use crate::{Facing, TrackedBody, TrackerConfig, TrackerError};

/// Of somebody who is seen, at least this is, square metres.
const SEEN_M2: f32 = 0.03;
/// Cosine from which on somebody faces the sensor, or turns their back to it.
const FRONT: f32 = 0.5;

/// Follows the people in one sensor's depth images.
pub struct BodyTracker {
    config: TrackerConfig,
    camera: Intrinsics,
    sight: Sight,
    grips: Grips,
    scene: Scene,
    people: People,
    segments: Segments,
    claims: Claims,
    /// The id of each owner number, of the last image.
    told: Vec<u64>,
    last_ns: Option<i64>,
    steps: Steps,
}

/// What is known of the place, and the image at hand.
struct Scene {
    lens: Lens,
    floor: Floor,
    background: Background,
    thin: DepthImage,
}

impl Scene {
    fn new(config: &TrackerConfig, camera: &Intrinsics) -> Self {
        let lens = Lens::new(camera, config.width, config.range_m);
        Self {
            background: Background::new(&lens),
            floor: Floor::default(),
            thin: DepthImage::empty(lens.camera.width, lens.camera.height),
            lens,
        }
    }
}

impl BodyTracker {
    /// A tracker for images of this camera.
    ///
    /// # Errors
    /// A setting or the camera cannot be, or the network cannot be used.
    pub fn new(config: TrackerConfig, camera: Intrinsics) -> Result<Self, TrackerError> {
        check_config(&config)?;
        check_camera(&camera)?;
        Ok(Self {
            sight: Sight::open(&config)?,
            grips: Grips::open(&config)?,
            scene: Scene::new(&config, &camera),
            people: People::default(),
            segments: Segments::default(),
            claims: Claims::default(),
            told: Vec::new(),
            last_ns: None,
            steps: Steps::default(),
            config,
            camera,
        })
    }

    /// Goes on with another camera, as when the sensor was unplugged and came back in another mode: everything about the
    /// scene is forgotten, but no id is given again.
    ///
    /// # Errors
    /// The camera cannot be.
    pub fn change_camera(&mut self, camera: Intrinsics) -> Result<(), TrackerError> {
        check_camera(&camera)?;
        self.scene = Scene::new(&self.config, &camera);
        self.people.clear();
        (self.camera, self.last_ns) = (camera, None);
        Ok(())
    }

    /// Its settings.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// What runs its network.
    pub fn runtime(&self) -> &Runtime {
        self.sight.network().runtime()
    }

    /// What the last image cost, step by step.
    pub fn steps(&self) -> &Steps {
        &self.steps
    }

    /// The id of whom each pixel of the last image belongs to, after thinning; 0 for nobody who was told of.
    pub fn owners(&self) -> impl Iterator<Item = u64> {
        let id = |owner: &u8| self.told.get(usize::from(*owner)).copied().unwrap_or(0);
        self.claims.owners.iter().map(id)
    }

    /// The camera of thinned images, as [`BodyTracker::owners`] speaks of.
    pub fn thinned(&self) -> &Intrinsics {
        &self.scene.lens.camera
    }

    /// Everybody in an image that was caught at `at_ns`, by a clock that need not be right but should be even. In the order of
    /// their ids.
    ///
    /// # Errors
    /// The image is not the camera's, or the network fails. The next image may be tracked all the same.
    pub fn track(
        &mut self,
        image: &DepthImage,
        at_ns: i64,
    ) -> Result<Vec<TrackedBody>, TrackerError> {
        check_image(&self.camera, image)?;
        // A clock that went back is begun anew: what is known of the scene stays.
        if self.last_ns.is_some_and(|last| at_ns < last) {
            self.people.clear();
        }
        let before_ns = self.last_ns.replace(at_ns);
        self.steps.begin();
        self.look(image);
        self.steps.end(Step::Surfaces);
        let lost = self.assign(before_ns, at_ns);
        self.steps.end(Step::People);
        let (frames, seen) = self.cut(&lost, at_ns);
        self.steps.end(Step::Crops);
        let estimates = self.sight.run(&frames)?;
        self.steps.end(Step::Network);
        let settled = self.take_in(&seen, estimates, at_ns);
        self.learn_of_hands(image, &settled, at_ns)?;
        self.steps.end(Step::Hands);
        let bodies = self.bodies(&settled, at_ns);
        self.learn(at_ns);
        self.steps.end(Step::Learning);
        Ok(bodies)
    }

    /// Thins the image and finds the surfaces in it.
    fn look(&mut self, image: &DepthImage) {
        let Scene {
            lens,
            floor,
            background,
            thin,
        } = &mut self.scene;
        lens.thin(image, &mut thin.millimetres);
        floor.update(lens, &thin.millimetres);
        background.look(lens, &thin.millimetres);
        let level = floor.level();
        self.segments
            .find(lens, &level, background, &thin.millimetres);
    }

    /// Gives each surface to whom it belongs. Says who was lost and not found again.
    fn assign(&mut self, before_ns: Option<i64>, at_ns: i64) -> Vec<bool> {
        let level = self.scene.floor.level();
        for track in &mut self.people.tracks {
            track.expect(&level, at_ns);
        }
        let tracks = &self.people.tracks;
        // Only who was seen in the image before takes surfaces: who is hidden would take those of who hides them.
        let mut lost: Vec<bool> = tracks
            .iter()
            .map(|track| Some(track.seen_ns) != before_ns)
            .collect();
        let shapes: Vec<(u8, &Flesh)> = (1u8..)
            .zip(tracks)
            .zip(&lost)
            .filter(|(_, lost)| !**lost)
            .map(|((number, track), _)| (number, &track.flesh))
            .collect();
        let groups = self.claims.take(&level, &self.segments, &shapes);
        let back = self.people.find_again(&groups, at_ns, &lost);
        for &(number, at) in &back {
            self.claims.give(&groups[at], number as u8 + 1);
            lost[number] = false;
        }
        let Scene { lens, thin, .. } = &self.scene;
        self.claims
            .draw(lens, &self.segments, &thin.millimetres, &shapes);
        let groups = groups.into_iter().enumerate();
        let strange = groups.filter(|(at, _)| back.iter().all(|(_, taken)| taken != at));
        for candidate in strange.flat_map(|(_, group)| candidates(&level, group)) {
            self.people
                .begin(&candidate, &level, self.config.people, at_ns);
            if lost.len() < self.people.tracks.len() {
                lost.push(true);
            }
        }
        lost
    }

    /// Cuts out everybody of whom enough is seen; gives the crops' frames and whose they are, with their surface's middle.
    fn cut(&mut self, lost: &[bool], at_ns: i64) -> (Vec<CropFrame>, Vec<(usize, V3)>) {
        let (mut frames, mut seen) = (Vec::new(), Vec::new());
        let owners = &self.claims.owners;
        for number in (0..lost.len()).filter(|&number| !lost[number]) {
            let owner = number as u8 + 1;
            let samples = self.claims.samples(&self.segments, owner);
            let Some((extent, area_m2, middle)) = measured(&self.segments, samples) else {
                continue;
            };
            if area_m2 < SEEN_M2 {
                continue;
            }
            let track = &mut self.people.tracks[number];
            if track.rests() {
                track.see(middle, track.joints, at_ns);
                continue;
            }
            let Scene { lens, thin, .. } = &self.scene;
            let belongs = |pixel: usize| owners[pixel] == owner;
            if let Some(frame) = self.sight.cut(thin, &lens.camera, extent, belongs) {
                frames.push(frame);
                seen.push((number, middle));
            }
        }
        (frames, seen)
    }

    /// Takes in what the network said of those who are seen; gives what it says of those who have an id.
    fn take_in(
        &mut self,
        seen: &[(usize, V3)],
        estimates: Vec<Option<Estimate>>,
        at_ns: i64,
    ) -> Vec<(usize, Estimate)> {
        let Scene {
            lens,
            floor,
            background,
            ..
        } = &self.scene;
        let level = floor.level();
        let mut settled: Vec<(usize, Estimate)> = Vec::new();
        for (&(number, surface), estimate) in seen.iter().zip(estimates) {
            let track = &mut self.people.tracks[number];
            let points = self.claims.samples(&self.segments, number as u8 + 1);
            let fits = |found: &Estimate| fits(found, points);
            let Some(mut estimate) = estimate.filter(fits) else {
                track.see(surface, None, at_ns);
                track.rest(number);
                continue;
            };
            // Something else may move, too, but does not look like a person to the network.
            if track.id == 0 && is_sure(&estimate) {
                let counts = background.alive(lens, &self.claims.owners, number as u8 + 1);
                track.judge(counts, is_convincing(&estimate));
            } else if is_dull(&estimate) {
                track.rest(number);
            }
            track.settle(&level, &mut estimate, at_ns);
            track.see(torso(&estimate), Some(estimate.joints), at_ns);
            settled.push((number, estimate));
        }
        self.people.name(self.config.people);
        self.told.clear();
        self.told.push(0);
        let ids = self.people.tracks.iter().map(|track| track.id);
        self.told.extend(ids);
        settled.retain(|(number, _)| self.people.tracks[*number].id > 0);
        settled
    }

    /// Looks at the hands of those who have an id.
    fn learn_of_hands(
        &mut self,
        image: &DepthImage,
        settled: &[(usize, Estimate)],
        at_ns: i64,
    ) -> Result<(), RunError> {
        for (number, found) in settled {
            self.grips.look(image, &self.camera, *number, found);
        }
        for (number, side, logit) in self.grips.run()? {
            self.people.tracks[number].hands[side].take(logit, at_ns);
        }
        Ok(())
    }

    fn bodies(&self, settled: &[(usize, Estimate)], at_ns: i64) -> Vec<TrackedBody> {
        let level = self.scene.floor.level();
        let mut bodies: Vec<TrackedBody> = settled
            .iter()
            .map(|(number, found)| self.body(*number, found, &level, at_ns))
            .collect();
        bodies.sort_by_key(|body| body.id);
        bodies
    }

    fn body(&self, number: usize, found: &Estimate, level: &Level, at_ns: i64) -> TrackedBody {
        let track = &self.people.tracks[number];
        let joint = |joint: Joint| {
            let index = joint as usize;
            let at = Position::from_vector(found.joints[index].cast());
            let trust = confidence(found.sigma_m[index], found.visible[index]);
            (joint, (at, trust))
        };
        let towards = track.heading.towards_sensor(level, &track.middle);
        TrackedBody {
            id: track.id,
            joints: Joint::ALL.into_iter().map(joint).collect(),
            facing: towards.map(|cosine| match cosine {
                cosine if cosine > FRONT => Facing::Front,
                cosine if cosine < -FRONT => Facing::Back,
                _ => Facing::Side,
            }),
            hands_closed: track.hands.map(|hand| hand.closed(at_ns)),
        }
    }

    /// Learns the background, and that what has stood still all along is a part of it.
    fn learn(&mut self, at_ns: i64) {
        let Scene {
            lens,
            background,
            thin,
            ..
        } = &mut self.scene;
        let owners = &self.claims.owners;
        background.learn(lens, &thin.millimetres, owners, at_ns);
        let still: Vec<bool> = std::iter::once(false)
            .chain(
                self.people
                    .tracks
                    .iter()
                    .map(|track| track.is_furniture(at_ns)),
            )
            .collect();
        if still.contains(&true) {
            background.absorb(|pixel| still[usize::from(owners[pixel])]);
            let mut numbers = still[1..].iter();
            self.people.tracks.retain(|_| numbers.next() != Some(&true));
        }
        self.people.forget(lens, at_ns);
    }
}
