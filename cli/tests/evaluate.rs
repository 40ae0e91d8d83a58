//! `posefuse evaluate`: tables, JSON, the page, and what is said of input that cannot be evaluated.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod common;

use common::User;
use serde_json::Value;

fn figure(group: &Value, method: &str, path: &[&str]) -> f64 {
    let runs = group["runs"].as_array().unwrap();
    let run = runs.iter().find(|run| run["method"] == method).unwrap();
    let value = path.iter().fold(&run["all"], |value, key| &value[*key]);
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{method} has no {path:?}: {run}"))
}

/// Loose bounds around what the methods gave when this was written: a figure outside of them is no chance.
#[test]
fn simulated_rooms_give_a_table_json_and_a_page() {
    let user = User::new();
    let page = user.home().join("report.html").display().to_string();
    let arguments = [
        "evaluate",
        "simulated",
        "--rooms",
        "ring4",
        "--seeds",
        "2",
        "--seconds",
        "8",
        "--errors",
        "default",
        "--methods",
        "mean,menard,weighted,kalman",
        "--report",
        &page,
    ];
    let told = user.json(&arguments);
    let room = &told["groups"][0];
    assert_eq!(room["name"], "ring4");
    let error = |method: &str| figure(room, method, &["own_error", "mean_mm"]);
    assert!((40.0..300.0).contains(&error("mean")), "{}", error("mean"));
    assert!(
        (15.0..45.0).contains(&error("menard")),
        "{}",
        error("menard")
    );
    assert!(error("weighted") < error("menard") && error("kalman") < error("menard"));
    let bound = figure(room, "kalman", &["noise_bound_mm"]);
    assert!((7.0..25.0).contains(&bound), "{bound}");
    let jitter = |method: &str| figure(room, method, &["jitter_mps2"]);
    assert!(jitter("kalman") < 0.5 * jitter("menard"));
    assert!(figure(room, "menard", &["sides_right"]) > 0.95);
    assert!(figure(room, "mean", &["sides_right"]) < figure(room, "menard", &["sides_right"]));
    assert!(figure(room, "kalman", &["lag_ms"]).abs() < 30.0);

    let html = std::fs::read_to_string(page).unwrap();
    assert!(html.starts_with("<!doctype html>") && html.trim_end().ends_with("</html>"));
    for foreign in ["http:", "https:", "src=", "url(", "<script", "<link"] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    assert!(html.contains("<svg") && html.contains("menard"));

    let settings = user.file("mine.toml", "[fusion.fuse]\nmethod = \"average\"\n");
    let table = user.run(&[
        "evaluate",
        "simulated",
        "--rooms",
        "arc2",
        "--seeds",
        "1",
        "--seconds",
        "4",
        "--methods",
        "menard",
        "--config",
        &settings,
    ]);
    assert_eq!(table.code, 0, "{table:?}");
    for expected in [
        "arc2",
        "noise bound B",
        "method",
        "jitter",
        "menard",
        "mine",
    ] {
        assert!(table.out.contains(expected), "{expected}: {table:?}");
    }
}

#[test]
fn a_take_is_judged_by_its_truth_and_without_one_sensor_against_sensor() {
    let user = User::new();
    user.json(&[
        "simulate",
        "--seconds",
        "6",
        "--true-calibration",
        "--out",
        "one",
    ]);
    let told = user.json(&["evaluate", "takes", "one", "--methods", "menard,kalman"]);
    assert_eq!(told["with_truth"], true);
    let error = figure(&told["groups"][0], "kalman", &["error", "mean_mm"]);
    assert!((5.0..60.0).contains(&error), "{error}");

    // Fused again it is another take with the same truth: the two are comparable, and told of together, too.
    user.json(&["refuse", "one", "--out", "two"]);
    let both = user.run(&[
        "evaluate",
        "takes",
        "one",
        "two",
        "--methods",
        "menard,kalman",
    ]);
    assert_eq!(both.code, 0, "{both:?}");
    assert!(both.out.contains("all 2 together"), "{both:?}");
    assert!(
        both.out.contains("kalman is better than menard on"),
        "{both:?}"
    );
}

