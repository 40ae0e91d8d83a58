//! The figures as rows of text.

use posefuse_bodytrack::Step;

use super::{BodytrackReport, Kind, Reliability};

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

/// By facing, distance and number of people; the first row is the heading.
pub fn kinds(report: &BodytrackReport) -> Vec<Vec<String>> {
    let heading = [
        "",
        "people",
        "found %",
        "visible mm",
        "hidden mm",
        "visible <10cm %",
        "all <10cm %",
        "sides right %",
    ];
    let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share), 1);
    let row = |(name, kind): (&String, &Kind)| {
        vec![
            name.clone(),
            kind.people.to_string(),
            percent(kind.found_share()),
            number(kind.visible.mean_mm(), 1),
            number(kind.hidden.mean_mm(), 1),
            percent(kind.visible.right_share()),
            percent(kind.all().right_share()),
            percent(kind.sides_share()),
        ]
    };
    let rows = report.kinds.iter().map(row);
    std::iter::once(heading.map(str::to_owned).to_vec())
        .chain(rows)
        .collect()
}

/// Votes on hands, by the same kinds; the first row is the heading.
pub fn hands(report: &BodytrackReport) -> Vec<Vec<String>> {
    let heading = [
        "",
        "hands in sight",
        "voted %",
        "votes right %",
        "hidden hands",
        "voted %",
        "votes right %",
    ];
    let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share), 1);
    let row = |(name, kind): (&String, &Kind)| {
        let votes = [kind.hands.seen, kind.hands.hidden].map(|votes| {
            [
                votes.hands.to_string(),
                percent(votes.voted_share()),
                percent(votes.right_share()),
            ]
        });
        std::iter::once(name.clone())
            .chain(votes.into_iter().flatten())
            .collect()
    };
    let rows = report.kinds.iter().map(row);
    std::iter::once(heading.map(str::to_owned).to_vec())
        .chain(rows)
        .collect()
}

/// What probabilities said and what was true, step by step; `heading`: what they are called, what they are about, what was true.
pub fn reliability(reliability: &Reliability, heading: [&str; 3]) -> Vec<Vec<String>> {
    let heading = heading.map(str::to_owned).to_vec();
    let said = reliability.0.iter().filter(|said| said.joints > 0);
    let rows = said.map(|said| {
        let joints = said.joints as f64;
        vec![
            format!("{:.3}", said.confidence / joints),
            said.joints.to_string(),
            format!("{:.1}", 100.0 * said.right as f64 / joints),
        ]
    });
    std::iter::once(heading).chain(rows).collect()
}

/// Milliseconds per image, by people in the room: median of each step, and of all together with the 95th percentile.
pub fn speed(report: &BodytrackReport) -> Vec<Vec<String>> {
    let mut heading = vec!["people".to_owned(), "images".to_owned()];
    heading.extend(Step::ALL.map(|step| format!("{step:?} ms").to_lowercase()));
    heading.extend(["all ms".to_owned(), "p95 ms".to_owned()]);
    let mut rows = vec![heading];
    for (people, times) in &report.times {
        let at = |share: f64, of: &dyn Fn(&[f64; Step::ALL.len()]) -> f64| {
            let mut values: Vec<f64> = times.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            let index = (values.len().saturating_sub(1) as f64 * share) as usize;
            number(values.get(index).copied(), 2)
        };
        let mut row = vec![people.to_string(), times.len().to_string()];
        row.extend((0..Step::ALL.len()).map(|step| at(0.5, &|times| times[step])));
        let all = |times: &[f64; Step::ALL.len()]| times.iter().sum();
        row.extend([at(0.5, &all), at(0.95, &all)]);
        rows.push(row);
    }
    rows
}
