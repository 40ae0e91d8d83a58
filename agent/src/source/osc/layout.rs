//! What the messages of different programs mean: addresses, units and axes, each by a name.

use std::fmt;
use std::str::FromStr;

use posefuse_skeleton::{Confidence, JointSet, Position, RawJoint};
use rosc::{OscMessage, OscType};
use serde::{Deserialize, Serialize};

/// Whose messages they are. A joint is called by its name or number in the joint set; `l_hand`, `left_hand` and
/// `HandLeft` are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// Our own: `/skel/PERSON/JOINT/pos x y z [confidence]` (`/pos` may be left out), `/frame` ends a frame, `/lost PERSON`.
    /// Metres, optical axes.
    #[default]
    Posefuse,
    /// KinectV2-OSC: `/bodies/PERSON/joints/JOINT x y z state`. Metres, camera space: x left, y up, z forward.
    KinectV2Osc,
    /// OSCeleton and its heirs: `/joint JOINT PERSON x y z` or `/joint/JOINT/PERSON x y z`, `/lost_user PERSON`. Scaled to
    /// about 0..1 (x, y) and 0..7 (z), mirrored.
    Osceleton,
    /// OSCeleton with real-world coordinates: the same in millimetres, x left (mirrored), y up, z forward.
    OsceletonMm,
    /// OSCeleton-KinectSDK: `/joint` or `/osceleton2/joint` with `JOINT SENSOR PERSON x y z confidence [time]`. Centimetres,
    /// x left, y down, z forward.
    OsceletonKinect,
    /// NI mate's basic format, one person: `/JOINT x y z ...`. Metres, x right, y up, z forward.
    NiMate,
}

/// What a number of the messages is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// OSCeleton's scaling: x = (1280 - X) / 2560, y = (960 - Y) / 1920, z = Z / 1280, X, Y and Z in millimetres.
    Osceleton,
}

/// Which of the messages' axes, with which sign, optical x (right), y (down) and z (forward) are: e.g. `-x,-y,z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes([(usize, i8); 3]);

impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "axes `{text}`: expected x, y and z in some order, each with or without -, e.g. -x,-y,z"
            )
        };
        let mut axes = [(0, 1); 3];
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        if parts.len() != 3 {
            return Err(wrong());
        }
        for (axis, part) in axes.iter_mut().zip(parts) {
            let (sign, name) = match part.strip_prefix('-') {
                Some(name) => (-1, name),
                None => (1, part),
            };
            let index = ["x", "y", "z"].iter().position(|known| *known == name);
            *axis = (index.ok_or_else(wrong)?, sign);
        }
        let mut used: Vec<usize> = axes.iter().map(|axis| axis.0).collect();
        used.sort_unstable();
        match used == [0, 1, 2] {
            true => Ok(Self(axes)),
            false => Err(wrong()),
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Posefuse => "posefuse",
            Self::KinectV2Osc => "kinect-v2-osc",
            Self::Osceleton => "osceleton",
            Self::OsceletonMm => "osceleton-mm",
            Self::OsceletonKinect => "osceleton-kinect",
            Self::NiMate => "ni-mate",
        })
    }
}

impl Layout {
    /// Unit and axes, where nobody says others.
    pub(super) fn usual(self) -> (Unit, Axes) {
        let axes = |x, y| Axes([(0, x), (1, y), (2, 1)]);
        match self {
            Self::Posefuse => (Unit::M, axes(1, 1)),
            Self::KinectV2Osc => (Unit::M, axes(-1, -1)),
            Self::Osceleton => (Unit::Osceleton, axes(-1, -1)),
            Self::OsceletonMm => (Unit::Mm, axes(-1, -1)),
            Self::OsceletonKinect => (Unit::Cm, axes(-1, 1)),
            Self::NiMate => (Unit::M, axes(1, -1)),
        }
    }

    /// The joint set that its programs usually send.
    pub fn usual_joint_set(self) -> JointSet {
        match self {
            Self::Posefuse | Self::KinectV2Osc => JointSet::KinectV2,
            Self::OsceletonKinect => JointSet::KinectV1,
            Self::Osceleton | Self::OsceletonMm | Self::NiMate => JointSet::Nite,
        }
    }
}

/// What one message says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Said {
    /// Where a joint of a person is; `None`: it is missing.
    Joint(u64, usize, Option<RawJoint>),
    /// What came so far is one frame.
    EndOfFrame,
    /// This person is gone.
    Lost(u64),
}

/// Reads messages of one layout into joints of one joint set.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    layout: Layout,
    unit: Unit,
    axes: Axes,
    /// The joints' names, told apart by [`key`].
    joints: Vec<String>,
}

impl Reader {
    pub(super) fn new(
        layout: Layout,
        joint_set: JointSet,
        unit: Option<Unit>,
        axes: Option<Axes>,
    ) -> Self {
        let usual = layout.usual();
        Self {
            layout,
            unit: unit.unwrap_or(usual.0),
            axes: axes.unwrap_or(usual.1),
            joints: joint_set
                .joint_names()
                .iter()
                .map(|name| key(name))
                .collect(),
        }
    }

