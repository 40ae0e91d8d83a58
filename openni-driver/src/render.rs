//! Draws frames ahead of time, on a thread of its own.
//!
//! Frame `n` of a stream is captured `n` thirtieths of a second after the stream's start, whatever the computer does.
//! When it cannot be drawn in time it is left out, and the numbers of the frames show that: as a real device loses them.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use posefuse_simulator::depth::DepthCamera;
use posefuse_skeleton::DepthImage;

use crate::sensor::{FPS, VirtualSensor};

/// How many frames are drawn ahead, half a second of them: that much may the computer stall.
const AHEAD: usize = 15;
/// After how long a room without people begins again, ns.
const EMPTY_ROUND_NS: i64 = 300_000_000_000;

/// A frame that waits for its moment.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    /// Counted from 1.
    pub(crate) number: u32,
    /// When the light is caught.
    pub(crate) at: Instant,
    pub(crate) image: Arc<DepthImage>,
}

/// When frame `number` of a stream is captured.
pub(crate) fn moment(start: Instant, number: u32) -> Instant {
    start + Duration::from_nanos(u64::from(number) * 1_000_000_000 / u64::from(FPS))
}

/// Draws from `start` on until the receiver is dropped; the thread's code is the driver's, so it is to be joined before that
/// is unloaded.
pub(crate) fn draw(
    sensor: Arc<VirtualSensor>,
    camera: DepthCamera,
    start: Instant,
) -> std::io::Result<(Receiver<Drawn>, JoinHandle<()>)> {
    let (sender, receiver) = sync_channel(AHEAD);
    let name = format!("virtual-draw-{}", sensor.index);
    let thread = thread::Builder::new()
        .name(name.chars().take(15).collect())
        .spawn(move || run(&sensor, &camera, start, &sender))?;
    Ok((receiver, thread))
}

fn run(sensor: &VirtualSensor, camera: &DepthCamera, start: Instant, frames: &SyncSender<Drawn>) {
    let mut kept: Vec<Option<Arc<DepthImage>>> = vec![None; sensor.repeat_frames];
    let mut number = 1;
    loop {
        let at = moment(start, number);
        let place = (number as usize).checked_rem(kept.len());
        let again = place.and_then(|place| kept[place].clone());
        let image = again.unwrap_or_else(|| {
            let seconds = seconds(sensor, at);
            Arc::new(sensor.world.depth(sensor.index, seconds, camera))
        });
        if let Some(place) = place {
            kept[place] = Some(image.clone());
        }
        if frames.send(Drawn { number, at, image }).is_err() {
            return;
        }
        number = next(start, number, Instant::now());
    }
}

/// The frame after `number`: the following one, unless its moment is past by more than a frame's length.
fn next(start: Instant, number: u32, now: Instant) -> u32 {
    let gone = now.saturating_duration_since(start).as_nanos();
    let current = (gone * u128::from(FPS) / 1_000_000_000) as u32;
    (number + 1).max(current)
}

/// The room's time: programs that look at the same room at the same moment see the same people. Whole microseconds, as
/// the frame's time is told, so that anybody can draw the same frame again.
fn seconds(sensor: &VirtualSensor, at: Instant) -> f64 {
    let round_ns = match sensor.world.performance().round_s() {
        Some(seconds) => (seconds * 1e9).round() as i64,
        None => EMPTY_ROUND_NS,
    };
    // Rounded as the frame's time is.
    let unix_ns = sensor.clock.unix_ns(at).div_euclid(1000) * 1000;
    unix_ns.rem_euclid(round_ns.max(1)) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_late_are_left_out_and_counted() {
        let start = Instant::now();
        let after = |ms: u64| start + Duration::from_millis(ms);
        assert_eq!(next(start, 1, after(10)), 2);
        assert_eq!(next(start, 1, after(67)), 2);
        assert_eq!(next(start, 1, after(1000)), 30);
        assert_eq!(moment(start, 30), after(1000));
    }
}
