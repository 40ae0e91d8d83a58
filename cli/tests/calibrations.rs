//! Calibrations as a user handles them: kept, compared, restored, written for other programs and read from them.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use common::{Done, Server, User};

const ROOM: &str = "version = 1\ncreated = \"2026-01-01T00:00:00Z\"\nmethod = \"svd\"\nfloor = \"walk\"\nverdict = \"passed\"\n\
    [sensors.left]\nposition_m = [0.0, 0.5, 1.0]\norientation_xyzw = [-0.5, 0.5, -0.5, 0.5]\n\
    [sensors.right]\nposition_m = [0.0, -2.0, 1.0]\norientation_xyzw = [-0.5, 0.5, -0.5, 0.5]\ntime_offset_ms = -4.0\n";

/// `posefuse calibrations` with these words, at that server.
fn calibrations(user: &User, server: &Server, words: &[&str]) -> Done {
    let command = [&["calibrations"], words, &["--server", &server.url]].concat();
    user.run(&command)
}

fn names(user: &User, server: &Server) -> Vec<String> {
    let list = calibrations(user, server, &["list", "--json"]).json();
    let list = list.as_array().unwrap().iter();
    list.map(|kept| kept["name"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn imported_moved_listed_compared_restored_and_exported() {
    let user = User::new();
    let server = user.server();
    let empty = calibrations(&user, &server, &[]);
    assert!(empty.out.contains("posefuse calibrate"), "{empty:?}");
    let file = user.file("room.toml", ROOM);
    let dry = calibrations(&user, &server, &["import", &file, "--dry-run"]);
    assert_eq!(dry.code, 0, "{dry:?}");
    assert!(names(&user, &server).is_empty());
    let imported = calibrations(&user, &server, &["import", &file]);
    assert!(
        imported.code == 0 && imported.out.contains("in force now"),
        "{imported:?}"
    );

    let turned = ["move", "--turn", "90", "--shift", "-1,0.5", "--json"];
    let turned = calibrations(&user, &server, &turned).json();
    let at = |axis: usize| turned[0]["position_m"][axis].as_f64().unwrap();
    assert!(
        (at(0) + 1.5).abs() < 1e-9 && (at(1) - 0.5).abs() < 1e-9,
        "{turned}"
    );

    let kept = names(&user, &server);
    assert_eq!(kept.len(), 2, "{kept:?}");
    let moves = calibrations(&user, &server, &["compare", &kept[1], "--json"]).json();
    assert_eq!(moves.as_array().unwrap().len(), 2);
    assert!(
        moves[0]["moved_mm"].as_f64().unwrap() < 1e-3,
        "only the room's frame moved: {moves}"
    );

    let restored = calibrations(&user, &server, &["restore", &kept[1]]);
    assert!(restored.out.contains("is in force"), "{restored:?}");
    let shown = calibrations(&user, &server, &["show", "--json"]).json();
    assert_eq!(shown[0]["position_m"][1], 0.5);
    let list = calibrations(&user, &server, &[]);
    let of_old = list
        .out
        .lines()
        .find(|line| line.starts_with(&format!("{} ", kept[1])))
        .unwrap();
    assert!(
        of_old.contains("in force") && of_old.contains("passed"),
        "{list:?}"
    );

    for (form, holds) in [
        ("toml", "[sensors.\"left\"]"),
        ("json", "\"position_m\""),
        ("tf2", "child_frame_id: \"left_optical\""),
        ("opencv", "!!opencv-matrix"),
    ] {
        let out = user.home().join(form).display().to_string();
        let export = ["export", "--format", form, "--output", &out];
        let export = calibrations(&user, &server, &export);
        assert!(export.code == 0 && export.out.is_empty(), "{export:?}");
        let text = std::fs::read_to_string(&out).unwrap();
        assert!(text.contains(holds), "{text}");
        let back = calibrations(&user, &server, &["import", &out, "--json"]).json();
        let z = back[1]["position_m"][2].as_f64().unwrap();
        assert!(
            (z - 1.0).abs() < 1e-9 && back[1]["sensor"] == "right",
            "{back}"
        );
    }
    assert!(calibrations(&user, &server, &["export", "--json"]).json()["sensors"].is_object());
}

#[test]
fn files_nobody_can_use_are_refused_in_words_and_change_nothing() {
    let user = User::new();
    let server = user.server();
    let good = user.file("room.toml", ROOM);
    assert_eq!(calibrations(&user, &server, &["import", &good]).code, 0);
    let opencv = calibrations(&user, &server, &["export", "--format", "opencv"]).out;
    let before = names(&user, &server);
    let old = ROOM.replace("version = 1", "version = 0");
    let nan = ROOM.replace("[0.0, 0.5, 1.0]", "[nan, 0.5, 1.0]");
    let millimetres = ROOM.replace("[0.0, 0.5, 1.0]", "[0, 500, 1000]");
    let row = opencv.find("data: [ ").unwrap() + "data: [ ".len();
    let end = row + opencv[row..].find('\n').unwrap();
    let flipped = opencv[row..end].split(", ").map(|n| {
        n.trim_end_matches(',')
            .parse::<f64>()
            .map_or(0.0, |n| -n)
            .to_string()
    });
    let flipped = flipped.take(3).collect::<Vec<_>>().join(", ");
    let mirrored = format!("{}{flipped},{}", &opencv[..row], &opencv[end..]);
    for (text, says) in [
        (old.as_str(), "version 0"),
        (&nan, "position_m"),
        (&millimetres, "millimetres"),
        (&mirrored, "a reflection"),
        ("dear diary", "none of the calibration files"),
    ] {
        let file = user.file("bad", text);
        let refused = calibrations(&user, &server, &["import", &file]);
        assert_eq!(refused.code, 1, "{text}\n{refused:?}");
        assert!(refused.err.contains(says), "{refused:?}");
        assert_eq!(names(&user, &server), before);
    }
    for (words, code, says) in [
        (&["import", "nowhere.toml"][..], 1, "nowhere.toml"),
        (&["restore", "yesterday"], 1, "posefuse calibrations"),
        (&["compare", "yesterday"], 1, "yesterday"),
        (&["show", "yesterday"], 1, "yesterday"),
        (&["move"], 2, "--turn"),
        (&["move", "--shift", "1500,0"], 2, "metres"),
        (&["export", "--format", "xml"], 2, "opencv"),
    ] {
        let refused = calibrations(&user, &server, words);
        assert!(
            refused.code == code && refused.err.contains(says),
            "{refused:?}"
        );
    }
}

#[test]
fn a_take_without_a_walk_is_no_calibration() {
    let user = User::new();
    let server = user.server();
    let record = [
        "record",
        "empty",
        "--seconds",
        "0.5",
        "--server",
        &server.url,
    ];
    assert_eq!(user.run(&record).code, 0);
    let refused = user.run(&["calibrate", "--from", "empty", "--out", "room.toml"]);
    assert_eq!(refused.code, 1, "{refused:?}");
    for part in ["the walk in take `empty`", "start an agent"] {
        assert!(refused.err.contains(part), "{refused:?}");
    }
    assert!(!user.home().join("room.toml").exists());
}

#[test]
fn a_calibration_file_of_an_old_version_is_a_trouble_of_the_server_that_names_the_remedy() {
    let user = User::new();
    let file = user.file("old.toml", ROOM.replace("version = 1", "version = 0"));
    let process = user.start(&[
        "server",
        "--listen",
        "127.0.0.1:0",
        "--calibration",
        &file,
        "--json",
    ]);
    let greeting: serde_json::Value = serde_json::from_str(&process.wait_for("url")).unwrap();
    let url = greeting["url"].as_str().unwrap().to_owned();
    let doctor = user.run(&["doctor", "--json", "--server", &url]);
    for part in ["old.toml", "version 0", "calibrate again"] {
        assert!(doctor.out.contains(part), "no `{part}` in {doctor:?}");
    }
    let kept = std::fs::read_to_string(&file).unwrap();
    assert!(kept.contains("version = 0"), "the file is left as it is");
}
