//! Which nodes of a file's skeleton make which canonical joint, for the skeletons that are in use.
//!
//! Three families: CMU's Acclaim bones; the MotionBuilder names that most BVH files and CMU's exponential maps use;
//! the Poser/DAZ names of the BVH conversions of CMU. A joint made of several nodes is their mean. `^name` is the
//! end of a node without children.

use posefuse_skeleton::{Joint, JointMap};

use super::tree::Node;

/// The nodes whose mean each joint is.
pub(crate) type Found = JointMap<Vec<usize>>;

type Table = [(Joint, &'static [&'static str])];

use Joint::*;

/// The wrist lies in the middle of Acclaim's `wrist` bone: half of it is still forearm.
const ACCLAIM: [(Joint, &[&str]); 25] = [
    (SpineBase, &["root"]),
    (SpineMid, &["upperback", "thorax"]),
    (SpineShoulder, &["lowerneck"]),
    (Neck, &["upperneck"]),
    (Head, &["head", "^head"]),
    (ShoulderLeft, &["lhumerus"]),
    (ElbowLeft, &["lradius"]),
    (WristLeft, &["lwrist", "lhand"]),
    (HandLeft, &["lfingers"]),
    (HandTipLeft, &["^lfingers"]),
    (ThumbLeft, &["^lthumb"]),
    (ShoulderRight, &["rhumerus"]),
    (ElbowRight, &["rradius"]),
    (WristRight, &["rwrist", "rhand"]),
    (HandRight, &["rfingers"]),
    (HandTipRight, &["^rfingers"]),
    (ThumbRight, &["^rthumb"]),
    (HipLeft, &["lfemur"]),
    (KneeLeft, &["ltibia"]),
    (AnkleLeft, &["lfoot"]),
    (FootLeft, &["ltoes"]),
    (HipRight, &["rfemur"]),
    (KneeRight, &["rtibia"]),
    (AnkleRight, &["rfoot"]),
    (FootRight, &["rtoes"]),
];

const MOTION_BUILDER: [(Joint, &[&str]); 25] = [
    (SpineBase, &["hips"]),
    (SpineMid, &["spine", "spine1"]),
    (SpineShoulder, &["neck"]),
    (Neck, &["neck1"]),
    (Head, &["head", "^head"]),
    (ShoulderLeft, &["leftarm"]),
    (ElbowLeft, &["leftforearm"]),
    (WristLeft, &["lefthand", "leftfingerbase"]),
    (HandLeft, &["lefthandindex1"]),
    (HandTipLeft, &["^lefthandindex1"]),
    (ThumbLeft, &["^lthumb"]),
    (ShoulderRight, &["rightarm"]),
    (ElbowRight, &["rightforearm"]),
    (WristRight, &["righthand", "rightfingerbase"]),
    (HandRight, &["righthandindex1"]),
    (HandTipRight, &["^righthandindex1"]),
    (ThumbRight, &["^rthumb"]),
    (HipLeft, &["leftupleg"]),
    (KneeLeft, &["leftleg"]),
    (AnkleLeft, &["leftfoot"]),
    (FootLeft, &["lefttoebase"]),
    (HipRight, &["rightupleg"]),
    (KneeRight, &["rightleg"]),
    (AnkleRight, &["rightfoot"]),
    (FootRight, &["righttoebase"]),
];

/// The same for skeletons that have one neck, no finger base, or no toes.
const PLAIN: [(Joint, &[&str]); 9] = [
    (SpineMid, &["spine"]),
    (Neck, &["neck"]),
    (Head, &["head"]),
    (WristLeft, &["lefthand"]),
    (WristRight, &["righthand"]),
    (HandTipLeft, &["^lefthand"]),
    (HandTipRight, &["^righthand"]),
    (FootLeft, &["^leftfoot"]),
    (FootRight, &["^rightfoot"]),
];

const DAZ: [(Joint, &[&str]); 25] = [
    (SpineBase, &["hip"]),
    (SpineMid, &["abdomen", "chest"]),
    (SpineShoulder, &["rcollar", "lcollar"]),
    (Neck, &["neck"]),
    (Head, &["head", "lefteye", "righteye"]),
    (ShoulderLeft, &["lshldr"]),
    (ElbowLeft, &["lforearm"]),
    (WristLeft, &["lhand"]),
    (HandLeft, &["lmid1"]),
    (HandTipLeft, &["^lmid2"]),
    (ThumbLeft, &["^lthumb2"]),
    (ShoulderRight, &["rshldr"]),
    (ElbowRight, &["rforearm"]),
    (WristRight, &["rhand"]),
    (HandRight, &["rmid1"]),
    (HandTipRight, &["^rmid2"]),
    (ThumbRight, &["^rthumb2"]),
    (HipLeft, &["lthigh"]),
    (KneeLeft, &["lshin"]),
    (AnkleLeft, &["lfoot"]),
    (FootLeft, &["^lfoot"]),
    (HipRight, &["rthigh"]),
    (KneeRight, &["rshin"]),
    (AnkleRight, &["rfoot"]),
    (FootRight, &["^rfoot"]),
];

/// Without these there is no body to speak of.
const NEEDED: [Joint; 13] = [
    SpineBase,
    Head,
    ShoulderLeft,
    ShoulderRight,
    ElbowLeft,
    ElbowRight,
    HipLeft,
    HipRight,
    KneeLeft,
    KneeRight,
    AnkleLeft,
    AnkleRight,
    WristLeft,
];

/// The canonical joints among `nodes`, by the family of names that gives most of them.
pub(crate) fn find_joints(nodes: &[Node]) -> Result<Found, String> {
    let mut plain = by(nodes, &MOTION_BUILDER);
    for (joint, found) in by(nodes, &PLAIN).iter() {
        if plain[joint].is_none() {
            plain[joint] = Some(found.clone());
        }
    }
    let candidates = [by(nodes, &ACCLAIM), by(nodes, &DAZ), plain];
    let best = candidates
        .into_iter()
        .max_by_key(JointMap::len)
        .unwrap_or_default();
    match NEEDED.into_iter().find(|joint| best[*joint].is_none()) {
        None => Ok(best),
        Some(missing) => Err(format!(
            "no node is known as {missing}; expected the names of CMU's ASF, of MotionBuilder (Hips, LeftUpLeg ..) \
             or of DAZ (hip, lThigh ..), found {}",
            nodes
                .iter()
                .map(|node| node.name.as_str())
                .take(12)
                .collect::<Vec<_>>()
                .join(", ")
        )),
    }
}

fn by(nodes: &[Node], table: &Table) -> Found {
    let names: Vec<String> = nodes.iter().map(|node| plain_name(&node.name)).collect();
    let node = |name: &&str| names.iter().position(|candidate| candidate == name);
    let all = |wanted: &[&str]| wanted.iter().map(node).collect::<Option<Vec<usize>>>();
    table
        .iter()
        .filter_map(|(joint, wanted)| Some((*joint, all(wanted)?)))
        .collect()
}

/// Lower case, without a `prefix:` and without separators; `^` marks an end.
fn plain_name(name: &str) -> String {
    let (end, name) = name
        .strip_prefix('^')
        .map_or(("", name), |name| ("^", name));
    let name = name.rsplit(':').next().unwrap_or(name);
    let letters = name.chars().filter(char::is_ascii_alphanumeric);
    format!("{end}{}", letters.collect::<String>().to_lowercase())
}
