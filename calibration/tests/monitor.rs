//! The watch over the sensors' places: laws on rooms made here, where nothing but the stated noise is wrong.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{DriftMonitor, DriftOptions, SensorDrift};
use posefuse_skeleton::{
    Comparison, Joint, JointMap, Position, SensorId, SensorPose, Timestamp, TrackId, Transform,
    View,
};

/// A small generator (SplitMix64).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// About normal, with this standard deviation.
    fn noise(&mut self, sigma: f64) -> Vector3<f64> {
        let mut one = || (0..6).map(|_| self.roll() - 0.5).sum::<f64>() * 2_f64.sqrt() * sigma;
        Vector3::new(one(), one(), one())
    }
}

fn id(index: usize) -> SensorId {
    SensorId::new(index).expect("a number below 64")
}

/// A ring of sensors that look at its middle, and what each has been moved by, in room axes about its own place.
struct Room {
    stands: Vec<Isometry3<f64>>,
    moved: Vec<Option<(Vector3<f64>, Vector3<f64>)>>,
    monitor: DriftMonitor,
    dice: Dice,
    fifths: i64,
    noise_m: f64,
    /// Views are given in reverse order.
    reversed: bool,
}

impl Room {
    fn new(sensors: usize) -> Self {
        let stand = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / sensors as f64;
            let from = Vector3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.2);
            let rotation = UnitQuaternion::face_towards(&-from, &-Vector3::z());
            Isometry3::from_parts(Translation3::from(from), rotation)
        };
        let mut room = Self {
            stands: (0..sensors).map(stand).collect(),
            moved: vec![None; sensors],
            monitor: DriftMonitor::new(DriftOptions::default()),
            dice: Dice(7),
            fifths: 0,
            noise_m: 0.01,
            reversed: false,
        };
        room.place();
        room
    }

    /// Tells the monitor where the sensors are believed to stand.
    fn place(&mut self) {
        let pose = |stand: &Isometry3<f64>| SensorPose {
            room_from_sensor: Transform::from_isometry(*stand),
            ..SensorPose::default()
        };
        let poses: Vec<_> = self.stands.iter().map(pose).collect();
        self.monitor
            .place(poses.iter().enumerate().map(|(i, pose)| (id(i), pose)));
    }

    /// Where sensor `i` truly stands.
    fn truth(&self, i: usize) -> Isometry3<f64> {
        let stand = self.stands[i];
        let Some((shift, turn)) = self.moved[i] else {
            return stand;
        };
        Isometry3::from_parts(
            Translation3::from(stand.translation.vector + shift),
            UnitQuaternion::from_scaled_axis(turn) * stand.rotation,
        )
    }

    /// Somebody walks about for so many seconds; the last look's findings.
    fn walk(&mut self, seconds: i64) -> Vec<SensorDrift> {
        let mut found = Vec::new();
        for _ in 0..seconds * 5 {
            self.fifths += 1;
            let t = self.fifths as f64 * 0.2;
            let time = Timestamp::from_seconds(100.0 + t);
            let at = Vector3::new(1.2 * (0.4 * t).sin(), 1.1 * (0.31 * t).cos(), 1.0);
            let mut views: Vec<View> = (0..self.stands.len())
                .map(|i| self.view(i, at, t))
                .collect();
            if self.reversed {
                views.reverse();
            }
            self.monitor.add(Comparison {
                time,
                track: TrackId(1),
                views,
            });
            if self.fifths % 5 == 0 {
                found = self.monitor.look(time);
            }
        }
        found
    }

    fn view(&mut self, i: usize, at: Vector3<f64>, t: f64) -> View {
        let sensor_from_room = self.truth(i).inverse();
        let (sin, cos) = (0.3 * t).sin_cos();
        let mut joints = JointMap::empty();
        for (k, joint) in Joint::ALL.into_iter().enumerate() {
            let side = if k % 2 == 0 { 0.2 } else { -0.2 };
            let offset = Vector3::new(-side * sin, side * cos, k as f64 / 25.0 * 1.6 - 0.8);
            let seen = sensor_from_room * Point3::from(at + offset) + self.dice.noise(self.noise_m);
            joints[joint] = Some(Position::from_point(seen));
        }
        View {
            sensor: id(i),
            joints,
        }
    }

    /// Walks on until a sensor is named; how long that took, seconds.
    fn until_named(&mut self) -> (i64, Vec<SensorDrift>) {
        for second in 1..=15 {
            let found = self.walk(1);
            if found.iter().any(|drift| drift.alarm) {
                return (second, found);
            }
        }
        panic!("nobody was named within 15 s");
    }
}