    /// How many joints a body has.
    pub(super) fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// What `message` says, or `None` where it is none of this layout's.
    pub(super) fn read(&self, message: &OscMessage) -> Option<Said> {
        let parts: Vec<&str> = message.addr.split('/').skip(1).collect();
        let args = message.args.as_slice();
        match (self.layout, parts.as_slice()) {
            (Layout::Posefuse, ["frame"]) => Some(Said::EndOfFrame),
            (Layout::Posefuse, ["lost"]) => Some(Said::Lost(person_of(args.first()?)?)),
            (Layout::Posefuse, ["skel", person, joint] | ["skel", person, joint, "pos"]) => {
                let confidence = args.get(3).map_or(Some(1.0), number)?;
                self.joint(person_named(person), joint, args, confidence)
            }
            (Layout::KinectV2Osc, ["bodies", person, "joints", joint]) => {
                let confidence = tracking_state(args.get(3)?)?;
                self.joint(person_named(person), joint, args, confidence)
            }
            (Layout::Osceleton | Layout::OsceletonMm, ["joint", joint, person]) => {
                self.joint(person_named(person), joint, args, 1.0)
            }
            (Layout::Osceleton | Layout::OsceletonMm, ["joint"]) => match args {
                [OscType::String(joint), person, xyz @ ..] => {
                    self.joint(person_of(person)?, joint, xyz, 1.0)
                }
                _ => None,
            },
            (Layout::OsceletonKinect, ["joint"] | ["osceleton2", "joint"]) => match args {
                [OscType::String(joint), _, person, xyz @ ..] => {
                    self.joint(person_of(person)?, joint, xyz, number(xyz.get(3)?)?)
                }
                _ => None,
            },
            (Layout::NiMate, [joint]) => {
                let joint = joint.strip_prefix("skeleton_").unwrap_or(joint);
                self.joint(1, joint, args, 1.0)
            }
            (_, ["lost_user"]) => Some(Said::Lost(person_of(args.first()?)?)),
            _ => None,
        }
    }

    /// The joint at the first three of `args`. Exactly (0, 0, 0) is what trackers say of a joint that they do not see.
    fn joint(&self, person: u64, name: &str, args: &[OscType], confidence: f64) -> Option<Said> {
        let index = self.index(name)?;
        let [x, y, z, ..] = args else { return None };
        let given = [number(x)?, number(y)?, number(z)?];
        let confidence = Confidence::saturating(confidence as f32);
        if given == [0.0; 3] || confidence == Confidence::NONE {
            return Some(Said::Joint(person, index, None));
        }
        let metres = self.metres(given);
        let [x, y, z] = self
            .axes
            .0
            .map(|(axis, sign)| metres[axis] * f64::from(sign));
        let joint = RawJoint {
            position: Position::new(x, y, z),
            confidence,
        };
        Some(Said::Joint(person, index, Some(joint)))
    }

    fn metres(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self.unit {
            Unit::M => [x, y, z],
            Unit::Cm => [x, y, z].map(|value| value / 100.0),
            Unit::Mm => [x, y, z].map(|value| value / 1000.0),
            Unit::Osceleton => [1.28 - 2.56 * x, 0.96 - 1.92 * y, 1.28 * z],
        }
    }

    fn index(&self, name: &str) -> Option<usize> {
        if let Ok(number) = name.parse::<usize>() {
            return (number < self.joints.len()).then_some(number);
        }
        let key = key(name);
        self.joints.iter().position(|known| *known == key)
    }
}

/// What a joint is known by, however it is spelled: side and part, without case and separators.
fn key(name: &str) -> String {
    let mut words: Vec<String> = vec![String::new()];
    let mut after_small = false;
    for letter in name.chars().take(64) {
        let small = !letter.is_ascii_uppercase();
        if !letter.is_ascii_alphanumeric() || (after_small && !small) {
            words.push(String::new());
        }
        if let (Some(word), true) = (words.last_mut(), letter.is_ascii_alphanumeric()) {
            word.push(letter.to_ascii_lowercase());
        }
        after_small = small;
    }
    let side = |word: &String| match word.as_str() {
        "l" | "left" => Some('l'),
        "r" | "right" => Some('r'),
        _ => None,
    };
    let found = words.iter().find_map(side).unwrap_or('-');
    let part: String = words
        .into_iter()
        .filter(|word| side(word).is_none())
        .collect();
    format!("{found}{part}")
}

/// The person's number; any other name becomes a number of its own (FNV-1a).
fn person_named(name: &str) -> u64 {
    name.parse().unwrap_or_else(|_| {
        name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    })
}

fn person_of(arg: &OscType) -> Option<u64> {
    match arg {
        OscType::Int(number) => u64::try_from(*number).ok(),
        OscType::Long(number) => u64::try_from(*number).ok(),
        OscType::String(name) => Some(person_named(name)),
        _ => None,
    }
}

/// A finite number.
fn number(arg: &OscType) -> Option<f64> {
    let number = match arg {
        OscType::Float(number) => f64::from(*number),
        OscType::Double(number) => *number,
        OscType::Int(number) => f64::from(*number),
        _ => return None,
    };
    number.is_finite().then_some(number)
}

/// Kinect's tracking state as a confidence.
fn tracking_state(arg: &OscType) -> Option<f64> {
    match arg {
        OscType::String(state) => match state.as_str() {
            "Tracked" => Some(1.0),
            "Inferred" => Some(0.5),
            "NotTracked" => Some(0.0),
            _ => None,
        },
        _ => None,
    }
}
