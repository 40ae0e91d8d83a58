//! CMU motion as exponential maps: 117 numbers a line, comma-separated, 120 frames per second.
//!
//! Root position (1 unit = 56.44 mm), then one rotation vector (radians) for each of 38 joints: CMU's MotionBuilder
//! skeleton depth first, end sites included. The vectors rotate row vectors, that is the other way round. The first
//! line is the rest pose, not a frame.
//!
//! The files hold no bone lengths. Directions at rest are CMU's (thighs 20 degrees outwards, arms sideways, y up,
//! z forwards, x left); lengths are those of an average adult.

use nalgebra::{UnitQuaternion, Vector3};

use super::tree::{Axes, Frame, Tree};
use super::{Flaw, flaw, numbers};
use crate::motion::Clip;

const JOINTS: usize = 38;
const RATE_HZ: f64 = 120.0;
const METRES_PER_UNIT: f64 = 0.0254 / 0.45;

/// Name, parent, offset in metres.
type Piece = (&'static str, &'static str, [f64; 3]);

/// The left half of the skeleton and its middle; `Left` and `L` become `Right` and `R` on the other side.
const LEG: [Piece; 6] = [
    ("LHipJoint", "Hips", [0.0, 0.0, 0.0]),
    ("LeftUpLeg", "LHipJoint", [0.090, -0.090, 0.030]),
    ("LeftLeg", "LeftUpLeg", [0.1436, -0.3947, 0.0]),
    ("LeftFoot", "LeftLeg", [0.1402, -0.3853, 0.0]),
    ("LeftToeBase", "LeftFoot", [0.0100, -0.0280, 0.1250]),
    ("^LeftToeBase", "LeftToeBase", [0.0, 0.0, 0.065]),
];

const SPINE: [Piece; 7] = [
    ("LowerBack", "Hips", [0.0, 0.0, 0.0]),
    ("Spine", "LowerBack", [0.0, 0.120, -0.006]),
    ("Spine1", "Spine", [0.0, 0.120, 0.0]),
    ("Neck", "Spine1", [0.0, 0.120, 0.005]),
    ("Neck1", "Neck", [0.0, 0.090, 0.008]),
    ("Head", "Neck1", [0.0, 0.090, -0.008]),
    ("^Head", "Head", [0.0, 0.095, -0.004]),
];

const ARM: [Piece; 9] = [
    ("LeftShoulder", "Spine1", [0.0, 0.120, 0.005]),
    ("LeftArm", "LeftShoulder", [0.185, 0.045, -0.015]),
    ("LeftForeArm", "LeftArm", [0.285, 0.0, 0.0]),
    ("LeftHand", "LeftForeArm", [0.200, 0.0, 0.0]),
    ("LeftFingerBase", "LeftHand", [0.100, 0.0, 0.0]),
    ("LeftHandIndex1", "LeftFingerBase", [0.050, 0.0, 0.0]),
    ("^LeftHandIndex1", "LeftHandIndex1", [0.045, 0.0, 0.0]),
    ("LThumb", "LeftHand", [0.100, 0.0, 0.0]),
    ("^LThumb", "LThumb", [0.035, 0.0, 0.035]),
];

/// The motion in the text of an exponential-map file.
pub fn expmap(name: &str, text: &str) -> Result<Clip, Flaw> {
    let tree = skeleton();
    let found = tree.joints(1)?;
    let (mut frames, mut last) = (Vec::new(), 1);
    for (index, text) in text.lines().enumerate() {
        let line = index + 1;
        if text.trim().is_empty() {
            continue;
        }
        let words: Vec<&str> = text.split(',').map(str::trim).collect();
        let values = numbers(line, &words, 3 + 3 * JOINTS)?;
        // The rest pose is read, so that a broken line is seen, and left out.
        if index > 0 {
            frames.push(tree.place(&frame(&values)));
        }
        last = line;
    }
    if frames.is_empty() {
        return flaw(
            last,
            "expected a rest pose and at least one frame, found no frame",
        );
    }
    Axes::y_up(1.0).clip(name, RATE_HZ, &found, &frames, last)
}

fn frame(values: &[f64]) -> Frame {
    let triple = |at: usize| Vector3::new(values[at], values[at + 1], values[at + 2]);
    Frame {
        root: triple(0) * METRES_PER_UNIT,
        rotations: (0..JOINTS)
            .map(|joint| UnitQuaternion::from_scaled_axis(-triple(3 + 3 * joint)))
            .collect(),
    }
}

fn skeleton() -> Tree {
    let mut tree = Tree { nodes: Vec::new() };
    tree.add("Hips", None, Vector3::zeros());
    let parts: [(&[Piece], bool); 5] = [
        (&LEG, false),
        (&LEG, true),
        (&SPINE, false),
        (&ARM, false),
        (&ARM, true),
    ];
    for (part, mirrored) in parts {
        for (name, parent, [x, y, z]) in part {
            let named = |name: &str| {
                if mirrored {
                    on_the_right(name)
                } else {
                    name.to_owned()
                }
            };
            let parent = named(parent);
            let parent = tree.nodes.iter().position(|node| node.name == parent);
            let x = if mirrored { -x } else { *x };
            tree.add(&named(name), parent, Vector3::new(x, *y, *z));
        }
    }
    tree
}

fn on_the_right(name: &str) -> String {
    match name {
        "LHipJoint" | "LThumb" | "^LThumb" => name.replacen('L', "R", 1),
        _ => name.replacen("Left", "Right", 1),
    }
}
