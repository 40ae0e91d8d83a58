//! What must hold for every motion: bones, feet, smoothness, distances, repeatability.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{BONES, Joint, JointMap, Position, Room};

use super::*;

fn cast(seed: u64, people: usize, hugs: bool) -> Performance {
    Performance::procedural(Cast {
        seed,
        people,
        area_m: 2.6,
        hugs,
        situation: Situation::Everyday,
        away_s: 0.0,
    })
}

fn at(pose: &JointMap<Position<Room>>, joint: Joint) -> Vector3<f64> {
    pose[joint].unwrap().vector()
}

/// Seconds from 0 to the end of the round and a little beyond, `step` apart.
fn times(performance: &Performance, step: f64) -> impl Iterator<Item = f64> {
    let count = ((performance.round_s().unwrap() + 3.0) / step) as usize;
    (0..count).map(move |i| i as f64 * step)
}

#[test]
fn bones_keep_their_lengths_all_round() {
    let performance = cast(3, 2, true);
    for person in 0..2 {
        let first = performance.pose(person, 0.0);
        for time in times(&performance, 0.21) {
            let pose = performance.pose(person, time);
            for bone in BONES {
                let length = |pose| (at(pose, bone.child) - at(pose, bone.parent)).norm();
                let change = (length(&pose) - length(&first)).abs();
                // The line between wrist and hand tip is no bone; all of BONES are rigid.
                assert!(change < 1e-9, "{bone:?} changed by {change} m at {time} s");
            }
        }
    }
}

#[test]
fn standing_feet_stay_where_they_are_and_nothing_sinks_into_the_floor() {
    for seed in [1, 5, 9] {
        let performance = cast(seed, 2, true);
        for person in 0..2 {
            let mut held: [Option<Vector3<f64>>; 2] = [None, None];
            for time in times(&performance, 0.01) {
                let pose = performance.pose(person, time);
                let standing = performance.feet_standing(person, time).unwrap();
                for (foot, joints) in [
                    [Joint::AnkleLeft, Joint::FootLeft],
                    [Joint::AnkleRight, Joint::FootRight],
                ]
                .into_iter()
                .enumerate()
                {
                    let ankle = at(&pose, joints[0]);
                    if let (true, Some(before)) = (standing[foot], held[foot]) {
                        let slid = (ankle - before).norm();
                        assert!(slid < 1e-3, "seed {seed}: {slid} m at {time} s");
                    }
                    held[foot] = standing[foot].then_some(held[foot].unwrap_or(ankle));
                    let toes = at(&pose, joints[1]).z;
                    assert!(
                        (0.0..0.4).contains(&toes),
                        "seed {seed}: toes at {toes} m, {time} s"
                    );
                }
            }
        }
    }
}

#[test]
fn no_joint_jumps_in_any_action() {
    let step = 1.0 / 240.0;
    for seed in [2, 4] {
        let performance = cast(seed, 3, true);
        let mut fastest: BTreeMap<Joint, f64> = BTreeMap::new();
        let mut hardest: BTreeMap<Joint, f64> = BTreeMap::new();
        for person in 0..3 {
            let mut before: Vec<JointMap<Position<Room>>> = Vec::new();
            for time in times(&performance, step) {
                before.push(performance.pose(person, time));
                let [a, b, c] = before.as_slice() else {
                    continue;
                };
                for joint in Joint::ALL {
                    let speed = (at(c, joint) - at(b, joint)).norm() / step;
                    let bend = at(c, joint) - at(b, joint) * 2.0 + at(a, joint);
                    let acceleration = bend.norm() / (step * step);
                    let top = fastest.entry(joint).or_default();
                    *top = top.max(speed);
                    let top = hardest.entry(joint).or_default();
                    *top = top.max(acceleration);
                    assert!(
                        speed < 7.0,
                        "{joint} at {speed} m/s, seed {seed} person {person} {time} s"
                    );
                    // A jump of 5 mm would be 290 m/s^2 here.
                    assert!(
                        acceleration < 90.0,
                        "{joint} at {acceleration} m/s^2, seed {seed} person {person} {time} s, {:?}",
                        performance.script(person).unwrap().at(time)
                    );
                }
                before.remove(0);
            }
        }
        println!("seed {seed}: m/s {fastest:.1?}\nm/s^2 {hardest:.0?}");
    }
}

