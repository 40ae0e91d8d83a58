use posefuse_skeleton::{JOINT_COUNT, Joint};

use super::*;
use crate::Config;

fn id(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

fn at(ms: i64) -> Timestamp {
    Timestamp::from_ns(7_000_000_000 + ms * 1_000_000)
}

/// A person of spread-out joints around (x, y), a little different per joint.
fn person(x: f64, y: f64) -> Body {
    let mut body = Body::default();
    for index in 0..JOINT_COUNT {
        let joint = Joint::ALL[index];
        let side = match (joint as usize).cmp(&(joint.mirrored() as usize)) {
            std::cmp::Ordering::Less => 0.15,
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => -0.15,
        };
        let height = 0.1 + 0.06 * (index.min(joint.mirrored() as usize)) as f64;
        body.set(index, Vector3::new(x, y + side, height), 1.0);
    }
    body
}

fn placed(tracking_id: u64, body: Body) -> Placed {
    Placed { tracking_id, body }
}

struct Room {
    people: People,
    config: Config,
    origins: Vec<Option<Vector3<f64>>>,
}

impl Room {
    fn new() -> Self {
        let origin = |i: usize| {
            let angle = i as f64 * 1.6;
            Some(Vector3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.5))
        };
        Self {
            people: People::default(),
            config: Config::default(),
            origins: (0..SensorId::MAX_SENSORS).map(origin).collect(),
        }
    }

    fn see(&mut self, sensor: usize, ms: i64, bodies: &[Placed]) {
        let origin = self.origins[sensor].unwrap();
        self.people
            .observe(id(sensor), origin, at(ms), bodies, &self.config);
    }

    /// The same, by a sensor that looks at (0, 0, 1) and is known to.
    fn look(&mut self, sensor: usize, ms: i64, bodies: &[Placed]) {
        self.see(sensor, ms, bodies);
        let from = self.origins[sensor].unwrap();
        let ahead = (Vector3::z() - from).normalize();
        let right = ahead.cross(&Vector3::z()).normalize();
        let axes = nalgebra::Matrix3::from_columns(&[right, ahead.cross(&right), ahead]);
        let turned = nalgebra::UnitQuaternion::from_matrix(&axes);
        let pose = posefuse_skeleton::Transform::from_parts(from, turned);
        self.people.watch(id(sensor), &pose, at(ms));
    }

    /// The ids and x of those shown.
    fn frame(&mut self, ms: i64) -> Vec<(u64, f64)> {
        let tracks = self
            .people
            .frame(at(ms), &self.origins, &self.config, |_, _| {});
        let x = |t: &posefuse_skeleton::Track| {
            t.skeleton.position(Joint::SpineBase).unwrap().vector().x
        };
        tracks.iter().map(|t| (t.id.0, x(t))).collect()
    }
}

#[test]
fn a_person_is_born_with_the_third_sighting() {
    let mut room = Room::new();
    room.see(0, 0, &[placed(1, person(0.0, 0.0))]);
    assert_eq!(room.frame(0), []);
    room.see(1, 10, &[placed(5, person(0.02, 0.0))]);
    assert_eq!(room.frame(10), []);
    room.see(0, 33, &[placed(1, person(0.01, 0.0))]);
    let shown = room.frame(33);
    assert_eq!(shown.len(), 1);
    assert_eq!(shown[0].0, 1);
}

#[test]
fn an_unseen_person_is_shown_for_a_while_remembered_for_longer_and_then_forgotten() {
    let mut room = Room::new();
    for i in 0..30 {
        room.see(0, i * 33, &[placed(1, person(0.0, 0.0))]);
        room.frame(i * 33);
    }
    let last = 29 * 33;
    assert_eq!(room.frame(last + 450).len(), 1);
    assert_eq!(room.frame(last + 550).len(), 0);
    // Back within 2 s, at a place within reach and under another tracking id: the same person.
    room.see(0, last + 1500, &[placed(9, person(0.6, 0.0))]);
    assert_eq!(room.frame(last + 1500).first().map(|t| t.0), Some(1));
    // Back after 2 s: nobody we know.
    for i in 0..4 {
        room.see(0, last + 4000 + i * 33, &[placed(10, person(0.6, 0.0))]);
    }
    assert_eq!(room.frame(last + 4100).first().map(|t| t.0), Some(2));
}

