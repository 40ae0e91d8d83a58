//! The page stands by itself, is closed properly, and shows names as they are.

use super::*;
use crate::judge::Judged;
use crate::methods::preset;
use crate::tally::Tally;

fn report() -> Report {
    let run = |name: &str, scale: f64| {
        let mut tally = Tally::default();
        for i in 0..400 {
            tally.own_visible.add(scale * f64::from(i) * 1e-4);
            tally.visible.add(scale * f64::from(i) * 1e-4);
            tally.by_joint[i as usize % 25].add(scale * f64::from(i) * 1e-4);
        }
        tally.jitter.add(scale);
        tally.look_ahead.add(0.033);
        tally.lag.add(0.004);
        let judged = Judged {
            tally,
            over_time: vec![(0.0, 0.01), (0.2, 0.02 * scale)],
        };
        Run::new(&preset(name).unwrap(), [&judged])
    };
    Report {
        title: "rooms <script>alert(1)</script>".into(),
        about: vec!["10 seeds & more".into()],
        with_truth: true,
        groups: vec![Group {
            name: "ring4 \"quoted\"".into(),
            note: String::new(),
            runs: vec![run("menard", 2.0), run("kalman", 1.0)],
        }],
        versus: Vec::new(),
        aims: crate::aims::check(&[Group {
            name: "ring4".into(),
            note: String::new(),
            runs: vec![run("menard", 2.0), run("kalman-1", 0.5)],
        }]),
    }
}

#[test]
fn nothing_comes_from_elsewhere_and_names_are_only_names() {
    let page = report().html();
    for foreign in [
        "http:", "https:", "//", "src=", "url(", "@import", "<link", "<script",
    ] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    assert!(page.contains("&lt;script&gt;") && page.contains("&quot;quoted&quot;"));
    assert!(page.contains("10 seeds &amp; more"));
    assert!(!page.contains("NaN") && !page.contains("inf"));
}

#[test]
fn every_element_is_closed() {
    let page = report().html();
    let mut open: Vec<String> = Vec::new();
    let mut rest = page.as_str();
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        let name: String = tag
            .trim_start_matches('/')
            .chars()
            .take_while(|c| c.is_ascii_alphanumeric())
            .collect();
        let void = matches!(name.as_str(), "meta" | "line" | "") || tag.starts_with('!');
        if void {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(
                open.pop().as_deref(),
                Some(name.as_str()),
                "before {rest:.80}"
            );
        } else {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn the_better_method_stands_out_and_aims_say_whether_they_are_met() {
    let page = report().html();
    assert!(
        page.contains("<td class=best>20"),
        "the mean error of the better one"
    );
    assert!(page.contains(" met</td>") && page.contains(" missed</td>"));
    let empty = Report::default().html();
    assert!(empty.contains("<main>"));
}
