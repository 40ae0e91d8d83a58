//! Wrong and damaged models are refused with the reason and what to do; nothing panics.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::fs;
use std::path::{Path, PathBuf};

use posefuse_models::{
    BackendChoice, Config, Device, Kind, Library, ModelFile, NeuralModel, NoRuntime, Refused,
};
use tempfile::TempDir;

mod support;
use support::{fixture, fixtures, on};

/// A copy of a test network's files that may be spoilt.
struct Copy(TempDir);

impl Copy {
    fn of(name: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for kind in ["toml", "onnx"] {
            let file = format!("{name}.{kind}");
            fs::copy(fixtures().join(&file), folder.path().join(&file)).unwrap();
        }
        Self(folder)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.0.path().join(file)
    }

    /// Reads the model after `change` to its manifest.
    fn with(
        &self,
        name: &str,
        change: impl FnOnce(String) -> String,
    ) -> Result<ModelFile, Refused> {
        let path = self.path(&format!("{name}.toml"));
        let text = fs::read_to_string(&path).unwrap();
        let changed = change(text.clone());
        assert_ne!(text, changed, "nothing was changed");
        fs::write(&path, changed).unwrap();
        ModelFile::read(&path)
    }
}

fn changed(from: &str, to: &str) -> Refused {
    let copy = Copy::of("tiny-gru");
    copy.with("tiny-gru", |text| text.replace(from, to))
        .unwrap_err()
}

