//! Replays one sensor of a recorded take.
//!
//! A take holds what the server got: canonical joints, stamped by the sensor's clock and by the server's. Frames are
//! handed on in the rhythm in which the server got them, the shortest way of the take counting as none. Where the
//! sensor's clock stepped (its agent was started anew), that is counted afresh.

use std::path::{Path, PathBuf};

use posefuse_session::{DiskStorage, TakeError, TakeReader};
use posefuse_skeleton::{Body, Confidence, Joint, JointSet, Observation, RawJoint, SensorInfo};
use serde::{Deserialize, Serialize};

use super::replay::{RecordedFrame, Replay, ReplayConfig, Tape};
use super::{Description, SourceBody, SourceError};
use crate::Clock;

/// A way that is longer or shorter by this than the one of the frame before means that the clock stepped.
const STEP_NS: i64 = 5_000_000_000;

/// Which take, which of its sensors, and how to replay it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TakeConfig {
    /// The take's file, `NAME.mcap`.
    pub file: PathBuf,
    /// The name of the sensor in the take.
    pub sensor: String,
    /// How to play it.
    #[serde(default)]
    pub replay: ReplayConfig,
}

impl TakeConfig {
    /// Real time, once, at once.
    pub fn new(file: impl Into<PathBuf>, sensor: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            sensor: sensor.into(),
            replay: ReplayConfig::default(),
        }
    }
}

/// Reads through the take once and makes its sensor a source.
pub(crate) fn open(
    config: &TakeConfig,
    clock: &dyn Clock,
) -> Result<Replay<TakeTape>, SourceError> {
    config.replay.check("take")?;
    let tape = TakeTape::open(&config.file, &config.sensor)?;
    Replay::start(tape, config.replay, false, clock)
}

/// One sensor of a take, read as it is played: memory stays bounded by a chunk of the file.
pub(crate) struct TakeTape {
    reader: TakeReader,
    sensor: SensorInfo,
    observations: Box<dyn Iterator<Item = Result<Observation, TakeError>> + Send>,
    shape: Shape,
    /// Where the present frame stands in `shape.ways`.
    way: usize,
    played: u64,
}

/// What one pass over the sensor's frames tells.
struct Shape {
    /// First and last frame of any sensor, server time.
    begins_ns: i64,
    last_ns: i64,
    /// From the frame of this number on, the sensor's clock is behind the server's by this much.
    ways: Vec<(u64, i64)>,
}

impl TakeTape {
    fn open(file: &Path, sensor: &str) -> Result<Self, SourceError> {
        let name = file
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default();
        let folder = file
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let storage = DiskStorage::for_reading(folder.unwrap_or(Path::new(".")));
        let reader = TakeReader::open(&storage, name).map_err(broken)?;
        let sensors = reader.sensors().map_err(broken)?;
        let known = sensors
            .iter()
            .map(|info| info.name.as_str())
            .collect::<Vec<_>>()
            .join(", ");
        let found = sensors
            .into_iter()
            .find(|info| info.name == sensor)
            .ok_or_else(|| {
                SourceError::Final(format!(
                    "take `{name}` has no sensor `{sensor}`; there are {known}"
                ))
            })?;
        let shape = Shape::of(&reader, &found)?.ok_or_else(|| {
            SourceError::Final(format!("take `{name}` has no frame of sensor `{sensor}`"))
        })?;
        let observations = Box::new(reader.observations());
        Ok(Self {
            reader,
            sensor: found,
            observations,
            shape,
            way: 0,
            played: 0,
        })
    }
}

fn broken(error: TakeError) -> SourceError {
    SourceError::Final(error.to_string())
}

impl Shape {
    /// `None` if the sensor has no frame.
    fn of(reader: &TakeReader, sensor: &SensorInfo) -> Result<Option<Self>, SourceError> {
        let (mut begins_ns, mut last_ns) = (i64::MAX, i64::MIN);
        let (mut ways, mut frames, mut before) = (Vec::<(u64, i64)>::new(), 0, None);
        for observation in reader.observations() {
            let observation = observation.map_err(broken)?;
            let received_ns = observation.received.ns();
            (begins_ns, last_ns) = (begins_ns.min(received_ns), last_ns.max(received_ns));
            if observation.sensor != sensor.id {
                continue;
            }
            let way_ns = received_ns.saturating_sub(observation.captured.ns());
            let stepped = before
                .is_none_or(|last: i64| way_ns.saturating_sub(last).saturating_abs() > STEP_NS);
            match ways.last_mut() {
                Some((_, shortest)) if !stepped => *shortest = way_ns.min(*shortest),
                _ => ways.push((frames, way_ns)),
            }
            before = Some(way_ns);
            frames += 1;
        }
        Ok((frames > 0).then_some(Self {
            begins_ns,
            last_ns,
            ways,
        }))
    }
}

impl Tape for TakeTape {
    fn description(&self) -> Description {
        // A take holds canonical joints, whatever the sensor's own joint set was.
        Description {
            model: self.sensor.model.clone(),
            joint_set: JointSet::KinectV2,
            camera: None,
        }
    }

    fn span_ns(&self) -> (i64, i64) {
        (self.shape.begins_ns, self.shape.last_ns + 33_333_333)
    }

    fn sensor_origin_ns(&self) -> i64 {
        let way_ns = self.shape.ways.first().map_or(0, |(_, way_ns)| *way_ns);
        self.shape.begins_ns.saturating_sub(way_ns)
    }

    fn rewind(&mut self) {
        self.observations = Box::new(self.reader.observations());
        (self.way, self.played) = (0, 0);
    }

    fn next(&mut self) -> Result<Option<RecordedFrame>, SourceError> {
        let own = self.observations.find(|observation| {
            observation
                .as_ref()
                .map_or(true, |observation| observation.sensor == self.sensor.id)
        });
        let Some(observation) = own.transpose().map_err(broken)? else {
            return Ok(None);
        };
        while self
            .shape
            .ways
            .get(self.way + 1)
            .is_some_and(|(from, _)| *from <= self.played)
        {
            self.way += 1;
        }
        self.played += 1;
        let way_ns = self
            .shape
            .ways
            .get(self.way)
            .map_or(0, |(_, way_ns)| *way_ns);
        Ok(Some(RecordedFrame {
            delivered_ns: observation.received.ns(),
            captured_ns: observation.captured.ns().saturating_add(way_ns),
            bodies: observation.bodies.iter().map(source_body).collect(),
        }))
    }
}

fn source_body(body: &Body) -> SourceBody {
    let joint = |joint: Joint| {
        let state = body.skeleton[joint].as_ref()?;
        Some(RawJoint {
            position: state.position,
            confidence: state.confidence,
        })
    };
    let orientations = body.orientations.as_ref().map(|orientations| {
        let xyzw = |joint: Joint| {
            let quaternion = orientations[joint].as_ref()?;
            Some([quaternion.i, quaternion.j, quaternion.k, quaternion.w].map(|v| v as f32))
        };
        Joint::ALL
            .into_iter()
            .map(|joint| xyzw(joint).unwrap_or_default())
            .collect()
    });
    SourceBody {
        tracking_id: body.tracking_id,
        joints: Joint::ALL.into_iter().map(joint).collect(),
        orientations: orientations.unwrap_or_default(),
        hands_closed: body.hands_closed.map(|closed| closed.map(Confidence::get)),
    }
}

#[cfg(test)]
mod tests;