#[test]
fn what_cannot_be_evaluated_is_refused_with_a_reason() {
    let user = User::new();
    let refused = |arguments: &[&str], code: i32, words: &[&str]| {
        let done = user.run(arguments);
        assert_eq!(done.code, code, "{done:?}");
        assert!(done.out.is_empty(), "{done:?}");
        for word in words {
            assert!(done.err.contains(word), "{word}: {done:?}");
        }
    };
    let empty = user.home().join("nothing");
    std::fs::create_dir(&empty).unwrap();
    let empty = empty.display().to_string();
    refused(
        &["evaluate", "repair", "--motion", &empty],
        1,
        &["none is for testing", "--split"],
    );
    refused(
        &["evaluate", "simulated", "--repair", "gausian"],
        2,
        &["--repair", "gausian"],
    );
    let simulated = |more: &[&'static str]| [&["evaluate", "simulated"], more].concat();
    refused(
        &simulated(&["--methods", "kalmann"]),
        2,
        &[
            "no method `kalmann`",
            "did you mean `kalman`",
            "--config FILE",
        ],
    );
    refused(
        &simulated(&["--rooms", "square4"]),
        2,
        &["no room `square4`", "ring4"],
    );
    refused(
        &simulated(&["--seconds", "2", "--skip", "2"]),
        2,
        &["--skip leaves nothing"],
    );
    refused(&["evaluate", "takes", "nowhere"], 1, &["no take `nowhere`"]);
    refused(&["evaluate", "csv", "nowhere.csv"], 1, &["nowhere.csv"]);
    let broken = user.file("broken.csv", "not, a, recording\n1,2,3\n");
    refused(&["evaluate", "csv", &broken], 1, &["line 1"]);

    user.json(&[
        "simulate",
        "--seconds",
        "1",
        "--true-calibration",
        "--out",
        "short",
    ]);
    refused(
        &["evaluate", "takes", "short"],
        1,
        &["`short` lasts", "--skip leaves nothing"],
    );
    let empty = user.file("empty.toml", "people = 0\n");
    user.json(&[
        "simulate",
        "--seconds",
        "4",
        "--true-calibration",
        "--scenario",
        &empty,
        "--out",
        "empty",
    ]);
    refused(&["evaluate", "takes", "empty"], 1, &["fuses nobody"]);
}

#[test]
fn methods_are_listed() {
    let user = User::new();
    let listed = user.json(&["evaluate", "methods"]);
    assert!(listed["menard"].as_str().unwrap().contains("reference A"));
    assert!(user.run(&["evaluate", "methods"]).out.contains("kalman"));
}

#[test]
fn bodies_are_compared_function_by_function_with_aims_and_a_page() {
    let user = User::new();
    let mine = user.home().join("mine.toml");
    std::fs::write(&mine, "[loose.feet]\nfirmness_mm = 50.0\n").unwrap();
    let (mine, page) = (
        mine.display().to_string(),
        user.home().join("bodies.html").display().to_string(),
    );
    let rooms = ["--rooms", "ring4", "--seeds", "1", "--seconds", "5"];
    let asked = ["evaluate", "bodies", "--methods", "kalman", "--bodies"];
    let rest = [mine.as_str(), "--report", page.as_str()];
    let done = user.run(&[&asked[..], &rest[..], &rooms[..]].concat());
    assert_eq!(done.code, 0, "{done:?}");
    for word in [
        "ring4, kalman",
        "as fused",
        "ships",
        "no-feet",
        "loose",
        "change, %",
        "aims met",
    ] {
        assert!(done.out.contains(word), "{word}: {done:?}");
    }
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.contains("Menard") && page.contains("look-auto"));

    let wrong = user.home().join("wrong.toml");
    std::fs::write(&wrong, "[loose.feet]\nfirmnes_mm = 50.0\n").unwrap();
    let done = user.run(&[
        "evaluate",
        "bodies",
        "--bodies",
        &wrong.display().to_string(),
    ]);
    assert_eq!(done.code, 2, "{done:?}");
    assert!(done.err.contains("firmness_mm"), "{done:?}");
}
