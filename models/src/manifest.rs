//! What is known of a model beside its weights: a TOML file next to the ONNX file.

use std::collections::BTreeMap;

use posefuse_fusion::Needs;
use posefuse_skeleton::JOINT_COUNT;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::Refused;

/// The newest manifest format this program knows.
pub const MANIFEST_VERSION: i64 = 1;
/// The joints every model speaks of, in the order of [`posefuse_skeleton::Joint::ALL`].
pub const JOINT_SET: &str = "kinect-v2-25";
/// Windows longer than a minute at 30 Hz are a mistake.
const MAX_POSES: usize = 1800;

/// A model's manifest, checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Of the format.
    pub version: i64,
    /// The model's name; its files have it, too.
    pub name: String,
    /// Whether it can run live.
    pub kind: Kind,
    /// Poses it looks at before the filled one.
    pub before: usize,
    /// Poses it looks at after it.
    pub after: usize,
    /// Poses per second.
    pub rate_hz: f64,
    /// Always [`JOINT_SET`].
    pub joint_set: String,
    /// How many windows go in at once.
    pub batch: Batch,
    /// Of ONNX.
    pub opset: u32,
    /// Of the ONNX file, 64 hexadecimal digits.
    pub sha256: String,
    /// Tensors that go in.
    pub inputs: BTreeMap<String, Port>,
    /// Tensors that come out.
    pub outputs: BTreeMap<String, Port>,
    /// What the training framework gave, to compare with.
    pub golden: Option<Golden>,
    /// For people.
    pub about: About,
    /// Its figures: name, with unit, to number or text.
    #[serde(default)]
    pub figures: BTreeMap<String, toml::Value>,
}

/// When a model can run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// It needs nothing from after the filled pose.
    Live,
    /// It looks ahead: only recordings have that.
    Offline,
}

/// How many windows a network takes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Batch {
    /// Exactly so many; only 1 is allowed.
    Fixed(usize),
    /// `"dynamic"`: any number.
    Any(Dynamic),
}

/// The word `dynamic`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dynamic {
    /// `dynamic`.
    Dynamic,
}

impl Batch {
    /// Any number of windows.
    pub const ANY: Self = Self::Any(Dynamic::Dynamic);
}

/// One tensor of 32-bit floats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Port {
    /// Its axes; the first may be `"N"`, the number of windows.
    pub shape: Vec<Axis>,
    /// Of its values.
    pub unit: String,
}

impl Port {
    /// The lengths of its axes after the first, `"N"`; `None` if they are not all given, or are more than a billion values.
    pub fn item_shape(&self) -> Option<Vec<usize>> {
        let (first, rest) = self.shape.split_first()?;
        let lengths = rest.iter().map(|axis| match axis {
            Axis::Length(length @ 1..) => Some(*length),
            _ => None,
        });
        let lengths: Vec<usize> = lengths.collect::<Option<_>>()?;
        let values = lengths
            .iter()
            .try_fold(1usize, |values, length| values.checked_mul(*length));
        let named = *first == Axis::Named("N".to_owned());
        (named && values.is_some_and(|values| values < 1_000_000_000)).then_some(lengths)
    }

    /// Its shape in words.
    pub(crate) fn shown(&self) -> String {
        shown(&self.shape)
    }
}

/// One axis of a tensor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Axis {
    /// So long.
    Length(usize),
    /// As long as there are windows, written `"N"`.
    Named(String),
}

/// Stored outputs of the training framework.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Golden {
    /// How many windows.
    pub windows: usize,
    /// Of the file `NAME.golden.bin`.
    pub sha256: String,
}

/// What people want to know of a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// In one line.
    pub summary: String,
    /// Whose method it is.
    pub source: String,
    /// Of the weights.
    pub licence: String,
    /// What it was trained on.
    pub training_data: String,
    /// How many weights.
    pub parameters: Option<u64>,
}

impl Manifest {
    /// Reads and checks a manifest; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused::Newer`], or [`Refused::Manifest`] with what was expected and found.
    pub fn parse(text: &str, place: &str) -> Result<Self, Refused> {
        let manifest: Self = parse_versioned(text, place)?;
        manifest.check().map_err(|problem| Refused::Manifest {
            place: place.to_owned(),
            problem,
        })?;
        Ok(manifest)
    }

    /// The window it needs.
    pub fn needs(&self) -> Needs {
        Needs {
            before: self.before,
            after: self.after,
            rate_hz: self.rate_hz,
        }
    }

    /// Poses in a window: T.
    pub fn poses(&self) -> usize {
        self.needs().poses()
    }

    /// Poses filled in a window: K, 1 or T. The check has seen that it is there.
    pub fn filled(&self) -> usize {
        match self
            .outputs
            .get("filled")
            .and_then(|port| port.shape.get(1))
        {
            Some(Axis::Length(length)) => *length,
            _ => 1,
        }
    }

