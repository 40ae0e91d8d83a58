//! What is sent by plain OSC, and what every UDP sink promises.

use std::collections::BTreeMap;

use crate::room::{Running, frame, listener, neighbours, performance, within};
use posefuse_sinks::{Axes, Config, Joints, OscPerson, OscSettings, SinkState, VmcSettings};
use posefuse_skeleton::{Joint, RoomFrame};
use rosc::{OscPacket, OscType};
use tokio::net::UdpSocket;

/// What one frame says: values by address.
type Heard = BTreeMap<String, Vec<f32>>;

/// All packets of one frame, which must come whole.
async fn heard(socket: &UdpSocket) -> Heard {
    let mut heard = Heard::new();
    for part in 1.. {
        let mut buffer = vec![0; 2000];
        let size = within(socket.recv(&mut buffer)).await.unwrap();
        assert!(size <= 1472, "{size} bytes");
        let (_, packet) = rosc::decoder::decode_udp(&buffer[..size]).unwrap();
        let OscPacket::Bundle(bundle) = packet else {
            panic!("no bundle")
        };
        let mut parts = 0.0;
        for content in bundle.content {
            let OscPacket::Message(message) = content else {
                panic!("no message")
            };
            let floats = message.args.into_iter().map(|value| match value {
                OscType::Float(value) => value,
                other => panic!("{other:?} is no float"),
            });
            let floats: Vec<f32> = floats.collect();
            if message.addr == "/skel/packet" {
                assert_eq!(floats[1], part as f32, "a packet is missing");
                parts = floats[2];
            }
            heard.insert(message.addr, floats);
        }
        if part as f32 == parts {
            break;
        }
    }
    heard
}

fn settings(socket: &UdpSocket) -> OscSettings {
    OscSettings {
        enabled: true,
        targets: vec![socket.local_addr().unwrap()],
        rate_hz: 0.0,
        ..OscSettings::default()
    }
}

fn with(osc: OscSettings) -> Config {
    Config {
        osc,
        ..Config::default()
    }
}

fn at(frame: &RoomFrame, track: usize, joint: Joint) -> [f64; 3] {
    let state = frame.tracks[track].skeleton[joint].as_ref().unwrap();
    state.position.vector().into()
}

#[tokio::test]
async fn joints_are_where_they_were_fused_and_people_enter_and_leave() {
    let (socket, _) = listener().await;
    let mut running = Running::start(&with(settings(&socket)));
    let performance = performance();
    for number in 0..30 {
        let who: &[(u64, usize)] = match number {
            0..10 => &[(4, 0)],
            10..20 => &[(4, 0), (6, 1)],
            _ => &[(6, 1)],
        };
        let shown = frame(&performance, number, who);
        running.show(&shown).await;
        let heard = heard(&socket).await;
        assert_eq!(heard["/skel/packet"][0], number as f32);
        assert_eq!(heard["/skel/count"], [who.len() as f32]);
        let people: Vec<f32> = who.iter().map(|(id, _)| *id as f32).collect();
        assert_eq!(heard["/skel/people"], people);
        assert_eq!(heard.contains_key("/skel/4/enter"), number == 0);
        assert_eq!(heard.contains_key("/skel/6/enter"), number == 10);
        assert_eq!(heard.contains_key("/skel/4/leave"), number == 20);
        let [day, second, rest] = heard["/skel/time"][..] else {
            panic!("three numbers of time")
        };
        let unix_s = f64::from(day) * 86400.0 + f64::from(second) + f64::from(rest);
        let expected_s = (shown.time.ns() + crate::room::UNIX_OFFSET_NS) as f64 * 1e-9;
        assert!((unix_s - expected_s).abs() < 1e-6);
        for (track, (id, _)) in who.iter().enumerate() {
            for joint in Joint::ALL {
                let values = &heard[&format!("/skel/{id}/{joint}/pos")];
                for (value, expected) in values.iter().zip(at(&shown, track, joint)) {
                    assert!((f64::from(*value) - expected).abs() < 1e-6);
                }
            }
        }
    }
    let status = running.status("osc");
    assert_eq!((status.state, status.delivered), (SinkState::Running, 30));
}

