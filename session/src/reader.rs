//! Reading a take that has its end. Memory is bounded by one chunk, whatever the file claims.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::sync::Arc;

use posefuse_fusion::Input;
use posefuse_skeleton::{Observation, RoomFrame, SensorInfo, Timestamp};

use crate::container::{ChunkContent, Index, RawMessage, decode_chunk, read_bytes};
use crate::header::{CALIBRATION, CONFIG, START, calibration_from_text};
use crate::info::END;
use crate::name::file_of;
use crate::storage::{ReadAt, Storage};
use crate::{
    EngineState, Event, Recorded, Result, TakeError, TakeHeader, TakeInfo, Topic, Truth, convert,
};

/// A take, open for reading.
pub struct TakeReader {
    file: Arc<dyn ReadAt>,
    index: Arc<Index>,
    header: Arc<TakeHeader>,
    info: TakeInfo,
    preamble: u32,
}

impl TakeReader {
    /// Opens a take; its index and descriptions are read, its messages are not.
    pub fn open(storage: &dyn Storage, name: &str) -> Result<Self> {
        let file = storage
            .open(&file_of(name)?)
            .map_err(|error| match error.kind() {
                io::ErrorKind::NotFound => TakeError::Missing(name.to_owned()),
                _ => TakeError::io("open", name)(error),
            })?;
        let index = Index::read(&*file, name)?;
        let Some(start) = index.read_metadata(&*file, name, START)? else {
            return Err(TakeError::Foreign {
                name: name.to_owned(),
                problem: format!("it is an MCAP file without the metadata `{START}`"),
            });
        };
        let (mut header, preamble) = TakeHeader::from_metadata(name, &start)?;
        header.config_toml = index
            .read_attachment(&*file, name, CONFIG)?
            .unwrap_or_default();
        if let Some(text) = index.read_attachment(&*file, name, CALIBRATION)? {
            header.calibration = Some(calibration_from_text(name, &text)?);
        }
        let mut info = TakeInfo::begun(&header);
        if let Some(end) = index.read_metadata(&*file, name, END)? {
            info.take_end(&end);
        }
        info.size_bytes = file.length().map_err(TakeError::io("read", name))?;
        Ok(Self {
            file,
            index: Arc::new(index),
            header: Arc::new(header),
            info,
            preamble,
        })
    }

    /// What the take began with.
    pub fn header(&self) -> &TakeHeader {
        &self.header
    }

    /// Its list entry.
    pub fn info(&self) -> &TakeInfo {
        &self.info
    }

    /// How many messages a topic has, as the index says.
    pub fn count(&self, topic: Topic) -> u64 {
        let of_topic = |(id, _): &(&u16, &u64)| {
            self.index
                .channels
                .get(id)
                .is_some_and(|name| name == topic.name())
        };
        self.index
            .counts
            .iter()
            .filter(of_topic)
            .map(|(_, count)| count)
            .sum()
    }

    /// The messages of these topics in the order they were recorded, from a server time on.
    pub fn entries(&self, topics: &[Topic], from: Option<Timestamp>) -> Entries {
        let topic_of = |(id, name): (&u16, &String)| {
            let topic = Topic::of_name(name)?;
            topics.contains(&topic).then_some((*id, topic))
        };
        Entries {
            file: self.file.clone(),
            index: self.index.clone(),
            header: self.header.clone(),
            topics: self.index.channels.iter().filter_map(topic_of).collect(),
            from: from.map_or(0, |time| self.header.unix_ns(time)),
            next_chunk: 0,
            ready: VecDeque::new(),
            failed: false,
        }
    }

    /// The engine's state when recording began, if the take holds it, and the inputs that set the scene.
    pub fn beginning(&self) -> Result<(Option<EngineState>, Vec<Input>)> {
        let (mut state, mut preamble) = (None, Vec::new());
        for entry in self.entries(&[Topic::Inputs], None) {
            let entry = entry?;
            match entry.decode()? {
                Recorded::State(found) if entry.number == 0 => state = Some(found),
                Recorded::Input(input) if preamble.len() < self.preamble as usize => {
                    preamble.push(input)
                }
                _ => break,
            }
        }
        Ok((state, preamble))
    }

    /// What the engine consumed live, in that order: without snapshot and preamble.
    pub fn inputs(&self) -> impl Iterator<Item = Result<Input>> + Send + use<> {
        let mut preamble = self.preamble;
        self.entries(&[Topic::Inputs], None)
            .filter_map(move |entry| {
                let entry = match entry {
                    Ok(entry) => entry,
                    Err(error) => return Some(Err(error)),
                };
                match entry.decode() {
                    Ok(Recorded::Input(_)) if preamble > 0 => {
                        preamble -= 1;
                        None
                    }
                    Ok(Recorded::Input(input)) => Some(Ok(input)),
                    Ok(_) => None,
                    Err(error) => Some(Err(error)),
                }
            })
    }

