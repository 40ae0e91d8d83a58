//! Pulls a virtual sensor out and plugs it in again while a take is recorded, by real processes of `posefuse`:
//! `unplug_take POSEFUSE CONTROL TIMES [OUT_S IN_S]`, with OPENNI2_REDIST and POSEFUSE_VIRTUAL=CONTROL set as in
//! `docs/OPENNI.md`. Prints what the take holds; fails if it is not whole, or a gap is not marked.
//!
//! The control file must say nothing of `plugged` itself.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use posefuse_session::{DiskStorage, TakeReader, TakeState};

const PORT: u16 = 7479;

/// A process that is ended with this.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [program, control, times, rest @ ..] = arguments.as_slice() else {
        anyhow::bail!("usage: unplug_take POSEFUSE CONTROL TIMES [OUT_S IN_S]");
    };
    let (times, control): (u32, &Path) = (times.parse()?, control.as_ref());
    let seconds = |index: usize, usual: f64| rest.get(index).map_or(Ok(usual), |text| text.parse());
    let (out_s, in_s) = (seconds(0, 2.5)?, seconds(1, 4.5)?);
    let folder = tempfile::tempdir()?;
    let room = std::fs::read_to_string(control)?;

    let (url, listen) = (
        format!("http://127.0.0.1:{PORT}"),
        format!("127.0.0.1:{PORT}"),
    );
    let takes = folder.path().to_string_lossy().into_owned();
    let calibration = folder
        .path()
        .join("none.toml")
        .to_string_lossy()
        .into_owned();
    let start = |arguments: &[&str]| -> Result<Running> {
        let child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        Ok(Running(
            child.with_context(|| format!("cannot start {program}"))?,
        ))
    };
    let _server = start(&[
        "server",
        "--listen",
        &listen,
        "--takes",
        &takes,
        "--calibration",
        &calibration,
    ])?;
    sleep(Duration::from_secs(2));
    let _agent = start(&[
        "agent",
        "openni",
        "--name",
        "virtual",
        "--device",
        "posefuse-0",
        "--server",
        &url,
    ])?;
    sleep(Duration::from_secs(6));
    let length_s = f64::from(times) * (out_s + in_s) + 2.0;
    let mut recorder = start(&[
        "record",
        "unplugged",
        "--server",
        &url,
        "--seconds",
        &length_s.to_string(),
    ])?;
    let began = Instant::now();
    sleep(Duration::from_secs(1));
    for _ in 0..times {
        std::fs::write(control, format!("plugged = []\n{room}"))?;
        sleep(Duration::from_secs_f64(out_s));
        std::fs::write(control, &room)?;
        sleep(Duration::from_secs_f64(in_s));
    }
    let ended = recorder.0.wait()?;
    println!(
        "recorded for {:.1} s, ended {ended}",
        began.elapsed().as_secs_f64()
    );
    look(folder.path(), times)
}

fn look(folder: &Path, times: u32) -> Result<()> {
    let storage = DiskStorage::new(folder)?;
    let reader = TakeReader::open(&storage, "unplugged")?;
    let info = reader.info();
    println!(
        "take: {:?}, {:.1} s, {} frames, {} + {} dropped {}",
        info.state,
        info.duration_ns as f64 * 1e-9,
        info.frames,
        info.dropped,
        info.dropped_outputs,
        info.trouble
    );
    let mut captured: Vec<i64> = Vec::new();
    for observation in reader.observations() {
        captured.push(observation?.captured.ns());
    }
    let steps: Vec<f64> = captured
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) as f64 * 1e-9)
        .collect();
    let gaps: Vec<f64> = steps.iter().copied().filter(|&step| step > 1.0).collect();
    println!(
        "sensor frames: {}, gaps over 1 s: {} (longest {:.2} s)",
        captured.len(),
        gaps.len(),
        gaps.iter().copied().fold(0.0, f64::max)
    );
    let (mut stalled, mut live) = (0, 0);
    for event in reader.events() {
        let event = event?;
        stalled += u32::from(event.kind == "sensor-stalled");
        live += u32::from(event.kind == "sensor-live");
    }
    println!("marked: {stalled} times stalled, {live} times live again");
    ensure!(
        info.state == TakeState::Complete && info.dropped + info.dropped_outputs == 0,
        "the take is not whole"
    );
    ensure!(
        gaps.len() == times as usize && stalled == times && live == times,
        "not every gap is there and marked"
    );
    ensure!(steps.iter().all(|&step| step > 0.0), "times do not grow");
    Ok(())
}
