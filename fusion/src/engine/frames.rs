//! Frames: made when they are due, held back while fusing looks ahead, sent through the stages and repair.

use std::collections::VecDeque;

use posefuse_skeleton::{RoomFrame, Timestamp};

use super::{Engine, MAX_FRAMES_PER_INPUT, State, put};
use crate::Output;
use crate::repair::{Circumstances, Outlet, Repair, RepairRequest};
use crate::stages::Pipeline;

impl Engine {
    /// Whether frames go on though no sensor says anything: somebody is there, or left just now.
    pub(super) fn must_go_on(&self, now: Timestamp) -> bool {
        let time = self.state.newest.unwrap_or(now);
        self.state.peopled || self.state.people.anyone(time, &self.config.associate)
    }

    pub(super) fn make_frames(&mut self) {
        let Some(now) = self.state.now else {
            return;
        };
        for _ in 0..MAX_FRAMES_PER_INPUT {
            let anyone = self.must_go_on(now);
            let Some(time) = self.state.intake.due(now, anyone, &self.config.intake) else {
                return;
            };
            self.make_frame(time, now);
        }
    }

    fn make_frame(&mut self, time: Timestamp, now: Timestamp) {
        let sensors = &mut self.state.sensors;
        let tracks =
            self.state
                .people
                .frame(time, &self.origins, &self.config, |sensor, residual_m| {
                    if let Some(Some(sensor)) = sensors.get_mut(sensor.index()) {
                        sensor.add_residual(residual_m);
                    }
                });
        let trusted = self.config.fuse.min_confidence;
        (self.comparer).look(time, &self.state.people, &self.state.sensors, trusted);
        self.keep_account(time);
        for id in self.state.people.take_flipped() {
            self.state.pipeline.restart(id);
            self.repair(|repair, at, out| repair.restart(Some(id), at, out));
        }
        self.known.clear();
        self.known.extend(self.state.people.ids());
        self.known.sort_unstable();
        self.state.pipeline.retain(&self.known);
        self.state.repair.retain(&self.known);

        self.state.peopled = !tracks.is_empty();
        self.state.newest = Some(time);
        let frame = RoomFrame {
            number: 0,
            time,
            look_ahead_ns: 0,
            tracks,
        };
        self.state.held.push_back(frame);
        self.release_ready();
        // Nobody is there: nothing is left to wait for, and perhaps nothing will come.
        if !self.must_go_on(now) {
            self.release(0);
            self.give(|pipeline, give| pipeline.flush(give));
            self.repair(Repair::flush);
        }
    }

    /// Notes each sensor's part in the frame of `time`.
    fn keep_account(&mut self, time: Timestamp) {
        let elapsed_s = self
            .state
            .newest
            .map_or(0.0, |last| time.since_seconds(last));
        let sensors = &mut self.state.sensors;
        for sensor in sensors.iter_mut().flatten() {
            sensor.ledger.forget(elapsed_s);
        }
        for part in self.state.people.parts() {
            if let Some(Some(sensor)) = sensors.get_mut(part.sensor.index()) {
                sensor.ledger.add(part);
            }
        }
    }

    /// Sends the frames held back on, looked back at from the present, but for the newest `keep`.
    pub(super) fn release(&mut self, keep: usize) {
        let State { held, people, .. } = &mut self.state;
        let ready = held.len().saturating_sub(keep);
        people.look_back(&mut held.make_contiguous()[..ready]);
        for _ in 0..ready {
            if let Some(frame) = self.state.held.pop_front() {
                self.give(|pipeline, give| pipeline.push(frame, give));
            }
        }
    }

    /// Sends on what has waited long enough. Smoothing offline goes back over many frames at once, each of which is
    /// then looked at twice at most, however far it looks ahead.
    fn release_ready(&mut self) {
        match self.smooth_over {
            Some(frames) if self.state.held.len() >= 2 * frames => self.release(frames),
            Some(_) => {}
            None => self.release(self.config.fuse.look_ahead_frames()),
        }
    }

    /// Sends the frames that `run` gets out of the stages on to repair.
    pub(super) fn give(&mut self, run: impl FnOnce(&mut Pipeline, &mut dyn FnMut(RoomFrame))) {
        let newest = self.state.newest;
        let (pipeline, repair, at, mut out) = self.way_out();
        run(pipeline, &mut |mut frame| {
            frame.look_ahead_ns = newest.map_or(0, |newest| newest.since_ns(frame.time));
            repair.push(frame, &at, &mut out);
        });
    }

    /// Lets repair work.
    pub(super) fn repair(
        &mut self,
        run: impl FnOnce(&mut Repair, &Circumstances, &mut dyn Outlet),
    ) {
        let (_, repair, at, mut out) = self.way_out();
        run(repair, &at, &mut out);
    }

    /// What a fused frame passes before it is an output.
    fn way_out(&mut self) -> (&mut Pipeline, &mut Repair, Circumstances<'_>, Outputs<'_>) {
        let State {
            now,
            pipeline,
            repair,
            outputs,
            frames,
            ..
        } = &mut self.state;
        let at = Circumstances {
            config: &self.config.repair,
            now: now.unwrap_or(Timestamp::ZERO),
            known: self.trackable,
            offline: self.smooth_over.is_some(),
        };
        (pipeline, repair, at, Outputs { outputs, frames })
    }
}

/// Numbers frames and puts out what comes.
struct Outputs<'a> {
    outputs: &'a mut VecDeque<Output>,
    frames: &'a mut u64,
}

impl Outlet for Outputs<'_> {
    fn frame(&mut self, mut frame: RoomFrame) {
        *self.frames += 1;
        frame.number = *self.frames;
        put(self.outputs, Output::Frame(frame));
    }

    fn request(&mut self, request: RepairRequest) {
        put(self.outputs, Output::Repair(Box::new(request)));
    }
}
