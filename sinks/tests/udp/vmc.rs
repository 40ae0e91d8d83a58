//! What is sent by VMC, as the crate `vmc` reads it.

use std::collections::BTreeMap;

use crate::room::{Running, frame, neighbours, performance, within};
use ::vmc::message::Message;
use ::vmc::{ModelState, VMCSocket};
use futures_util::StreamExt;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use posefuse_kinematics::Figure;
use posefuse_simulator::motion::Performance;
use posefuse_sinks::{Config, SinkState, VmcSettings, VmcTravel};
use posefuse_skeleton::{Confidence, HandVotes, Joint, Position, Room};

type Q = UnitQuaternion<f64>;

/// What one frame says on one port.
#[derive(Debug, Default)]
struct Heard {
    root: Option<(Vector3<f64>, Q)>,
    bones: BTreeMap<String, (Vector3<f64>, Q)>,
    state: Option<::vmc::State>,
    time_s: Option<f32>,
}

/// Everything until a time is told, or until the model is said to be gone.
async fn heard(socket: &mut VMCSocket) -> Heard {
    let mut heard = Heard::default();
    loop {
        let (packet, _) = within(socket.next()).await.unwrap().unwrap();
        for message in ::vmc::parse(packet).unwrap() {
            match message {
                Message::RootTransform(root) => {
                    heard.root = Some(pair(root.position, root.rotation))
                }
                Message::BoneTransform(bone) => {
                    let name = bone.bone.to_string();
                    heard.bones.insert(name, pair(bone.position, bone.rotation));
                }
                Message::State(state) => heard.state = Some(state),
                Message::Time(time) => heard.time_s = Some(time.0),
                other => panic!("{other:?}"),
            }
        }
        let gone =
            heard.state.as_ref().map(|state| state.model_state) == Some(ModelState::NotLoaded);
        if heard.time_s.is_some() || gone {
            return heard;
        }
    }
}

fn pair(at: ::vmc::Vec3, turn: ::vmc::Quat) -> (Vector3<f64>, Q) {
    let [x, y, z, w] = [turn.x, turn.y, turn.z, turn.w].map(f64::from);
    let turn = Quaternion::new(w, x, y, z);
    assert!((turn.norm() - 1.0).abs() < 1e-5);
    let at = Vector3::new(at.x, at.y, at.z).map(f64::from);
    (at, Q::new_normalize(turn))
}

fn is_there(heard: &Heard) -> bool {
    heard.state.as_ref().map(|state| state.model_state) == Some(ModelState::Loaded)
}

/// Unity's own table of which bone carries which.
fn carrier(bone: &str) -> &'static str {
    match bone.trim_start_matches("Left").trim_start_matches("Right") {
        "Hips" => "root",
        "Spine" | "UpperLeg" => "Hips",
        "Chest" => "Spine",
        "Neck" | "Shoulder" => "Chest",
        "Head" => "Neck",
        "UpperArm" => "Shoulder",
        "LowerArm" => "UpperArm",
        "Hand" => "LowerArm",
        "LowerLeg" => "UpperLeg",
        "Foot" => "LowerLeg",
        "Toes" => "Foot",
        _ => panic!("{bone} is none of Unity's bones"),
    }
}

/// Where a bone begins and how it is turned, by the chain of those that carry it; Unity's axes.
fn placed(heard: &Heard, bone: &str) -> (Vector3<f64>, Q) {
    let Some((at, turn)) = heard.bones.get(bone).copied() else {
        return heard.root.unwrap();
    };
    let above = carrier(bone);
    let side = ["Left", "Right"]
        .into_iter()
        .find(|side| bone.starts_with(side));
    let above = match side.map(|side| format!("{side}{above}")) {
        Some(above) if heard.bones.contains_key(&above) => above,
        _ => above.to_owned(),
    };
    let (origin, axes) = placed(heard, &above);
    (origin + axes * at, axes * turn)
}

fn unity(at: Position<Room>) -> Vector3<f64> {
    let at = at.vector();
    Vector3::new(-at.y, at.z, at.x)
}

