//! Who is who at an instant, over all sensors at once: the bodies that are one person, each with its left and right put
//! right against the others'.

use nalgebra::{Isometry3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, JointMap, Position, Room, trunk_axes};

use crate::graph::Placed;
use crate::matching::{INLIER_M, Votes, match_bodies, vote};
use crate::pair::REACH_M;
use crate::tracks::{Point, Pose};

/// How much better an exchange of one part's sides must fit than none.
const EXCHANGE_MARGIN: f64 = 1.1;
/// What tells a person's own left from right, against one sensor's word for it: toes that point to where the labels say
/// the body faces; a sensor that says it sees a back (one that is mistaken takes a back for a front).
const TOES_VOTE: f64 = 2.0;
const BACK_VOTE: f64 = 2.0;

/// Which sides of a body are exchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Exchanged {
    /// Shoulders to thumbs.
    pub(crate) arms: bool,
    /// Hips to feet.
    pub(crate) legs: bool,
}

/// One sensor's body among those that are one person.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// The sensor.
    pub(crate) sensor: usize,
    /// Which of the sensor's tracks the body belongs to.
    pub(crate) track: usize,
    /// Its labels against the person's.
    pub(crate) exchanged: Exchanged,
}

impl Member {
    /// The person's `joint` as this body has it, sensor frame; `bodies` are its sensor's at this instant.
    pub(crate) fn joint<'p>(&self, joint: usize, bodies: &'p [Pose]) -> Option<&'p Point> {
        let pose = bodies.iter().find(|pose| pose.track == self.track)?;
        pose.joints[label(joint, self.exchanged)].as_ref()
    }
}

/// The bodies that are one person at an instant: two or more, by sensor.
#[derive(Clone, Debug)]
pub(crate) struct Person {
    /// Which of the instants.
    pub(crate) instant: usize,
    /// The bodies.
    pub(crate) members: Vec<Member>,
}

/// Index of the joint that a body calls `joint` of the person.
pub(crate) fn label(joint: usize, exchanged: Exchanged) -> usize {
    let other = Joint::ALL[joint].mirrored() as usize;
    let is_leg = LEGS[joint];
    if (is_leg && exchanged.legs) || (!is_leg && exchanged.arms) {
        other
    } else {
        joint
    }
}

const LEGS: [bool; JOINT_COUNT] = {
    use Joint::*;
    let mut legs = [false; JOINT_COUNT];
    let of = [
        HipLeft, KneeLeft, AnkleLeft, FootLeft, HipRight, KneeRight, AnkleRight, FootRight,
    ];
    let mut i = 0;
    while i < of.len() {
        legs[of[i] as usize] = true;
        i += 1;
    }
    legs
};

/// The people of all instants. `seen` is per sensor, per instant.
pub(crate) fn people(seen: &[Vec<Vec<Pose>>], placed: &[Placed]) -> Vec<Person> {
    let sensors = seen.len();
    let mut relations = Vec::new();
    for a in 0..sensors {
        for b in a + 1..sensors {
            let a_from_b = placed[a].world_from_sensor.inverse() * placed[b].world_from_sensor;
            let several = seen[a]
                .iter()
                .chain(&seen[b])
                .any(|bodies| bodies.len() > 1);
            // With one body at a time there is nothing to vote on.
            let votes = several.then(|| vote(&seen[a], &seen[b], &a_from_b, REACH_M));
            relations.push((a, b, a_from_b, votes));
        }
    }
    let instants = seen.first().map_or(0, Vec::len);
    let mut people = Vec::new();
    for instant in 0..instants {
        let first = people.len();
        group(seen, instant, &relations, &mut people);
        for person in &mut people[first..] {
            exchange_parts(person, seen, placed);
            settle_sides(person, seen, placed);
        }
    }
    people
}

type Relation = (usize, usize, Isometry3<f64>, Option<Votes>);

/// Joins bodies that match, the best matches first; no two of one sensor.
fn group(seen: &[Vec<Vec<Pose>>], instant: usize, relations: &[Relation], into: &mut Vec<Person>) {
    let mut matches = Vec::new();
    for (a, b, a_from_b, votes) in relations {
        let (bodies_a, bodies_b) = (&seen[*a][instant], &seen[*b][instant]);
        for found in match_bodies(bodies_a, bodies_b, a_from_b, REACH_M, votes.as_ref()) {
            let tracks = [bodies_a[found.a].track, bodies_b[found.b].track];
            matches.push((*a, *b, tracks, found));
        }
    }
    matches.sort_by(|x, y| y.3.score.total_cmp(&x.3.score));
    let mut groups: Vec<Vec<Member>> = Vec::new();
    let find = |groups: &[Vec<Member>], sensor: usize, track: usize| {
        groups
            .iter()
            .position(|g| g.iter().any(|m| m.sensor == sensor && m.track == track))
    };
    for (a, b, [track_a, track_b], found) in matches {
        let member = |sensor: usize, track: usize, mirrored: bool| Member {
            sensor,
            track,
            exchanged: Exchanged {
                arms: mirrored,
                legs: mirrored,
            },
        };
        let of = |groups: &[Vec<Member>], group: usize, sensor: usize| {
            let member = groups[group].iter().find(|m| m.sensor == sensor);
            member.is_some_and(|m| m.exchanged.arms)
        };
        match (find(&groups, a, track_a), find(&groups, b, track_b)) {
            (None, None) => groups.push(vec![
                member(a, track_a, false),
                member(b, track_b, found.mirrored),
            ]),
            (Some(g), None) if groups[g].iter().all(|m| m.sensor != b) => {
                let mirrored = of(&groups, g, a) != found.mirrored;
                groups[g].push(member(b, track_b, mirrored));
            }
            (None, Some(g)) if groups[g].iter().all(|m| m.sensor != a) => {
                let mirrored = of(&groups, g, b) != found.mirrored;
                groups[g].push(member(a, track_a, mirrored));
            }
            (Some(g), Some(h)) if g != h => {
                let apart = groups[g]
                    .iter()
                    .all(|m| groups[h].iter().all(|n| n.sensor != m.sensor));
                if apart {
                    let turn = of(&groups, g, a) != (of(&groups, h, b) != found.mirrored);
                    let moved = std::mem::take(&mut groups[h]);
                    groups[g].extend(moved.into_iter().map(|m| Member {
                        exchanged: Exchanged {
                            arms: m.exchanged.arms != turn,
                            legs: m.exchanged.legs != turn,
                        },
                        ..m
                    }));
                }
            }
            _ => {}
        }
    }
    into.extend(
        groups
            .into_iter()
            .filter(|g| g.len() > 1)
            .map(|mut members| {
                members.sort_by_key(|m| m.sensor);
                Person { instant, members }
            }),
    );
}

