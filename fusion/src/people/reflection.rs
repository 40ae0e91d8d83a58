//! Images in a mirror: a candidate that is where, and as, a flat upright mirror would show somebody to all sensors
//! that see the candidate.
//!
//! Two people who face each other at ease look much the same. They are told from person and image by time: while the
//! person walks, the plane between the two stays where it is only if it is a mirror.

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use super::{People, TrackState};

/// Mean distance of an image's joints from where the plane puts them, up to which they fit: metres, and metres per
/// metre from the nearest sensor that sees the image.
const FITS_M: f64 = 0.06;
const FITS_PER_M: f64 = 0.022;
/// Further away than this from all who see it, where sensors see badly and people are rarely, it fits more easily: metres,
/// and how much more. Up to the second of these it may or may not fit.
const FAR_M: f64 = 4.5;
const FAR_FITS: [f64; 2] = [1.6, 2.6];
/// Nearer than this to a sensor, whoever several sensors see is no image, metres.
const SURE_M: f64 = 3.5;
/// A mirror that is known shows whose trunk is so near to where it would show somebody's, metres.
const SHOWN_M: f64 = 0.5;
/// Who is this far behind a mirror shows that there is none, metres.
const BEHIND_M: f64 = 0.3;
/// Fewest joints both need to have.
const MIN_JOINTS: usize = 8;
/// Person and image are at least this far apart, metres.
const APART_M: f64 = 0.7;
/// Planes are the same up to this angle (cosine) and distance, metres.
const SAME_COSINE: f64 = 0.94;
const SAME_M: f64 = 0.35;
/// A plane that stood still while the person moved this far is a mirror, metres.
const PROVEN_M: f64 = 0.45;
/// Without proof a suspect waits this long, and one far away, ns.
const PATIENCE_NS: [i64; 2] = [10_000_000_000, 30_000_000_000];
/// One far away of which it was never clear whether it fits waits this long, ns.
const UNCLEAR_NS: i64 = 2_000_000_000;
/// Looks one after the other that must not fit before a suspect is cleared.
const CLEARED_AFTER: u32 = 10;
/// Mirrors that are remembered.
const MAX_MIRRORS: usize = 4;
/// Who was not seen for this long has no image, ns.
const FRESH_NS: i64 = 400_000_000;

/// An upright plane: points with `normal . point = offset_m`, the normal towards the images.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plane {
    normal: Vector3<f64>,
    offset_m: f64,
}

/// What speaks for a candidate being an image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Suspicion {
    /// The plane as first found, and where the person was then.
    first: Option<(Plane, Vector3<f64>, Timestamp)>,
    misfits: u32,
    cleared: bool,
}

/// What the candidate's pose says.
enum Likeness {
    /// It is as the mirror would show whoever is there.
    Fits(Plane, Vector3<f64>),
    /// It may be: too little is seen, and from too far.
    Unclear,
    Differs,
}

impl Plane {
    /// How far `point` is on the images' side, metres.
    fn beyond(&self, point: Vector3<f64>) -> f64 {
        self.normal.dot(&point) - self.offset_m
    }

    fn image(&self, point: Vector3<f64>) -> Vector3<f64> {
        point - self.normal * (2.0 * self.beyond(point))
    }

    /// `near` is where the planes are compared.
    fn is_like(&self, other: &Self, near: Vector3<f64>) -> bool {
        let apart_m = (self.beyond(near) - other.beyond(near)).abs();
        self.normal.dot(&other.normal) > SAME_COSINE && apart_m < SAME_M
    }
}

impl People {
    /// Whether candidate number `index` is to be taken for somebody's image at `time`.
    pub(super) fn is_image(
        &mut self,
        index: usize,
        time: Timestamp,
        suspicion: &mut Suspicion,
    ) -> bool {
        let far = self.is_far(index, time);
        let seeing = self.tracks[index].sensors_since(time.plus_ns(-FRESH_NS));
        if seeing.len() > 1 && self.away_m(index, time) < SURE_M {
            // Nobody hangs a mirror where several sensors see all of somebody in it.
            return false;
        }
        if self.is_shown(index, time) {
            return true;
        }
        if suspicion.cleared {
            return false;
        }
        let (plane, person) = match self.likeness(index, time, far, suspicion) {
            Likeness::Fits(plane, person) => (plane, person),
            Likeness::Unclear => {
                let waits_ns = time.since_ns(match &suspicion.first {
                    Some((.., since)) => *since,
                    None => self.tracks[index].since,
                });
                let never = suspicion.first.is_none();
                return waits_ns < if never { UNCLEAR_NS } else { PATIENCE_NS[1] };
            }
            Likeness::Differs => {
                suspicion.misfits += 1;
                suspicion.cleared = suspicion.first.is_none() || suspicion.misfits >= CLEARED_AFTER;
                return !suspicion.cleared;
            }
        };
        suspicion.misfits = 0;
        let (first, was, since) = *suspicion.first.get_or_insert((plane, person, time));
        let mirrors = &mut self.births.mirrors;
        if mirrors.iter().any(|mirror| mirror.is_like(&plane, person)) {
            return true;
        }
        if (person - was).norm() > PROVEN_M {
            if mirrors.len() == MAX_MIRRORS {
                mirrors.remove(0);
            }
            mirrors.push(first);
            return true;
        }
        time.since_ns(since) < PATIENCE_NS[usize::from(far)]
    }

