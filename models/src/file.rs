//! A model's files, read and held against each other: manifest, network, stored outputs.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::{Manifest, Refused};

/// A model whose files fit each other. It has not been opened yet.
#[derive(Clone, Debug)]
pub struct ModelFile {
    /// Its manifest.
    pub manifest: Manifest,
    /// Where it is from: a path, or that it is part of the program.
    pub place: String,
    onnx: Cow<'static, [u8]>,
    golden: Option<Vec<u8>>,
}

impl ModelFile {
    /// Reads the manifest at `path` and the files beside it.
    ///
    /// # Errors
    /// What is missing, damaged or not understood, and what to do.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        let (place, text) = read_manifest(path)?;
        let onnx = path.with_extension("onnx");
        let golden = path.with_extension("golden.bin");
        // Only tests need the stored outputs.
        let stored = golden.is_file().then(|| read(&golden)).transpose()?;
        let file = Self::from_parts(&text, place, Cow::Owned(read(&onnx)?), stored)?;
        match path.file_stem().and_then(|stem| stem.to_str()) {
            Some(stem) if stem == file.manifest.name => Ok(file),
            _ => Err(Refused::Manifest {
                problem: format!(
                    "its name is `{}`, so its files must be called so",
                    file.manifest.name
                ),
                place: file.place,
            }),
        }
    }

    pub(crate) fn from_parts(
        text: &str,
        place: String,
        onnx: Cow<'static, [u8]>,
        golden: Option<Vec<u8>>,
    ) -> Result<Self, Refused> {
        let manifest = Manifest::parse(text, &place)?;
        check_hash(&onnx, "onnx", &manifest.sha256, &manifest.name, &place)?;
        if let (Some(bytes), Some(golden)) = (&golden, &manifest.golden) {
            check_hash(bytes, "golden.bin", &golden.sha256, &manifest.name, &place)?;
        }
        Ok(Self {
            manifest,
            place,
            onnx,
            golden,
        })
    }

    /// The network.
    pub fn onnx(&self) -> &[u8] {
        &self.onnx
    }

    /// What the training framework gave; `None` where it was not stored.
    ///
    /// # Errors
    /// The stored file has another length than the manifest says.
    pub fn golden(&self) -> Result<Option<GoldenOutputs>, Refused> {
        let (Some(bytes), Some(golden)) = (&self.golden, &self.manifest.golden) else {
            return Ok(None);
        };
        let (n, t, k) = (
            golden.windows,
            self.manifest.poses(),
            self.manifest.filled(),
        );
        let lengths = [t * 75, t * 25, t * 25, k * 75, k * 25].map(|each| n * each);
        let expected = 4 * lengths.iter().sum::<usize>();
        if bytes.len() != expected {
            return Err(Refused::Manifest {
                place: self.place.clone(),
                problem: format!(
                    "expected {expected} bytes of stored outputs for {n} windows, found {}",
                    bytes.len()
                ),
            });
        }
        let mut values = bytes
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let [pose, mask, age, filled, sigma] =
            lengths.map(|length| values.by_ref().take(length).collect());
        Ok(Some(GoldenOutputs {
            windows: n,
            pose,
            mask,
            age,
            filled,
            sigma,
        }))
    }
}

/// A manifest's place and text.
pub(crate) fn read_manifest(path: &Path) -> Result<(String, String), Refused> {
    let place = path.display().to_string();
    let text = String::from_utf8(read(path)?).map_err(|_| Refused::Manifest {
        place: place.clone(),
        problem: "not text".to_owned(),
    })?;
    Ok((place, text))
}

pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Refused> {
    fs::read(path).map_err(|error| Refused::Unreadable {
        file: path.display().to_string(),
        problem: error.to_string(),
    })
}

/// Windows and what the training framework made of them; each tensor whole, in C order.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct GoldenOutputs {
    pub windows: usize,
    pub pose: Vec<f32>,
    pub mask: Vec<f32>,
    pub age: Vec<f32>,
    pub filled: Vec<f32>,
    pub sigma: Vec<f32>,
}

/// Whether `bytes` are those of the file NAME.KIND that the manifest at `place` describes.
///
/// # Errors
/// [`Refused::Damaged`].
pub(crate) fn check_hash(
    bytes: &[u8],
    kind: &str,
    expected: &str,
    name: &str,
    place: &str,
) -> Result<(), Refused> {
    let found = hex(&Sha256::digest(bytes));
    if found == expected {
        return Ok(());
    }
    Err(Refused::Damaged {
        file: format!("{name}.{kind}"),
        place: place.to_owned(),
        bytes: bytes.len(),
        found,
        expected: expected.to_owned(),
    })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
