//! Where the sensors of a simulated room stand, as a calibration from a walk finds.
//!
//! A walk fixes where sensors stand to each other and the floor, but the room's origin and heading are anyone's
//! choice. To compare with the truth, the solved room is laid over the true one as a whole, by the sensors' places.

use std::sync::Arc;

use anyhow::Context;
use posefuse_calibration::{Options, PointPair, Solution, kabsch, solve};
use posefuse_evaluate::SimulatedRoom;
use posefuse_fusion::Config;
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{Calibration, Position, Room, Sensor, Transform};

use super::{WalkTap, now_rfc3339};

/// Points by which rooms are laid over each other, in a sensor's own frame: the sensor, and where people walk.
const MARKS: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 3.0],
    [1.0, 0.0, 3.0],
    [0.0, 1.0, 3.0],
];

/// Solves from one person's walk of `seconds` in the same room. `progress` hears the seconds that are done. The
/// verdict may be any; a room that cannot be solved at all is an error.
pub(crate) fn from_simulated_walk(
    world: &World,
    seconds: f64,
    config: &Config,
    progress: &mut dyn FnMut(f64),
) -> anyhow::Result<Solution> {
    let alone = Scenario {
        people: 1,
        ..world.scenario().clone()
    };
    let walk_world = Arc::new(World::new(&alone)?);
    let room = SimulatedRoom::new(&walk_world, seconds)?;
    let mut tap = WalkTap::new(room.sensors(), config.clone());
    for (time, input) in room {
        tap.add(&input);
        progress(SimulatedRoom::scenario_seconds(time).max(0.0));
    }
    let options = Options {
        created: now_rfc3339(),
        ..Options::default()
    };
    let solution = solve(&tap.walk(), &options);
    let mut solution = solution.context("the simulated walk gives no calibration")?;
    lay_over(&mut solution.calibration, world)?;
    Ok(solution)
}

fn lay_over(calibration: &mut Calibration, world: &World) -> anyhow::Result<()> {
    let mut pairs: Vec<PointPair<Room, Room>> = Vec::new();
    for index in 0..world.sensor_count() {
        let Some(pose) = calibration.sensors.get(world.sensor_name(index)) else {
            continue;
        };
        let truth: Transform<Room, Sensor> = world.room_from_sensor(index);
        for [x, y, z] in MARKS {
            let mark = Position::new(x, y, z);
            pairs.push(PointPair {
                to: truth.apply(mark),
                from: pose.room_from_sensor.apply(mark),
                weight: 1.0,
            });
        }
    }
    let true_from_solved = kabsch(&pairs)
        .context("the solved room cannot be laid over the true one")?
        .to_from_from;
    for pose in calibration.sensors.values_mut() {
        pose.room_from_sensor = true_from_solved.then(&pose.room_from_sensor);
    }
    Ok(())
}