/// Checks a person's pose as heard against the figure that was sent.
fn assert_is(heard: &Heard, figure: &Figure) {
    let places = figure.rig.place(&figure.pose);
    let mut found = 0;
    for (bone, (at, _)) in figure.rig.bones.iter().zip(&places) {
        if heard.bones.contains_key(&bone.name) {
            let off = (placed(heard, &bone.name).0 - unity(*at)).norm();
            assert!(off < 1e-4, "{} is {off} m off", bone.name);
            found += 1;
        }
    }
    assert_eq!(found, 21);
    assert_eq!(heard.bones.len(), 21);
}

/// Checks that somebody is upright, as tall as they truly are, and faces where they truly do, without any of our code.
fn assert_stands_as(heard: &Heard, performance: &Performance, person: usize, seconds: f64) {
    let truth = performance.pose(person, seconds);
    let true_at = |joint: Joint| unity(truth[joint].unwrap());
    let at = |bone: &str| placed(heard, bone).0;
    let height = |head: Vector3<f64>, foot: Vector3<f64>| head.y - foot.y;
    let (sent, is) = (
        height(at("Head"), at("LeftFoot")),
        height(true_at(Joint::Neck), true_at(Joint::AnkleLeft)),
    );
    assert!((sent - is).abs() < 0.04, "{sent} m high, truly {is}");
    let across = true_at(Joint::ShoulderRight) - true_at(Joint::ShoulderLeft);
    // Unity: X right, Y up; what is right of somebody, turned by a quarter to the left, is ahead of them.
    let ahead = Vector3::new(-across.z, 0.0, across.x).normalize();
    let (_, chest) = placed(heard, "Chest");
    let faces = chest * Vector3::z();
    let faces = Vector3::new(faces.x, 0.0, faces.z).normalize();
    assert!(faces.dot(&ahead) > 0.85, "faces {faces}, truly {ahead}");
    let up = chest * Vector3::y();
    let trunk = (true_at(Joint::SpineShoulder) - true_at(Joint::SpineMid)).normalize();
    assert!(up.dot(&trunk) > 0.9, "up is {up}, truly {trunk}");
}

fn settings(first: &VMCSocket, people: usize) -> Config {
    let vmc = VmcSettings {
        enabled: true,
        target: first.local_addr().unwrap(),
        people,
        rate_hz: 0.0,
        ..VmcSettings::default()
    };
    Config {
        vmc,
        ..Config::default()
    }
}

#[tokio::test]
async fn two_people_come_and_go_each_on_a_port_of_their_own() {
    let [one, two] = neighbours::<2>().await;
    let mut ports = [VMCSocket::new(one), VMCSocket::new(two)];
    let mut running = Running::start(&settings(&ports[0], 2));
    let performance = performance();
    let (mut time_s, mut path) = (-1.0, 0.0);
    let mut before: Option<Vector3<f64>> = None;
    for number in 0..150 {
        let who: &[(u64, usize)] = match number {
            0..30 => &[(7, 0)],
            30..70 => &[(7, 0), (8, 1)],
            70..90 => &[(8, 1)],
            _ => &[(8, 1), (9, 0)],
        };
        let figures = running.show(&frame(&performance, number, who)).await;
        for figure in &figures {
            let slot = usize::from(figure.id.0 == 8);
            let mut heard = heard(&mut ports[slot]).await;
            if !is_there(&heard) {
                assert_eq!(slot, 0, "only the first one ever left");
                assert!(heard.bones.is_empty() && (70..110).contains(&number));
                heard = self::heard(&mut ports[slot]).await;
            }
            assert!(is_there(&heard), "{number}");
            assert_is(&heard, figure);
            let person = usize::from(slot == 1);
            let seconds = *crate::room::BEGIN_S + number as f64 / crate::room::RATE_HZ;
            if number % 10 == 0 {
                assert_stands_as(&heard, &performance, person, seconds);
            }
            if slot == 1 {
                let now = heard.time_s.unwrap();
                assert!(now > time_s);
                time_s = now;
                let at = heard.root.unwrap().0;
                assert!(at.y.abs() < 1e-6, "the root is on the floor");
                path += before.map_or(0.0, |before| (at - before).norm());
                before = Some(at);
            }
        }
    }
    assert!(time_s > 4.0);
    assert!(path > 0.3, "nobody moved: {path} m");
    let status = running.status("vmc");
    assert_eq!((status.state, status.dropped), (SinkState::Running, 0));
    assert!(status.delivered >= 140, "{status:?}");
}

