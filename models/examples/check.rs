//! Whether the program would take a model, on each runtime, and how near that comes to what was stored at its export.
//!
//! `cargo run -p posefuse-models --example check -- models/data/NAME.toml...`

use std::path::Path;
use std::process::ExitCode;

use posefuse_models::{BackendChoice, Config, ModelFile, agreement, onnx_runtime};

fn main() -> ExitCode {
    let mut good = true;
    for path in std::env::args().skip(1) {
        good &= check(Path::new(&path));
    }
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn check(path: &Path) -> bool {
    let file = match ModelFile::read(path) {
        Ok(file) => file,
        Err(refused) => {
            println!("refused: {refused}");
            return false;
        }
    };
    println!(
        "{}: {} bytes, {:?}",
        file.manifest.name,
        file.onnx().len(),
        file.manifest.needs()
    );
    let mut good = true;
    for backend in [BackendChoice::Rten, BackendChoice::Ort] {
        let config = Config {
            backend,
            ..Config::default()
        };
        if backend == BackendChoice::Ort
            && let Err(why) = onnx_runtime(&config)
        {
            println!("  not compared: {why}");
            continue;
        }
        match agreement(&file, &config) {
            Ok(Some(found)) => {
                let near = found.filled_m.max(found.sigma_m) <= 1e-4;
                let word = if near { "agrees" } else { "DIFFERS" };
                println!(
                    "  {}: {word}, {:.1e} m and sigma {:.1e} m; {:.2} ms a window",
                    found.runtime,
                    found.filled_m,
                    found.sigma_m,
                    1e3 * found.latency_s
                );
                good &= near;
            }
            Ok(None) => println!("  {backend:?}: opens; no stored outputs to compare with"),
            Err(refused) => {
                println!("  refused: {refused}");
                good = false;
            }
        }
    }
    good
}
