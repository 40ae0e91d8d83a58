//! The report as one HTML page that stands by itself.

use std::fmt::Write;

use super::svg::{COLOURS, escaped, number};
use super::{Group, Report, Run, plots};
use crate::aims::{Aim, Matrix, in_matrix, matrix};
use crate::methods::REFERENCE;
use crate::metrics::Metrics;
use crate::table::{Column, REPAIR, cell, rows};
use crate::versus::Versus;

const STYLE: &str = include_str!("report.css");
/// With more groups than this, plots are drawn of the first only.
const MOST_PLOTTED: usize = 6;

pub(super) fn html(report: &Report) -> String {
    let mut page = beginning(&report.title, &report.about);
    legend(report, &mut page);
    aims(&report.aims, A_AND_B, &mut page);
    if !report.versus.is_empty() {
        side_by_side(&report.versus, &mut page);
    }
    let plotted = if report.groups.len() > MOST_PLOTTED {
        1
    } else {
        report.groups.len()
    };
    for (index, group) in report.groups.iter().enumerate() {
        section(report, group, index < plotted, &mut page);
    }
    let columns = report.columns().iter();
    glossary(columns.map(|column| (column.name, column.about)), &mut page);
    page.push_str(END);
    page
}

/// What ends a page.
pub(super) const END: &str = "</main></body></html>\n";
/// What the aims of fusing are measured by.
const A_AND_B: &str =
    "A is the mean of the sensors with left and right put right, B the noise bound of the room.";

/// A page up to its first section.
pub(super) fn beginning(title: &str, about: &[String]) -> String {
    let mut page = String::new();
    let title = escaped(title);
    push(
        &mut page,
        format_args!(
            "<!doctype html>\n<html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>\
             <title>{title}</title><style>{STYLE}</style></head><body><main>\n<h1>{title}</h1>\n"
        ),
    );
    for sentence in about {
        push(
            &mut page,
            format_args!("<p class=soft>{}</p>\n", escaped(sentence)),
        );
    }
    page
}

pub(super) fn push(page: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = page.write_fmt(what);
}

fn legend(report: &Report, page: &mut String) {
    let Some(group) = report.groups.first() else {
        return;
    };
    page.push_str("<section><h2>What is compared</h2><ul class=methods>");
    for (series, run) in group.runs.iter().enumerate() {
        push(
            page,
            format_args!(
                "<li><span class='swatch s{}'></span><b>{}</b> <span class=soft>{}</span></li>",
                series % COLOURS,
                escaped(&run.method),
                escaped(&run.about)
            ),
        );
    }
    page.push_str("</ul></section>\n");
}

/// The aims as rows, the rooms as columns, after a sentence `about` them.
pub(super) fn aims(aims: &[Aim], about: &str, page: &mut String) {
    if aims.is_empty() {
        return;
    }
    let met = aims.iter().filter(|aim| aim.met).count();
    let Matrix { rooms, rows } = matrix(aims);
    push(
        page,
        format_args!(
            "<section><h2>Aims</h2><p class=soft>{met} of {} are met. {}</p><div class=wide><table><thead><tr>\
             <th>figure</th><th>aim</th>",
            aims.len(),
            escaped(about)
        ),
    );
    for room in &rooms {
        push(page, format_args!("<th>{}</th>", escaped(room)));
    }
    page.push_str("</tr></thead><tbody>");
    for (figure, limit) in rows {
        push(
            page,
            format_args!(
                "<tr><td>{}</td><td>{}</td>",
                escaped(figure),
                escaped(limit)
            ),
        );
        for room in &rooms {
            let shown = in_matrix(aims, room, (figure, limit));
            page.push_str(&shown.map_or_else(|| "<td>-</td>".to_owned(), aim_cell));
        }
        page.push_str("</tr>");
    }
    page.push_str("</tbody></table></div></section>\n");
}

fn aim_cell(aim: &Aim) -> String {
    let (class, verdict) = if aim.met {
        ("yes", "met")
    } else {
        ("no", "missed")
    };
    let measured = aim.measured.map_or_else(|| "-".to_owned(), number);
    let value = aim
        .value
        .map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
    format!(
        "<td class={class} title='{verdict}: {measured} {}'>{value} {verdict}</td>",
        escaped(aim.unit)
    )
}

fn side_by_side(all: &[Versus], page: &mut String) {
    page.push_str("<section><h2>Take by take</h2><p class=soft>A method is better on a take if no figure is worse by more than 1 %.</p>");
    for versus in all {
        push(page, format_args!("<p>{}</p>", escaped(&versus.told())));
        if !versus.others.is_empty() {
            let other = |(take, worse): &(String, Vec<&str>)| {
                format!(
                    "{take} ({})",
                    if worse.is_empty() {
                        "equal".to_owned()
                    } else {
                        worse.join(", ")
                    }
                )
            };
            let others: Vec<String> = versus.others.iter().map(other).collect();
            push(
                page,
                format_args!(
                    "<p class=soft>The others: {}.</p>",
                    escaped(&others.join("; "))
                ),
            );
        }
    }
    page.push_str("</section>\n");
}

