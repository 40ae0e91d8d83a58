//! Figures of a virtual sensor read through the real OpenNI2 (`docs/OPENNI.md` says how OpenNI2 finds the driver):
//!
//! - `virtual_device measure URI SECONDS`: frames a second, lost frames, how right the agent's capture times are;
//! - `virtual_device record URI SECONDS FILE.oni`: records with OpenNI2's recorder, replays, compares;
//! - `virtual_device replug URI CONTROL TIMES`: pulls it out and plugs it in by the control file (which must say nothing of
//!   `plugged` itself), and measures how long its images are away.
//!
//! Times are compared with the truth where `drift_ppm` and `delay_ms` are 0 in the control file.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use posefuse_agent::source::{OpenNiConfig, openni};
use posefuse_agent::{Clock, DepthSource, SourceError, SystemClock};
use posefuse_devices::openni::{Frame, OpenNi, Playback, Recorder};

/// From one frame to the next, ns.
const FRAME_NS: f64 = 1e9 / 30.0;
/// What an agent needs to find the least delay, seconds.
const SETTLE_S: f64 = 2.0;
/// The driver's own property: when the sensor's clock showed 0, ns since 1970.
const CLOCK_ZERO: i32 = 0x504f_0001;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["measure", uri, seconds] => measure(uri, seconds.parse()?),
        ["record", uri, seconds, file] => record(uri, seconds.parse()?, Path::new(file)),
        ["replug", uri, control, times] => replug(uri, Path::new(control), times.parse()?),
        _ => bail!("usage: virtual_device measure|record|replug ..., see the top of the example"),
    }
}

fn source(uri: &str, clock: &Arc<dyn Clock>) -> Result<Box<dyn DepthSource>> {
    let config = OpenNiConfig {
        device: Some(uri.to_owned()),
        ..OpenNiConfig::default()
    };
    Ok(openni::open(&config, clock)?)
}

fn measure(uri: &str, seconds: f64) -> Result<()> {
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let mut source = source(uri, &clock)?;
    let unix_ns = clock.unix_ns() - clock.monotonic_ns();
    // A second look at the same stream tells the sensor's own times: each frame is a thirtieth of a second after the last.
    let raw = OpenNi::load(None)?.open(Some(uri))?.depth(None)?;
    let zero_ns = raw.device().own_property(CLOCK_ZERO);
    let zero_ns = zero_ns.context("that is no virtual sensor")?;
    raw.start()?;
    let first = raw.next(Duration::from_secs(5))?.context("no frame")?;
    let first_ns = zero_ns + i64::try_from(first.timestamp_us)? * 1000 - unix_ns;

    let (mut numbers, mut errors_ns): (Vec<i64>, Vec<f64>) = (Vec::new(), Vec::new());
    let began = Instant::now();
    while began.elapsed().as_secs_f64() < seconds {
        let frame = source.next_frame()?.context("the source ended")?;
        let since = (frame.captured.ns() - first_ns) as f64;
        let number = (since / FRAME_NS).round();
        numbers.push(number as i64);
        if began.elapsed().as_secs_f64() > SETTLE_S {
            errors_ns.push(since - number * FRAME_NS);
        }
    }
    let took = began.elapsed().as_secs_f64();
    let steps = || numbers.windows(2).map(|pair| pair[1] - pair[0]);
    let lost: i64 = steps().filter(|&step| step > 1).map(|step| step - 1).sum();
    let twice = steps().filter(|&step| step < 1).count();
    println!(
        "{} frames in {took:.1} s, {:.3} a second, {lost} lost, {twice} out of order",
        numbers.len(),
        numbers.len() as f64 / took
    );
    errors_ns.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let at = |share: f64| errors_ns[((errors_ns.len() - 1) as f64 * share) as usize] * 1e-6;
    ensure!(!errors_ns.is_empty(), "measure for more than {SETTLE_S} s");
    println!(
        "capture time against the truth: median {:.3} ms, 99 % within {:.3} ms, worst {:.3} ms",
        at(0.5),
        at(0.99).abs(),
        at(1.0).abs()
    );
    Ok(())
}

fn record(uri: &str, seconds: f64, file: &Path) -> Result<()> {
    let openni = OpenNi::load(None)?;
    let stream = openni.open(Some(uri))?.depth(None)?;
    let recorder = Recorder::start(&stream, file)?;
    stream.start()?;
    let began = Instant::now();
    let mut live: Vec<Frame> = Vec::new();
    while began.elapsed().as_secs_f64() < seconds {
        live.push(stream.next(Duration::from_secs(5))?.context("no frame")?);
    }
    stream.stop();
    drop(recorder);

    let recording = openni.open(file.to_str())?;
    recording.play(Playback::OnDemand)?;
    let replayed = recording.depth(None)?;
    replayed.start()?;
    let count = replayed
        .frames()
        .context("a recording tells how many frames it has")?;
    let (mut again, mut same, mut nearly) = (Vec::new(), 0, 0);
    for _ in 0..count {
        again.push(
            replayed
                .next(Duration::from_secs(5))?
                .context("the recording ends too soon")?,
        );
    }
    // The recorder may have begun some frames before anybody read.
    let ahead = again
        .iter()
        .position(|frame| likeness(frame, &live[0]) != Likeness::Other)
        .context("the first frame is missing")?;
    for frame in &live {
        let since = frame.timestamp_us - live[0].timestamp_us;
        let twin = again[ahead..]
            .iter()
            .find(|twin| twin.timestamp_us - again[ahead].timestamp_us == since);
        match twin.map(|twin| likeness(twin, frame)) {
            Some(Likeness::Same) => same += 1,
            Some(Likeness::ButForTheEnd) => nearly += 1,
            _ => {}
        }
    }
    let bytes = std::fs::metadata(file)?.len();
    println!(
        "{} frames read, {count} in the file ({bytes} bytes); {same} identical in pixels and times, {nearly} but for the \
         last {END} pixels of the last row",
        live.len()
    );
    ensure!(same + nearly == live.len(), "frames differ");
    Ok(())
}

/// OpenNI2's compression gives a wrong value for the last pixels of a frame that ends with several alike.
const END: usize = 64;

#[derive(PartialEq)]
enum Likeness {
    Same,
    ButForTheEnd,
    Other,
}

fn likeness(one: &Frame, other: &Frame) -> Likeness {
    let (one, other) = (&one.image.millimetres, &other.image.millimetres);
    match one.iter().zip(other).position(|(one, other)| one != other) {
        None => Likeness::Same,
        Some(first) if first + END >= one.len() => Likeness::ButForTheEnd,
        Some(_) => Likeness::Other,
    }
}

fn replug(uri: &str, control: &Path, times: u32) -> Result<()> {
    let rest = std::fs::read_to_string(control)?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let mut source = source(uri, &clock)?;
    let mut away_s = Vec::new();
    for _ in 0..times {
        for _ in 0..15 {
            source.next_frame()?;
        }
        std::fs::write(control, format!("plugged = []\n{rest}"))?;
        while !matches!(source.next_frame(), Err(SourceError::Trouble(_))) {}
        std::fs::write(control, &rest)?;
        let back = Instant::now();
        while source.next_frame().is_err() {}
        away_s.push(back.elapsed().as_secs_f64());
    }
    away_s.sort_by(f64::total_cmp);
    let longest = away_s.last().context("at least once")?;
    println!(
        "{times} times out and in; images again after {:.3} s (median), {longest:.3} s (longest)",
        away_s[away_s.len() / 2]
    );
    Ok(())
}
