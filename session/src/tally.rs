//! Counting what went into a take, for its list entry; the same when recording and when recovering.

use std::collections::{BTreeMap, BTreeSet};

use posefuse_fusion::Input;
use posefuse_skeleton::SensorId;

use crate::{Event, Recorded, TakeInfo};

/// What has been seen of a take so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) frames: u64,
    people: usize,
    /// Everybody who greeted.
    names: BTreeMap<SensorId, String>,
    /// Who delivered.
    sensors: BTreeSet<SensorId>,
    latest_unix_ns: u64,
    dropped_inputs: u64,
    dropped_outputs: u64,
}

impl Tally {
    /// Counts a message; `time` is its log time, ns since 1970.
    pub(crate) fn count(&mut self, unix_ns: u64, message: &Recorded) {
        self.latest_unix_ns = self.latest_unix_ns.max(unix_ns);
        match message {
            Recorded::Input(input) => self.count_input(input),
            Recorded::Frame(frame) => self.count_frame(frame.tracks.len()),
            Recorded::Event(event) => self.count_event(event),
            _ => {}
        }
    }

    pub(crate) fn count_time(&mut self, unix_ns: u64) {
        self.latest_unix_ns = self.latest_unix_ns.max(unix_ns);
    }

    pub(crate) fn count_input(&mut self, input: &Input) {
        match input {
            Input::Sensor(info) => {
                self.names.insert(info.id, info.name.clone());
            }
            Input::Observation(observation) => {
                self.sensors.insert(observation.sensor);
            }
            _ => {}
        }
    }

    pub(crate) fn count_frame(&mut self, people: usize) {
        self.frames += 1;
        self.people = self.people.max(people);
    }

    pub(crate) fn count_event(&mut self, event: &Event) {
        let dropped = match event.kind.as_str() {
            Event::INPUTS_DROPPED => &mut self.dropped_inputs,
            Event::OUTPUTS_DROPPED => &mut self.dropped_outputs,
            _ => return,
        };
        *dropped = dropped.saturating_add(event.count);
    }

    /// Writes what was counted into a list entry; `start_unix_ns` is when the take began.
    pub(crate) fn tell(&self, start_unix_ns: u64, info: &mut TakeInfo) {
        info.frames = self.frames;
        info.dropped = self.dropped_inputs;
        info.dropped_outputs = self.dropped_outputs;
        info.people = u32::try_from(self.people).unwrap_or(u32::MAX);
        let names = self.sensors.iter().filter_map(|id| self.names.get(id));
        info.sensors = names.cloned().collect();
        info.sensors.sort_unstable();
        let duration = self.latest_unix_ns.saturating_sub(start_unix_ns);
        info.duration_ns = i64::try_from(duration).unwrap_or(i64::MAX);
    }
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::{AgentTime, JointSet, Observation, SensorInfo, Timestamp};

    use super::*;

    #[test]
    fn a_take_names_the_sensors_that_delivered() {
        let mut tally = Tally::default();
        for (number, name) in [(0, "right"), (1, "ghost"), (2, "left")] {
            tally.count_input(&Input::Sensor(SensorInfo {
                id: SensorId::new(number).unwrap(),
                name: name.to_owned(),
                model: String::new(),
                joint_set: JointSet::KinectV2,
            }));
        }
        for number in [0, 2] {
            tally.count_input(&Input::Observation(Observation {
                sensor: SensorId::new(number).unwrap(),
                sequence: 0,
                captured: AgentTime::from_ns(0),
                received: Timestamp::ZERO,
                bodies: Vec::new(),
            }));
        }
        let mut info = TakeInfo::default();
        tally.tell(0, &mut info);
        assert_eq!(info.sensors, ["left", "right"]);
    }
}
