//! What the solver takes: everything each sensor saw of the walk, in its own optical axes, on the server's clock.

use posefuse_skeleton::{Body, Confidence, JointMap, JointSet, Position, Sensor, Timestamp};
use serde::{Deserialize, Serialize};

/// A walk as all sensors of a room saw it. The order of the sensors does not matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Walk {
    /// One entry per sensor, each name once.
    pub sensors: Vec<SensorWalk>,
}

/// A walk as one sensor saw it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorWalk {
    /// The sensor's name, unique in the room.
    pub name: String,
    /// The joint set its tracker sends, `None` where nobody said: then its joints are taken to be those of the room's
    /// most common set.
    #[serde(default)]
    pub joint_set: Option<JointSet>,
    /// Its frames; order and doubles do not matter.
    pub frames: Vec<WalkFrame>,
}

/// One frame: every body the sensor saw at `time`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkFrame {
    /// Capture time on the server's clock.
    pub time: Timestamp,
    /// The bodies; empty where nobody was seen.
    pub bodies: Vec<WalkBody>,
}

/// One body: what calibration needs of a [`Body`], at a quarter of its size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkBody {
    /// The sensor's own id for this person.
    pub tracking_id: u64,
    /// The joints that were seen.
    pub joints: JointMap<WalkJoint>,
}

/// One joint as the sensor's tracker placed it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkJoint {
    /// Where, metres, optical axes.
    pub position: Position<Sensor>,
    /// How much the tracker trusts it.
    pub confidence: Confidence,
}

impl Walk {
    /// The entry of the sensor called `name`, made if it is not there yet.
    pub fn sensor_mut(&mut self, name: &str) -> &mut SensorWalk {
        let index = self.sensors.iter().position(|s| s.name == name);
        let index = index.unwrap_or_else(|| {
            self.sensors.push(SensorWalk {
                name: name.to_owned(),
                ..SensorWalk::default()
            });
            self.sensors.len() - 1
        });
        &mut self.sensors[index]
    }
}

impl WalkFrame {
    /// The frame that `bodies` make at `time`.
    pub fn new(time: Timestamp, bodies: &[Body]) -> Self {
        Self {
            time,
            bodies: bodies.iter().map(WalkBody::from).collect(),
        }
    }
}

impl From<&Body> for WalkBody {
    fn from(body: &Body) -> Self {
        Self {
            tracking_id: body.tracking_id,
            joints: body.skeleton.map(|_, state| WalkJoint {
                position: state.position,
                confidence: state.confidence,
            }),
        }
    }
}
