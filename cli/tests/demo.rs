//! The demo as a user runs it: real processes, real gRPC, a real take.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use std::time::Duration;

use common::{User, still_running_after};
use rustix::process::Signal;

/// A demo of three processes that records until it is ended.
const LONG_DEMO: [&str; 9] = [
    "demo",
    "--no-browser",
    "--no-calibrate",
    "--seconds",
    "600",
    "--sensors",
    "2",
    "--listen",
    "127.0.0.1:0",
];

#[test]
fn runs_by_itself_calibrates_and_leaves_a_take_that_reads_back() {
    let user = User::new();
    let arguments = [
        "demo",
        "--seconds",
        "8",
        "--walk",
        "12",
        "--no-browser",
        "--listen",
        "127.0.0.1:0",
        "--json",
    ];
    let demo = user.start(&arguments);
    demo.wait_for("dashboard");
    demo.wait_for("recording `");
    let children = demo.children();
    assert_eq!(
        children.len(),
        5,
        "one server and four agents, each a process"
    );
    let (code, printed) = demo.ended(Duration::from_secs(60));
    assert_eq!(code, Some(0), "{printed}");
    assert_eq!(
        still_running_after(&children, Duration::ZERO),
        Vec::<u32>::new(),
        "a child was left behind"
    );

    let json = &printed[printed.find("{\n").unwrap()..];
    let end: serde_json::Value = serde_json::Deserializer::from_str(json)
        .into_iter()
        .next()
        .unwrap()
        .unwrap();
    assert_ne!(end["calibration"]["verdict"], "failed", "{end}");
    assert_eq!(end["calibration"]["sensors"].as_array().unwrap().len(), 4);
    let name = end["take"]["name"].as_str().unwrap();
    assert_eq!(
        end["take"]["path"].as_str().unwrap(),
        user.takes().join(format!("{name}.mcap")).to_str().unwrap()
    );

    let take = user.json(&["takes", "show", name]);
    assert_eq!(take["state"], "complete");
    assert_eq!(take["people"], 1);
    assert_eq!(take["sensors"].as_array().unwrap().len(), 4);
    let frames = take["frames_read"].as_u64().unwrap();
    assert!(frames > 100, "8 s at 30 fps, found {frames} frames");
    assert_eq!(take["frames"].as_u64(), Some(frames));

    let again = user.json(&["refuse", name]);
    assert_eq!(again["identical"], true, "{again}");
}

#[test]
fn ctrl_c_ends_everything_in_order_and_the_take_is_whole() {
    for signal in [Signal::INT, Signal::TERM] {
        let user = User::new();
        let demo = user.start(&LONG_DEMO);
        demo.wait_for("recording `");
        let children = demo.children();
        assert_eq!(children.len(), 3);
        std::thread::sleep(Duration::from_secs(1));
        // A terminal's Ctrl-C goes to the whole group: the children must leave the end to their parent.
        if signal == Signal::INT {
            for child in &children {
                let id = rustix::process::Pid::from_raw(*child as i32).unwrap();
                rustix::process::kill_process(id, Signal::INT).unwrap();
            }
        }
        demo.signal(signal);
        let (code, printed) = demo.ended(Duration::from_secs(10));
        assert_eq!(code, Some(0), "{printed}");
        assert!(printed.contains("posefuse takes show"), "{printed}");
        assert_eq!(
            still_running_after(&children, Duration::ZERO),
            Vec::<u32>::new()
        );
        let takes = user.json(&["takes"]);
        assert_eq!(takes[0]["state"], "complete", "{takes}");
        let take = user.json(&["takes", "show", takes[0]["name"].as_str().unwrap()]);
        assert!(take["messages"][0][1].as_u64().unwrap() > 10, "{take}");
    }
}

#[test]
fn ctrl_c_while_it_calibrates_is_clean_too() {
    let user = User::new();
    let demo = user.start(&[
        "demo",
        "--no-browser",
        "--sensors",
        "2",
        "--listen",
        "127.0.0.1:0",
    ]);
    demo.wait_for("calibrating");
    let children = demo.children();
    demo.signal(Signal::INT);
    let (code, printed) = demo.ended(Duration::from_secs(10));
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains("nothing was recorded"), "{printed}");
    assert_eq!(
        still_running_after(&children, Duration::ZERO),
        Vec::<u32>::new()
    );
}

#[test]
fn children_do_not_outlive_a_killed_parent_and_the_take_survives() {
    let user = User::new();
    let demo = user.start(&LONG_DEMO);
    demo.wait_for("recording `");
    let children = demo.children();
    assert_eq!(children.len(), 3);
    std::thread::sleep(Duration::from_secs(1));
    demo.signal(Signal::KILL);
    assert_eq!(
        still_running_after(&children, Duration::from_secs(3)),
        Vec::<u32>::new()
    );
    user.run(&["takes", "recover"]);
    let takes = user.json(&["takes"]);
    assert!(
        ["complete", "recovered"].contains(&takes[0]["state"].as_str().unwrap()),
        "{takes}"
    );
}

#[test]
fn a_taken_port_is_replaced_and_said() {
    let user = User::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let arguments = [
        "demo",
        "--no-browser",
        "--no-calibrate",
        "--sensors",
        "1",
        "--seconds",
        "0.2",
        "--listen",
        &address,
    ];
    let done = user.run(&arguments);
    assert_eq!(done.code, 0, "{done:?}");
    let port = taken.local_addr().unwrap().port();
    assert!(
        done.err.contains(&format!("port {port} is in use")),
        "{}",
        done.err
    );
}

#[test]
fn a_server_that_dies_is_said_and_so_is_what_becomes_of_the_take() {
    let user = User::new();
    let demo = user.start(&[
        "demo",
        "--no-browser",
        "--no-calibrate",
        "--seconds",
        "600",
        "--sensors",
        "2",
        "--listen",
        "127.0.0.1:0",
    ]);
    demo.wait_for("recording `");
    let is_server = |id: &u32| {
        let line = std::fs::read_to_string(format!("/proc/{id}/cmdline")).unwrap_or_default();
        line.split('\0').nth(1) == Some("server")
    };
    let server = demo.children().into_iter().find(is_server).unwrap();
    let id = rustix::process::Pid::from_raw(server as i32).unwrap();
    rustix::process::kill_process(id, Signal::KILL).unwrap();
    let (code, printed) = demo.ended(Duration::from_secs(20));
    assert_eq!(code, Some(1), "{printed}");
    assert!(
        printed.contains("posefuse takes recover") && printed.contains("repaired"),
        "{printed}"
    );
}
