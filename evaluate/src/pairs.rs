//! What occlusion models are asked in a simulated room, beside the truth: pairs that they can be trained on.
//!
//! The windows are those that the engine gives to a model outside, and nobody answers, so that nothing is made up and frames
//! are what sensors and filter make of them. The truth is the one that errors are measured against: displaced by the part
//! of the error that no sensor can see.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_fusion::{Input, Needs, RepairConfig, RepairModel, RepairRequest, Window};
use posefuse_simulator::World;
use posefuse_skeleton::{JointMap, Position, Room, RoomFrame, SensorIdError, Timestamp, TrackId};

use crate::compare::compare;
use crate::fuse::fuse_beside;
use crate::methods::Method;
use crate::room::{SimulatedRoom, perfect_calibration};
use crate::truth::{SimulatedTruth, Truth};

/// The name under which windows are asked for.
const ASKED: &str = "pairs";

/// A window that a model would have been asked to fill, and what is true.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// What the model gets; the pose to be filled is number [`Needs::before`].
    pub window: Window,
    /// Where the joints truly are.
    pub truth: JointMap<Position<Room>>,
    /// Where the frame has them without repair.
    pub plain: JointMap<Position<Room>>,
    /// By how many sensors each joint is truly seen; absent: none.
    pub seen: JointMap<u32>,
}

/// The windows of `needs` that `method`, which must not repair by itself, asks for in the first `seconds` of a room that is
/// perfectly calibrated; of each person every `every`th.
///
/// # Errors
/// More sensors than a room may have.
pub fn pairs(
    world: &Arc<World>,
    method: &Method,
    needs: Needs,
    seconds: f64,
    every: usize,
) -> Result<Vec<Pair>, SensorIdError> {
    let mut method = method.clone();
    method.config.repair = RepairConfig {
        model: ASKED.to_owned(),
        ..RepairConfig::default()
    };
    let offered = RepairModel {
        name: ASKED.to_owned(),
        needs,
    };
    let truth = SimulatedTruth::new(world, seconds);
    let calibration = Arc::new(perfect_calibration(world));
    let first = (Timestamp::ZERO, Input::Calibration(calibration));
    let inputs = std::iter::once(first)
        .chain(SimulatedRoom::new(world, seconds)?)
        .map(|(time, input)| (time, Ok(input)));
    let mut found = Vec::new();
    let asked = RefCell::new(Vec::<RepairRequest>::new());
    fuse_beside(
        &method,
        Some(offered),
        &mut |request| {
            asked.borrow_mut().push(request.clone());
            // An answer without any joint: nothing is made up.
            vec![JointMap::empty(); request.wanted.len()]
        },
        inputs,
        |_, _| {},
        &mut |frame| {
            // Frames come in order; what was asked for later ones waits.
            let mut asked = asked.borrow_mut();
            let own = asked.iter().filter(|request| request.time == frame.time);
            found.extend(own.filter_map(|request| pair(request, &frame, &truth)));
            asked.retain(|request| request.time > frame.time);
        },
    );
    let mut turns = BTreeMap::<TrackId, usize>::new();
    found.retain(|(track, _)| {
        let turn = turns.entry(*track).or_default();
        *turn += 1;
        (*turn).is_multiple_of(every.max(1))
    });
    Ok(found.into_iter().map(|(_, pair)| pair).collect())
}

/// `None` where nobody true is behind the track.
fn pair(
    request: &RepairRequest,
    frame: &RoomFrame,
    truth: &SimulatedTruth,
) -> Option<(TrackId, Pair)> {
    let people = truth.reported(frame.time)?;
    let paired = compare(frame, &people).pairs;
    let who = paired.iter().find(|pair| pair.track == request.track)?;
    let person = people.iter().find(|person| person.id == who.person)?;
    let track = frame.tracks.iter().find(|track| track.id == who.track)?;
    let sighted = truth.sighted(frame.time)?;
    let seen = sighted.iter().find(|seen| seen.person == who.person)?;
    let pair = Pair {
        window: request.window.clone(),
        truth: person.joints.clone(),
        plain: track.skeleton.map(|_, state| state.position),
        seen: seen.joints.clone(),
    };
    Some((track.id, pair))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::preset;
    use crate::suite::Setting;

    #[test]
    fn windows_end_with_what_the_frame_has_and_miss_something() {
        let scenario = Setting::named("desk2").unwrap().scenario;
        let world = Arc::new(World::new(&scenario).unwrap());
        let needs = Needs {
            before: 20,
            after: 0,
            rate_hz: 30.0,
        };
        let pairs = pairs(&world, &preset("kalman").unwrap(), needs, 6.0, 2).unwrap();
        assert!(pairs.len() > 10, "{}", pairs.len());
        for pair in &pairs {
            assert_eq!(pair.window.poses.len(), needs.poses());
            let newest = &pair.window.poses[needs.before];
            assert!(newest.iter().any(|joint| joint.weight < 1.0));
            for (joint, place) in pair.plain.iter() {
                let known = &newest[joint as usize];
                // Nothing was made up: the frame has what was measured.
                let off = (known.position - place.vector()).norm();
                assert!(known.weight == 0.0 || off < 1e-9, "{joint:?}: {off} m");
            }
            assert_eq!(pair.truth.len(), 25);
        }
        let hidden = pairs.iter().filter(|pair| pair.seen.len() < 25).count();
        assert!(2 * hidden > pairs.len(), "{hidden} of {}", pairs.len());
    }
}
