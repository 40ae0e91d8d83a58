//! Shows what OpenNI2 sees: `openni_look` lists the devices, `openni_look URI|SERIAL|FILE.oni [FRAMES]` prints frames.

use std::time::{Duration, Instant};

use posefuse_devices::openni::{OpenNi, Playback};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let openni = OpenNi::load(None)?;
    println!(
        "OpenNI2 {} ({})",
        openni.version(),
        openni.library().display()
    );
    for device in openni.devices()? {
        let serial = openni
            .open_uri(&device.uri)
            .ok()
            .and_then(|device| device.serial());
        println!("{device:?} serial {serial:?}");
    }
    let mut arguments = std::env::args().skip(1);
    let Some(which) = arguments.next() else {
        return Ok(());
    };
    let frames: u32 = arguments.next().map_or(Ok(10), |text| text.parse())?;
    let device = openni.open(Some(&which))?;
    println!(
        "{:?} recording: {}, modes {:?}",
        device.info(),
        device.is_recording(),
        device.depth_modes()
    );
    let registered = device.register_to_colour(false);
    println!("registration off: {registered:?}");
    if device.is_recording() {
        device.play(Playback::OnDemand)?;
    }
    let stream = device.depth(None)?;
    println!(
        "{stream:?}, {:?}, frames {:?}",
        stream.camera(),
        stream.frames()
    );
    stream.start()?;
    let began = Instant::now();
    for _ in 0..frames {
        match stream.next(Duration::from_secs(1)) {
            Ok(Some(frame)) => {
                let seen: Vec<u16> = frame
                    .image
                    .millimetres
                    .iter()
                    .copied()
                    .filter(|&mm| mm > 0)
                    .collect();
                let (least, most) = (seen.iter().min(), seen.iter().max());
                println!(
                    "{:8.4} s: frame {} at {} us, {} pixels, {least:?} to {most:?} mm",
                    began.elapsed().as_secs_f64(),
                    frame.index,
                    frame.timestamp_us,
                    seen.len()
                );
            }
            other => println!(
                "{:8.4} s: {other:?}, event {:?}",
                began.elapsed().as_secs_f64(),
                openni.next_event(Duration::ZERO)
            ),
        }
    }
    Ok(())
}
