//! The end of a take: asked for, or forced by the disk.

use std::io;

use mcap::records::MessageHeader;

use super::{TakeWriter, unwritable};
use crate::info::END;
use crate::{Event, Result, TakeError, TakeInfo, TakeState, Topic, convert};

impl TakeWriter {
    /// Ends the take because of the disk: footer and index go into the space that was set aside.
    pub(super) fn end(&mut self, trouble: &str) -> Result<()> {
        tracing::warn!(take = self.header.name, trouble, "the take ends by itself");
        let event = Event {
            time_ns: self.now.ns(),
            kind: "take-ended".to_owned(),
            text: trouble.to_owned(),
            ..Event::default()
        };
        let time = self.header.unix_ns(self.now);
        let header = MessageHeader {
            channel_id: Topic::Events as u16 + 1,
            sequence: self.sequences[Topic::Events as usize],
            log_time: time,
            publish_time: time,
        };
        let written = self
            .container
            .message(&header, &convert::event_to_bytes(&event));
        self.durable.ended = Some(trouble.to_owned());
        written.map_err(|error| unwritable(&self.header.name, error))?;
        self.close(trouble)
    }

    fn close(&mut self, trouble: &str) -> Result<()> {
        let mut info = self.info();
        // Holds until the end is on the disk; nothing more may be written in any case.
        self.finished = Some(TakeInfo {
            state: TakeState::Damaged,
            trouble: format!("{trouble}; its end could not be written, the next start repairs it"),
            ..info.clone()
        });
        info.state = TakeState::Complete;
        info.trouble = trouble.to_owned();
        let name = &self.header.name;
        self.container
            .metadata(END, info.to_metadata())
            .map_err(|error| unwritable(name, error))?;
        info.size_bytes = self
            .container
            .finish()
            .map_err(TakeError::io("end", name))?;
        self.note_durable();
        self.finished = Some(info);
        Ok(())
    }

    /// Ends the take: everything is durable, with index and footer.
    pub fn finish(mut self) -> Result<TakeInfo> {
        self.tell_dropped()?;
        if self.finished.is_none() {
            self.close("")?;
        }
        Ok(self.finished.unwrap_or_default())
    }

    /// Ends a take begun with [`TakeWriter::draft`] and gives it its name. One that ended by itself is an error:
    /// nothing of it is kept.
    pub(crate) fn publish(mut self) -> Result<TakeInfo> {
        self.tell_dropped()?;
        self.check_going_on()?;
        self.close("")?;
        let name = &self.header.name;
        if let Some(draft) = self.draft.take() {
            draft.publish().map_err(|error| match error.kind() {
                io::ErrorKind::AlreadyExists => TakeError::Exists(name.clone()),
                _ => TakeError::io("end", name)(error),
            })?;
        }
        Ok(self.finished.unwrap_or_default())
    }
}

pub(super) fn disk_trouble(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the disk was full; free space or choose another take folder".to_owned()
        }
        _ => format!("the disk failed: {error}"),
    }
}