/// The joints of a member, in the person's labels and world axes.
fn placed_joint(
    member: &Member,
    joint: usize,
    bodies: &[Pose],
    placed: &[Placed],
) -> Option<(Vector3<f64>, f64)> {
    let point: &Point = member.joint(joint, bodies)?;
    let world_from_sensor = &placed[member.sensor].world_from_sensor;
    let at = world_from_sensor.rotation * point.at + world_from_sensor.translation.vector;
    Some((at, point.weight))
}

/// Some trackers exchange only arms or only legs: each part of each body but the first against the others'.
fn exchange_parts(person: &mut Person, seen: &[Vec<Vec<Pose>>], placed: &[Placed]) {
    for index in 1..person.members.len() {
        for legs in [false, true] {
            let kept = part_score(person, index, legs, seen, placed);
            let was = person.members[index].exchanged;
            let part = &mut person.members[index].exchanged;
            if legs {
                part.legs = !part.legs;
            } else {
                part.arms = !part.arms;
            }
            if part_score(person, index, legs, seen, placed) <= EXCHANGE_MARGIN * kept {
                person.members[index].exchanged = was;
            }
        }
    }
}

/// How well a member's arms or legs agree with all other members'.
fn part_score(
    person: &Person,
    index: usize,
    legs: bool,
    seen: &[Vec<Vec<Pose>>],
    placed: &[Placed],
) -> f64 {
    let member = &person.members[index];
    let bodies = |m: &Member| &seen[m.sensor][person.instant];
    let mut score = 0.0;
    for joint in (0..JOINT_COUNT).filter(|j| LEGS[*j] == legs) {
        let Some((at, weight)) = placed_joint(member, joint, bodies(member), placed) else {
            continue;
        };
        for other in person.members.iter().filter(|m| m.sensor != member.sensor) {
            if let Some((there, w)) = placed_joint(other, joint, bodies(other), placed) {
                score += weight * w / (1.0 + (at - there).norm_squared() / (INLIER_M * INLIER_M));
            }
        }
    }
    score
}

/// Makes the person's left the left: by the toes, by sensors that see a back, and by the most sensors.
fn settle_sides(person: &mut Person, seen: &[Vec<Vec<Pose>>], placed: &[Placed]) {
    let joints = consensus(person, seen, placed);
    let Some(trunk) = trunk_axes(&joints) else {
        return;
    };
    let forward: Vector3<f64> = trunk.column(0).into();
    let at = |joint: Joint| joints[joint].map(|p| p.vector());
    let toes = [
        (Joint::AnkleLeft, Joint::FootLeft),
        (Joint::AnkleRight, Joint::FootRight),
    ];
    let ahead: Vector3<f64> = toes
        .iter()
        .filter_map(|(ankle, foot)| Some(at(*foot)? - at(*ankle)?))
        .sum();
    let along = ahead.try_normalize(0.02).map_or(0.0, |a| a.dot(&forward));
    let mut votes = TOES_VOTE * along;
    let centre = at(Joint::SpineBase).or_else(|| at(Joint::SpineShoulder));
    for member in &person.members {
        let word = if member.exchanged.arms { -1.0 } else { 1.0 };
        let away = centre.map_or(0.0, |centre| {
            let ray = centre - placed[member.sensor].world_from_sensor.translation.vector;
            ray.normalize().dot(&forward) * word
        });
        votes += word * if away > 0.3 { BACK_VOTE } else { 1.0 };
    }
    if votes < 0.0 {
        for member in &mut person.members {
            member.exchanged.arms = !member.exchanged.arms;
            member.exchanged.legs = !member.exchanged.legs;
        }
    }
}

/// The mean of all members' joints, world axes.
pub(crate) fn consensus(
    person: &Person,
    seen: &[Vec<Vec<Pose>>],
    placed: &[Placed],
) -> JointMap<Position<Room>> {
    let mean = |joint: usize| {
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for member in &person.members {
            let bodies = &seen[member.sensor][person.instant];
            if let Some((at, weight)) = placed_joint(member, joint, bodies, placed) {
                sum += at * weight;
                total += weight;
            }
        }
        (total > 0.0).then(|| Position::from_vector(sum / total))
    };
    (0..JOINT_COUNT)
        .filter_map(|joint| Some((Joint::ALL[joint], mean(joint)?)))
        .collect()
}
