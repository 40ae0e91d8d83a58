//! A room by hand: a server, agents, and every command that talks to it.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use std::time::Duration;

use common::{Running, Server, User};
use rustix::process::Signal;
use serde_json::Value;

fn agents(user: &User, server: &Server, names: &[&str]) -> Vec<Running> {
    let begin = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap()
        .as_nanos()
        .to_string();
    let start = |(index, name): (usize, &&str)| {
        let sensor = (index + 1).to_string();
        user.start(&[
            "agent",
            "sim",
            "--name",
            name,
            "--sensor",
            &sensor,
            "--sensors",
            "2",
            "--layout",
            "arc",
            "--epoch-ns",
            &begin,
            "--server",
            &server.url,
        ])
    };
    names.iter().enumerate().map(start).collect()
}

fn sensor_findings(user: &User, server: &Server) -> Vec<Value> {
    let doctor = user
        .run(&["doctor", "--json", "--server", &server.url])
        .json();
    let findings = doctor["findings"].as_array().unwrap().clone();
    findings
        .into_iter()
        .filter(|finding| finding["what"].as_str().unwrap().starts_with("sensor "))
        .collect()
}

fn wait_for_sensors(user: &User, server: &Server, count: usize) {
    for _ in 0..100 {
        if sensor_findings(user, server).len() == count {
            return;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("the agents did not join");
}

#[test]
fn calibrated_watched_recorded_listed_and_played_back() {
    let user = User::new();
    let server = user.server();
    let agents = agents(&user, &server, &["left", "right"]);
    wait_for_sensors(&user, &server, 2);
    std::thread::sleep(Duration::from_secs(2));
    for finding in sensor_findings(&user, &server) {
        assert_eq!(finding["grade"], "doubtful");
        assert_eq!(finding["remedy"], "posefuse calibrate", "{finding}");
    }

    let dry = user.run(&[
        "calibrate",
        "--seconds",
        "3",
        "--dry-run",
        "--json",
        "--server",
        &server.url,
    ]);
    assert_eq!(dry.json()["in_force"], false, "{dry:?}");
    let real = user.run(&[
        "calibrate",
        "--seconds",
        "14",
        "--json",
        "--server",
        &server.url,
    ]);
    assert!([0, 3].contains(&real.code), "{real:?}");
    assert_eq!(real.json()["in_force"], true);
    assert_eq!(real.json()["sensors"].as_array().unwrap().len(), 2);

    let watched = user.run(&["watch", "--json", "--frames", "20", "--server", &server.url]);
    assert_eq!(watched.code, 0, "{watched:?}");
    let frames: Vec<Value> = watched
        .out
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(frames.len(), 20);
    let people = frames
        .iter()
        .flat_map(|frame| frame["people"].as_array().unwrap());
    let heads = people.filter_map(|person| person["joints"]["Head"]["position_m"][2].as_f64());
    let heads: Vec<f64> = heads.collect();
    assert!(
        !heads.is_empty() && heads.iter().all(|z| (0.3..2.3).contains(z)),
        "{heads:?}"
    );

    let record = [
        "record",
        "scene",
        "--seconds",
        "2",
        "--slate",
        "1A/1",
        "--json",
        "--server",
        &server.url,
    ];
    let recorded = user.run(&record);
    assert_eq!(recorded.code, 0, "{recorded:?}");
    assert_eq!(recorded.json()["name"], "scene");
    let until_stopped = user.start(&["record", "scene", "--server", &server.url]);
    until_stopped.wait_for("recording");
    std::thread::sleep(Duration::from_secs(1));
    until_stopped.signal(Signal::INT);
    let (code, printed) = until_stopped.ended(Duration::from_secs(5));
    assert!(code == Some(0) && printed.contains("scene-2"), "{printed}");

    let of_server = user.json(&["takes", "list", "--server", &server.url]);
    let of_folder = user.json(&["takes"]);
    for takes in [&of_server, &of_folder] {
        let names: Vec<_> = takes
            .as_array()
            .unwrap()
            .iter()
            .map(|take| take["name"].as_str().unwrap())
            .collect();
        assert_eq!(names, ["scene-2", "scene"]);
        assert_eq!(takes[1]["slate"], "1A/1");
    }
    assert_eq!(user.json(&["refuse", "scene"])["identical"], true);

    drop(agents);
    let played = user.run(&[
        "agent",
        "take",
        "scene",
        "--sensor",
        "left",
        "--name",
        "played",
        "--json",
        "--server",
        &server.url,
    ]);
    assert_eq!(played.code, 0, "{played:?}");
    assert_eq!(played.json()["delivered"], played.json()["captured"]);
    let gone = sensor_findings(&user, &server);
    assert_eq!(gone.len(), 3);
    assert!(
        gone.iter().all(|finding| finding["grade"] == "bad"),
        "their agents are gone: {gone:?}"
    );

    server.process.signal(Signal::TERM);
    let (code, printed) = server.process.ended(Duration::from_secs(10));
    assert_eq!(code, Some(0), "{printed}");
}

#[test]
fn an_agent_waits_for_its_server_and_a_lost_take_is_reported() {
    let user = User::new();
    let port = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .to_string();
    let agent = user.start(&["agent", "sim", "--name", "early", "--server", &port]);
    std::thread::sleep(Duration::from_secs(1));
    let server = user.start(&["server", "--listen", &port, "--json"]);
    server.wait_for("url");
    agent.wait_for("connected");

    let record = user.start(&["record", "--server", &port]);
    record.wait_for("recording");
    std::thread::sleep(Duration::from_secs(1));
    server.signal(Signal::KILL);
    let (code, printed) = record.ended(Duration::from_secs(10));
    assert!(
        code == Some(1) && printed.contains("server went away"),
        "{code:?} {printed}"
    );
    let watch = user.run(&["watch", "--server", &port]);
    assert_eq!(watch.code, 1, "{watch:?}");
}

#[test]
fn before_a_calibration_a_take_holds_no_fused_frame_and_refuse_says_what_to_do() {
    let user = User::new();
    let server = user.server();
    let agents = agents(&user, &server, &["left", "right"]);
    wait_for_sensors(&user, &server, 2);
    let doctor = user
        .run(&["doctor", "--json", "--server", &server.url])
        .json();
    let findings = doctor["findings"].as_array().unwrap();
    let calibration = findings.iter().find(|f| f["what"] == "calibration");
    let found = calibration.unwrap()["found"].as_str().unwrap();
    assert!(found.contains("server has none in force"), "{found}");

    let record = ["record", "scene", "--seconds", "1", "--server", &server.url];
    assert_eq!(user.run(&record).code, 0);
    drop(agents);
    let refused = user.run(&["refuse", "scene"]);
    assert!(!refused.out.contains("identical"), "{refused:?}");
    for part in [
        "no frame was fused",
        "no calibration in it",
        "posefuse calibrate --from scene --out room.toml",
        "posefuse refuse scene --calibration room.toml",
    ] {
        assert!(refused.out.contains(part), "no `{part}` in {refused:?}");
    }
}