#[test]
fn two_people_who_hug_stay_two_and_one_seen_twice_becomes_one() {
    let mut room = Room::new();
    // Hug: both sensors see both, 12 cm apart.
    for i in 0..60 {
        for sensor in 0..2 {
            let bodies = [placed(1, person(0.0, 0.0)), placed(2, person(0.12, 0.0))];
            room.see(sensor, i * 33, &bodies);
        }
        room.frame(i * 33);
    }
    assert_eq!(room.frame(60 * 33).len(), 2);

    // Each sensor has its own idea of one person at first, then both come together.
    let mut room = Room::new();
    for i in 0..60 {
        let apart = if i < 20 { 0.9 } else { 0.05 };
        room.see(0, i * 33, &[placed(1, person(0.0, 0.0))]);
        room.see(1, i * 33, &[placed(1, person(apart, 0.0))]);
        let shown = room.frame(i * 33).len();
        if i == 19 {
            assert_eq!(shown, 2);
        }
    }
    let shown = room.frame(60 * 33);
    assert_eq!(shown.iter().map(|t| t.0).collect::<Vec<_>>(), [1]);
}

#[test]
fn a_sensors_own_id_decides_between_two_people_who_are_close() {
    let mut room = Room::new();
    for i in 0..30 {
        room.see(
            0,
            i * 33,
            &[placed(7, person(-0.2, 0.0)), placed(8, person(0.2, 0.0))],
        );
        room.frame(i * 33);
    }
    let before = room.frame(30 * 33);
    // Both drift to one side, so that person 7 is now where 8 was.
    for i in 1..12 {
        let shift = 0.4 * f64::from(i) / 11.0;
        let ms = 30 * 33 + i64::from(i) * 33;
        room.see(
            0,
            ms,
            &[
                placed(8, person(0.2 + shift, 0.0)),
                placed(7, person(-0.2 + shift, 0.0)),
            ],
        );
        room.frame(ms);
    }
    let after = room.frame(42 * 33);
    assert_eq!(before.len(), 2);
    for (b, a) in before.iter().zip(&after) {
        assert_eq!(b.0, a.0);
        assert!((a.1 - b.1 - 0.4).abs() < 0.1, "{before:?} {after:?}");
    }
}

#[test]
fn ids_are_never_used_again_and_candidates_are_bounded() {
    let mut room = Room::new();
    let mut seen = Vec::new();
    for round in 0..20 {
        for i in 0..4 {
            room.see(0, round * 10_000 + i * 33, &[placed(1, person(0.0, 0.0))]);
        }
        seen.extend(room.frame(round * 10_000 + 100).into_iter().map(|t| t.0));
    }
    assert_eq!(seen, (1..=20).collect::<Vec<_>>());
    let crowd: Vec<Placed> = (0..200)
        .map(|i| placed(i, person(i as f64 * 3.0, 0.0)))
        .collect();
    for i in 0..10 {
        room.see(0, 500_000 + i * 33, &crowd);
    }
    assert!(room.people.tracks.len() <= 16 + 8);
    assert!(room.frame(500_400).len() <= 16);
}

#[test]
fn a_sensor_that_sees_left_for_right_is_put_right() {
    let mut room = Room::new();
    for i in 0..30 {
        let mut swapped = person(0.0, 0.0);
        swapped.mirror([true; 2]);
        room.see(0, i * 33, &[placed(1, person(0.0, 0.0))]);
        room.see(1, i * 33, &[placed(1, swapped)]);
        let tracks = room
            .people
            .frame(at(i * 33), &room.origins, &room.config, |_, _| {});
        for track in tracks {
            let across = |l, r| {
                let joint = |j| track.skeleton.position(j).unwrap().vector();
                (joint(l) - joint(r)).norm()
            };
            assert!((across(Joint::HipLeft, Joint::HipRight) - 0.3).abs() < 1e-6);
        }
    }
}

#[test]
fn a_merge_does_not_set_other_pairs_back() {
    // Two sensors disagree on where two people are; their ideas come together, the second person's 5 frames earlier.
    let mut room = Room::new();
    // Without a memory of its own: each pair comes together when its bodies do.
    room.config.fuse.method = crate::FuseMethod::Weighted;
    let apart = |frames: i32| (0.9 - 0.05 * f64::from(frames.max(0))).max(0.02);
    let mut shown = Vec::new();
    for i in 0..80 {
        let ms = i64::from(i) * 33;
        room.see(
            0,
            ms,
            &[placed(1, person(0.0, 0.0)), placed(2, person(4.0, 0.0))],
        );
        let (first, second) = (apart(i - 25), 4.0 + apart(i - 20));
        room.see(
            1,
            ms,
            &[
                placed(1, person(first, 0.0)),
                placed(2, person(second, 0.0)),
            ],
        );
        shown.push(room.frame(ms).len());
    }
    let last = |people: usize| shown.iter().rposition(|count| *count == people).unwrap();
    assert_eq!(shown[19], 4);
    // A frame more or less is the filter's.
    assert!((4..=6).contains(&(last(3) - last(4))), "{shown:?}");
}

