//! Counting what went into a take, for its list entry; the same when recording and when recovering.

use std::collections::BTreeSet;

use posefuse_fusion::Input;

use crate::{Event, Recorded, TakeInfo};

/// What has been seen of a take so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) frames: u64,
    people: usize,
    sensors: BTreeSet<String>,
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
        if let Input::Sensor(info) = input {
            self.sensors.insert(info.name.clone());
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
        info.sensors = self.sensors.iter().cloned().collect();
        let duration = self.latest_unix_ns.saturating_sub(start_unix_ns);
        info.duration_ns = i64::try_from(duration).unwrap_or(i64::MAX);
    }
}
