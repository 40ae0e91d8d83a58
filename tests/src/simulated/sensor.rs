//! A simulated sensor for simulated time: computes ahead, says when frames are due, remembers what it captured.

use std::sync::{Arc, Mutex};

use nalgebra::Isometry3;
use posefuse_agent::source::SensorClock;
use posefuse_agent::{Clock, Description, SensorSource, SourceBody, SourceError, SourceFrame};
use posefuse_simulator::{SimBody, SimClock, SimSensor, World};
use posefuse_skeleton::{AgentTime, JointSet, Position, RawJoint};

/// A frame that a sensor gave to its agent.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturedFrame {
    /// The sensor's clock.
    pub captured: AgentTime,
    /// Who was in view.
    pub bodies: Vec<SourceBody>,
}

/// A sensor's frames in order; the agent numbers them from 0.
pub type Captures = Arc<Mutex<Vec<CapturedFrame>>>;

/// How a sensor has been moved from where the world has it, in its own axes; takes effect with its next frame.
pub(super) type Moved = Arc<Mutex<Option<Isometry3<f64>>>>;

/// One sensor of a simulated world, from now on.
pub(super) struct SimulatedSensor {
    sensor: SimSensor,
    clock: SimClock,
    epoch_ns: i64,
    until_ns: i64,
    last_due_ns: i64,
    captures: Captures,
    moved: Moved,
}

impl SimulatedSensor {
    /// Sensor `index`; it ends after `seconds`.
    pub(super) fn new(
        world: &Arc<World>,
        index: usize,
        clock: &dyn Clock,
        seconds: f64,
        captures: Captures,
        moved: Moved,
    ) -> Self {
        let epoch_ns = clock.monotonic_ns();
        Self {
            sensor: SimSensor::new(world.clone(), index),
            clock: world.sensor_clock(index),
            epoch_ns,
            until_ns: (seconds * 1e9) as i64,
            last_due_ns: epoch_ns,
            captures,
            moved,
        }
    }
}

impl SensorSource for SimulatedSensor {
    fn description(&self) -> Description {
        Description {
            model: "simulated Kinect v2".into(),
            joint_set: JointSet::KinectV2,
            camera: None,
        }
    }

    fn clock(&self) -> SensorClock {
        let (clock, epoch_ns) = (self.clock, self.epoch_ns);
        Arc::new(move |monotonic_ns| clock.shows(monotonic_ns - epoch_ns))
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        let frame = loop {
            if self.sensor.next_at_ns() >= self.until_ns {
                return Ok(None);
            }
            let frame = self.sensor.next_frame();
            if !frame.dropped {
                break frame;
            }
        };
        let due_ns = self.epoch_ns + frame.at_ns + frame.arrival_delay_ns.max(0);
        self.last_due_ns = self.last_due_ns.max(due_ns);
        let moved = *self.moved.lock().unwrap();
        let from_before = moved.map(|by| by.inverse());
        let body = |body: SimBody| SourceBody {
            tracking_id: body.tracking_id,
            joints: displaced(body.joints, from_before.as_ref()),
            orientations: Vec::new(),
            hands_closed: [None; 2],
        };
        let bodies: Vec<_> = frame.bodies.into_iter().map(body).collect();
        self.captures.lock().unwrap().push(CapturedFrame {
            captured: frame.captured,
            bodies: bodies.clone(),
        });
        Ok(Some(SourceFrame {
            captured: frame.captured,
            due_ns: Some(self.last_due_ns),
            bodies,
        }))
    }
}

/// The joints as a sensor sees them from its new place. What is in view stays as it was: it moves by centimetres.
fn displaced(
    mut joints: Vec<Option<RawJoint>>,
    from_before: Option<&Isometry3<f64>>,
) -> Vec<Option<RawJoint>> {
    if let Some(from_before) = from_before {
        for joint in joints.iter_mut().flatten() {
            joint.position = Position::from_point(from_before * joint.position.point());
        }
    }
    joints
}
