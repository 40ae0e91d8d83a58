//! Pictures of what a simulated depth sensor sees, and how long one image takes.
//!
//! `cargo run --release -p posefuse-simulator --example depth -- OUT [SEED] [PEOPLE]` writes OUT/00.pgm ... (brightness falls with
//! distance; black where the sensor has none).

use std::error::Error;
use std::path::Path;
use std::time::Instant;
use std::{fs, io};

use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{Layout, Scenario, World};
use posefuse_skeleton::DepthImage;

const PICTURES: usize = 8;
const TIMED: usize = 200;
/// Where brightness ends, millimetres.
const FAR_MM: u32 = 5000;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments
        .first()
        .ok_or("expected: depth OUT [SEED] [PEOPLE]")?;
    let number = |index: usize, otherwise: &str| -> Result<u64, Box<dyn Error>> {
        let text = arguments.get(index).map_or(otherwise, String::as_str);
        Ok(text.parse()?)
    };
    let world = World::new(&Scenario {
        seed: number(1, "1")?,
        people: number(2, "2")? as usize,
        layout: Layout::Arc,
        ..Scenario::default()
    })?;
    fs::create_dir_all(out)?;
    for index in 0..PICTURES {
        let camera = if index % 2 == 0 {
            DepthCamera::structured_light(640, 480)
        } else {
            DepthCamera::time_of_flight(512, 424)
        };
        let sensor = index / 2 % world.sensor_count();
        let image = world.depth(sensor, 2.0 + 3.3 * index as f64, &camera);
        write(&Path::new(out).join(format!("{index:02}.pgm")), &image)?;
    }
    for [width, height] in [[320, 240], [640, 480]] {
        let camera = DepthCamera::structured_light(width, height);
        let began = Instant::now();
        let seen = (0..TIMED)
            .map(|index| world.depth(index % 4, index as f64 * 0.4, &camera))
            .filter(|image| image.millimetres.iter().any(|mm| *mm > 0))
            .count();
        let ms = began.elapsed().as_secs_f64() * 1e3 / TIMED as f64;
        println!("{width} x {height}: {ms:.2} ms an image ({seen} not empty)");
    }
    Ok(())
}

fn write(path: &Path, image: &DepthImage) -> io::Result<()> {
    let mut bytes = format!("P5 {} {} 255\n", image.width, image.height).into_bytes();
    let grey = |mm: &u16| match u32::from(*mm) {
        0 => 0,
        mm => 255 - (mm.min(FAR_MM) * 230 / FAR_MM) as u8,
    };
    bytes.extend(image.millimetres.iter().map(grey));
    fs::write(path, bytes)
}
