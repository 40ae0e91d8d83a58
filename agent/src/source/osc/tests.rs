//! Packets over loopback, and packets that are none.

use std::net::UdpSocket;

use proptest::prelude::*;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType, encoder};

use super::*;
use crate::SystemClock;
use crate::source::SourceBody;

struct Bench {
    source: OscSource,
    sender: UdpSocket,
}

impl Bench {
    fn new(layout: Layout) -> Self {
        Self::with(OscConfig {
            layout,
            ..OscConfig::default()
        })
    }

    fn with(config: OscConfig) -> Self {
        let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
        let config = OscConfig {
            listen: "127.0.0.1:0".parse().unwrap(),
            ..config
        };
        let source = OscSource::open(&config, &clock).unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        sender.connect(source.local_addr().unwrap()).unwrap();
        Self { source, sender }
    }

    fn send(&self, messages: &[(&str, Vec<OscType>)]) {
        for message in messages {
            self.sender
                .send(&encoder::encode(&osc(message)).unwrap())
                .unwrap();
        }
    }

    fn bundle(&self, tag: u32, messages: &[(&str, Vec<OscType>)]) {
        let bundle = OscPacket::Bundle(OscBundle {
            timetag: OscTime::from((tag, 0)),
            content: messages.iter().map(osc).collect(),
        });
        self.sender
            .send(&encoder::encode(&bundle).unwrap())
            .unwrap();
    }

    fn next(&mut self) -> SourceFrame {
        self.source.next_frame().unwrap().unwrap()
    }
}

fn osc((address, args): &(&str, Vec<OscType>)) -> OscPacket {
    OscPacket::Message(OscMessage {
        addr: (*address).to_owned(),
        args: args.clone(),
    })
}

fn floats(values: &[f32]) -> Vec<OscType> {
    values.iter().map(|value| OscType::Float(*value)).collect()
}

fn joint(body: &SourceBody, set: JointSet, name: &str) -> Option<([f64; 3], f32)> {
    let index = set
        .joint_names()
        .iter()
        .position(|known| *known == name)
        .unwrap();
    body.joints[index].map(|raw| {
        let v = raw.position.vector();
        let rounded = [v.x, v.y, v.z].map(|value| (value * 1e4).round() / 1e4);
        (rounded, raw.confidence.get())
    })
}

#[test]
fn a_frame_ends_where_the_sender_says_so_where_a_joint_comes_again_and_after_a_pause() {
    let mut bench = Bench::new(Layout::Posefuse);
    bench.send(&[
        ("/skel/1/Head/pos", floats(&[0.1, -0.6, 2.5])),
        ("/skel/2/head", floats(&[0.9, -0.6, 2.5, 0.25])),
        ("/frame", vec![]),
        ("/skel/1/Head/pos", floats(&[0.2, -0.6, 2.5])),
        ("/skel/1/hand_left/pos", floats(&[0.0, 0.0, 0.0])),
        ("/skel/1/Head/pos", floats(&[0.3, -0.6, 2.5])),
    ]);
    let both = bench.next();
    assert_eq!(both.bodies.len(), 2);
    assert_eq!(both.bodies[0].joints.len(), 25);
    let head = |body| joint(body, JointSet::KinectV2, "Head");
    assert_eq!(head(&both.bodies[0]), Some(([0.1, -0.6, 2.5], 1.0)));
    assert_eq!(head(&both.bodies[1]), Some(([0.9, -0.6, 2.5], 0.25)));
    let again = bench.next();
    assert_eq!(head(&again.bodies[0]), Some(([0.2, -0.6, 2.5], 1.0)));
    let hand = joint(&again.bodies[0], JointSet::KinectV2, "HandLeft");
    assert_eq!(hand, None, "zeros are no place");
    let paused = bench.next();
    assert_eq!(head(&paused.bodies[0]), Some(([0.3, -0.6, 2.5], 1.0)));
    let times = [both.captured, again.captured, paused.captured];
    assert!(times[0] <= times[1] && times[1] <= times[2]);
    assert!(
        bench.next().bodies.is_empty(),
        "silence says that nobody is there"
    );
}

#[test]
fn bundles_of_one_time_are_one_frame() {
    let mut bench = Bench::new(Layout::Posefuse);
    for tag in [100, 101] {
        bench.bundle(tag, &[("/skel/1/Head", floats(&[0.1, 0.0, 2.0]))]);
        bench.bundle(tag, &[("/skel/2/Head", floats(&[0.2, 0.0, 2.0]))]);
    }
    assert_eq!(bench.next().bodies.len(), 2);
    assert_eq!(bench.next().bodies.len(), 2);
}

