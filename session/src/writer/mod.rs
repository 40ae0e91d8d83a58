//! Recording a take.
//!
//! The caller's thread is the recorder's; no clock is read here. What was given is durable after the next
//! [`TakeWriter::flush`] that is due (every 250 ms): a chunk is closed, written and synced. When the disk fills up or
//! fails, the take ends by itself with a valid footer and index and says why; the room goes on.

mod begin;
mod end;
mod options;

use std::io;
use std::sync::Arc;

use mcap::records::MessageHeader;
use posefuse_fusion::{Input, Rejection};
use posefuse_proto::{foxglove, room_frame_to_wire};
use posefuse_skeleton::{Calibration, RoomFrame, Timestamp};
use prost::Message;

use crate::container::{Container, Pushed};
use crate::draft::Draft;
use crate::storage::Storage;
use crate::tally::Tally;
use crate::{Event, Result, TakeError, TakeHeader, TakeInfo, Topic, Truth, convert};

use end::disk_trouble;
pub use options::{Flushed, TakeOptions};

/// Closed chunks are handed to the system when they are this many bytes, even between flushes.
const PUSH_BYTES: usize = 256 * 1024;
/// The sensors' places are repeated this often for viewers, nanoseconds.
const TRANSFORMS_EVERY_NS: u64 = 1_000_000_000;

/// A take that is being recorded.
pub struct TakeWriter {
    storage: Arc<dyn Storage>,
    options: TakeOptions,
    header: TakeHeader,
    container: Container,
    /// The file's name for now, if the take can be made again.
    draft: Option<Draft>,
    sequences: [u32; Topic::ALL.len()],
    /// The latest server time seen: for messages without a time of their own.
    now: Timestamp,
    tally: Tally,
    inputs: u64,
    /// Dropped messages that no event in the file tells of yet: inputs, outputs.
    untold: [u64; 2],
    calibration: Option<Arc<Calibration>>,
    next_scene: u64,
    next_transforms: u64,
    last_flush: Option<Timestamp>,
    durable: Flushed,
    finished: Option<TakeInfo>,
}

impl TakeWriter {
    fn start_unix_ns(&self) -> u64 {
        self.header
            .unix_ns(Timestamp::from_ns(self.header.start_ns()))
    }

    /// Records what the engine consumes, in that order.
    pub fn input(&mut self, input: &Input) -> Result<()> {
        self.write_input(input, None)?;
        self.inputs += 1;
        if let Input::Calibration(calibration) = input {
            self.calibration = Some(calibration.clone());
            self.next_transforms = 0;
        }
        let now = self.header.unix_ns(self.now);
        if now >= self.next_transforms {
            self.write_transforms(now)?;
        }
        Ok(())
    }

    fn write_input(&mut self, input: &Input, logged: Option<u64>) -> Result<()> {
        let time = input.time().unwrap_or(self.now);
        if logged.is_none() {
            self.now = self.now.max(time);
        }
        self.tally.count_input(input);
        let time = self.header.unix_ns(time);
        self.message(
            Topic::Inputs,
            logged.unwrap_or(time),
            time,
            &convert::input_to_bytes(input),
        )
    }

    fn write_transforms(&mut self, unix_ns: u64) -> Result<()> {
        self.next_transforms = unix_ns.saturating_add(TRANSFORMS_EVERY_NS);
        match self.calibration.clone() {
            Some(calibration) => {
                let bytes = foxglove::sensors_of(&calibration, unix_ns);
                self.message(Topic::Transforms, unix_ns, unix_ns, &bytes)
            }
            None => Ok(()),
        }
    }

    /// Records a fused frame.
    pub fn frame(&mut self, frame: &RoomFrame) -> Result<()> {
        let time = self.header.unix_ns(frame.time);
        self.message(
            Topic::Frames,
            time,
            time,
            &room_frame_to_wire(frame).encode_to_vec(),
        )?;
        self.tally.count_frame(frame.tracks.len());
        if time >= self.next_scene {
            self.next_scene = time.saturating_add(self.options.scene_every_ns);
            self.message(Topic::Scene, time, time, &foxglove::scene_of(frame, time))?;
        }
        Ok(())
    }

    /// Records something that the engine refused.
    pub fn rejection(&mut self, rejection: &Rejection) -> Result<()> {
        let time = self.header.unix_ns(rejection.time);
        self.message(
            Topic::Rejections,
            time,
            time,
            &convert::rejection_to_bytes(rejection),
        )
    }

    /// Records something that happened around the engine.
    pub fn event(&mut self, event: &Event) -> Result<()> {
        let time = self.header.unix_ns(Timestamp::from_ns(event.time_ns));
        self.message(Topic::Events, time, time, &convert::event_to_bytes(event))?;
        self.tally.count_event(event);
        Ok(())
    }

    /// Records where simulated people truly are.
    pub fn truth(&mut self, truth: &Truth) -> Result<()> {
        let time = self.header.unix_ns(truth.time);
        self.message(Topic::Truth, time, time, &convert::truth_to_bytes(truth))
    }

