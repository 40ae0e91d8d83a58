//! Any small network: both runtimes give what the training framework gave; wrong and damaged ones are refused.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::fs;

use posefuse_models::{BackendChoice, Network, NetworkFile, Refused, onnx_runtime};

mod support;
use support::{fixtures, on};

fn tiny() -> NetworkFile {
    NetworkFile::read(&fixtures().join("networks/tiny-image.toml")).unwrap()
}

/// A manifest with one thing changed, beside the true network.
fn changed(from: &str, to: &str) -> Result<NetworkFile, Refused> {
    let read = |kind| fs::read(fixtures().join(format!("networks/tiny-image.{kind}"))).unwrap();
    let text = String::from_utf8(read("toml")).unwrap();
    let spoilt = text.replace(from, to);
    assert_ne!(text, spoilt, "nothing was changed");
    NetworkFile::from_parts(&spoilt, "tiny-image.toml", read("onnx"))
}

#[test]
fn both_runtimes_give_what_the_training_framework_gave_for_one_and_for_several_items() {
    let mut backends = vec![BackendChoice::Rten];
    match onnx_runtime(&on(BackendChoice::Ort)) {
        Ok(_) => backends.push(BackendChoice::Ort),
        Err(absent) => println!("skipped for ONNX Runtime: {absent}"),
    }
    let file = tiny();
    let stored = |name: &str| file.manifest.settings[name].as_array().unwrap().clone();
    for backend in backends {
        let mut network = Network::open(&file, &on(backend)).unwrap();
        for count in [1, 3, 2] {
            let ramp = (0..count * 40).map(|index| (index % 40) as f32 / 40.0);
            let image = network.input("image").unwrap();
            image.clear();
            image.extend(ramp);
            network.run(count).unwrap();
            for (name, key) in [("share", "ramp_share"), ("place", "ramp_place")] {
                let expected = stored(key);
                let found = network.output(name);
                assert_eq!(found.len(), count * expected.len());
                for (found, expected) in found.iter().zip(expected.iter().cycle()) {
                    let far = f64::from(*found) - expected.as_float().unwrap();
                    assert!(far.abs() < 1e-5, "{name}: {found} for {expected}");
                }
            }
        }
    }
}

#[test]
fn a_call_with_too_few_values_is_an_error_and_does_no_harm() {
    let mut network = Network::open(&tiny(), &on(BackendChoice::Rten)).unwrap();
    assert!(network.input("picture").is_none() && network.output("picture").is_empty());
    network.input("image").unwrap().resize(39, 0.0);
    let error = network.run(1).unwrap_err().to_string();
    assert!(
        error.contains("39 values for 1 items, expected 40"),
        "{error}"
    );
    network.input("image").unwrap().resize(40, 0.0);
    network.run(1).unwrap();
}

#[test]
fn what_cannot_be_is_refused_with_what_was_expected() {
    for (from, to, part) in [
        ("version = 1", "version = 9", "newer posefuse"),
        ("[\"N\", 4]", "[2, 4]", "`share` of shape N x LENGTH"),
        ("sha256 = \"", "sha256 = \"zz", "64 hexadecimal digits"),
        ("opset", "opsett", "did you mean `opset`"),
        (
            "[outputs]",
            "[inputs.other]\nshape = [\"N\"]\nunit = \"m\"\n[outputs]",
            "",
        ),
    ] {
        let read =
            changed(from, to).and_then(|file| Network::open(&file, &on(BackendChoice::Rten)));
        let text = read.err().unwrap().to_string();
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
    let ports = changed("[\"N\", 2, 4, 5]", "[\"N\", 2, 4, 6]").unwrap();
    let refused = Network::open(&ports, &on(BackendChoice::Rten))
        .err()
        .unwrap();
    assert!(matches!(refused, Refused::Ports { .. }), "{refused}");
    let file = fs::read(fixtures().join("networks/tiny-image.onnx")).unwrap();
    let text = fs::read_to_string(fixtures().join("networks/tiny-image.toml")).unwrap();
    let cut = NetworkFile::from_parts(&text, "here", file[..file.len() / 2].to_vec());
    assert!(matches!(cut, Err(Refused::Damaged { .. })));
}
