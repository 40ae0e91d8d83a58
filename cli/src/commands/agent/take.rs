//! A sensor of a recorded take as a source: its frames again, stamped as they were, paced by when they came in.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use posefuse_agent::{
    Clock, Description, Parts, SensorSource, SourceBody, SourceError, SourceFrame,
    source::SensorClock,
};
use posefuse_fusion::Input;
use posefuse_skeleton::{AgentTime, Body, Joint, JointSet, Observation, RawJoint, SensorId};

use crate::takes_folder::{Located, TakesFolder};

/// Which take, and which of its sensors.
#[derive(Debug, Args)]
pub(crate) struct TakeArgs {
    /// The take: its name or its file
    take: PathBuf,
    /// Which of its sensors; also the name unless --name says another
    #[arg(long, value_name = "SENSOR")]
    pub(super) sensor: String,
    /// How many times faster than recorded
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed)]
    speed: f64,
    /// Begin again at the end, for ever
    #[arg(long = "loop")]
    repeat: bool,
    #[command(flatten)]
    takes: TakesFolder,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text
        .parse::<f64>()
        .ok()
        .filter(|speed| (0.01..=1000.0).contains(speed));
    speed.ok_or_else(|| "expected a factor between 0.01 and 1000".to_owned())
}

impl TakeArgs {
    /// Reads the sensor's frames.
    pub(super) fn open(&self, parts: &Parts) -> anyhow::Result<Box<dyn SensorSource>> {
        let take = self.takes.find(&self.take)?;
        let recorded = read(&take, &self.sensor)?;
        Ok(Box::new(TakeSource::new(
            recorded,
            self.speed,
            self.repeat,
            parts.clock.as_ref(),
        )))
    }
}

/// What a take holds of one sensor.
struct RecordedSensor {
    model: String,
    frames: Vec<Observation>,
}

fn read(take: &Located, sensor: &str) -> anyhow::Result<RecordedSensor> {
    let reader = take.open()?;
    let (mut names, mut found): (Vec<String>, Option<(SensorId, String)>) = (Vec::new(), None);
    let mut frames = Vec::new();
    let (_, preamble) = reader.beginning()?;
    for input in preamble.into_iter().map(Ok).chain(reader.inputs()) {
        match input? {
            Input::Sensor(info) => {
                if info.name == sensor {
                    found = Some((info.id, info.model));
                }
                names.push(info.name);
            }
            Input::Observation(observation) => {
                if found
                    .as_ref()
                    .is_some_and(|(id, _)| *id == observation.sensor)
                {
                    frames.push(observation);
                }
            }
            _ => {}
        }
    }
    names.sort();
    names.dedup();
    let Some((_, model)) = found else {
        bail!(
            "take `{}` has no sensor `{sensor}`; its sensors are {}",
            take.name,
            names.join(", ")
        );
    };
    if frames.is_empty() {
        bail!("take `{}` has no frame of sensor `{sensor}`", take.name);
    }
    Ok(RecordedSensor { model, frames })
}

/// A recorded sensor, paced by the agent's clock.
struct TakeSource {
    recorded: RecordedSensor,
    speed: f64,
    repeat: bool,
    /// The agent's clock when the first frame is due.
    start_ns: i64,
    /// Server time of the first frame, and of the last one with the pause to the next round.
    first_received_ns: i64,
    round_ns: i64,
    /// The shortest way from a capture to the server, in the mixed clocks of both: taken for the clocks' offset.
    server_minus_sensor_ns: i64,
    next: usize,
    round: i64,
}

impl TakeSource {
    fn new(recorded: RecordedSensor, speed: f64, repeat: bool, clock: &dyn Clock) -> Self {
        let received = |o: &Observation| o.received.ns();
        let first = recorded.frames.first().map_or(0, received);
        let last = recorded.frames.last().map_or(first, received);
        let pause = (last - first) / (recorded.frames.len() as i64 - 1).max(1);
        let delays = recorded
            .frames
            .iter()
            .map(|o| o.received.ns().saturating_sub(o.captured.ns()));
        Self {
            server_minus_sensor_ns: delays.min().unwrap_or(0),
            start_ns: clock.monotonic_ns(),
            first_received_ns: first,
            round_ns: (last - first + pause).max(1),
            next: 0,
            round: 0,
            recorded,
            speed,
            repeat,
        }
    }
}

