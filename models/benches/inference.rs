//! Time of one call with one window, of every shipped model and test network, on the embedded runtime beside ONNX Runtime's
//! own in the same run, one thread each.
//!
//! `cargo bench -p posefuse-models --bench inference [-- NAME...]`, with ONNX Runtime where ORT_DYLIB_PATH or a usual place
//! has it. A live model is to need no more than 2 ms a person and frame on rten.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use posefuse_fusion::{OcclusionModel, Window, WindowJoint};
use posefuse_models::{BackendChoice, Config, Kind, ModelFile, NeuralModel, onnx_runtime};
use posefuse_skeleton::JOINT_COUNT;

/// What a live model may take.
const AIM_MS: f64 = 2.0;
/// Each model is run for so long after a tenth of it to warm up, but no less than `LEAST` times.
const TIME: Duration = Duration::from_millis(1500);
const LEAST: usize = 30;

fn main() {
    let names: Vec<String> = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"))
        .collect();
    let ort = onnx_runtime(&Config::default());
    match &ort {
        Ok(runtime) => println!(
            "{runtime}, {}",
            runtime
                .library
                .as_deref()
                .unwrap_or(Path::new(""))
                .display()
        ),
        Err(why) => println!("without ONNX Runtime: {why}"),
    }
    println!(
        "{:<20} {:>6} {:>9} {:>26} {:>26} {:>6}",
        "ms a window", "KiB", "poses", "rten least/median/p99", "ort least/median/p99", "ratio"
    );
    let mut missed = Vec::new();
    for path in manifests() {
        let file = match ModelFile::read(&path) {
            Ok(file) => file,
            Err(refused) => {
                println!("{refused}");
                continue;
            }
        };
        let name = file.manifest.name.clone();
        if !names.is_empty() && !names.contains(&name) {
            continue;
        }
        let rten = times(&file, BackendChoice::Rten);
        let other = ort
            .is_ok()
            .then(|| times(&file, BackendChoice::Ort))
            .flatten();
        let shown = |times: &Option<Times>| {
            times.as_ref().map_or("-".to_owned(), |times| {
                format!("{:.3}/{:.3}/{:.3}", times.least, times.median, times.p99)
            })
        };
        let ratio = rten
            .as_ref()
            .zip(other.as_ref())
            .map(|(rten, other)| rten.least / other.least);
        let poses = format!("{} of {}", file.manifest.filled(), file.manifest.poses());
        println!(
            "{:<20} {:>6} {:>9} {:>26} {:>26} {:>6}",
            name,
            file.onnx().len() / 1024,
            poses,
            shown(&rten),
            shown(&other),
            ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"))
        );
        let slow = rten.is_none_or(|rten| rten.least > AIM_MS);
        if slow && file.manifest.kind == Kind::Live {
            missed.push(name);
        }
    }
    match missed.is_empty() {
        true => println!("aim, live models <= {AIM_MS} ms: reached"),
        false => println!(
            "aim, live models <= {AIM_MS} ms: missed by {}",
            missed.join(", ")
        ),
    }
}

/// Milliseconds.
struct Times {
    /// Equal calls make equal work, so the least is what a call costs; the rest is what else the machine did.
    least: f64,
    median: f64,
    p99: f64,
}

fn times(file: &ModelFile, backend: BackendChoice) -> Option<Times> {
    let config = Config {
        backend,
        ..Config::default()
    };
    let mut model = NeuralModel::open(file, &config)
        .map_err(|refused| println!("{refused}"))
        .ok()?;
    let window = window(&file.manifest);
    let wanted = match file.manifest.kind {
        Kind::Live => window.poses.len() - 1..window.poses.len(),
        Kind::Offline => file.manifest.before..file.manifest.before + 1,
    };
    let mut times = Vec::new();
    let began = Instant::now();
    loop {
        let call = Instant::now();
        model.fill(&window, wanted.clone()).ok()?;
        let took = call.elapsed();
        let so_far = began.elapsed();
        if so_far > TIME / 10 {
            times.push(took.as_secs_f64() * 1e3);
        }
        if so_far > TIME && times.len() >= LEAST {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    Some(Times {
        least: times[0],
        median: times[times.len() / 2],
        p99: times[times.len() * 99 / 100],
    })
}

/// Somebody who sways; the last third of the joints were lost half-way.
fn window(manifest: &posefuse_models::Manifest) -> Window {
    let count = manifest.poses();
    let step_s = 1.0 / manifest.rate_hz;
    let pose = |number: usize| {
        std::array::from_fn(|joint| {
            let hidden = number > count / 2 && joint >= 2 * JOINT_COUNT / 3;
            let seen = if hidden { count / 2 } else { number };
            let sway = 0.2 * (seen as f64 * step_s + joint as f64).sin();
            WindowJoint {
                position: Vector3::new(sway, 0.1 * joint as f64 - 1.2, 0.07 * joint as f64),
                weight: if hidden { 0.0 } else { 1.0 },
                confidence: if hidden { 0.0 } else { 1.0 },
                age_s: ((number - seen) as f64 * step_s) as f32,
            }
        })
    };
    Window {
        step_s,
        poses: (0..count).map(pose).collect(),
    }
}

fn manifests() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = ["data", "tests/fixtures"].into_iter().flat_map(|folder| {
        let entries = std::fs::read_dir(root.join(folder))
            .into_iter()
            .flatten()
            .flatten();
        entries.map(|entry| entry.path())
    });
    let is_model = |path: &PathBuf| {
        let name = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default();
        let own = path.starts_with(root.join("data")) && name != "default";
        path.extension().is_some_and(|kind| kind == "toml") && (own || name.starts_with("tiny-"))
    };
    let mut manifests: Vec<PathBuf> = files.filter(is_model).collect();
    manifests.sort();
    manifests
}