fn named(found: &[SensorDrift]) -> Vec<usize> {
    let alarmed = found.iter().filter(|drift| drift.alarm);
    alarmed.map(|drift| drift.sensor.index()).collect()
}

#[test]
fn nobody_is_named_while_nothing_moves() {
    let mut room = Room::new(4);
    for _ in 0..60 {
        let found = room.walk(5);
        assert!(named(&found).is_empty(), "{found:#?}");
    }
    let found = room.walk(5);
    assert_eq!(found.len(), 4);
    for drift in &found {
        assert!(drift.off_m < 0.004 && drift.significance < 4.0, "{drift:?}");
        assert!(
            (0.5..2.0).contains(&(drift.residual_m / drift.usual_m)),
            "{drift:?}"
        );
    }
}

#[test]
fn the_sensor_that_moved_is_named_with_the_size_and_the_innocent_are_not() {
    let none = Vector3::zeros();
    let turn = Vector3::new(0.0, 0.0, 1_f64.to_radians());
    for (sensors, shift, turn) in [
        (3, Vector3::new(0.02, 0.0, 0.0), none),
        (4, Vector3::new(0.0, 0.0, -0.02), none),
        (4, none, turn),
        (6, Vector3::new(0.03, 0.04, 0.0), 2.0 * turn),
    ] {
        let mut room = Room::new(sensors);
        room.walk(90);
        room.moved[1] = Some((shift, turn));
        let (second, found) = room.until_named();
        assert_eq!(named(&found), [1], "{sensors} sensors, after {second} s");
        let found = room.walk(20);
        assert_eq!(named(&found), [1], "{found:#?}");
        let drift = found[1];
        assert_eq!(drift.instead, None);
        assert!(
            (drift.moved_m - shift.norm()).abs() < 0.008,
            "{shift:?}: {drift:?}"
        );
        assert!(
            (drift.turned_rad - turn.norm()).abs() < 0.004,
            "{turn:?}: {drift:?}"
        );
        assert!(drift.since.is_some());
    }
}

#[test]
fn of_two_sensors_nobody_can_say_which_one_moved() {
    let mut room = Room::new(2);
    room.walk(90);
    room.moved[0] = Some((Vector3::new(0.0, 0.05, 0.0), Vector3::zeros()));
    room.until_named();
    let found = room.walk(15);
    assert_eq!(named(&found), [0, 1]);
    assert_eq!(found[0].instead, Some(id(1)));
    assert_eq!(found[1].instead, Some(id(0)));
}

#[test]
fn a_sensor_that_is_put_back_or_calibrated_anew_is_named_no_more() {
    let mut room = Room::new(4);
    room.walk(90);
    let bump = (Vector3::new(0.0, 0.05, 0.0), Vector3::zeros());
    room.moved[2] = Some(bump);
    room.until_named();
    room.moved[2] = None;
    assert!(named(&room.walk(40)).is_empty(), "put back");

    room.moved[2] = Some(bump);
    room.until_named();
    room.stands[2] = room.truth(2);
    room.moved[2] = None;
    room.place();
    assert!(named(&room.walk(30)).is_empty(), "calibrated anew");
}

#[test]
fn a_move_by_much_is_named_even_when_nothing_has_been_learnt() {
    let mut room = Room::new(4);
    room.moved[3] = Some((Vector3::new(0.1, 0.0, 0.0), Vector3::zeros()));
    let (_, found) = room.until_named();
    assert_eq!(named(&found), [3]);
}

#[test]
fn the_order_of_the_sensors_does_not_matter() {
    let mut ways = [false, true].map(|reversed| {
        let mut room = Room::new(3);
        room.noise_m = 0.0;
        room.reversed = reversed;
        room.walk(30);
        room.moved[0] = Some((Vector3::new(0.05, 0.0, 0.0), Vector3::zeros()));
        room.walk(20)
    });
    for drift in ways.iter_mut().flatten() {
        drift.moved_m = (drift.moved_m * 1e6).round();
        drift.turned_rad = (drift.turned_rad * 1e6).round();
        drift.off_m = (drift.off_m * 1e6).round();
        for value in [
            &mut drift.sigma_m,
            &mut drift.sigma_rad,
            &mut drift.significance,
        ] {
            *value = (*value * 1e4).round();
        }
        drift.residual_m = (drift.residual_m * 1e6).round();
    }
    assert_eq!(ways[0], ways[1]);
}

#[test]
fn nothing_is_said_of_sensors_that_see_nobody_together() {
    let mut room = Room::new(3);
    room.walk(20);
    let later = Timestamp::from_seconds(100.0 + 60.0);
    assert!(room.monitor.look(later).is_empty(), "everybody has left");
}