#[test]
fn everybody_ends_the_round_where_they_began() {
    for seed in 0..40 {
        let people = 1 + seed as usize % 5;
        let performance = cast(seed, people, seed % 2 == 0);
        let round = performance.round_s().unwrap();
        assert!((200.0..330.0).contains(&round), "{round} s");
        for person in 0..people {
            let (end, start) = (
                performance.pose(person, round - 1e-9),
                performance.pose(person, round),
            );
            for joint in Joint::ALL {
                let gap = (at(&end, joint) - at(&start, joint)).norm();
                assert!(gap < 1e-6, "seed {seed}, person {person}, {joint}: {gap} m");
            }
        }
    }
}

#[test]
fn everything_on_the_list_is_done() {
    let performance = cast(6, 2, true);
    let actions: Vec<Action> = performance
        .script(0)
        .unwrap()
        .actions
        .iter()
        .map(|timed| timed.action)
        .collect();
    let mut spent: BTreeMap<String, f64> = BTreeMap::new();
    for timed in &performance.script(0).unwrap().actions {
        *spent.entry(format!("{:?}", timed.action)).or_default() += timed.duration;
    }
    println!("{spent:.0?}");
    for action in Action::ON_THE_SPOT.into_iter().chain([
        Action::Stand,
        Action::Walk,
        Action::Turn,
        Action::Hug(1),
    ]) {
        assert!(actions.contains(&action), "{action:?} never happens");
    }
}

#[test]
fn people_keep_off_each_other_except_to_hug_and_do_cross() {
    for seed in [8, 20, 21] {
        keep_off_and_cross(&cast(seed, 4, true));
    }
}

fn keep_off_and_cross(performance: &Performance) {
    let (mut crossings, mut hugs) = (0, 0);
    for time in times(performance, 0.1) {
        let poses: Vec<_> = (0..4)
            .map(|person| performance.pose(person, time))
            .collect();
        for a in 0..4 {
            assert!(at(&poses[a], Joint::SpineBase).xy().amax() < 1.7);
            for b in 0..a {
                let distance = (at(&poses[a], Joint::SpineMid) - at(&poses[b], Joint::SpineMid))
                    .xy()
                    .norm();
                let doing = |person: usize| {
                    performance
                        .script(person)
                        .unwrap()
                        .at(time.rem_euclid(performance.round_s().unwrap()))
                        .unwrap()
                        .action
                };
                if distance < 0.42 {
                    hugs += 1;
                    assert!(distance > 0.22, "{distance} m apart at {time} s");
                    let close =
                        |action| matches!(action, Action::Hug(_) | Action::Shuffle | Action::Stand);
                    assert!(
                        close(doing(a)) && close(doing(b)),
                        "{distance} m at {time} s: {:?} {:?}",
                        doing(a),
                        doing(b)
                    );
                } else if distance < 0.85 {
                    crossings += 1;
                }
            }
        }
    }
    assert!(crossings > 50, "close passes seen in {crossings} samples");
    assert!(hugs > 50, "hugs seen in {hugs} samples");
}

#[test]
fn the_same_seed_gives_the_same_motion_in_any_order_of_asking() {
    let (a, b) = (cast(11, 2, true), cast(11, 2, true));
    let forwards: Vec<_> = times(&a, 1.7).map(|time| a.pose(1, time)).collect();
    let mut backwards: Vec<_> = times(&b, 1.7)
        .collect::<Vec<_>>()
        .into_iter()
        .rev()
        .map(|time| b.pose(1, time))
        .collect();
    backwards.reverse();
    assert_eq!(forwards, backwards);
    assert_ne!(cast(12, 2, true).pose(1, 20.0), a.pose(1, 20.0));
}

#[test]
fn people_are_upright_with_left_on_their_left() {
    let performance = cast(13, 1, false);
    for time in times(&performance, 0.5) {
        let pose = performance.pose(0, time);
        let left = at(&pose, Joint::HipLeft) - at(&pose, Joint::HipRight);
        let toes = at(&pose, Joint::FootLeft) - at(&pose, Joint::AnkleLeft);
        assert!(
            left.cross(&Vector3::z()).dot(&toes) > 0.0,
            "toes point backwards at {time} s"
        );
        assert!(at(&pose, Joint::Head).z > at(&pose, Joint::KneeLeft).z);
        let height = performance.shape(0).unwrap().height;
        assert!(at(&pose, Joint::Head).z < height);
    }
}