#[test]
fn an_unseen_joint_becomes_uncertain_with_time_not_with_frames() {
    let variance = |step_ms: usize| {
        let mut room = Room::new();
        for i in 0..10 {
            room.see(0, i * 33, &[placed(1, person(0.0, 0.0))]);
            room.frame(i * 33);
        }
        let last = 9 * 33;
        let mut found = 0.0;
        for ms in (step_ms..=400).step_by(step_ms) {
            let time = at(last + ms as i64);
            let tracks = room
                .people
                .frame(time, &room.origins, &room.config, |_, _| {});
            found = tracks[0].skeleton[Joint::Head]
                .as_ref()
                .unwrap()
                .covariance
                .trace();
        }
        found
    };
    let (slow, fast) = (variance(40), variance(5));
    assert!(
        (slow - fast).abs() < 0.05 * slow,
        "{slow} at 25 Hz, {fast} at 200 Hz"
    );
    assert!(
        slow > 3.0 * (0.6 * 0.3_f64).powi(2),
        "0.6 m/s for 0.3 s and more: {slow} m^2"
    );
}

/// How many are shown in each frame when sensor 0 sees `bodies(second)` and the other two of three see `others`.
fn shown(
    seconds: f64,
    mut bodies: impl FnMut(f64) -> Vec<Placed>,
    others: &[Placed],
) -> Vec<usize> {
    let mut room = Room::new();
    let frames = (seconds * 30.0) as i64;
    let mut shown = Vec::new();
    for frame in 0..frames {
        let ms = frame * 33;
        room.look(0, ms, &bodies(ms as f64 * 1e-3));
        for sensor in 1..3 {
            room.look(sensor, ms, others);
        }
        shown.push(room.frame(ms).len());
    }
    shown
}

#[test]
fn furniture_that_one_sensor_takes_for_a_person_is_nobody_while_others_see_the_place() {
    let everybody = [placed(1, person(0.0, 0.6))];
    let with_chair = |_: f64| vec![placed(1, person(0.0, 0.6)), placed(2, person(-0.3, -0.8))];
    let seen = shown(6.0, with_chair, &everybody);
    assert!(seen[6..].iter().all(|count| *count == 1), "{seen:?}");
}

#[test]
fn a_person_whom_other_trackers_miss_is_believed_when_they_walk() {
    let walk = |second: f64| vec![placed(2, person(-0.3, -0.8 + 0.5 * second))];
    let seen = shown(3.0, walk, &[]);
    assert_eq!(seen[15], 0, "{seen:?}");
    assert_eq!(seen.last(), Some(&1), "{seen:?}");
}

#[test]
fn who_is_out_of_the_others_sight_is_born_once_they_move() {
    let walk = |second: f64| vec![placed(2, person(1.0 - 2.0 * second, 2.6))];
    let seen = shown(0.7, walk, &[]);
    assert!(seen[14..].iter().all(|count| *count == 1), "{seen:?}");
}

/// A person's image in a mirror at x = -2, sides named as they look.
fn image(body: &Body) -> Body {
    let mut image = body.clone();
    for position in &mut image.position {
        position.x = -4.0 - position.x;
    }
    image.mirror([true; 2]);
    image
}

#[test]
fn an_image_in_a_mirror_is_nobody_and_a_second_person_is() {
    // The sensors' origins are at x = 3, -0.1 and -3: the first two alone are before the mirror.
    type Second = Box<dyn FnMut(f64, &Body) -> Body>;
    let look = |mut second: Second| {
        let mut room = Room::new();
        let mut shown = 0;
        for frame in 0..240 {
            let ms = frame * 33;
            let seconds = ms as f64 * 1e-3;
            let first = person(0.4 + 0.5 * (1.5 * seconds).sin(), 0.3 * seconds.cos());
            let other = second(seconds, &first);
            for sensor in 0..2 {
                room.look(
                    sensor,
                    ms,
                    &[placed(1, first.clone()), placed(2, other.clone())],
                );
            }
            shown = room.frame(ms).len();
        }
        shown
    };
    assert_eq!(look(Box::new(|_, first| image(first))), 1);
    let walks = |seconds: f64, _: &Body| person(-3.8 + 0.3 * (2.3 * seconds).cos(), 0.2);
    assert_eq!(look(Box::new(walks)), 2);
}