    /// The fused frames.
    pub fn frames(&self) -> impl Iterator<Item = Result<RoomFrame>> + Send + use<> {
        self.of(Topic::Frames, |message| match message {
            Recorded::Frame(frame) => Some(frame),
            _ => None,
        })
    }

    /// The sensors' frames, as they came live.
    pub fn observations(&self) -> impl Iterator<Item = Result<Observation>> + Send + use<> {
        self.inputs().filter_map(|input| match input {
            Ok(Input::Observation(observation)) => Some(Ok(observation)),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        })
    }

    /// The sensors that took part, in the order of their numbers, each as it was greeted last.
    pub fn sensors(&self) -> Result<Vec<SensorInfo>> {
        let mut sensors = BTreeMap::new();
        for entry in self.entries(&[Topic::Inputs], None) {
            if let Recorded::Input(Input::Sensor(info)) = entry?.decode()? {
                sensors.insert(info.id, info);
            }
        }
        Ok(sensors.into_values().collect())
    }

    /// What happened around the engine.
    pub fn events(&self) -> impl Iterator<Item = Result<Event>> + Send + use<> {
        self.of(Topic::Events, |message| match message {
            Recorded::Event(event) => Some(event),
            _ => None,
        })
    }

    /// True poses of simulated people.
    pub fn truth(&self) -> impl Iterator<Item = Result<Truth>> + Send + use<> {
        self.of(Topic::Truth, |message| match message {
            Recorded::Truth(truth) => Some(truth),
            _ => None,
        })
    }

    fn of<T, P: Fn(Recorded) -> Option<T> + Send>(
        &self,
        topic: Topic,
        pick: P,
    ) -> impl Iterator<Item = Result<T>> + Send + use<T, P> {
        let decoded = self.entries(&[topic], None).map(|entry| entry?.decode());
        decoded.filter_map(move |message| message.map(&pick).transpose())
    }
}

/// One message of a take, not decoded yet.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its topic.
    pub topic: Topic,
    /// Its number on its topic.
    pub number: u32,
    /// When it happened, server time.
    pub time: Timestamp,
    /// The protobuf message.
    pub bytes: Vec<u8>,
    take: Arc<TakeHeader>,
}

impl Entry {
    /// The message, checked.
    pub fn decode(&self) -> Result<Recorded> {
        convert::recorded(self.topic, &self.bytes).map_err(|error| TakeError::Message {
            name: self.take.name.clone(),
            topic: self.topic.name(),
            number: self.number,
            problem: error.to_string(),
        })
    }
}

/// Messages of a take in the order they were recorded. Ends after the first error.
pub struct Entries {
    file: Arc<dyn ReadAt>,
    index: Arc<Index>,
    header: Arc<TakeHeader>,
    topics: BTreeMap<u16, Topic>,
    from: u64,
    next_chunk: usize,
    ready: VecDeque<RawMessage>,
    failed: bool,
}

impl Entries {
    /// Unpacks the next chunk that can hold a message that is asked for; whether there was one.
    fn load(&mut self) -> Result<bool> {
        let wanted: BTreeSet<u16> = self.topics.keys().copied().collect();
        while let Some(chunk) = self.index.chunks.get(self.next_chunk) {
            self.next_chunk += 1;
            let holds_none = !chunk.channels.is_empty() && chunk.channels.is_disjoint(&wanted);
            if holds_none || chunk.end_time < self.from {
                continue;
            }
            let (name, record) = (&self.header.name, chunk.record);
            let broken =
                |problem| TakeError::damaged(name, format!("at byte {}: {problem}", record.offset));
            crate::container::check_head(&*self.file, name, record)?;
            let body = read_bytes(&*self.file, name, record.body(), record.length)?;
            for content in decode_chunk(&body).map_err(broken)? {
                if let ChunkContent::Message(message) = content
                    && wanted.contains(&message.header.channel_id)
                    && message.header.log_time >= self.from
                {
                    self.ready.push_back(message);
                }
            }
            return Ok(true);
        }
        Ok(false)
    }
}

impl Iterator for Entries {
    type Item = Result<Entry>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.ready.is_empty() {
            if self.failed {
                return None;
            }
            match self.load() {
                Ok(true) => {}
                Ok(false) => return None,
                Err(error) => {
                    self.failed = true;
                    return Some(Err(error));
                }
            }
        }
        let RawMessage { header, data } = self.ready.pop_front()?;
        Some(Ok(Entry {
            topic: *self.topics.get(&header.channel_id)?,
            number: header.sequence,
            time: self.header.server_time(header.log_time),
            bytes: data,
            take: self.header.clone(),
        }))
    }
}
