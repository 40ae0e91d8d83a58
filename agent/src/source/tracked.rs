//! A depth sensor with a body tracker behind it, as a sensor that gives skeletons.
//!
//! A device's images come in on a thread of its own into a slot for the newest one: a computer that cannot track all of them
//! tracks fewer, none of them late. A source that wants every image tracked is read by the tracker itself.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use posefuse_bodytrack::{BodyTracker, TrackedBody, TrackerConfig, TrackerError};
use posefuse_skeleton::{Intrinsics, Joint, JointSet, RawJoint};

use super::{
    Camera, DepthFrame, DepthSource, Description, PreviewSlot, SensorClock, SensorSource,
    SourceBody, SourceError, SourceFrame,
};

/// Pause before a device in trouble is asked again.
const RETRY: Duration = Duration::from_secs(1);

/// A depth source and a body tracker.
pub struct Tracked {
    description: Description,
    clock: SensorClock,
    input: Input,
    tracker: BodyTracker,
    camera: Intrinsics,
    previews: PreviewSlot,
    skipped: Arc<AtomicU64>,
}

/// Where images come from.
enum Input {
    /// Read by the tracker's thread.
    Every(Box<dyn DepthSource>),
    /// Read by a thread of its own.
    Newest(Arc<Slot>),
}

/// An image and the camera that took it.
struct Taken {
    frame: DepthFrame,
    camera: Intrinsics,
}

impl Tracked {
    /// Puts a body tracker behind `source`. Loads the network and, for a device, starts its reader.
    ///
    /// # Errors
    /// The settings, the camera or the network cannot be used.
    pub fn new(source: Box<dyn DepthSource>, config: TrackerConfig) -> Result<Self, SourceError> {
        let (camera, range_m) = (source.intrinsics(), config.range_m);
        let tracker = BodyTracker::new(config, camera).map_err(fatal)?;
        let skipped = Arc::new(AtomicU64::new(0));
        Ok(Self {
            description: Description {
                model: source.model(),
                joint_set: JointSet::KinectV2,
                camera: Some(Camera {
                    view_deg: camera.view().map(f64::to_degrees),
                    range_m,
                    preview: true,
                }),
            },
            clock: source.clock(),
            input: match source.every_frame() {
                true => Input::Every(source),
                false => Input::Newest(Slot::read(source, skipped.clone())?),
            },
            tracker,
            camera,
            previews: PreviewSlot::new(),
            skipped,
        })
    }

    /// How many images were not tracked because a newer one was there. The counter lives on with the source.
    pub fn skipped(&self) -> Arc<AtomicU64> {
        self.skipped.clone()
    }

    fn take(&mut self) -> Result<Option<Taken>, SourceError> {
        match &mut self.input {
            Input::Every(source) => {
                let frame = source.next_frame()?;
                let camera = source.intrinsics();
                Ok(frame.map(|frame| Taken { frame, camera }))
            }
            Input::Newest(slot) => slot.take(),
        }
    }
}

impl SensorSource for Tracked {
    fn description(&self) -> Description {
        self.description.clone()
    }

    fn clock(&self) -> SensorClock {
        self.clock.clone()
    }

    fn previews(&self) -> Option<PreviewSlot> {
        Some(self.previews.clone())
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        let Some(Taken { frame, camera }) = self.take()? else {
            return Ok(None);
        };
        if camera != self.camera {
            self.tracker.change_camera(camera).map_err(trouble)?;
            self.camera = camera;
        }
        let captured = frame.captured;
        let bodies = self.tracker.track(&frame.image, captured.ns());
        let bodies: Vec<SourceBody> = bodies.map_err(trouble)?.iter().map(source_body).collect();
        self.previews
            .offer(captured, &camera, &frame.image, &bodies);
        Ok(Some(SourceFrame {
            captured,
            due_ns: frame.due_ns,
            bodies,
        }))
    }
}

impl Drop for Tracked {
    fn drop(&mut self) {
        if let Input::Newest(slot) = &self.input {
            slot.lock().left = true;
        }
    }
}

fn source_body(body: &TrackedBody) -> SourceBody {
    let raw = |joint: Joint| {
        let (position, confidence) = body.joints[joint]?;
        Some(RawJoint {
            position,
            confidence,
        })
    };
    SourceBody {
        tracking_id: body.id,
        joints: Joint::ALL.map(raw).to_vec(),
        orientations: Vec::new(),
        hands_closed: body.hands_closed.map(|closed| closed.map(|p| p as f32)),
    }
}

fn fatal(error: TrackerError) -> SourceError {
    SourceError::Final(error.to_string())
}

fn trouble(error: TrackerError) -> SourceError {
    SourceError::Trouble(error.to_string())
}

/// Room for one image: the newest.
#[derive(Default)]
struct Slot {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    newest: Option<Taken>,
    /// Told once it has been fetched.
    trouble: Option<String>,
    /// How the source ended.
    end: Option<Result<(), String>>,
    /// Nobody wants images any more.
    left: bool,
}

impl Slot {
    /// Starts the thread that fills the slot, until the source ends or nobody wants more.
    fn read(
        mut source: Box<dyn DepthSource>,
        skipped: Arc<AtomicU64>,
    ) -> Result<Arc<Self>, SourceError> {
        let slot = Arc::new(Self::default());
        let into = Reading(slot.clone());
        let body = move || {
            let slot = &into.0;
            loop {
                let next = source.next_frame();
                let camera = source.intrinsics();
                let pause = matches!(next, Err(SourceError::Trouble(_)));
                if slot.put(next, camera, &skipped) {
                    return;
                }
                if pause {
                    std::thread::sleep(RETRY);
                }
            }
        };
        let thread = std::thread::Builder::new().name("depth-reader".into());
        thread
            .spawn(body)
            .map_err(|error| SourceError::Final(format!("no thread to read depth: {error}")))?;
        Ok(slot)
    }

    /// Whether that was the last.
    fn put(
        &self,
        next: Result<Option<DepthFrame>, SourceError>,
        camera: Intrinsics,
        skipped: &AtomicU64,
    ) -> bool {
        let mut state = self.lock();
        match next {
            Ok(Some(frame)) => {
                if state.newest.replace(Taken { frame, camera }).is_some() {
                    skipped.fetch_add(1, Ordering::Relaxed);
                }
            }
            Ok(None) => state.end = Some(Ok(())),
            Err(SourceError::Trouble(why)) => state.trouble = Some(why),
            Err(SourceError::Final(why)) => state.end = Some(Err(why)),
        }
        self.changed.notify_one();
        state.left || state.end.is_some()
    }

    /// Waits for an image, trouble or the end; what was seen before an end still comes.
    fn take(&self) -> Result<Option<Taken>, SourceError> {
        let mut state = self.lock();
        loop {
            if let Some(taken) = state.newest.take() {
                return Ok(Some(taken));
            }
            if let Some(why) = state.trouble.take() {
                return Err(SourceError::Trouble(why));
            }
            match &state.end {
                Some(Ok(())) => return Ok(None),
                Some(Err(why)) => return Err(SourceError::Final(why.clone())),
                None => {}
            }
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread that fills a slot: however it ends, nobody waits for more.
struct Reading(Arc<Slot>);

impl Drop for Reading {
    fn drop(&mut self) {
        let why = "the depth reader failed; start the agent again";
        let mut state = self.0.lock();
        state.end.get_or_insert_with(|| Err(why.into()));
        self.0.changed.notify_one();
    }
}

#[cfg(test)]
mod tests;