#[tokio::test]
async fn slots_bodies_axes_and_details_are_a_matter_of_settings() {
    let (first, _) = listener().await;
    let (second, second_at) = listener().await;
    let mut osc = settings(&first);
    osc.targets.push(second_at);
    osc.axes = Axes::Unity;
    osc.person = OscPerson::Slot;
    osc.joints = Joints::Body;
    (osc.confidence, osc.provenance) = (true, true);
    let mut running = Running::start(&with(osc));
    let performance = performance();
    let mut bodies = 0;
    for number in 0..20 {
        let figures = running
            .show(&frame(&performance, number, &[(4, 1), (900, 0)]))
            .await;
        let heard = self::heard(&first).await;
        assert_eq!(heard, self::heard(&second).await, "both targets get all");
        assert_eq!(heard["/skel/count"], [figures.len() as f32]);
        for (slot, figure) in figures.iter().enumerate() {
            let slot = slot + 1;
            assert_eq!(heard[&format!("/skel/{slot}/id")], [figure.id.0 as f32]);
            let knee = figure.joints[Joint::KneeLeft].unwrap().vector();
            let unity = [-knee.y, knee.z, knee.x].map(|value| value as f32);
            assert_eq!(heard[&format!("/skel/{slot}/KneeLeft/pos")], unity);
            assert_eq!(heard[&format!("/skel/{slot}/KneeLeft/confidence")], [1.0]);
            assert_eq!(heard[&format!("/skel/{slot}/KneeLeft/provenance")], [0.0]);
            bodies += 1;
        }
    }
    assert!(bodies > 10);
}

#[tokio::test]
async fn an_empty_room_is_told_though_no_frames_come() {
    let (socket, _) = listener().await;
    let mut running = Running::start(&with(settings(&socket)));
    running.show(&frame(&performance(), 0, &[(4, 0)])).await;
    assert!(heard(&socket).await.contains_key("/skel/4/enter"));
    let quiet = heard(&socket).await;
    assert_eq!(quiet["/skel/count"], [0.0]);
    assert!(quiet.contains_key("/skel/4/leave"));
    assert_eq!(quiet["/skel/packet"][0], 1.0);
}

#[tokio::test]
async fn a_receiver_that_never_reads_costs_others_nothing() {
    let [healthy] = neighbours::<1>().await;
    let (stalled, _) = listener().await;
    let mut config = with(settings(&stalled));
    config.vmc = VmcSettings {
        enabled: true,
        target: healthy.local_addr().unwrap(),
        people: 1,
        rate_hz: 0.0,
        ..VmcSettings::default()
    };
    let mut running = Running::start(&config);
    let performance = performance();
    let (mut figures, mut bytes) = (0, 0);
    let mut buffer = vec![0; 2000];
    // Two megabytes: ten times what the system keeps for a socket.
    for number in 0..700 {
        let shown = running
            .show(&frame(&performance, number, &[(4, 0), (5, 1)]))
            .await;
        figures += usize::from(!shown.is_empty());
        if !shown.is_empty() {
            // A pose is two packets.
            for _ in 0..2 {
                bytes += within(healthy.recv(&mut buffer)).await.unwrap();
            }
        }
    }
    assert!(bytes > 1000 * figures, "{bytes} bytes of {figures} poses");
    let (osc, vmc) = (running.status("osc"), running.status("vmc"));
    assert_eq!((osc.trouble.as_str(), vmc.trouble.as_str()), ("", ""));
    assert_eq!(vmc.dropped, 0);
    assert_eq!(osc.delivered + osc.dropped, 700);
}

#[test]
fn other_machines_are_refused_unless_allowed() {
    let mut config = Config::default();
    config.check().unwrap();
    config.osc.targets.push("192.0.2.1:9000".parse().unwrap());
    let error = config.check().unwrap_err().to_string();
    assert!(
        error.contains("sinks.osc.targets") && error.contains("allow_remote"),
        "{error}"
    );
    config.osc.targets.pop();
    config.vmc.target = "[2001:db8::1]:39539".parse().unwrap();
    let error = config.check().unwrap_err().to_string();
    assert!(
        error.contains("sinks.vmc.target") && error.contains("allow_remote"),
        "{error}"
    );
    config.allow_remote = true;
    config.check().unwrap();
    config.vmc.target = "127.0.0.1:65534".parse().unwrap();
    let error = config.check().unwrap_err().to_string();
    assert!(error.contains("4 ports"), "{error}");
    let mut labs = Config::default();
    labs.lsl.enabled = true;
    let error = labs.check().unwrap_err().to_string();
    assert!(error.contains("allow_remote"), "{error}");
    labs.allow_remote = true;
    labs.check().unwrap();
}

#[tokio::test]
async fn what_is_missing_for_labs_is_told_with_a_remedy() {
    let mut config = Config {
        allow_remote: true,
        ..Config::default()
    };
    config.lsl.enabled = true;
    config.lsl.library = "/nowhere/liblsl.so".into();
    let running = Running::start(&config);
    let trouble = within(async {
        loop {
            let status = running.status("lsl");
            if status.state == SinkState::Failing {
                return status.trouble;
            }
            tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        }
    })
    .await;
    assert!(
        trouble.contains("/nowhere/liblsl.so") && trouble.contains("pylsl"),
        "{trouble}"
    );
}