fn situated(seed: u64, people: usize, situation: Situation) -> Performance {
    Performance::procedural(Cast {
        seed,
        people,
        area_m: 2.6,
        hugs: false,
        situation,
        away_s: 1.8,
    })
}

/// Distance over the floor of the first two people's pelvises.
fn apart(performance: &Performance, time: f64) -> f64 {
    let base = |person| at(&performance.pose(person, time), Joint::SpineBase).xy();
    (base(0) - base(1)).norm()
}

#[test]
fn every_situation_moves_smoothly_on_rigid_bones_above_the_floor() {
    let step = 1.0 / 100.0;
    for situation in Situation::ALL {
        let performance = situated(4, 2, situation);
        let first = performance.pose(1, 0.0);
        let mut before: Vec<JointMap<Position<Room>>> = Vec::new();
        for time in times(&performance, step).take(9000) {
            before.push(performance.pose(1, time));
            let [a, b, c] = before.as_slice() else {
                continue;
            };
            for bone in BONES {
                let length = |pose| (at(pose, bone.child) - at(pose, bone.parent)).norm();
                assert!(
                    (length(c) - length(&first)).abs() < 1e-9,
                    "{situation:?} {bone:?}"
                );
            }
            for joint in Joint::ALL {
                let bend = at(c, joint) - at(b, joint) * 2.0 + at(a, joint);
                let acceleration = bend.norm() / (step * step);
                assert!(
                    acceleration < 90.0,
                    "{situation:?} {joint} {acceleration} m/s^2 at {time} s"
                );
                let height = at(c, joint).z;
                assert!(
                    height > -0.03,
                    "{situation:?} {joint} at {height} m, {time} s"
                );
            }
            before.remove(0);
        }
    }
}

#[test]
fn people_cross_closely_and_embrace_really() {
    for seed in 1..=3 {
        let crossing = situated(seed, 2, Situation::Crossing);
        let distances: Vec<f64> = times(&crossing, 0.05)
            .map(|t| apart(&crossing, t))
            .collect();
        let closest = distances.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((0.38..0.6).contains(&closest), "seed {seed}: {closest} m");
        let passes = distances
            .windows(2)
            .filter(|w| w[0] >= 0.8 && w[1] < 0.8)
            .count();
        assert!(passes >= 15, "seed {seed}: {passes} passes");
        let hugging = situated(seed, 2, Situation::Hugging);
        let held = times(&hugging, 0.1)
            .filter(|t| apart(&hugging, *t) < 0.28)
            .count();
        assert!(held > 250, "seed {seed}: {held} tenths of a second");
    }
}

#[test]
fn who_leaves_is_gone_for_a_while_and_comes_back() {
    let performance = situated(2, 2, Situation::Leaving);
    for person in 0..2 {
        let present: Vec<bool> = times(&performance, 0.05)
            .map(|t| performance.present(person, t))
            .collect();
        let gone = present.iter().filter(|here| !**here).count() as f64 * 0.05;
        let left = present.windows(2).filter(|w| w[0] && !w[1]).count();
        assert!(left >= 6, "left {left} times");
        let mean_s = gone / left as f64;
        assert!((0.9..=1.8).contains(&mean_s), "away for {mean_s} s");
    }
    let always = situated(2, 1, Situation::Everyday);
    assert!(times(&always, 0.5).all(|t| always.present(0, t)));
}

#[test]
fn who_lies_is_low_and_who_faces_away_shows_no_front() {
    let lying = situated(3, 1, Situation::Lying);
    let low = times(&lying, 0.1)
        .filter(|t| at(&lying.pose(0, *t), Joint::Head).z < 0.4)
        .count();
    assert!(low > 300, "{low} tenths of a second");
    let away = situated(3, 1, Situation::Away);
    for i in 0..190 {
        let pose = away.pose(0, f64::from(i) * 0.1);
        let left = at(&pose, Joint::HipLeft) - at(&pose, Joint::HipRight);
        assert!(left.cross(&Vector3::z()).x < 0.0, "faces +x at {i} tenths");
    }
}
