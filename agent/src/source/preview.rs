//! Depth previews: small depth images for the eyes of an operator who aims a sensor.
//!
//! A source that has depth images holds a [`PreviewSlot`] and offers it every image together with the bodies that were
//! tracked in it. The slot keeps the newest one only, thinned out, and only while somebody watches; otherwise an offer
//! costs one atomic load. The uplink takes what is there when it has nothing better to send.

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use posefuse_skeleton::{AgentTime, DepthImage, Intrinsics};

use super::SourceBody;

/// Most pixels to a side of a preview.
const MAX_SIDE: u32 = 160;
/// Most previews a second, whatever is asked for.
const MAX_RATE_HZ: f64 = 30.0;
/// The interval that stands for "nobody watches".
const NEVER: i64 = i64::MAX;

/// A depth image for an operator, with what was tracked in this very image.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthPreview {
    /// When the light was caught, by the sensor's clock.
    pub captured: AgentTime,
    /// The camera of the thinned image.
    pub camera: Intrinsics,
    /// At most 160 pixels to a side.
    pub image: DepthImage,
    /// Joints in the order of the source's joint set.
    pub bodies: Vec<SourceBody>,
}

/// Where a source leaves its newest preview. Clones are the same slot.
#[derive(Clone, Debug)]
pub struct PreviewSlot(Arc<Slot>);

#[derive(Debug)]
struct Slot {
    /// Nanoseconds between two previews; [`NEVER`]: none are wanted.
    interval_ns: AtomicI64,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// Since the first one was taken in.
    pace: Option<Pace>,
    newest: Option<DepthPreview>,
    /// The uplink, while it waits.
    waker: Option<Waker>,
}

impl Default for PreviewSlot {
    fn default() -> Self {
        Self(Arc::new(Slot {
            interval_ns: AtomicI64::new(NEVER),
            state: Mutex::default(),
        }))
    }
}

impl PreviewSlot {
    /// A slot of which nobody wants anything yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the image caught at this moment would be kept. Cheap while nobody watches.
    pub fn is_wanted(&self, captured: AgentTime) -> bool {
        let interval_ns = self.0.interval_ns.load(Ordering::Relaxed);
        let due = |pace: Pace| pace.is_due(captured.ns(), interval_ns);
        interval_ns != NEVER && self.lock().pace.is_none_or(due)
    }

    /// Leaves an image, of the given camera, with the bodies tracked in it; says whether it was kept. An older one that
    /// was not fetched yet is gone. An image whose size is not its camera's is none.
    pub fn offer(
        &self,
        captured: AgentTime,
        camera: &Intrinsics,
        image: &DepthImage,
        bodies: &[SourceBody],
    ) -> bool {
        let fits = (camera.width, camera.height) == (image.width, image.height)
            && image.millimetres.len() == image.width as usize * image.height as usize
            && !image.millimetres.is_empty();
        if !fits || !self.is_wanted(captured) {
            return false;
        }
        let step = image.width.max(image.height).div_ceil(MAX_SIDE);
        let preview = DepthPreview {
            captured,
            camera: camera.every(step),
            image: image.every(step),
            bodies: bodies.to_vec(),
        };
        let waker = {
            let mut state = self.lock();
            // Nobody watches any more since a moment ago.
            let interval_ns = self.0.interval_ns.load(Ordering::Relaxed);
            if interval_ns == NEVER {
                return false;
            }
            state.pace = Some(Pace::after(state.pace, captured.ns(), interval_ns));
            state.newest = Some(preview);
            state.waker.take()
        };
        if let Some(waker) = waker {
            waker.wake();
        }
        true
    }

    /// How many previews a second are wanted from now on; 0 (or nonsense): none, and what is there is dropped.
    pub(crate) fn ask(&self, max_rate_hz: f64) {
        let interval_ns = if max_rate_hz.is_finite() && max_rate_hz > 0.0 {
            // A rate of once in years is as good as once in an hour.
            (1e9 / max_rate_hz.min(MAX_RATE_HZ)).min(3.6e12) as i64
        } else {
            NEVER
        };
        let mut state = self.lock();
        self.0.interval_ns.store(interval_ns, Ordering::Relaxed);
        if interval_ns == NEVER {
            (state.newest, state.pace) = (None, None);
        }
    }

