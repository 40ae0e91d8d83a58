//! What `posefuse-kinematics` makes of fused people, beside the people as fused and the truth.
//!
//! [`Variant`]s are ways to make a body of a person: as fused, bone by bone, fitted, and the fit with one of its functions
//! off. Each works on the same frames of a simulated room. A person's measures are learned from all of a track's frames, as
//! an export does. Joints that were not fused are not counted, so that all variants are judged by the same joints.

mod aims;
mod table;
mod tally;
mod trials;
mod variants;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_fusion::Input;
use posefuse_kinematics::{Body, Solver};
use posefuse_simulator::World;
use posefuse_skeleton::{
    Calibration, JointMap, Position, Room, RoomFrame, SensorIdError, Timestamp, Track, TrackId,
};

pub use table::{FIGURES, Figure, MENARD, menard_rows, rows};
pub use tally::{BodyFigures, BodyTally};
pub use trials::{BodiesError, BodiesReport, BodiesRoom, BodiesRow, Trials};
pub use variants::{AS_FUSED, SHIPS, Variant, variants};

use crate::compare::compare;
use crate::fuse::fuse;
use crate::judge::{Judge, Judged};
use crate::methods::Method;
use crate::room::SimulatedRoom;
use crate::truth::{SimulatedTruth, Truth};
use tally::{Bends, Sample};

/// What one variant came to.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Positions, as of any method.
    pub judged: Judged,
    /// What only bodies have.
    pub body: BodyTally,
}

/// A simulated room as fused by one method, ready for variants.
pub struct Fused {
    world: Arc<World>,
    truth: SimulatedTruth,
    from: Timestamp,
    seconds: f64,
    frames: Vec<RoomFrame>,
    bodies: BTreeMap<TrackId, Body>,
}

impl Fused {
    /// Fuses the first `seconds` of a room; the first `skip_s` of them are not judged.
    ///
    /// # Errors
    /// More sensors than a room may have.
    pub fn new(
        world: &Arc<World>,
        method: &Method,
        calibration: Calibration,
        seconds: f64,
        skip_s: f64,
    ) -> Result<Self, SensorIdError> {
        let mut frames = Vec::new();
        let first = (Timestamp::ZERO, Input::Calibration(Arc::new(calibration)));
        let inputs = std::iter::once(first).chain(SimulatedRoom::new(world, seconds)?);
        fuse(method, inputs, &mut |frame| frames.push(frame));
        let mut tracks: BTreeMap<TrackId, Vec<&Track>> = BTreeMap::new();
        for track in frames.iter().flat_map(|frame| &frame.tracks) {
            tracks.entry(track.id).or_default().push(track);
        }
        let learned = |(id, tracks): (TrackId, Vec<&Track>)| (id, Body::learn(tracks));
        Ok(Self {
            world: Arc::clone(world),
            truth: SimulatedTruth::new(world, seconds),
            from: SimulatedRoom::server_time(skip_s),
            seconds,
            bodies: tracks.into_iter().map(learned).collect(),
            frames,
        })
    }

    /// What this variant makes of it.
    pub fn judge(&self, variant: &Variant) -> Outcome {
        let mut judge = Judge::new(Some(&self.truth), self.from);
        let mut tally = BodyTally::default();
        let mut solvers: BTreeMap<TrackId, Solver> = BTreeMap::new();
        for frame in &self.frames {
            let mut frame = frame.clone();
            let mut bends: BTreeMap<TrackId, Bends> = BTreeMap::new();
            for track in &mut frame.tracks {
                let Some(config) = &variant.config else {
                    bends.insert(track.id, tally::bends(&positions(track)));
                    continue;
                };
                let solver = solvers
                    .entry(track.id)
                    .or_insert_with(|| Solver::new(&self.bodies[&track.id], config.clone()));
                let begun = Instant::now();
                let solved = solver.step(track, frame.time);
                tally.solved(begun.elapsed());
                let Some(solved) = solved else {
                    continue;
                };
                for (joint, state) in track.skeleton.iter_mut() {
                    if let Some(position) = solved.joints[joint] {
                        state.position = position;
                    }
                }
                bends.insert(track.id, tally::hinges(solver.rig(), &solved.pose));
            }
            if frame.time >= self.from {
                self.count(&frame, &bends, &mut tally);
            }
            judge.add(frame);
        }
        tally.end();
        let mut judged = judge.finish();
        judged.tally.live_s = self.seconds;
        Outcome {
            judged,
            body: tally,
        }
    }

    fn count(&self, frame: &RoomFrame, bends: &BTreeMap<TrackId, Bends>, tally: &mut BodyTally) {
        let Some(people) = self.truth.people(frame.time) else {
            return;
        };
        let seconds = SimulatedRoom::scenario_seconds(frame.time);
        for pair in compare(frame, &people).pairs {
            let person = people.iter().find(|person| person.id == pair.person);
            let track = frame.tracks.iter().find(|track| track.id == pair.track);
            let (Some(person), Some(track)) = (person, track) else {
                continue;
            };
            let index = (pair.person - 1) as usize;
            let performance = self.world.performance();
            tally.add(
                pair.person,
                Sample {
                    track: pair.track,
                    time: frame.time,
                    stands: performance.feet_standing(index, seconds),
                    bends: bends.get(&pair.track).copied().unwrap_or_default(),
                    true_bends: tally::bends(&person.joints),
                    joints: positions(track),
                    truth: person.joints.clone(),
                },
            );
        }
    }
}

fn positions(track: &Track) -> JointMap<Position<Room>> {
    track.skeleton.map(|_, state| state.position)
}

impl BodyTally {
    fn solved(&mut self, took: Duration) {
        self.busy_s += took.as_secs_f64();
        self.solved += 1;
    }
}