    /// Counts inputs that could not be given to this writer (its queue was full). The next flush writes an event that
    /// tells of them.
    pub fn dropped(&mut self, inputs: u64) {
        self.untold[0] += inputs;
    }

    /// Counts frames, rejections and events that could not be given to this writer, as [`TakeWriter::dropped`] does.
    pub fn dropped_outputs(&mut self, outputs: u64) {
        self.untold[1] += outputs;
    }

    fn tell_dropped(&mut self) -> Result<()> {
        let kinds = [
            (Event::INPUTS_DROPPED, "inputs"),
            (Event::OUTPUTS_DROPPED, "frames, rejections or events"),
        ];
        for (which, (kind, what)) in kinds.into_iter().enumerate() {
            let count = self.untold[which];
            if count > 0 && self.finished.is_none() {
                let event = Event {
                    time_ns: self.now.ns(),
                    kind: kind.to_owned(),
                    text: format!("{count} {what} could not be recorded: the disk was too slow"),
                    count,
                    ..Event::default()
                };
                self.event(&event)?;
                self.untold[which] = 0;
            }
        }
        Ok(())
    }

    fn message(
        &mut self,
        topic: Topic,
        log_time: u64,
        publish_time: u64,
        data: &[u8],
    ) -> Result<()> {
        self.check_going_on()?;
        let header = MessageHeader {
            channel_id: topic as u16 + 1,
            sequence: self.sequences[topic as usize],
            log_time,
            publish_time,
        };
        self.container
            .message(&header, data)
            .map_err(|error| unwritable(&self.header.name, error))?;
        self.sequences[topic as usize] = header.sequence.wrapping_add(1);
        self.tally.count_time(log_time);
        if self.container.pending_bytes() > PUSH_BYTES {
            self.push()?;
        }
        Ok(())
    }

    pub(crate) fn check_going_on(&self) -> Result<()> {
        match &self.finished {
            Some(ended) => Err(TakeError::Ended(ended.trouble.clone())),
            None => Ok(()),
        }
    }

    /// Moves closed chunks to the file; ends the take when the disk does not take more.
    fn push(&mut self) -> Result<()> {
        match self.container.push() {
            Ok(Pushed::Ample) => Ok(()),
            Ok(Pushed::Ending(error)) | Err(error) => self.end(&disk_trouble(&error)),
        }
    }

    /// Makes everything durable if a flush is due at `now` (server time), and tells what is durable.
    ///
    /// Call it after each batch, and at least as often as [`TakeOptions::flush_every_ns`].
    pub fn flush(&mut self, now: Timestamp) -> Result<Flushed> {
        let due = self
            .last_flush
            .is_none_or(|last| now.since_ns(last) >= self.options.flush_every_ns);
        if due && self.finished.is_none() {
            self.last_flush = Some(now);
            self.now = self.now.max(now);
            self.flush_all()?;
        }
        Ok(self.durable.clone())
    }

    fn flush_all(&mut self) -> Result<()> {
        self.tell_dropped()?;
        if self.finished.is_some() {
            return Ok(());
        }
        self.container
            .close_chunk()
            .map_err(|error| unwritable(&self.header.name, error))?;
        if self.container.pending_bytes() > 0 {
            self.push()?;
            if self.finished.is_some() {
                return Ok(());
            }
            if let Err(error) = self.container.sync() {
                return self.end(&disk_trouble(&error));
            }
        }
        self.note_durable();
        match self.storage.free_bytes() {
            Ok(free) if free < self.options.min_free_bytes => {
                let megabytes = self.options.min_free_bytes / 1_000_000;
                self.end(&format!(
                    "less than {megabytes} MB were free in {}",
                    self.storage.place()
                ))
            }
            // Where the free space cannot be asked for, the space set aside has to do.
            _ => Ok(()),
        }
    }

    fn note_durable(&mut self) {
        self.durable = Flushed {
            inputs: self.inputs,
            frames: self.tally.frames,
            bytes: self.container.written_bytes(),
            ended: self.durable.ended.take(),
        };
    }

    /// The server time at which the next flush is due; `None`: at once.
    pub fn next_flush(&self) -> Option<Timestamp> {
        self.last_flush
            .map(|last| last.plus_ns(self.options.flush_every_ns))
    }

    /// The take's list entry as it stands.
    pub fn info(&self) -> TakeInfo {
        if let Some(finished) = &self.finished {
            return finished.clone();
        }
        let mut info = TakeInfo::begun(&self.header);
        self.tally.tell(self.start_unix_ns(), &mut info);
        info.dropped = info.dropped.saturating_add(self.untold[0]);
        info.dropped_outputs = info.dropped_outputs.saturating_add(self.untold[1]);
        info.size_bytes = self.container.written_bytes();
        info
    }
}

fn unwritable(name: &str, error: mcap::McapError) -> TakeError {
    TakeError::io("write", name)(io::Error::other(error))
}