    fn check(&self) -> Result<(), String> {
        check_name(&self.name)?;
        let within = |key: &str, found: f64, low: f64, high: f64| {
            let fits = (low..=high).contains(&found);
            fits.then_some(())
                .ok_or_else(|| format!("expected `{key}` from {low} to {high}, found {found}"))
        };
        let most = (MAX_POSES - 1) as f64;
        within("before", self.before as f64, 0.0, most)?;
        within("after", self.after as f64, 0.0, most - self.before as f64)?;
        within("rate_hz", self.rate_hz, 1.0, 240.0)?;
        within("opset", f64::from(self.opset), 7.0, 100.0)?;
        if self.kind == Kind::Live && self.after != 0 {
            return Err(format!(
                "a live model knows nothing of what comes: expected `after = 0`, found {}",
                self.after
            ));
        }
        if self.joint_set != JOINT_SET {
            return Err(format!(
                "unknown joint set `{}`, known is `{JOINT_SET}`",
                self.joint_set
            ));
        }
        if let Batch::Fixed(found) = self.batch
            && found != 1
        {
            return Err(format!(
                "expected `batch = \"dynamic\"` or 1, found {found}"
            ));
        }
        check_hash("sha256", &self.sha256)?;
        if let Some(golden) = &self.golden {
            within("golden.windows", golden.windows as f64, 1.0, 64.0)?;
            check_hash("golden.sha256", &golden.sha256)?;
        }
        self.check_ports()
    }

    fn check_ports(&self) -> Result<(), String> {
        let t = self.poses();
        let k = match self.filled() {
            k if k == 1 || k == t => k,
            found => {
                return Err(format!(
                    "expected output `filled` for 1 pose or for all {t}, found {found}"
                ));
            }
        };
        let joints = JOINT_COUNT;
        let inputs: [(&str, &[usize], &str); 3] = [
            ("pose", &[t, joints, 3], "m"),
            ("mask", &[t, joints], "1"),
            ("age", &[t, joints], "s"),
        ];
        let outputs: [(&str, &[usize], &str); 2] = [
            ("filled", &[k, joints, 3], "m"),
            ("sigma", &[k, joints], "m"),
        ];
        check_side("input", &self.inputs, &inputs, self.batch)?;
        check_side("output", &self.outputs, &outputs, self.batch)
    }
}

/// Reads a manifest of any kind, if it is of the known version.
///
/// # Errors
/// [`Refused::Newer`] or [`Refused::Manifest`].
pub(crate) fn parse_versioned<T: DeserializeOwned>(text: &str, place: &str) -> Result<T, Refused> {
    let wrong = |problem: String| Refused::Manifest {
        place: place.to_owned(),
        problem,
    };
    // Before anything else: a newer format may have keys that this one refuses.
    let table: toml::Table = text
        .parse()
        .map_err(|error: toml::de::Error| wrong(format!("not TOML: {}", error.message())))?;
    match table.get("version").and_then(toml::Value::as_integer) {
        Some(MANIFEST_VERSION) => {}
        Some(found) if found > MANIFEST_VERSION => {
            return Err(Refused::Newer {
                place: place.to_owned(),
                found,
                known: MANIFEST_VERSION,
            });
        }
        _ => return Err(wrong(format!("expected `version = {MANIFEST_VERSION}`"))),
    }
    posefuse_fusion::parse_toml(text).map_err(|error| wrong(error.to_string()))
}

fn check_side(
    side: &str,
    ports: &BTreeMap<String, Port>,
    expected: &[(&str, &[usize], &str)],
    batch: Batch,
) -> Result<(), String> {
    for (name, lengths, unit) in expected {
        let port = ports
            .get(*name)
            .ok_or_else(|| format!("{side} `{name}` is missing"))?;
        let first = match batch {
            Batch::Any(_) => Axis::Named("N".to_owned()),
            Batch::Fixed(length) => Axis::Length(length),
        };
        let rest = lengths.iter().map(|length| Axis::Length(*length));
        let shape: Vec<Axis> = std::iter::once(first).chain(rest).collect();
        if port.shape != shape {
            let (shape, found) = (shown(&shape), shown(&port.shape));
            return Err(format!(
                "expected {side} `{name}` of shape {shape}, found {found}"
            ));
        }
        if port.unit != *unit {
            let found = &port.unit;
            return Err(format!(
                "expected {side} `{name}` in unit `{unit}`, found `{found}`"
            ));
        }
    }
    let known = |name: &str| expected.iter().any(|(known, ..)| *known == name);
    match ports.keys().find(|name| !known(name)) {
        Some(name) => Err(format!("nothing is known of {side} `{name}`")),
        None => Ok(()),
    }
}

fn shown(shape: &[Axis]) -> String {
    let axes = shape.iter().map(|axis| match axis {
        Axis::Length(length) => length.to_string(),
        Axis::Named(name) => name.clone(),
    });
    axes.collect::<Vec<_>>().join(" x ")
}

pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let may = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if (1..=64).contains(&name.len()) && name.chars().all(may) {
        return Ok(());
    }
    Err(format!(
        "expected a `name` of 1 to 64 letters a-z, digits and -, found `{name}`"
    ))
}

pub(crate) fn check_hash(key: &str, found: &str) -> Result<(), String> {
    let is_hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
    if found.len() == 64 && found.chars().all(is_hex) {
        return Ok(());
    }
    Err(format!(
        "expected `{key}` of 64 hexadecimal digits in lower case, found `{found}`"
    ))
}
