use super::*;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use posefuse_skeleton::{AgentTime, DepthImage};

/// Gives what it is handed; ends when the sender is gone.
struct Handed {
    frames: Receiver<Result<DepthFrame, SourceError>>,
    every: bool,
}

fn handed(every: bool) -> (SyncSender<Result<DepthFrame, SourceError>>, Box<Handed>) {
    let (sender, frames) = sync_channel(0);
    (sender, Box::new(Handed { frames, every }))
}

impl DepthSource for Handed {
    fn model(&self) -> String {
        "handed".into()
    }
    fn intrinsics(&self) -> Intrinsics {
        Intrinsics::from_view(160, 120, 1.0, 0.75)
    }
    fn every_frame(&self) -> bool {
        self.every
    }
    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError> {
        self.frames.recv().ok().transpose()
    }
}

fn frame(number: i64) -> Result<DepthFrame, SourceError> {
    Ok(DepthFrame {
        captured: AgentTime::from_ns(number),
        due_ns: None,
        image: DepthImage::empty(160, 120),
    })
}

fn captured(tracked: &mut Tracked) -> Option<i64> {
    let frame = tracked.next_frame().unwrap();
    frame.map(|frame| frame.captured.ns())
}

#[test]
fn a_device_that_is_quicker_than_the_tracker_loses_images_and_none_comes_late() {
    let (sender, source) = handed(false);
    let mut tracked = Tracked::new(source, TrackerConfig::default()).unwrap();
    // The last one's hand-over ends when it is read, so the fourth lies in the slot for sure.
    for number in 1..=5 {
        sender.send(frame(number)).unwrap();
    }
    drop(sender);
    let mut seen = Vec::new();
    while let Some(number) = captured(&mut tracked) {
        seen.push(number);
    }
    assert_eq!(seen.last(), Some(&5));
    assert!(seen.is_sorted() && seen[0] >= 4, "{seen:?}");
    let skipped = tracked.skipped().load(Ordering::Relaxed);
    assert_eq!(skipped + seen.len() as u64, 5);
}

/// A camera that gives an image every `every_ms` of a made-up time and a tracker that takes `busy_ms` for each; gives the delay
/// from the light to the skeleton of each image that was tracked, and how many were not.
fn in_made_up_time(every_ms: i64, busy_ms: i64, until_ms: i64) -> (Vec<i64>, u64) {
    let (slot, skipped) = (Slot::default(), AtomicU64::new(0));
    let camera = Intrinsics::from_view(160, 120, 1.0, 0.75);
    let (mut now, mut next, mut delays) = (0, 0, Vec::new());
    while now < until_ms {
        // What the camera gave while the tracker was busy; or the tracker waits for what comes.
        loop {
            let waits = slot.lock().newest.is_none();
            if next > now && !waits {
                break;
            }
            now = now.max(next);
            slot.put(frame(next).map(Some), camera, &skipped);
            next += every_ms;
        }
        let taken = slot.take().unwrap().unwrap();
        now += busy_ms;
        delays.push(now - taken.frame.captured.ns());
    }
    (delays, skipped.into_inner())
}

#[test]
fn a_tracker_that_is_too_slow_gives_fewer_skeletons_and_none_of_them_later() {
    let (quick, none) = in_made_up_time(33, 20, 60_000);
    assert_eq!((none, quick.len()), (0, 60_000 / 33 + 1));
    assert!(quick.iter().all(|delay| *delay == 20));
    for busy_ms in [40, 100, 330] {
        let (delays, skipped) = in_made_up_time(33, busy_ms, 60_000);
        let worst = delays.iter().max().unwrap();
        assert!(*worst <= busy_ms + 33, "{worst} ms at {busy_ms}");
        // It is never idle either: as many as there is time for.
        let most = 60_000 / busy_ms + 1;
        assert!(delays.len() as i64 >= most - 1, "{}", delays.len());
        let given = delays.len() as u64 + skipped;
        assert!(given.abs_diff(60_000 / 33) <= 330 / 33 + 1, "{given}");
    }
}

#[test]
fn a_file_is_tracked_image_by_image() {
    let (sender, source) = handed(true);
    let mut tracked = Tracked::new(source, TrackerConfig::default()).unwrap();
    let feeder = std::thread::spawn(move || {
        (1..=5).for_each(|number| sender.send(frame(number)).unwrap());
    });
    let seen: Vec<i64> = std::iter::from_fn(|| captured(&mut tracked)).collect();
    assert_eq!(seen, [1, 2, 3, 4, 5]);
    feeder.join().unwrap();
}

#[test]
fn trouble_passes_and_an_image_of_another_size_is_trouble_too() {
    let (sender, source) = handed(false);
    let mut tracked = Tracked::new(source, TrackerConfig::default()).unwrap();
    let wrong = DepthFrame {
        image: DepthImage::empty(80, 60),
        ..frame(1).unwrap()
    };
    sender.send(Ok(wrong)).unwrap();
    let trouble = tracked.next_frame().unwrap_err();
    assert!(
        matches!(&trouble, SourceError::Trouble(why) if why.contains("[80, 60]")),
        "{trouble}"
    );
    let feeder = std::thread::spawn(move || {
        sender
            .send(Err(SourceError::Trouble("unplugged".into())))
            .unwrap();
        sender.send(frame(2)).unwrap();
    });
    let trouble = tracked.next_frame().unwrap_err();
    assert_eq!(trouble, SourceError::Trouble("unplugged".into()));
    assert_eq!(captured(&mut tracked), Some(2));
    assert_eq!(captured(&mut tracked), None);
    feeder.join().unwrap();
}

/// A source with a fault in it.
struct Faulty;

impl DepthSource for Faulty {
    fn model(&self) -> String {
        "faulty".into()
    }
    fn intrinsics(&self) -> Intrinsics {
        Intrinsics::from_view(160, 120, 1.0, 0.75)
    }
    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError> {
        panic!("a fault of the source")
    }
}

#[test]
fn a_reader_that_panics_ends_the_sensor_and_does_not_silence_it() {
    let mut tracked = Tracked::new(Box::new(Faulty), TrackerConfig::default()).unwrap();
    for _ in 0..2 {
        let end = tracked.next_frame().unwrap_err();
        assert!(
            matches!(&end, SourceError::Final(why) if why.contains("the depth reader failed")),
            "{end}"
        );
    }
}
