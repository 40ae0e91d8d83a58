//! The beginning of a take: its description, the channels, the engine's snapshot and what sets the scene.

use std::collections::BTreeMap;

use posefuse_fusion::Input;

use super::{TakeWriter, unwritable};
use crate::container::{Container, NewChannel, Pushed};
use crate::header::{CALIBRATION, CONFIG, START, calibration_to_text};
use crate::schema::schema_of;
use crate::{EngineState, Result, TakeError, Topic, convert};

impl TakeWriter {
    pub(super) fn begin(&mut self, preamble: &[Input], state: Option<&EngineState>) -> Result<()> {
        self.write_start(preamble.len())?;
        let start = self.start_unix_ns();
        if let Some(state) = state {
            self.message(Topic::Inputs, start, start, &convert::state_to_bytes(state))?;
        }
        for input in preamble {
            self.write_input(input, Some(start))?;
        }
        self.write_transforms(start)?;
        self.container
            .close_chunk()
            .map_err(|error| unwritable(&self.header.name, error))?;
        let name = self.header.name.clone();
        match self
            .container
            .push()
            .map_err(TakeError::io("begin", &name))?
        {
            Pushed::Ample => self.container.sync().map_err(TakeError::io("begin", &name)),
            Pushed::Ending(error) => Err(TakeError::io("set space aside for", &name)(error)),
        }
    }

    /// The records that a list of takes can read without the rest, then the channels.
    fn write_start(&mut self, preamble: usize) -> Result<()> {
        let start = self.start_unix_ns();
        let mut texts = vec![(CONFIG, self.header.config_toml.clone())];
        if let Some(calibration) = &self.header.calibration {
            let text = calibration_to_text(calibration).map_err(|error| TakeError::Config {
                name: self.header.name.clone(),
                problem: format!("the calibration has no text form: {error}"),
            })?;
            texts.push((CALIBRATION, text));
        }
        let write = |container: &mut Container| {
            container.metadata(START, self.header.to_metadata(preamble))?;
            for (name, text) in &texts {
                container.attach(&mcap::Attachment {
                    log_time: start,
                    create_time: start,
                    name: (*name).to_owned(),
                    media_type: "application/toml".to_owned(),
                    data: text.as_bytes().into(),
                })?;
            }
            for (id, topic) in (1..).zip(Topic::ALL) {
                container.add_schema(id, topic.schema(), "protobuf", &schema_of(topic))?;
                container.add_channel(&NewChannel {
                    id,
                    topic: topic.name(),
                    encoding: "protobuf",
                    metadata: &BTreeMap::new(),
                    schema_id: id,
                })?;
            }
            Ok(())
        };
        write(&mut self.container).map_err(|error| unwritable(&self.header.name, error))
    }
}
