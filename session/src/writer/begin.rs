//! The beginning of a take: its description, the channels, the engine's snapshot and what sets the scene.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use posefuse_fusion::Input;
use posefuse_skeleton::Timestamp;

use super::{Flushed, TakeOptions, TakeWriter, unwritable};
use crate::container::{Container, NewChannel, Pushed};
use crate::draft::Draft;
use crate::header::{CALIBRATION, CONFIG, START, calibration_to_text};
use crate::name::file_of;
use crate::storage::{Append, Storage};
use crate::tally::Tally;
use crate::{EngineState, Result, TakeError, TakeHeader, Topic, convert};

impl TakeWriter {
    /// Begins a take with the usual options.
    ///
    /// `preamble` is what an engine must be told before the first live input (`Engine::preamble`); `state` is its
    /// snapshot at that instant, which makes a take that began mid-stream fuse again to the same bytes.
    pub fn create(
        storage: &Arc<dyn Storage>,
        header: TakeHeader,
        preamble: &[Input],
        state: Option<&EngineState>,
    ) -> Result<Self> {
        Self::create_with(storage, header, preamble, state, TakeOptions::default())
    }

    /// Begins a take.
    pub fn create_with(
        storage: &Arc<dyn Storage>,
        header: TakeHeader,
        preamble: &[Input],
        state: Option<&EngineState>,
        options: TakeOptions,
    ) -> Result<Self> {
        let file_name = file_of(&header.name)?;
        check_space(&**storage, &header, &options)?;
        let file = storage
            .create(&file_name)
            .map_err(cannot_begin(&header.name))?;
        let mut writer = Self::new(storage, file, header, options)?;
        if let Err(error) = writer.begin(preamble, state) {
            drop(writer);
            // A take that never began is no take; if even this fails, the next start's recovery names the file.
            let _ = storage.remove(&file_name);
            return Err(error);
        }
        Ok(writer)
    }

    /// Begins a take that can be made again: it is none before [`TakeWriter::publish`].
    pub(crate) fn draft(
        storage: &Arc<dyn Storage>,
        header: TakeHeader,
        preamble: &[Input],
        state: Option<&EngineState>,
        options: TakeOptions,
    ) -> Result<Self> {
        check_space(&**storage, &header, &options)?;
        if storage.open(&file_of(&header.name)?).is_ok() {
            return Err(TakeError::Exists(header.name));
        }
        let (draft, file) =
            Draft::create(storage, &header.name).map_err(cannot_begin(&header.name))?;
        let mut writer = Self::new(storage, file, header, options)?;
        writer.draft = Some(draft);
        writer.begin(preamble, state)?;
        Ok(writer)
    }

    fn new(
        storage: &Arc<dyn Storage>,
        file: Box<dyn Append>,
        header: TakeHeader,
        options: TakeOptions,
    ) -> Result<Self> {
        let container = Container::new(file).map_err(|error| unwritable(&header.name, error))?;
        Ok(Self {
            storage: storage.clone(),
            options,
            now: Timestamp::from_ns(header.start_ns()),
            container,
            draft: None,
            sequences: Default::default(),
            tally: Tally::default(),
            inputs: 0,
            untold: [0; 2],
            calibration: header.calibration.clone().map(Arc::new),
            next_scene: 0,
            next_transforms: 0,
            last_flush: None,
            durable: Flushed::default(),
            finished: None,
            header,
        })
    }

    fn begin(&mut self, preamble: &[Input], state: Option<&EngineState>) -> Result<()> {
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
        let calibration = self.header.calibration.as_ref();
        if let Some(text) = calibration.and_then(|c| calibration_to_text(&self.header.name, c)) {
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
                container.add_schema(
                    id,
                    topic.schema(),
                    "protobuf",
                    &posefuse_proto::schema_of(topic.schema()),
                )?;
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

fn check_space(storage: &dyn Storage, header: &TakeHeader, options: &TakeOptions) -> Result<()> {
    let free_bytes = storage
        .free_bytes()
        .map_err(TakeError::io("begin", &header.name))?;
    if free_bytes < options.min_free_bytes {
        return Err(TakeError::DiskLow {
            place: storage.place(),
            free_bytes,
            needed_bytes: options.min_free_bytes,
        });
    }
    Ok(())
}

fn cannot_begin(name: &str) -> impl FnOnce(io::Error) -> TakeError {
    move |error| match error.kind() {
        io::ErrorKind::AlreadyExists => TakeError::Exists(name.to_owned()),
        _ => TakeError::io("begin", name)(error),
    }
}