fn section(report: &Report, group: &Group, plotted: bool, page: &mut String) {
    push(
        page,
        format_args!(
            "<section><h2>{}</h2><p class=soft>{}</p>",
            escaped(&group.name),
            escaped(&group.note)
        ),
    );
    table(report, group, page);
    repair_table(group, page);
    if plotted {
        let what = match report.with_truth {
            true => "error",
            false => "distance from a left-out sensor",
        };
        push(
            page,
            format_args!(
                "<div class=plots><div><h3>How many joints are how far off</h3>{}</div>\
                 <div><h3>Steadiness and what it costs in delay</h3>{}</div></div>",
                plots::distribution(group, what),
                plots::jitter_and_delay(group)
            ),
        );
        if let Some(plot) = plots::over_time(group) {
            push(
                page,
                format_args!("<h3>Error over time, first run</h3>{plot}"),
            );
        }
        if let Some(plot) = plots::by_joint(group) {
            push(
                page,
                format_args!("<h3>Error of every joint, and the best method's</h3>{plot}"),
            );
        }
    }
    page.push_str("</section>\n");
}

fn table(report: &Report, group: &Group, page: &mut String) {
    let columns = report.columns();
    page.push_str("<div class=wide><table><thead><tr><th>method</th>");
    for column in columns {
        push(
            page,
            format_args!(
                "<th title='{}'>{}<small>{}</small></th>",
                escaped(column.about),
                escaped(column.name),
                if column.unit.is_empty() {
                    "&nbsp;"
                } else {
                    column.unit
                }
            ),
        );
    }
    let ratios = report.with_truth && group.of(REFERENCE).is_some();
    if ratios {
        page.push_str(
            "<th title='error as a multiple of reference A'>/ A<small>&nbsp;</small></th>",
        );
        page.push_str(
            "<th title='error as a multiple of the noise bound B'>/ B<small>&nbsp;</small></th>",
        );
    }
    page.push_str("</tr></thead><tbody>");
    for (series, run) in group.runs.iter().enumerate() {
        push(
            page,
            format_args!(
                "<tr><td><span class='swatch s{}'></span>{}</td>",
                series % COLOURS,
                escaped(&run.method)
            ),
        );
        for column in columns {
            let best = is_best(column, run, group);
            let class = if best { " class=best" } else { "" };
            push(
                page,
                format_args!("<td{class}>{}</td>", cell(column, &run.all)),
            );
        }
        if ratios {
            let error = |metrics: &Metrics| metrics.own_error.mean_mm;
            let a = group.of(REFERENCE).and_then(|run| error(&run.all));
            for reference in [a, run.all.noise_bound_mm] {
                let ratio = error(&run.all).zip(reference).map(|(e, r)| e / r);
                let shown = ratio.map_or_else(|| "-".to_owned(), |r| format!("{r:.2}"));
                push(page, format_args!("<td>{shown}</td>"));
            }
        }
        page.push_str("</tr>");
    }
    page.push_str("</tbody></table></div>");
}

/// What repair does, where any run has it.
fn repair_table(group: &Group, page: &mut String) {
    let repaired = group.runs.iter().filter(|run| run.all.repair.is_some());
    let mut repaired = repaired
        .map(|run| (run.method.as_str(), &run.all))
        .peekable();
    if repaired.peek().is_none() {
        return;
    }
    page.push_str("<h3>What repair does</h3>");
    plain_table(&rows(&REPAIR, "", repaired), page);
}

/// A table of texts, whose first two rows are headings.
pub(super) fn plain_table(rows: &[Vec<String>], page: &mut String) {
    page.push_str("<div class=wide><table>");
    for (index, row) in rows.iter().enumerate() {
        let (open, close, tag) = match index {
            0 => ("<thead>", "", "th"),
            1 => ("", "</thead><tbody>", "th"),
            _ => ("", "", "td"),
        };
        push(page, format_args!("{open}<tr>"));
        for cell in row {
            push(page, format_args!("<{tag}>{}</{tag}>", escaped(cell)));
        }
        push(page, format_args!("</tr>{close}"));
    }
    page.push_str("</tbody></table></div>");
}

/// Whether no other method's figure, as it is shown, is better, and not all are the same.
fn is_best(column: &Column, run: &Run, group: &Group) -> bool {
    let shown = |run: &Run| cell(column, &run.all).parse::<f64>().ok();
    let Some(own) = shown(run) else {
        return false;
    };
    let own_key = if column.smaller_is_better { own } else { -own };
    let others: Vec<f64> = group
        .runs
        .iter()
        .filter_map(shown)
        .map(|value| {
            if column.smaller_is_better {
                value
            } else {
                -value
            }
        })
        .collect();
    others.iter().all(|other| own_key <= *other) && others.iter().any(|other| own_key < *other)
}

/// What each of `terms` means.
pub(super) fn glossary<'a>(terms: impl Iterator<Item = (&'a str, &'a str)>, page: &mut String) {
    page.push_str("<section><h2>What the figures mean</h2><dl>");
    for (name, about) in terms {
        push(
            page,
            format_args!("<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(about)),
        );
    }
    page.push_str("</dl></section>\n");
}

#[cfg(test)]
mod tests;
