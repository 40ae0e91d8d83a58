//! Bad input: each gets a message that names the thing and the remedy, and its exit code.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use std::net::TcpListener;
use std::time::Duration;

use common::User;

/// Runs, and checks the exit code and that the message holds each of these.
fn refused(user: &User, arguments: &[&str], code: i32, message: &[&str]) {
    let done = user.run(arguments);
    assert_eq!(done.code, code, "{done:?}");
    for part in message {
        assert!(done.err.contains(part), "no `{part}` in {done:?}");
    }
    assert!(
        !done.err.contains("panicked") && done.out.is_empty(),
        "{done:?}"
    );
}

#[test]
fn a_typing_error_in_the_configuration_is_answered_with_what_was_meant() {
    let user = User::new();
    let file = user.file("room.toml", "[takes]\nfoldr = \"x\"\n");
    refused(
        &user,
        &["server", "--config", &file],
        2,
        &["room.toml", "line 2", "foldr", "did you mean `folder`?"],
    );
    let file = user.file("scenario.toml", "peple = 2\n");
    refused(
        &user,
        &["simulate", "--scenario", &file],
        2,
        &["scenario.toml", "did you mean `people`?"],
    );
    refused(
        &user,
        &["server", "--config", "nothing.toml"],
        2,
        &["nothing.toml", "cannot be read"],
    );
    let file = user.file("calibration.toml", "version = 1\n");
    refused(
        &user,
        &["refuse", "x", "--calibration", &file],
        1,
        &["no take `x`"],
    );
}

#[test]
fn a_port_in_use_is_named_with_another_to_choose() {
    let user = User::new();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let next = format!("--listen 127.0.0.1:{}", address.port() + 1);
    let port = format!("port {}", address.port());
    refused(
        &user,
        &["server", "--listen", &address.to_string()],
        1,
        &[&port, "in use", &next],
    );
}

#[test]
fn an_address_that_others_reach_needs_leave() {
    let user = User::new();
    refused(
        &user,
        &["server", "--listen", "0.0.0.0:0"],
        1,
        &["not encrypted", "--allow-remote"],
    );
}

#[test]
fn a_takes_folder_that_cannot_be_written_is_named() {
    let user = User::new();
    user.file("file", "");
    let arguments = ["server", "--listen", "127.0.0.1:0", "--takes", "file/takes"];
    refused(&user, &arguments, 1, &["file/takes", "create it writable"]);
    refused(
        &user,
        &["simulate", "--seconds", "1", "--takes", "file/takes"],
        1,
        &["file/takes"],
    );
    let demo = [
        "demo",
        "--no-browser",
        "--listen",
        "127.0.0.1:0",
        "--takes",
        "file/takes",
    ];
    let done = user.run(&demo);
    assert_eq!(done.code, 1, "{done:?}");
    assert!(
        done.err.contains("server ended") && done.err.contains("file/takes"),
        "{done:?}"
    );
}

#[test]
fn a_take_that_is_not_there_or_cut_off_or_no_take() {
    let user = User::new();
    refused(
        &user,
        &["takes", "show", "walk"],
        1,
        &["no take `walk`", "posefuse takes", "--takes DIR"],
    );
    refused(
        &user,
        &["refuse", "some/walk.mcap"],
        1,
        &["no file `some/walk.mcap`"],
    );
    let made = user.json(&[
        "simulate",
        "--seconds",
        "3",
        "--true-calibration",
        "--out",
        "walk",
    ]);
    let whole = std::fs::read(made["take"]["path"].as_str().unwrap()).unwrap();
    let cut = user.file("cut.mcap", &whole[..whole.len() * 3 / 4]);
    let repair = "posefuse takes recover";
    refused(
        &user,
        &["takes", "show", &cut],
        1,
        &["`cut`", "no end", repair],
    );
    refused(&user, &["refuse", &cut], 1, &["`cut`", "no end", repair]);
    refused(
        &user,
        &["calibrate", "--from", &cut],
        1,
        &["`cut`", "no end", repair],
    );
    let noise = user.file("noise.mcap", [7; 5000]);
    refused(
        &user,
        &["takes", "show", &noise],
        1,
        &["`noise`", "cannot be read"],
    );
    refused(
        &user,
        &["agent", "take", "walk", "--sensor", "x"],
        1,
        &["no sensor `x`", "sim1, sim2, sim3, sim4"],
    );

    let folder = user.home().to_str().unwrap();
    let repaired = user.run(&["takes", "recover", "--takes", folder]);
    assert!(repaired.out.contains("cut: repaired"), "{repaired:?}");
    assert_eq!(user.json(&["takes", "show", &cut])["state"], "recovered");
}