#[tokio::test]
async fn hips_carry_the_way_where_receivers_know_no_root() {
    let [socket] = neighbours::<1>().await;
    let mut port = VMCSocket::new(socket);
    let mut config = settings(&port, 1);
    config.vmc.travel = VmcTravel::Hips;
    let mut running = Running::start(&config);
    let performance = performance();
    for number in 0..15 {
        for figure in running.show(&frame(&performance, number, &[(1, 0)])).await {
            let heard = heard(&mut port).await;
            assert_eq!(heard.root.unwrap().0, Vector3::zeros());
            let off = (heard.bones["Hips"].0 - unity(figure.pose.root)).norm();
            assert!(off < 1e-6);
            assert_is(&heard, &figure);
        }
    }
}

#[tokio::test]
async fn receivers_are_told_when_nothing_comes_any_more_and_when_the_sink_is_switched_off() {
    let [socket] = neighbours::<1>().await;
    let mut port = VMCSocket::new(socket);
    let mut running = Running::start(&settings(&port, 1));
    let performance = performance();
    let mut last = Heard::default();
    for number in 0..12 {
        let figures = running.show(&frame(&performance, number, &[(1, 0)])).await;
        if !figures.is_empty() {
            last = heard(&mut port).await;
        }
    }
    assert!(is_there(&last));
    assert!(
        !is_there(&heard(&mut port).await),
        "after a second of nothing"
    );
    let figures = running.show(&frame(&performance, 13, &[(1, 0)])).await;
    assert_eq!(figures.len(), 1);
    while !is_there(&heard(&mut port).await) {}
    running.sinks.switch("vmc", false).unwrap();
    assert!(!is_there(&heard(&mut port).await), "when switched off");
}

#[tokio::test]
async fn fingers_bend_to_the_palm_in_closed_hands() {
    let [socket] = neighbours::<1>().await;
    let mut port = VMCSocket::new(socket);
    let mut config = settings(&port, 1);
    config.vmc.fingers = true;
    let mut running = Running::start(&config);
    let performance = performance();
    let mut last = Heard::default();
    for number in 0..45 {
        let mut shown = frame(&performance, number, &[(1, 0)]);
        let closed = HandVotes {
            closed: Confidence::FULL,
            sensors: 2,
        };
        shown.tracks[0].hands = [Some(closed); 2];
        if !running.show(&shown).await.is_empty() {
            last = heard(&mut port).await;
        }
    }
    assert_eq!(last.bones.len(), 21 + 2 * 13);
    // In the T-pose a left hand points to Unity's -x, palm down.
    for (side, out) in [("Left", -Vector3::x()), ("Right", Vector3::x())] {
        for finger in ["Index", "Middle", "Ring", "Little"] {
            let at = |phalanx: &str| last.bones[&format!("{side}{finger}{phalanx}")];
            let (knuckle, proximal) = at("Proximal");
            assert!(
                knuckle.dot(&out) > 0.04,
                "{side} {finger} begins at {knuckle}"
            );
            let (along, intermediate) = at("Intermediate");
            assert!(along.dot(&out) > 0.01);
            let middle = proximal * intermediate * out;
            assert!(proximal * out != out && middle.y < 0.3 && middle.dot(&out) < 0.0);
            assert!(
                (proximal * out).y < -0.5,
                "{side} {finger}: {}",
                proximal * out
            );
        }
        let across = last.bones[&format!("{side}IndexProximal")].0
            - last.bones[&format!("{side}LittleProximal")].0;
        assert!(across.z > 0.02, "the index is on the thumb's side, ahead");
    }
}