fn says(refused: &Refused, parts: &[&str]) {
    let text = refused.to_string();
    for part in parts {
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
}

#[test]
fn a_manifest_that_cannot_be_is_refused_with_what_was_expected() {
    let newer = changed("version = 1", "version = 2\nsurprise = true");
    assert!(
        matches!(
            newer,
            Refused::Newer {
                found: 2,
                known: 1,
                ..
            }
        ),
        "{newer}"
    );
    says(&newer, &["newer posefuse"]);
    for (from, to, parts) in [
        (
            "kinect-v2-25",
            "smpl-24",
            ["unknown joint set `smpl-24`", "`kinect-v2-25`"],
        ),
        ("after = 0", "after = 2", ["live model", "found 2"]),
        (
            "before = 7",
            "before = 6",
            ["expected input", "found N x 8"],
        ),
        (
            "[\"N\", 8, 25, 3], unit = \"m\"",
            "[\"N\", 8, 20, 3], unit = \"m\"",
            ["`pose`", "found N x 8 x 20 x 3"],
        ),
        (
            "unit = \"s\"",
            "unit = \"ms\"",
            ["`age` in unit `s`", "found `ms`"],
        ),
        (
            "age = {",
            "agee = {",
            ["`age` is missing", "models/data/README.md"],
        ),
        ("batch = \"dynamic\"", "batch = 4", ["`batch", "found 4"]),
        ("rate_hz", "rate_hx", ["rate_hx", "did you mean `rate_hz`"]),
        (
            "sha256 = \"",
            "sha256 = \"zz",
            ["64 hexadecimal digits", "zz"],
        ),
        (
            "version = 1",
            "version = \"one\"",
            ["expected `version = 1`", "tiny-gru.toml"],
        ),
        ("kind = \"live\"", "kind = [", ["not TOML", "tiny-gru.toml"]),
    ] {
        let refused = changed(from, to);
        assert!(
            matches!(refused, Refused::Manifest { .. }),
            "{from}: {refused}"
        );
        says(&refused, &parts);
    }
}

#[test]
fn a_file_that_is_not_the_described_one_is_refused() {
    let copy = Copy::of("tiny-gru");
    let onnx = copy.path("tiny-gru.onnx");
    let whole = fs::read(&onnx).unwrap();
    fs::write(&onnx, &whole[..whole.len() / 2]).unwrap();
    let refused = ModelFile::read(&copy.path("tiny-gru.toml")).unwrap_err();
    assert!(matches!(refused, Refused::Damaged { .. }), "{refused}");
    says(&refused, &["tiny-gru.onnx", "cut off", "fetch both again"]);
    fs::remove_file(&onnx).unwrap();
    let refused = ModelFile::read(&copy.path("tiny-gru.toml")).unwrap_err();
    assert!(matches!(refused, Refused::Unreadable { .. }), "{refused}");
    says(&refused, &["tiny-gru.onnx", "NAME.onnx in one folder"]);
}

#[test]
fn a_renamed_model_is_refused() {
    let copy = Copy::of("tiny-gru");
    for kind in ["toml", "onnx"] {
        let file = |name: &str| copy.path(&format!("{name}.{kind}"));
        fs::rename(file("tiny-gru"), file("mine")).unwrap();
    }
    let refused = ModelFile::read(&copy.path("mine.toml")).unwrap_err();
    says(&refused, &["its name is `tiny-gru`"]);
}

/// A model whose bytes are spoilt and whose manifest tells of the spoilt bytes.
fn spoilt(copy: &Copy, name: &str, bytes: &[u8]) -> Result<NeuralModel, Refused> {
    use sha2::Digest;
    fs::write(copy.path(&format!("{name}.onnx")), bytes).unwrap();
    let digest = sha2::Sha256::digest(bytes);
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let old = fixture(name).manifest.sha256;
    let file = copy.with(name, |text| text.replace(&old, &digest))?;
    NeuralModel::open(&file, &on(BackendChoice::Rten))
}

#[test]
fn nonsense_with_the_right_hash_is_refused_by_the_runtime() {
    let whole = fs::read(fixtures().join("tiny-gru.onnx")).unwrap();
    let texts: [&[u8]; 3] = [b"", b"not a network at all", &[0xff; 400]];
    for bytes in texts {
        let refused = spoilt(&Copy::of("tiny-gru"), "tiny-gru", bytes)
            .err()
            .unwrap();
        assert!(
            matches!(refused, Refused::Network { .. } | Refused::Ports { .. }),
            "{refused}"
        );
    }
    // Cut off or changed anywhere: refused or, where only a weight changed, run; never a panic.
    for cut in (1..whole.len()).step_by(whole.len() / 12) {
        if let Err(refused) = spoilt(&Copy::of("tiny-gru"), "tiny-gru", &whole[..cut]) {
            assert!(!refused.to_string().is_empty());
        }
        let mut flipped = whole.clone();
        flipped[cut] ^= 0x5a;
        let _ = spoilt(&Copy::of("tiny-gru"), "tiny-gru", &flipped);
    }
}

fn refused(name: &str) -> Refused {
    let opened = NeuralModel::open(&fixture(name), &on(BackendChoice::Rten));
    opened.err().unwrap()
}

#[test]
fn a_network_that_is_not_as_described_or_gives_nonsense_is_refused() {
    let blind = refused("blind");
    assert!(matches!(blind, Refused::Ports { .. }), "{blind}");
    says(&blind, &["no input `age`", "export both anew"]);
    let strange = refused("strange");
    assert!(matches!(strange, Refused::Network { .. }), "{strange}");
    says(&strange, &["rten", "Sparkle", "models.backend"]);
    let lost = refused("lost");
    assert!(matches!(lost, Refused::Nonsense { .. }), "{lost}");
    says(&lost, &["m away from the person"]);
    let copy = Copy::of("tiny-conv");
    let file = copy.with("tiny-conv", |text| {
        text.replace("before = 4", "before = 5")
            .replace(", 8, 25", ", 9, 25")
    });
    let opened = NeuralModel::open(&file.unwrap(), &on(BackendChoice::Rten));
    let long = opened.err().unwrap();
    assert!(matches!(long, Refused::Ports { .. }), "{long}");
    says(&long, &["any x 8 x 25", "N x 9 x 25"]);
}

#[test]
fn an_unknown_name_is_answered_with_those_there_are() {
    let config = Config {
        folder: fixtures(),
        ..Config::default()
    };
    let library = Library::new(&config);
    assert!(
        library.names().contains(&"tiny-gru".to_owned()),
        "{:?}",
        library.names()
    );
    assert!(library.read("tiny-gru").is_ok());
    let by_path = fixtures().join("tiny-gru.toml");
    assert!(Library::default().read(by_path.to_str().unwrap()).is_ok());
    let refused = library.read("tiny-gro").unwrap_err();
    says(
        &refused,
        &["did you mean `tiny-gru`", "tiny-conv", "path/to/NAME.toml"],
    );
    let none = Library::default().read("default").unwrap_err();
    assert!(matches!(none, Refused::Unknown { .. }), "{none}");
}

#[test]
fn every_shipped_model_can_be_opened_and_what_auto_means_is_one_of_them() {
    let library = Library::default();
    for (name, file) in library.all() {
        let file = file.unwrap_or_else(|refused| panic!("{name}: {refused}"));
        let model = NeuralModel::open(&file, &on(BackendChoice::Rten));
        model.unwrap_or_else(|refused| panic!("{name}: {refused}"));
    }
    for kind in [Kind::Live, Kind::Offline] {
        if let Some(name) = library.default_model(kind) {
            let manifest = library.read(&name).unwrap().manifest;
            assert_eq!(manifest.kind, kind, "{name}");
        }
    }
}

#[test]
fn without_onnx_runtime_the_embedded_one_goes_on_and_the_wish_for_it_is_answered() {
    let file = fixture("tiny-gru");
    let nowhere = |backend| Config {
        onnxruntime: Path::new("/nowhere/libonnxruntime.so").into(),
        ..on(backend)
    };
    let auto = NeuralModel::open(&file, &nowhere(BackendChoice::Auto)).unwrap();
    assert_eq!(auto.runtime().name, "rten");
    let refused = NeuralModel::open(&file, &nowhere(BackendChoice::Ort))
        .err()
        .unwrap();
    let expected = [
        NoRuntime::NotBuilt,
        NoRuntime::NotThere("/nowhere/libonnxruntime.so".into()),
    ];
    assert!(
        matches!(&refused, Refused::NoRuntime(why) if expected.contains(why)),
        "{refused}"
    );
    let on_card = Config {
        device: Device::Cuda,
        ..on(BackendChoice::Rten)
    };
    says(
        &NeuralModel::open(&file, &on_card).err().unwrap(),
        &["processors only", "cuda"],
    );
}

#[cfg(feature = "ort")]
#[test]
fn a_library_that_is_none_does_not_load() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("libonnxruntime.so");
    fs::write(&library, "no library").unwrap();
    let config = Config {
        onnxruntime: library,
        ..on(BackendChoice::Ort)
    };
    let refused = NeuralModel::open(&fixture("tiny-gru"), &config)
        .err()
        .unwrap();
    assert!(
        matches!(refused, Refused::NoRuntime(NoRuntime::NotLoaded { .. })),
        "{refused}"
    );
}
