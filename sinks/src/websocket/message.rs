//! The messages, as serde writes them. Missing joints are absent; lengths are rounded to 0.1 mm.

use posefuse_kinematics::{Figure, HandState, Rig};
use posefuse_skeleton::{BONES, Joint, JointState, Provenance, Room, Track, TrackId};
use serde::{Serialize, Serializer};

/// The version of the schema; a new one may drop fields, the same one may only gain some.
const VERSION: u32 = 1;

/// What a client is told first.
#[derive(Serialize)]
pub(super) struct Hello {
    r#type: &'static str,
    version: u32,
    server: &'static str,
    units: &'static str,
    axes: Axes,
    joints: [&'static str; Joint::ALL.len()],
    bones: Vec<[&'static str; 2]>,
    bodies: bool,
    /// 0: every frame.
    rate_hz: f64,
}

#[derive(Serialize)]
struct Axes {
    x: &'static str,
    y: &'static str,
    z: &'static str,
    handedness: &'static str,
}

impl Hello {
    pub(super) fn new(bodies: bool, rate_hz: f64) -> Self {
        Self {
            r#type: "hello",
            version: VERSION,
            server: env!("CARGO_PKG_VERSION"),
            units: "metres",
            axes: Axes {
                x: "forward",
                y: "left",
                z: "up",
                handedness: "right",
            },
            joints: Joint::ALL.map(Joint::name),
            bones: BONES
                .iter()
                .map(|bone| [bone.parent.name(), bone.child.name()])
                .collect(),
            bodies,
            rate_hz,
        }
    }
}

/// The bones of a person, before the first frame that turns them.
#[derive(Serialize)]
pub(super) struct RigMessage<'a> {
    r#type: &'static str,
    person: u64,
    revision: u32,
    bones: Vec<RigBone<'a>>,
}

#[derive(Serialize)]
struct RigBone<'a> {
    name: &'a str,
    parent: Option<&'a str>,
    offset: [f64; 3],
}

impl<'a> RigMessage<'a> {
    pub(super) fn new(person: TrackId, revision: u32, rig: &'a Rig) -> Self {
        let bones = rig.bones.iter().map(|bone| RigBone {
            name: &bone.name,
            parent: bone.parent.map(|parent| rig.bones[parent].name.as_str()),
            offset: metres(bone.offset.into()),
        });
        Self {
            r#type: "rig",
            person: person.0,
            revision,
            bones: bones.collect(),
        }
    }
}

/// What of a frame is the client's own.
#[derive(Serialize)]
pub(super) struct Head {
    pub(super) r#type: &'static str,
    pub(super) number: u64,
    /// The server's clock, seconds.
    pub(super) time_s: f64,
    /// Civil time; a string, for a JavaScript number holds no nanoseconds.
    pub(super) unix_ns: String,
    pub(super) joined: Vec<u64>,
    pub(super) left: Vec<u64>,
}

impl Head {
    /// The whole message: this, and people that are shared with other clients.
    pub(super) fn with_people(&self, people: &str) -> String {
        let head = serde_json::to_string(self).unwrap_or_default();
        let head = head.trim_end_matches('}');
        format!("{head},\"people\":{people}}}")
    }
}

/// One person.
#[derive(Serialize)]
pub(super) struct Person<'a> {
    id: u64,
    joints: ByJoint<'a, [f64; 3]>,
    confidence: ByJoint<'a, f64>,
    provenance: ByJoint<'a, &'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    hands: Option<Hands>,
    #[serde(skip_serializing_if = "Option::is_none")]
    body: Option<Body<'a>>,
}

#[derive(Serialize)]
struct Hands {
    left: Option<&'static str>,
    right: Option<&'static str>,
}

#[derive(Serialize)]
struct Body<'a> {
    revision: u32,
    root: [f64; 3],
    rotations: Rotations<'a>,
}

impl<'a> Person<'a> {
    /// With the body only where `bodies` are asked for and this person has one.
    pub(super) fn new(track: &'a Track, figure: Option<&'a Figure>, bodies: bool) -> Self {
        let hand = |hand: &Option<HandState>| {
            let closed = hand.as_ref()?.closed;
            Some(if closed { "closed" } else { "open" })
        };
        let hands = figure.map(|figure| Hands {
            left: hand(&figure.hands[0]),
            right: hand(&figure.hands[1]),
        });
        let body = figure.filter(|_| bodies).map(|figure| Body {
            revision: figure.revision,
            root: metres(figure.pose.root.vector().into()),
            rotations: Rotations(figure),
        });
        Self {
            id: track.id.0,
            joints: ByJoint(track, |state| metres(state.position.vector().into())),
            confidence: ByJoint(track, |state| {
                rounded(f64::from(state.confidence.get()), 1e3)
            }),
            provenance: ByJoint(track, |state| match state.provenance {
                Provenance::Measured(_) => "measured",
                Provenance::Predicted(_) => "predicted",
                Provenance::Repaired => "repaired",
            }),
            hands: hands.filter(|hands| hands.left.is_some() || hands.right.is_some()),
            body,
        }
    }
}

/// Something of each joint that there is, by its name.
struct ByJoint<'a, T>(&'a Track, fn(&JointState<Room>) -> T);

impl<T: Serialize> Serialize for ByJoint<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(track, of) = self;
        let joints = track.skeleton.iter();
        serializer.collect_map(joints.map(|(joint, state)| (joint.name(), of(state))))
    }
}

/// Each bone's turn against its parent's axes, `[x, y, z, w]`.
struct Rotations<'a>(&'a Figure);

impl Serialize for Rotations<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(figure) = self;
        let turns = figure.rig.bones.iter().zip(&figure.pose.rotations);
        serializer.collect_map(turns.map(|(bone, turn)| {
            let turn = [turn.i, turn.j, turn.k, turn.w];
            (&bone.name, turn.map(|part| rounded(part, 1e6)))
        }))
    }
}

fn metres(at: [f64; 3]) -> [f64; 3] {
    at.map(|part| rounded(part, 1e4))
}

fn rounded(value: f64, parts: f64) -> f64 {
    // Never "-0".
    (value * parts).round() / parts + 0.0
}