#[test]
fn every_layout_puts_the_same_hand_in_the_same_place() {
    let string = |text: &str| OscType::String(text.to_owned());
    let with = |first: Vec<OscType>, rest: &[f32]| [first, floats(rest)].concat();
    // The left hand of somebody who faces the sensor: 0.3 m to the right in the picture, 0.1 m up, 2.5 m away.
    let cases = [
        (
            Layout::Posefuse,
            ("/skel/7/HandLeft/pos", floats(&[0.3, -0.1, 2.5])),
            "HandLeft",
        ),
        (
            Layout::KinectV2Osc,
            (
                "/bodies/7/joints/HandLeft",
                [floats(&[-0.3, 0.1, 2.5]), vec![string("Inferred")]].concat(),
            ),
            "HandLeft",
        ),
        (
            Layout::Osceleton,
            (
                "/joint",
                with(
                    vec![string("l_hand"), OscType::Int(7)],
                    &[
                        (1280.0 + 300.0) / 2560.0,
                        (960.0 - 100.0) / 1920.0,
                        2500.0 * 7.8125 / 10000.0,
                    ],
                ),
            ),
            "LeftHand",
        ),
        (
            Layout::OsceletonMm,
            ("/joint/l_hand/7", floats(&[-300.0, 100.0, 2500.0])),
            "LeftHand",
        ),
        (
            Layout::OsceletonKinect,
            (
                "/joint",
                with(
                    vec![string("l_hand"), OscType::Int(0), OscType::Int(7)],
                    &[-30.0, -10.0, 250.0, 0.5],
                ),
            ),
            "HandLeft",
        ),
        (
            Layout::NiMate,
            ("/Left_Hand", floats(&[0.3, 0.1, 2.5])),
            "LeftHand",
        ),
    ];
    for (layout, message, name) in cases {
        let mut bench = Bench::new(layout);
        bench.send(&[message]);
        let frame = bench.next();
        let person = if layout == Layout::NiMate { 1 } else { 7 };
        assert_eq!(frame.bodies[0].tracking_id, person, "{layout}");
        let found = joint(&frame.bodies[0], layout.usual_joint_set(), name).unwrap();
        assert_eq!(found.0, [0.3, -0.1, 2.5], "{layout}");
        let guess = matches!(layout, Layout::KinectV2Osc | Layout::OsceletonKinect);
        assert_eq!(found.1, if guess { 0.5 } else { 1.0 }, "{layout}");
    }
}

#[test]
fn unit_and_axes_can_be_said() {
    let mut bench = Bench::with(OscConfig {
        layout: Layout::NiMate,
        unit: Some(Unit::Cm),
        axes: Some("y,-z,x".into()),
        ..OscConfig::default()
    });
    bench.send(&[(
        "/skeleton_head",
        floats(&[100.0, 200.0, 300.0, 0.0, 0.0, 0.0, 1.0]),
    )]);
    let frame = bench.next();
    let head = joint(&frame.bodies[0], JointSet::Nite, "Head");
    assert_eq!(head.unwrap().0, [2.0, -3.0, 1.0]);
}

#[test]
fn what_cannot_be_meant_or_opened_is_told_with_a_remedy() {
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let bench = Bench::new(Layout::Posefuse);
    let taken = OscConfig {
        listen: bench.source.local_addr().unwrap(),
        ..OscConfig::default()
    };
    let axes = OscConfig {
        axes: Some("x,x,z".into()),
        ..OscConfig::default()
    };
    for (config, words) in [(taken, "choose another port"), (axes, "e.g. -x,-y,z")] {
        match OscSource::open(&config, &clock) {
            Err(SourceError::Final(why)) => assert!(why.contains(words), "{why}"),
            other => panic!("{:?}", other.map(|_| ())),
        }
    }
}

#[test]
fn garbage_is_counted_and_told_and_does_not_hide_what_is_good() {
    let mut bench = Bench::new(Layout::Posefuse);
    bench.source.heard_ns -= SILENT_NS;
    assert!(
        matches!(bench.source.next_frame(), Err(SourceError::Trouble(why)) if why.contains("no OSC message"))
    );

    bench.send(&[("/tempo", floats(&[120.0]))]);
    bench.sender.send(b"GET / HTTP/1.1\r\n").unwrap();
    bench.sender.send(&[]).unwrap();
    let nested: Vec<u8> = b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\xff\0".repeat(3000);
    bench.sender.send(&nested).unwrap();
    let arrays = [b"/a\0\0,".to_vec(), b"[".repeat(60_000), vec![0; 3]].concat();
    bench.sender.send(&arrays).unwrap();
    // What waits while trouble is told is thrown away; this is not.
    bench.source.troubled = false;
    bench.source.receive().unwrap();
    bench.source.heard_ns -= SILENT_NS;
    assert!(
        matches!(bench.source.next_frame(), Err(SourceError::Trouble(why)) if why.contains("/tempo f") && why.contains("--layout"))
    );
    bench.source.troubled = false;
    bench.send(&[
        ("/skel/1/Head", floats(&[0.1, 0.0, 2.0])),
        ("/frame", vec![]),
    ]);
    assert_eq!(bench.next().bodies.len(), 1);
    assert_eq!(
        (bench.source.counts.broken, bench.source.counts.foreign),
        (4, 1)
    );
}

#[test]
fn more_people_than_a_frame_may_have_are_counted() {
    let mut bench = Bench::new(Layout::Posefuse);
    for person in 0..20 {
        let address = format!("/skel/{person}/Head");
        bench.send(&[(&address, floats(&[0.1, 0.0, 2.0]))]);
    }
    bench.send(&[("/frame", vec![])]);
    assert_eq!(
        (bench.next().bodies.len(), bench.source.gather.surplus),
        (16, 4)
    );
}

proptest! {
    #[test]
    fn no_packet_whatsoever_does_harm(bytes in proptest::collection::vec(any::<u8>(), 0..400), start in 0..4usize) {
        let start: &[u8] = [&b""[..], b"#bundle\0", b"/skel/1/Head\0\0\0\0,fff", b"/joint\0\0,sifff\0\0"][start];
        let packet = [start, &bytes].concat();
        let reader = Reader::new(Layout::Osceleton, JointSet::Nite, None, None);
        let mut gather = Gather::new(15, 8_000_000);
        for (tag, message) in packet::messages(&packet).unwrap_or_default() {
            if let Some(said) = reader.read(&message) {
                gather.hear(said, tag, 0);
            }
        }
        gather.idle(i64::MAX);
        while let Some(frame) = gather.next() {
            for raw in frame.bodies.iter().flat_map(|body| &body.joints).flatten() {
                prop_assert!(raw.position.vector().iter().all(|value| value.is_finite()));
            }
        }
    }
}
