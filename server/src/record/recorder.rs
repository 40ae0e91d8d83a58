//! The recorder's thread: takes messages from the queue, writes them, and flushes four times a second or more.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use posefuse_session::{
    EngineState, Storage, TakeError, TakeHeader, TakeInfo, TakeOptions, TakeWriter,
};
use tokio::sync::{mpsc, oneshot};

use super::{Config, Preamble, Progress, Record};
use crate::{Clock, ServerError, Threads};

/// Messages taken from the queue at once.
const BATCH: usize = 256;

/// Whether the file could be begun.
pub(crate) type Ready = oneshot::Receiver<Result<(), TakeError>>;

/// A recorder's thread.
pub(crate) struct Started {
    pub(crate) ready: Ready,
    /// Comes when the file has its end.
    pub(crate) ended: oneshot::Receiver<TakeInfo>,
}

/// What a take begins with, and where its messages come from.
pub(crate) struct Opening {
    pub(crate) header: TakeHeader,
    pub(crate) preamble: Preamble,
    pub(crate) records: mpsc::Receiver<Record>,
    pub(crate) progress: Arc<Progress>,
}

/// Starts the recorder's thread. It ends when every sender of `records` is dropped, or by itself when the disk is full.
pub(crate) fn start(
    threads: Threads,
    clock: Arc<dyn Clock>,
    storage: Arc<dyn Storage>,
    config: &Config,
    opening: Opening,
) -> Result<Started, ServerError> {
    let Opening {
        header,
        preamble,
        records,
        progress,
    } = opening;
    let options = TakeOptions {
        flush_every_ns: Duration::from_millis(config.flush_ms).as_nanos() as i64,
        min_free_bytes: config.min_free_mb.saturating_mul(1_000_000),
        ..TakeOptions::default()
    };
    let (begun, ready) = oneshot::channel();
    let ended = threads.spawn("recorder", async move {
        let state = preamble.state.map(|state| EngineState {
            build: header.build.clone(),
            state,
        });
        let name = header.name.clone();
        let created =
            TakeWriter::create_with(&storage, header, &preamble.inputs, state.as_ref(), options);
        let writer = match created {
            Ok(writer) => writer,
            Err(error) => {
                let _ = begun.send(Err(error));
                return TakeInfo::default();
            }
        };
        let _ = begun.send(Ok(()));
        let mut recorder = Recorder {
            writer,
            progress,
            told: [0; 2],
        };
        let trouble = recorder.run(records, &*clock).await.err();
        recorder.finish(&name, trouble)
    })?;
    Ok(Started { ready, ended })
}

struct Recorder {
    writer: TakeWriter,
    progress: Arc<Progress>,
    /// Dropped inputs, and dropped outputs, the writer has been told of.
    told: [u64; 2],
}

impl Recorder {
    /// Writes until nobody is left to send, or the take has ended by itself.
    async fn run(
        &mut self,
        mut records: mpsc::Receiver<Record>,
        clock: &dyn Clock,
    ) -> Result<(), TakeError> {
        let mut batch = Vec::with_capacity(BATCH);
        loop {
            let due = self.writer.next_flush().unwrap_or_else(|| clock.now());
            tokio::select! {
                biased;
                taken = records.recv_many(&mut batch, BATCH) => {
                    if taken == 0 {
                        self.note_dropped();
                        return Ok(());
                    }
                    for record in batch.drain(..) {
                        self.write(&record)?;
                    }
                }
                () = clock.sleep_until(due) => {}
            }
            self.note_dropped();
            let flushed = self.writer.flush(clock.now())?;
            self.progress.bytes.store(flushed.bytes, Ordering::Relaxed);
            if flushed.ended.is_some() {
                return Ok(());
            }
        }
    }

    fn write(&mut self, record: &Record) -> Result<(), TakeError> {
        match record {
            Record::Input(input) => self.writer.input(input),
            Record::Frame(frame) => {
                self.progress.frames.fetch_add(1, Ordering::Relaxed);
                let people = frame.tracks.len() as u64;
                self.progress.people.fetch_max(people, Ordering::Relaxed);
                self.writer.frame(frame)
            }
            Record::Rejection(rejection) => self.writer.rejection(rejection),
            Record::Event(event) => self.writer.event(event),
        }
    }

    fn note_dropped(&mut self) {
        let progress = &self.progress;
        let dropped = [&progress.dropped, &progress.dropped_outputs]
            .map(|count| count.load(Ordering::Relaxed));
        let [inputs, outputs] = [dropped[0] - self.told[0], dropped[1] - self.told[1]];
        if inputs + outputs == 0 {
            return;
        }
        self.told = dropped;
        self.writer.dropped(inputs);
        self.writer.dropped_outputs(outputs);
        tracing::warn!(inputs, outputs, "not recorded: the disk is too slow");
    }

    fn finish(self, name: &str, trouble: Option<TakeError>) -> TakeInfo {
        let unfinished = self.writer.info();
        match self.writer.finish() {
            Ok(mut info) => {
                if let Some(trouble) = trouble
                    && info.trouble.is_empty()
                {
                    info.trouble = trouble.to_string();
                }
                info
            }
            Err(error) => {
                tracing::error!(take = name, %error, "a take could not be finished; it is recovered at the next start");
                TakeInfo {
                    state: posefuse_session::TakeState::Damaged,
                    trouble: error.to_string(),
                    ..unfinished
                }
            }
        }
    }
}
