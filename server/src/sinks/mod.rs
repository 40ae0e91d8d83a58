//! Where the fusion thread's results go. Each sink has a bounded queue of its own; a full one loses its own messages,
//! counted, and delays nobody.

mod meter;
mod subscriber;

use std::sync::Arc;

use bytes::Bytes;
use posefuse_fusion::Input;
use posefuse_proto::{observation_to_wire, room_frame_to_wire};
use posefuse_sinks::Civil;
use posefuse_skeleton::{Observation, RoomFrame, SensorId, Timestamp};
use prost::Message;
use serde::{Deserialize, Serialize};

pub(crate) use meter::{Counters, Meter};
pub(crate) use posefuse_sinks::{FramePace, Pace};
pub(crate) use subscriber::{Subscriber, place, subscribe};

use crate::room::{TimecodeConfig, stamp};

/// What subscribers get. Section `[watch]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Subscribers to fused and to raw frames at once, together; further ones are refused.
    pub max_subscribers: usize,
    /// Messages that may wait for one subscriber; beyond, it loses the newest.
    pub queue: usize,
    /// A subscriber that has taken nothing for so long is cut, milliseconds.
    pub cut_after_ms: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            max_subscribers: 256,
            queue: 128,
            cut_after_ms: 5000,
        }
    }
}

/// A subscriber to sensors' frames.
#[derive(Debug)]
pub(crate) struct SensorSubscriber {
    pub(crate) subscriber: Subscriber,
    /// The sensors it wants; empty: all.
    pub(crate) names: Vec<String>,
    /// One pace for each sensor, by number.
    pub(crate) paces: Vec<Pace>,
}

/// The subscribers. Recording and calibration have sinks of their own.
#[derive(Debug)]
pub(crate) struct Subscribers {
    frames: Vec<(Subscriber, FramePace)>,
    sensors: Vec<SensorSubscriber>,
    names: Vec<String>,
    counters: Arc<Counters>,
    timecode: TimecodeConfig,
}

impl Subscribers {
    pub(crate) fn new(counters: Arc<Counters>, timecode: TimecodeConfig) -> Self {
        Self {
            frames: Vec::new(),
            sensors: Vec::new(),
            names: vec![String::new(); SensorId::MAX_SENSORS],
            counters,
            timecode,
        }
    }

    pub(crate) fn add_watch(&mut self, subscriber: Subscriber, pace: FramePace) {
        self.frames.push((subscriber, pace));
    }

    pub(crate) fn add_watch_sensors(&mut self, subscriber: SensorSubscriber) {
        self.sensors.push(subscriber);
    }

    /// Lets go of subscribers that are gone: one that is never offered anything would stay for ever.
    pub(crate) fn forget_gone(&mut self) {
        self.frames.retain(|(subscriber, _)| !subscriber.is_gone());
        self.sensors.retain(|wanting| !wanting.subscriber.is_gone());
    }

    /// Hands a sensor's frame to whoever wants it; encodes it at most once.
    pub(crate) fn input(&mut self, input: &Input, now: Timestamp) {
        match input {
            Input::Sensor(info) => self.names[info.id.index()].clone_from(&info.name),
            Input::Observation(observation) if !self.sensors.is_empty() => {
                self.observation(observation, now);
            }
            _ => {}
        }
    }

    fn observation(&mut self, observation: &Observation, now: Timestamp) {
        let sensor = observation.sensor.index();
        let name = &self.names[sensor];
        let meter = &self.counters.watch_sensors;
        let mut encoded: Option<Bytes> = None;
        self.sensors.retain_mut(|wanting| {
            let wanted = wanting.names.is_empty() || wanting.names.contains(name);
            if !wanted || !wanting.paces[sensor].is_due(observation.received) {
                return true;
            }
            let bytes = encoded
                .get_or_insert_with(|| observation_to_wire(observation).encode_to_vec().into());
            wanting.subscriber.offer(bytes, now, meter)
        });
    }

    /// When a frame is for the world.
    pub(crate) fn civil(&self, frame: &RoomFrame, unix_offset_ns: i64) -> Civil {
        let unix_ns = frame.time.ns().saturating_add(unix_offset_ns);
        Civil {
            unix_offset_ns,
            timecode: self.timecode.at(unix_ns).at(unix_ns).to_string(),
        }
    }

    /// Hands a fused frame to every subscriber; encodes it at most once. `unix_offset_ns` is civil time minus the frame's
    /// clock.
    pub(crate) fn frame(&mut self, frame: &RoomFrame, now: Timestamp, unix_offset_ns: i64) {
        if self.frames.is_empty() {
            return;
        }
        let unix_ns = frame.time.ns().saturating_add(unix_offset_ns);
        let mut wire = room_frame_to_wire(frame);
        stamp(&mut wire, unix_ns, Some(self.timecode.at(unix_ns)));
        let bytes: Bytes = wire.encode_to_vec().into();
        let meter = &self.counters.watch;
        self.frames.retain_mut(|(subscriber, pace)| {
            !pace.is_due(frame) || subscriber.offer(&bytes, now, meter)
        });
    }
}