impl SensorSource for TakeSource {
    fn description(&self) -> Description {
        // A take holds canonical joints, whatever the sensor's own set was.
        Description {
            model: self.recorded.model.clone(),
            joint_set: JointSet::KinectV2,
        }
    }

    fn clock(&self) -> SensorClock {
        let (start, speed) = (self.start_ns, self.speed);
        let sensor_start = self
            .first_received_ns
            .saturating_sub(self.server_minus_sensor_ns);
        Arc::new(move |monotonic_ns: i64| {
            let since = (monotonic_ns.saturating_sub(start) as f64 * speed).round() as i64;
            AgentTime::from_ns(sensor_start.saturating_add(since))
        })
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        if self.next == self.recorded.frames.len() {
            if !self.repeat {
                return Ok(None);
            }
            (self.next, self.round) = (0, self.round + 1);
        }
        let frame = &self.recorded.frames[self.next];
        self.next += 1;
        let gone_round = self.round.saturating_mul(self.round_ns);
        let since_first = frame.received.ns() - self.first_received_ns + gone_round;
        Ok(Some(SourceFrame {
            captured: frame.captured.plus_ns(gone_round),
            due_ns: Some(
                self.start_ns
                    .saturating_add((since_first as f64 / self.speed).round() as i64),
            ),
            bodies: frame.bodies.iter().map(source_body).collect(),
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
    let orientation = |joint: Joint| {
        let rotation = body.orientations.as_ref()?[joint].as_ref()?;
        Some([rotation.i, rotation.j, rotation.k, rotation.w].map(|v| v as f32))
    };
    SourceBody {
        tracking_id: body.tracking_id,
        joints: Joint::ALL.into_iter().map(joint).collect(),
        orientations: match body.orientations {
            Some(_) => Joint::ALL
                .into_iter()
                .map(|j| orientation(j).unwrap_or([0.0; 4]))
                .collect(),
            None => Vec::new(),
        },
    }
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::Timestamp;

    use super::*;

    struct Fixed(i64);

    impl Clock for Fixed {
        fn monotonic_ns(&self) -> i64 {
            self.0
        }
        fn unix_ns(&self) -> i64 {
            0
        }
    }

    fn recorded() -> RecordedSensor {
        let frame = |sequence: u64| Observation {
            sensor: SensorId::new(0).unwrap(),
            sequence,
            captured: AgentTime::from_ns(1_000 + sequence as i64 * 100),
            // The second one was 30 ns slower on its way.
            received: Timestamp::from_ns(
                9_000 + sequence as i64 * 100 + [0, 30, 0][sequence as usize],
            ),
            bodies: Vec::new(),
        };
        RecordedSensor {
            model: "x".into(),
            frames: (0..3).map(frame).collect(),
        }
    }

    #[test]
    fn frames_come_as_they_came_and_the_clock_agrees_with_their_stamps() {
        let mut source = TakeSource::new(recorded(), 2.0, true, &Fixed(500));
        let clock = source.clock();
        let frames: Vec<_> = (0..4)
            .map(|_| source.next_frame().unwrap().unwrap())
            .collect();
        let due: Vec<i64> = frames.iter().map(|f| f.due_ns.unwrap()).collect();
        assert_eq!(due, [500, 565, 600, 650]);
        // Stamps agree with the clock that answers probes, but for what the frame was late.
        assert_eq!(clock(due[0]), frames[0].captured);
        assert_eq!(clock(due[1]).since_ns(frames[1].captured), 30);
        assert_eq!(
            clock(due[3]),
            frames[3].captured,
            "the second round goes on where the first ended"
        );
    }

    #[test]
    fn it_ends_unless_told_to_repeat() {
        let mut source = TakeSource::new(recorded(), 1.0, false, &Fixed(0));
        assert_eq!(
            std::iter::from_fn(|| source.next_frame().unwrap()).count(),
            3
        );
    }
}