    /// Fetches the newest preview, or has the task woken when there is one.
    pub(crate) fn poll_newest(&self, context: &mut Context<'_>) -> Poll<DepthPreview> {
        let mut state = self.lock();
        match state.newest.take() {
            Some(preview) => Poll::Ready(preview),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How previews follow each other, nanoseconds of the sensor's clock.
#[derive(Clone, Copy, Debug)]
struct Pace {
    last_ns: i64,
    next_ns: i64,
}

impl Pace {
    /// Whether an image is due. One a little early is, or 30 Hz thinned to 10 would become 7.5; so is one from before the
    /// last (the device came back, a file began anew).
    fn is_due(self, captured_ns: i64, interval_ns: i64) -> bool {
        captured_ns < self.last_ns || captured_ns.saturating_add(interval_ns / 10) >= self.next_ns
    }

    fn after(before: Option<Self>, captured_ns: i64, interval_ns: i64) -> Self {
        // A schedule, so that what came early does not make the rate higher; but what was late is not made up for.
        let scheduled_ns = before
            .filter(|before| before.last_ns <= captured_ns)
            .map_or(captured_ns, |before| {
                before.next_ns.max(captured_ns.saturating_sub(interval_ns))
            });
        Self {
            last_ns: captured_ns,
            next_ns: scheduled_ns.saturating_add(interval_ns),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME_NS: i64 = 33_333_333;

    fn offer(slot: &PreviewSlot, frame: i64, width: u32, height: u32) -> bool {
        let camera = Intrinsics::from_view(width, height, 1.0, 0.8);
        let mut image = DepthImage::empty(width, height);
        image.millimetres[0] = frame as u16;
        let captured = AgentTime::from_ns(frame * FRAME_NS);
        slot.offer(captured, &camera, &image, &[])
    }

    fn fetch(slot: &PreviewSlot) -> Option<DepthPreview> {
        match slot.poll_newest(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(preview) => Some(preview),
            Poll::Pending => None,
        }
    }

    #[test]
    fn nothing_is_kept_unless_asked_for_and_then_only_the_newest_at_the_rate_asked_for() {
        let slot = PreviewSlot::new();
        assert!(!offer(&slot, 0, 64, 48));
        assert_eq!(fetch(&slot), None);
        slot.ask(10.0);
        let kept = (1..301)
            .filter(|frame| offer(&slot, *frame, 64, 48))
            .count();
        assert_eq!(kept, 100);
        assert_eq!(fetch(&slot).unwrap().image.millimetres[0], 298);
        assert_eq!(fetch(&slot), None, "each is given once");
        slot.ask(0.0);
        assert!(!offer(&slot, 400, 64, 48));
        slot.ask(f64::NAN);
        assert!(!offer(&slot, 500, 64, 48));
    }

    #[test]
    fn what_waits_is_dropped_when_nobody_watches_any_more() {
        let slot = PreviewSlot::new();
        slot.ask(5.0);
        assert!(offer(&slot, 1, 64, 48));
        slot.ask(0.0);
        slot.ask(5.0);
        assert_eq!(fetch(&slot), None);
        assert!(offer(&slot, 2, 64, 48), "the first one is due at once");
    }

    #[test]
    fn a_clock_that_goes_back_does_not_end_the_previews() {
        let slot = PreviewSlot::new();
        slot.ask(10.0);
        assert!(offer(&slot, 9000, 64, 48));
        assert!(offer(&slot, 3, 64, 48));
        assert!(!offer(&slot, 4, 64, 48));
    }

    #[test]
    fn images_are_thinned_to_160_pixels_with_their_camera() {
        let slot = PreviewSlot::new();
        slot.ask(30.0);
        for (at, size, thin) in [
            (100, (640, 480), (160, 120)),
            (200, (512, 424), (128, 106)),
            (300, (1024, 1024), (147, 147)),
            (400, (160, 120), (160, 120)),
        ] {
            assert!(offer(&slot, at, size.0, size.1));
            let preview = fetch(&slot).unwrap();
            assert_eq!((preview.image.width, preview.image.height), thin);
            assert_eq!((preview.camera.width, preview.camera.height), thin);
            assert_eq!(preview.image.millimetres.len(), (thin.0 * thin.1) as usize);
        }
    }

    #[test]
    fn an_image_that_is_not_its_camera_s_is_none() {
        let slot = PreviewSlot::new();
        slot.ask(30.0);
        let camera = Intrinsics::from_view(64, 48, 1.0, 0.8);
        let image = DepthImage::empty(48, 64);
        assert!(!slot.offer(AgentTime::from_ns(1), &camera, &image, &[]));
        let camera = Intrinsics::from_view(0, 0, 1.0, 0.8);
        let image = DepthImage::empty(0, 0);
        assert!(!slot.offer(AgentTime::from_ns(2), &camera, &image, &[]));
    }
}
