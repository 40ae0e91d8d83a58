//! What works without a server: simulate, takes, refuse, calibrate from a take, doctor.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use common::User;

#[test]
fn a_simulated_take_is_measured_listed_fused_again_and_calibrated_from() {
    let user = User::new();
    let made = user.json(&["simulate", "--seconds", "25", "--out", "walk"]);
    assert_eq!(made["calibration"]["verdict"], "passed", "{made}");
    let error = made["error"]["mpjpe_mm"].as_f64().unwrap();
    assert!(
        error < 60.0,
        "MPJPE {error} mm; a single sensor has some 70"
    );
    assert!(
        made["error"]["missed_share"].as_f64().unwrap() < 0.05,
        "{made}"
    );

    let listed = user.json(&["takes"]);
    assert_eq!(listed[0]["name"], "walk");
    let shown = user.json(&["takes", "show", "walk"]);
    assert_eq!(shown["frames_read"], made["take"]["frames"]);
    let truth = shown["messages"]
        .as_array()
        .unwrap()
        .iter()
        .find(|topic| topic[0] == "/truth")
        .unwrap();
    assert_eq!(truth[1], made["take"]["frames"], "a truth for each frame");

    let again = user.json(&["refuse", "walk"]);
    assert_eq!(
        (&again["identical"], &again["frames"]),
        (&true.into(), &made["take"]["frames"])
    );
    let settings = user.file("average.toml", "[fusion.fuse]\nmethod = \"average\"\n");
    let other = user.json(&["refuse", "walk", "--config", &settings, "--out", "averaged"]);
    assert_eq!(other["identical"], false);
    assert_eq!(user.json(&["takes"]).as_array().unwrap().len(), 3);

    let file = user.home().join("calibration.toml").display().to_string();
    let calibrated = user.json(&["calibrate", "--from", "walk", "--out", &file]);
    assert_ne!(calibrated["verdict"], "failed", "{calibrated}");
    for pair in calibrated["pairs"].as_array().unwrap() {
        let (before, after) = (
            pair["before_mm"].as_f64().unwrap(),
            pair["after_mm"].as_f64().unwrap(),
        );
        assert!(after < 100.0 && after < before, "{pair}");
    }
    let moved = user.json(&[
        "refuse",
        "walk",
        "--calibration",
        &file,
        "--out",
        "recalibrated",
    ]);
    assert_eq!(
        moved["identical"], false,
        "the room's origin is another one now"
    );
    assert!(moved["frames"].as_u64().unwrap() > 500, "{moved}");
}

#[test]
fn the_same_seed_gives_the_same_take_and_another_one_another() {
    let user = User::new();
    let error = |seed: &str| {
        let made = user.json(&[
            "simulate",
            "--seconds",
            "4",
            "--true-calibration",
            "--people",
            "2",
            "--seed",
            seed,
        ]);
        made["error"]["mpjpe_mm"].as_f64().unwrap()
    };
    let (first, same, other) = (error("5"), error("5"), error("6"));
    assert_eq!(first, same);
    assert_ne!(first, other);
}

#[test]
fn the_printed_configuration_is_taken_again() {
    let user = User::new();
    let printed = user.run(&["server", "--print-config"]);
    assert_eq!(printed.code, 0);
    let file = user.file("server.toml", printed.out);
    let doctor = user.run(&["doctor", "--config", &file, "--json"]).json();
    let finding = finding(&doctor, "configuration");
    assert_eq!(finding["grade"], "good", "{finding}");
}

#[test]
fn the_doctor_finds_what_is_broken_and_says_what_to_do() {
    let user = User::new();
    let nobody = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .to_string();
    let well = user.run(&["doctor", "--json", "--server", &nobody]);
    assert_eq!(well.code, 0, "{well:?}");
    let well = well.json();
    for what in [
        "processors",
        "clock",
        "open files",
        "takes folder",
        "free space",
        "calibration",
        "server",
    ] {
        assert_ne!(finding(&well, what)["grade"], "bad", "{what}");
    }
    assert_eq!(finding(&well, "server")["grade"], "unknown");

    let settings = user.file("server.toml", "[calibration]\nfle = \"x\"\n");
    user.file("file", "");
    std::fs::create_dir_all(user.home().join("data/posefuse")).unwrap();
    user.file("data/posefuse/calibration.toml", "version = 7\n");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let ill = user.run(&[
        "doctor",
        "--json",
        "--config",
        &settings,
        "--takes",
        "file/takes",
        "--server",
        &address,
    ]);
    assert_eq!(ill.code, 1, "{ill:?}");
    let ill = ill.json();
    for what in ["configuration", "takes folder", "calibration", "server"] {
        let finding = finding(&ill, what);
        assert_eq!(finding["grade"], "bad", "{finding}");
        assert!(!finding["remedy"].as_str().unwrap().is_empty(), "{finding}");
    }
}

fn finding<'a>(doctor: &'a serde_json::Value, what: &str) -> &'a serde_json::Value {
    let findings = doctor["findings"].as_array().unwrap();
    findings
        .iter()
        .find(|finding| finding["what"] == what)
        .unwrap()
}
