//! The page about repair.

use super::page::{END, aims, beginning, glossary, plain_table, push};
use super::svg::{Axis, COLOURS, Plot, escaped};
use crate::repair::{FIGURES, Figure, GAPS_S, ModelRun, RepairReport, Tests, rows};

const SIZE: [f64; 2] = [520.0, 300.0];

pub(crate) fn html(report: &RepairReport) -> String {
    let mut page = beginning(&report.title, &report.about);
    legend(report, &mut page);
    let about = "Error of the network that runs unless told otherwise (or, where a simple method does, of the best network), as a multiple of the best simple method's on the same gaps.";
    aims(&report.aims, about, &mut page);
    for tests in Tests::ALL {
        section(report, tests, &mut page);
    }
    let terms = FIGURES.iter().map(|figure| (figure.name, figure.about));
    glossary(terms, &mut page);
    page.push_str(END);
    page
}

fn legend(report: &RepairReport, page: &mut String) {
    page.push_str("<section><h2>What is compared</h2><ul class=methods>");
    for (series, model) in report.models.iter().enumerate() {
        let cost = model.us_per_pose.map_or_else(String::new, |us| {
            format!(", {:.2} ms a pose on one core", us * 1e-3)
        });
        push(
            page,
            format_args!(
                "<li><span class='swatch s{}'></span><b>{}</b> <span class=soft>{}{cost}{}</span></li>",
                series % COLOURS,
                escaped(&model.name),
                escaped(&model.about),
                if model.default {
                    "; * what runs unless told otherwise"
                } else {
                    ""
                }
            ),
        );
    }
    page.push_str("</ul></section>\n");
}

fn section(report: &RepairReport, tests: Tests, page: &mut String) {
    push(
        page,
        format_args!("<section><h2>{}</h2>", escaped(tests.name())),
    );
    page.push_str("<div class=plots>");
    for (live, title) in [(true, "Live"), (false, "Offline")] {
        if report.models.iter().any(|model| model.live == live) {
            push(
                page,
                format_args!("<div><h3>{title}</h3>{}</div>", plot(report, tests, live)),
            );
        }
    }
    page.push_str("</div>");
    for figure in &FIGURES {
        table(report, tests, figure, page);
    }
    page.push_str("</section>\n");
}

/// The error against the length of the gap, mean over the parts of the body.
fn plot(report: &RepairReport, tests: Tests, live: bool) -> String {
    let points = |model: &ModelRun| -> Vec<(f64, f64)> {
        let at = |gap_s: f64| {
            let own = |f: &&crate::repair::Figures| (f.tests, f.gap_s) == (tests, gap_s);
            let errors = model.figures.iter().filter(own);
            let errors: Vec<f64> = errors.filter_map(|f| f.mean_mm).collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            (!errors.is_empty()).then_some((gap_s, mean))
        };
        GAPS_S.into_iter().filter_map(at).collect()
    };
    let shown = || {
        let all = report.models.iter().enumerate();
        all.filter(|(_, model)| model.live == live)
    };
    let most = shown()
        .flat_map(|(_, model)| points(model))
        .map(|(_, mm)| mm);
    let x = Axis::from_zero("length of the gap, s", GAPS_S.into_iter());
    let y = Axis::from_zero("mean error, mm", most);
    let mut plot = Plot::new("error against length of the gap", SIZE, x, y);
    for (series, model) in shown() {
        plot.line(series, &model.name, &points(model));
    }
    plot.finish()
}

fn table(report: &RepairReport, tests: Tests, figure: &Figure, page: &mut String) {
    push(page, format_args!("<h3>{}</h3>", escaped(figure.name)));
    let mut rows = rows(report, tests, figure);
    // It stands above the table.
    rows[0][0].clear();
    plain_table(&rows, page);
}
