//! Draws what a depth sensor or recording shows, with the people who are found in it:
//! `depth_picture DEVICE|FILE.oni OUT.png [FRAMES]` (the last of so many frames; without a number the recording's last).
//!
//! Near is bright. Bones are green where the tracker is sure of both ends, red where it is not.

use std::sync::Arc;

use posefuse_agent::source::{OpenNiConfig, openni};
use posefuse_agent::{Clock, SystemClock};
use posefuse_bodytrack::{BodyTracker, TrackedBody, TrackerConfig};
use posefuse_skeleton::{BONES, DepthImage, Intrinsics};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(device), Some(file)) = (arguments.next(), arguments.next()) else {
        return Err("usage: depth_picture DEVICE|FILE.oni OUT.png [FRAMES]".into());
    };
    let most: usize = arguments
        .next()
        .map_or(Ok(usize::MAX), |text| text.parse())?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let config = OpenNiConfig {
        device: Some(device),
        fast: true,
        ..OpenNiConfig::default()
    };
    let mut source = openni::open(&config, &clock)?;
    let mut tracker = BodyTracker::new(TrackerConfig::default(), source.intrinsics())?;
    let (mut count, mut last) = (0, None);
    while count < most {
        let Some(frame) = source.next_frame()? else {
            break;
        };
        count += 1;
        // A recording's own rhythm: the tracker looks at how people move.
        let bodies = tracker.track(&frame.image, count as i64 * 33_333_333)?;
        let seen = frame.image.millimetres.iter().filter(|&&mm| mm > 0).count();
        println!(
            "frame {count}: {seen} pixels with depth, {} people",
            bodies.len()
        );
        last = Some((frame.image, bodies));
    }
    let (image, bodies) = last.ok_or("no frame")?;
    for body in &bodies {
        tell(body);
    }
    let picture = picture(&image, &source.intrinsics(), &bodies);
    std::fs::write(&file, png(image.width, image.height, &picture))?;
    println!("{file}: {}x{}", image.width, image.height);
    Ok(())
}

fn tell(body: &TrackedBody) {
    println!(
        "person {}, facing {:?}, hands closed {:?}",
        body.id, body.facing, body.hands_closed
    );
    for (joint, (position, confidence)) in body.joints.iter() {
        let at = position.vector();
        println!(
            "  {joint:?}: {:.2} {:.2} {:.2} m, {:.2}",
            at.x,
            at.y,
            at.z,
            confidence.get()
        );
    }
}

/// Red, green, blue of each pixel.
fn picture(image: &DepthImage, camera: &Intrinsics, bodies: &[TrackedBody]) -> Vec<[u8; 3]> {
    let grey = |&mm: &u16| match mm {
        0 => [20, 20, 60],
        mm => [(255.0 * (1.0 - (f64::from(mm) / 5000.0).min(1.0)).powf(0.8)) as u8; 3],
    };
    let mut pixels: Vec<[u8; 3]> = image.millimetres.iter().map(grey).collect();
    for body in bodies {
        for bone in BONES {
            let (Some((from, sure)), Some((to, also))) =
                (&body.joints[bone.parent], &body.joints[bone.child])
            else {
                continue;
            };
            let (Some(from), Some(to)) = (camera.pixel(from), camera.pixel(to)) else {
                continue;
            };
            let sure = f64::from(sure.get().min(also.get()));
            let colour = [(255.0 * (1.0 - sure)) as u8, (255.0 * sure) as u8, 40];
            line(&mut pixels, image, from, to, colour);
        }
    }
    pixels
}

/// Three pixels wide.
fn line(pixels: &mut [[u8; 3]], image: &DepthImage, from: [f64; 2], to: [f64; 2], colour: [u8; 3]) {
    let steps = (to[0] - from[0])
        .abs()
        .max((to[1] - from[1]).abs())
        .ceil()
        .clamp(1.0, 2000.0);
    for step in 0..=steps as u32 {
        let along = f64::from(step) / steps;
        let at = [0, 1].map(|axis| (from[axis] + along * (to[axis] - from[axis])).round() as i64);
        for (du, dv) in (-1..=1).flat_map(|du| (-1..=1).map(move |dv| (du, dv))) {
            let (u, v) = (at[0] + du, at[1] + dv);
            if (0..i64::from(image.width)).contains(&u) && (0..i64::from(image.height)).contains(&v)
            {
                pixels[(v * i64::from(image.width) + u) as usize] = colour;
            }
        }
    }
}

/// A PNG file without compression (PNG specification, RFC 1950, RFC 1951).
fn png(width: u32, height: u32, pixels: &[[u8; 3]]) -> Vec<u8> {
    let rows = pixels.chunks(width as usize);
    let raw: Vec<u8> = rows
        .flat_map(|row| std::iter::once(0).chain(row.iter().flatten().copied()))
        .collect();
    let mut data = vec![0x78, 0x01];
    let blocks = raw.chunks(65_535);
    let count = blocks.len();
    for (number, block) in blocks.enumerate() {
        let size = block.len() as u16;
        data.push(u8::from(number + 1 == count));
        data.extend(size.to_le_bytes());
        data.extend((!size).to_le_bytes());
        data.extend(block);
    }
    let (mut a, mut b) = (1u32, 0u32);
    for &byte in &raw {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    data.extend((b << 16 | a).to_be_bytes());

    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = [width.to_be_bytes(), height.to_be_bytes()].concat();
    header.extend([8, 2, 0, 0, 0]);
    for (name, body) in [(b"IHDR", header), (b"IDAT", data), (b"IEND", Vec::new())] {
        file.extend((body.len() as u32).to_be_bytes());
        let chunk: Vec<u8> = name.iter().chain(&body).copied().collect();
        file.extend(&chunk);
        file.extend(crc(&chunk).to_be_bytes());
    }
    file
}

fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, &byte: &u8| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    };
    !bytes.iter().fold(!0, step)
}