    /// Whether a known mirror shows somebody where candidate number `index` is.
    fn is_shown(&self, index: usize, time: Timestamp) -> bool {
        let Some(there) = self.tracks[index].trunk() else {
            return false;
        };
        let fresh =
            |track: &&TrackState| track.id.is_some() && time.since_ns(track.last_seen) <= FRESH_NS;
        let trunks = self.tracks.iter().filter(fresh);
        trunks.filter_map(TrackState::trunk).any(|trunk| {
            let mut mirrors = self.births.mirrors.iter();
            mirrors.any(|mirror| (mirror.image(trunk) - there).norm() < SHOWN_M)
        })
    }

    /// How far track number `index` is from the nearest sensor that sees it, metres.
    fn away_m(&self, index: usize, time: Timestamp) -> f64 {
        let Some(there) = self.tracks[index].trunk() else {
            return f64::INFINITY;
        };
        let seeing = self.tracks[index].sensors_since(time.plus_ns(-FRESH_NS));
        let from = |sensor: SensorId| self.eyes.get(sensor.index()).copied().flatten();
        seeing
            .iter()
            .filter_map(from)
            .map(|eye| (there - eye.origin).norm())
            .fold(f64::INFINITY, f64::min)
    }

    fn is_far(&self, index: usize, time: Timestamp) -> bool {
        let away_m = self.away_m(index, time);
        away_m.is_finite() && away_m > FAR_M
    }

    /// Whether candidate number `index` is as a mirror would show anybody, the one that is suspected if there is one.
    fn likeness(
        &self,
        index: usize,
        time: Timestamp,
        far: bool,
        suspicion: &Suspicion,
    ) -> Likeness {
        let mut likeness = Likeness::Differs;
        for other in (0..self.tracks.len()).filter(|&other| other != index) {
            match self.likeness_to(index, other, time, far) {
                Likeness::Fits(plane, person) => {
                    let first = suspicion.first.as_ref();
                    if first.is_none_or(|(first, ..)| first.is_like(&plane, person)) {
                        return Likeness::Fits(plane, person);
                    }
                }
                Likeness::Unclear => likeness = Likeness::Unclear,
                Likeness::Differs => {}
            }
        }
        likeness
    }

    /// Whether a mirror would show track number `other` as number `index`.
    fn likeness_to(&self, index: usize, other: usize, time: Timestamp, far: bool) -> Likeness {
        let (image, person) = (&self.tracks[index], &self.tracks[other]);
        let origins = self.eyes.iter().flatten().map(|eye| eye.origin);
        if time.since_ns(person.last_seen) > FRESH_NS || origins.clone().next().is_none() {
            return Likeness::Differs;
        }
        let Some((off_m, plane)) = mirror_between(person, image) else {
            let few = image.pose.iter().flatten().count() < MIN_JOINTS;
            return if far && few {
                Likeness::Unclear
            } else {
                Likeness::Differs
            };
        };
        // Sensors are in the room, and so is everybody who is no image.
        let mut beyond = origins.map(|origin| plane.beyond(origin));
        if beyond.any(|beyond_m| beyond_m > 0.0) || self.is_peopled(&plane) {
            return Likeness::Differs;
        }
        let fits_m = FITS_M + FITS_PER_M * self.away_m(index, time).min(2.0 * FAR_M);
        let [fits, may_fit] = if far { FAR_FITS } else { [1.0; 2] };
        match person.trunk() {
            Some(trunk) if off_m < fits * fits_m => Likeness::Fits(plane, trunk),
            Some(_) if off_m < may_fit * fits_m => Likeness::Unclear,
            _ => Likeness::Differs,
        }
    }

    /// Whether somebody is behind `plane`.
    fn is_peopled(&self, plane: &Plane) -> bool {
        let people = self.tracks.iter().filter(|track| track.id.is_some());
        people
            .filter_map(TrackState::trunk)
            .any(|trunk| plane.beyond(trunk) > BEHIND_M)
    }

    /// Forgets mirrors that somebody has walked through.
    pub(super) fn forget_mirrors(&mut self) {
        let mut mirrors = std::mem::take(&mut self.births.mirrors);
        mirrors.retain(|plane| !self.is_peopled(plane));
        self.births.mirrors = mirrors;
    }
}

/// The upright mirror that would show `person` as `image`, and how far its joints are from that, metres.
fn mirror_between(person: &TrackState, image: &TrackState) -> Option<(f64, Plane)> {
    let both = |mirrored: bool| {
        Joint::ALL.into_iter().filter_map(move |joint| {
            let partner = if mirrored { joint.mirrored() } else { joint };
            let a = person.pose[partner as usize].as_ref()?.position;
            let b = image.pose[joint as usize].as_ref()?.position;
            Some((a, b))
        })
    };
    let count = both(true).count();
    if count < MIN_JOINTS {
        return None;
    }
    let misfit = |mirrored: bool| {
        let (mut a, mut b) = (Vector3::zeros(), Vector3::zeros());
        for (p, i) in both(mirrored) {
            a += p / count as f64;
            b += i / count as f64;
        }
        let across = Vector3::new(b.x - a.x, b.y - a.y, 0.0);
        if across.norm() < APART_M {
            return None;
        }
        let normal = across.normalize();
        let offset_m = normal.dot(&((a + b) * 0.5));
        let plane = Plane { normal, offset_m };
        let off = both(mirrored).map(|(p, i)| (plane.image(p) - i).norm().min(1.0));
        Some((off.sum::<f64>() / count as f64, plane))
    };
    [misfit(true)?, misfit(false)?]
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
}