#[test]
fn an_address_without_a_server_or_that_is_none() {
    let user = User::new();
    let nobody = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .to_string();
    let no_server = ["no server answers", &nobody, "posefuse server"];
    refused(&user, &["watch", "--server", &nobody], 1, &no_server);
    refused(&user, &["record", "--server", &nobody], 1, &no_server);
    refused(&user, &["calibrate", "--server", &nobody], 1, &no_server);
    refused(
        &user,
        &["takes", "list", "--server", &nobody],
        1,
        &no_server,
    );
    refused(
        &user,
        &["watch", "--server", "ftp://x:1"],
        2,
        &["ftp://x:1", "http://studio:7400"],
    );

    // Something that speaks another protocol.
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for stream in other.incoming().flatten() {
            use std::io::Write;
            let _ = (&stream).write_all(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n");
        }
    });
    refused(
        &user,
        &["watch", "--server", &address],
        1,
        &["not as a Posefuse server", &address],
    );
}

#[test]
fn an_agent_that_cannot_be_what_it_is_told() {
    let user = User::new();
    refused(
        &user,
        &["agent", "sim", "--name", "a b"],
        2,
        &["`a b`", "letters"],
    );
    refused(
        &user,
        &["agent", "sim", "--sensor", "9"],
        2,
        &["--sensor 9", "1 to 4"],
    );
    refused(
        &user,
        &["agent", "csv", "walk.csv", "--name", "left"],
        1,
        &["left", "walk.csv"],
    );
    refused(&user, &["agent", "csv", "walk.csv"], 2, &["--name"]);
    refused(&user, &["agent"], 2, &["sim", "take", "csv"]);
}

#[test]
fn a_second_agent_of_the_same_name_is_told_so() {
    let user = User::new();
    let server = user.server();
    let agent = ["agent", "sim", "--name", "left", "--server", &server.url];
    let first = user.start(&agent);
    first.wait_for("connected");
    let second = user.start(&agent);
    let said = second.wait_for("left");
    second.signal(rustix::process::Signal::INT);
    let (_, rest) = second.ended(Duration::from_secs(10));
    assert!(
        format!("{said}\n{rest}").contains("another"),
        "{said}\n{rest}"
    );
}

#[test]
fn wrong_usage_is_2_and_help_is_0() {
    let user = User::new();
    refused(&user, &["frobnicate"], 2, &["frobnicate"]);
    refused(&user, &["demo", "--people", "0"], 2, &["--people"]);
    refused(
        &user,
        &["record", "--seconds", "0"],
        2,
        &["--seconds", "more than 0"],
    );
    refused(&user, &["simulate", "--out", "../x"], 2, &["../x"]);
    let broken = user.file("walk.bvh", "HIERARCHY\nROOT\n");
    refused(
        &user,
        &["simulate", "--motion", &broken],
        2,
        &["walk.bvh, line"],
    );
    refused(
        &user,
        &["simulate", "--motion", "walk.xyz"],
        2,
        &["walk.xyz", ".bvh"],
    );
    refused(&user, &["calibrate", "--out", "x"], 2, &["--from"]);
    refused(
        &user,
        &["server", "--listen", "7421"],
        2,
        &["--listen", "expected ADDRESS:PORT", "127.0.0.1:7421"],
    );
    refused(
        &user,
        &["agent", "take", "x", "--sensor", "a", "--speed", "fast"],
        2,
        &["--speed", "expected a factor"],
    );
    refused(
        &user,
        &["agent", "sim", "--sensors", "many"],
        2,
        &["--sensors", "a whole number from 1 to 64"],
    );
    assert_eq!(
        user.run(&["--version"]).out.trim(),
        concat!("posefuse ", env!("CARGO_PKG_VERSION"))
    );
    for command in [
        "demo",
        "server",
        "agent",
        "calibrate",
        "record",
        "takes",
        "refuse",
        "simulate",
        "watch",
        "doctor",
        "completions",
    ] {
        let done = user.run(&[command, "--help"]);
        assert!(done.code == 0 && done.out.contains("Usage:"), "{done:?}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let user = User::new();
    let mut command = user.command(&["completions", "bash"]);
    let mut child = command
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn completions_name_every_command() {
    let user = User::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let done = user.run(&["completions", shell]);
        assert_eq!(done.code, 0);
        for command in ["demo", "calibrate", "refuse", "doctor"] {
            assert!(done.out.contains(command), "{shell} lacks {command}");
        }
    }
}
