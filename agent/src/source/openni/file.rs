//! A recording (`.oni`) in a sensor's place.

use std::sync::Arc;
use std::time::Duration;

use posefuse_devices::openni::{DepthStream, Frame, OpenNi, OpenNiError, Playback};
use posefuse_skeleton::{AgentTime, Intrinsics};

use crate::Clock;
use crate::source::{DepthFrame, DepthSource, SourceError};

/// How long OpenNI2 may take to read one frame from a disk.
const READ: Duration = Duration::from_secs(5);

/// Plays a recording once.
pub(super) struct FileSource {
    clock: Arc<dyn Clock>,
    stream: DepthStream,
    /// Every frame, as fast as it is asked for.
    fast: bool,
    left: u32,
    /// The first frame's time in the file, microseconds, and when it was played, agent's clock, ns.
    began: Option<(u64, i64)>,
    last_ns: i64,
}

impl FileSource {
    pub(super) fn open(
        openni: &Arc<OpenNi>,
        file: &str,
        fast: bool,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, OpenNiError> {
        let device = openni.open_uri(file)?;
        // Frames are asked for one by one and paced here: at the library's own pace those that nobody waits for are lost.
        device.play(Playback::OnDemand)?;
        let stream = device.depth(None)?;
        stream.start()?;
        Ok(Self {
            clock,
            fast,
            left: stream.frames().unwrap_or(u32::MAX),
            stream,
            began: None,
            last_ns: i64::MIN,
        })
    }

    /// When a frame is captured as if the recording happened now. Fast, that is when it is read: a time that has not
    /// come yet would be refused.
    fn captured_ns(&mut self, frame: &Frame) -> i64 {
        let now_ns = self.clock.monotonic_ns();
        let (first_us, start_ns) = *self.began.get_or_insert((frame.timestamp_us, now_ns));
        let since_us = i64::try_from(frame.timestamp_us.saturating_sub(first_us)).unwrap_or(0);
        let at_ns = match self.fast {
            true => now_ns,
            false => start_ns.saturating_add(since_us.saturating_mul(1000)),
        };
        self.last_ns = at_ns.max(self.last_ns.saturating_add(1));
        self.last_ns
    }
}

impl DepthSource for FileSource {
    fn model(&self) -> String {
        "OpenNI2 recording".to_owned()
    }

    fn intrinsics(&self) -> Intrinsics {
        self.stream.camera()
    }

    fn every_frame(&self) -> bool {
        self.fast
    }

    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError> {
        if self.left == 0 {
            return Ok(None);
        }
        let next = self.stream.next(READ);
        let Some(frame) = next.map_err(|error| SourceError::Final(error.to_string()))? else {
            // The file has fewer frames than it says: it was cut off.
            tracing::warn!("the recording ends {} frames too soon", self.left);
            self.left = 0;
            return Ok(None);
        };
        self.left -= 1;
        let captured_ns = self.captured_ns(&frame);
        if !self.fast {
            let wait_ns = captured_ns.saturating_sub(self.clock.monotonic_ns());
            std::thread::sleep(Duration::from_nanos(u64::try_from(wait_ns).unwrap_or(0)));
        }
        Ok(Some(DepthFrame {
            captured: AgentTime::from_ns(captured_ns),
            due_ns: None,
            image: frame.image,
        }))
    }
}
