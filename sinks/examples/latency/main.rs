//! What sinks add: `cargo run --release -p posefuse-sinks --example latency -- [people] [seconds] [rate_hz]`.
//!
//! Simulated people through the real sinks to receivers of this machine: first those that send, then those that listen.

mod clients;
mod figures;
mod packets;
mod people;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let people: usize = arguments.next().map_or(Ok(2), |text| text.parse())?;
    let seconds: f64 = arguments.next().map_or(Ok(20.0), |text| text.parse())?;
    let rate_hz: f64 = arguments.next().map_or(Ok(30.0), |text| text.parse())?;
    let frames = people::frames(people, seconds, rate_hz);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let _entered = runtime.enter();
    println!("{people} people, {rate_hz} Hz, {} frames", frames.len());
    packets::measure(&runtime, &frames, rate_hz)?;
    let all = clients::measure_all(frames.into(), rate_hz);
    runtime.block_on(all).map_err(|error| error.to_string())?;
    Ok(())
}
