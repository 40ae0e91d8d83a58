//! The sensors of this server run: a name gets its number once, and has at most one live stream.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use posefuse_fusion::Input;
use posefuse_proto::{PROTOCOL, check_sensor_name, v1};
use posefuse_skeleton::{JointSet, SensorId, SensorInfo};
use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::depth;
use super::sensor::{Live, Sensor};
use crate::Clock;
use crate::fusion_thread::Inputs;

/// How long a stream that is taken over may take to end.
const TAKE_OVER: Duration = Duration::from_secs(1);
/// Longest texts an agent may give about itself, bytes.
const MAX_TEXT: usize = 128;

/// The sensors, in the order of their first greeting.
#[derive(Debug, Default)]
pub(crate) struct Registry {
    sensors: Mutex<Vec<Arc<Sensor>>>,
}

/// A stream's hold on its sensor. Dropping it lets go.
#[derive(Debug)]
pub(crate) struct Joined {
    pub(crate) sensor: Arc<Sensor>,
    pub(crate) joint_set: JointSet,
    pub(crate) last_sequence: Option<u64>,
    /// Another stream of the same agent wants to take over, or the server stops.
    pub(crate) cancel: CancellationToken,
    gone: CancellationToken,
}

impl Drop for Joined {
    fn drop(&mut self) {
        self.sensor.set_connected(false);
        self.sensor.greeting().live = None;
        self.gone.cancel();
        tracing::info!(sensor = %self.sensor.name(), "an agent left");
    }
}

impl Registry {
    /// Every sensor that ever greeted.
    pub(crate) fn sensors(&self) -> Vec<Arc<Sensor>> {
        self.lock().clone()
    }

    /// What a sensor is called; empty: there is none of this number.
    pub(crate) fn name(&self, sensor: SensorId) -> String {
        let sensors = self.lock();
        let found = sensors.get(sensor.index());
        found.map_or_else(String::new, |sensor| sensor.name().to_owned())
    }

    /// The sensor of this name, if one ever greeted.
    pub(crate) fn named(&self, name: &str) -> Option<Arc<Sensor>> {
        let sensors = self.lock();
        sensors.iter().find(|sensor| sensor.name() == name).cloned()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Arc<Sensor>>> {
        self.sensors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes in an agent, or says why not. The engine hears of the sensor before any of its frames.
    pub(crate) async fn join(
        &self,
        hello: &v1::Hello,
        inputs: &Inputs,
        clock: &dyn Clock,
        stop: &CancellationToken,
    ) -> Result<Joined, Status> {
        let joint_set = check(hello)?;
        loop {
            let sensor = self.sensor(hello, joint_set)?;
            let gone = match claim(&sensor, hello, joint_set, stop)? {
                Claim::Joined(joined) => {
                    announce(&joined, inputs).await?;
                    return Ok(joined);
                }
                Claim::Wait(gone) => gone,
            };
            tokio::select! {
                () = gone.cancelled() => {}
                () = clock.sleep(TAKE_OVER) => {
                    return Err(Status::unavailable(format!(
                        "the previous stream of `{}` has not ended yet; try again", hello.sensor
                    )));
                }
            }
        }
    }

    fn sensor(&self, hello: &v1::Hello, joint_set: JointSet) -> Result<Arc<Sensor>, Status> {
        let mut sensors = self.lock();
        if let Some(known) = sensors.iter().find(|sensor| sensor.name() == hello.sensor) {
            return Ok(known.clone());
        }
        let id = SensorId::new(sensors.len())
            .map_err(|error| Status::resource_exhausted(error.to_string()))?;
        let sensor = Arc::new(Sensor::new(info(id, hello, joint_set)));
        sensors.push(sensor.clone());
        Ok(sensor)
    }
}

enum Claim {
    /// It is ours.
    Joined(Joined),
    /// An earlier stream of the same agent has been told to end.
    Wait(CancellationToken),
}

fn claim(
    sensor: &Arc<Sensor>,
    hello: &v1::Hello,
    joint_set: JointSet,
    stop: &CancellationToken,
) -> Result<Claim, Status> {
    let mut greeting = sensor.greeting();
    if let Some(live) = &greeting.live {
        if live.run_id != hello.run_id {
            return Err(Status::already_exists(format!(
                "another agent is connected as `{}`: stop it, or start this one with another name",
                hello.sensor
            )));
        }
        live.cancel.cancel();
        return Ok(Claim::Wait(live.gone.clone()));
    }
    let (cancel, gone) = (stop.child_token(), CancellationToken::new());
    greeting.live = Some(Live {
        run_id: hello.run_id,
        cancel: cancel.clone(),
        gone: gone.clone(),
    });
    if greeting.run_id != hello.run_id {
        greeting.run_id = hello.run_id;
        greeting.last_sequence = None;
        greeting.health = None;
    }
    greeting.agent_version = hello.agent_version.clone();
    greeting.camera = depth::sane(hello.camera);
    let previews = greeting.camera.is_some_and(|camera| camera.depth_preview);
    sensor.depth().greeted(previews);
    greeting.last_refusal = None;
    greeting.info = info(sensor.id(), hello, joint_set);
    sensor.set_connected(true);
    Ok(Claim::Joined(Joined {
        sensor: sensor.clone(),
        joint_set,
        last_sequence: greeting.last_sequence,
        cancel,
        gone,
    }))
}

/// Tells the engine of a sensor that is new or has other properties than it was told.
async fn announce(joined: &Joined, inputs: &Inputs) -> Result<(), Status> {
    let info = {
        let greeting = joined.sensor.greeting();
        if greeting.announced.as_ref() == Some(&greeting.info) {
            return Ok(());
        }
        greeting.info.clone()
    };
    inputs.send(Input::Sensor(info.clone())).await?;
    joined.sensor.greeting().announced = Some(info);
    Ok(())
}

fn info(id: SensorId, hello: &v1::Hello, joint_set: JointSet) -> SensorInfo {
    SensorInfo {
        id,
        name: hello.sensor.clone(),
        model: hello.model.clone(),
        joint_set,
    }
}

fn check(hello: &v1::Hello) -> Result<JointSet, Status> {
    if hello.protocol != PROTOCOL {
        return Err(Status::failed_precondition(format!(
            "this server speaks protocol version {PROTOCOL}, the agent {}: use an agent of the same release",
            hello.protocol
        )));
    }
    check_sensor_name(&hello.sensor)
        .map_err(|error| Status::invalid_argument(error.to_string()))?;
    for (field, text) in [
        ("model", &hello.model),
        ("agent_version", &hello.agent_version),
    ] {
        if text.len() > MAX_TEXT {
            return Err(Status::invalid_argument(format!(
                "`{field}` has {} bytes, at most {MAX_TEXT} are taken",
                text.len()
            )));
        }
    }
    hello
        .joint_set
        .parse()
        .map_err(|error: posefuse_skeleton::UnknownJointSet| {
            Status::invalid_argument(error.to_string())
        })
}
