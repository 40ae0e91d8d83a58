//! The page about bodies.

use super::page::{END, aims, beginning, glossary, plain_table, push};
use super::svg::escaped;
use crate::kinematics::{BodiesReport, FIGURES, MENARD, menard_rows, rows};

pub(crate) fn html(report: &BodiesReport) -> String {
    let mut page = beginning(&report.title, &report.about);
    if let Some(room) = report.rooms.first() {
        page.push_str("<section><h2>What is compared</h2><ul class=methods>");
        for row in &room.rows {
            let (name, about) = (escaped(&row.name), escaped(&row.about));
            push(
                &mut page,
                format_args!("<li><b>{name}</b> <span class=soft>{about}</span></li>"),
            );
        }
        page.push_str("</ul></section>\n");
    }
    let about =
        "Of what ships; where a share is asked for, of the same figure of the people as fused.";
    aims(&report.aims, about, &mut page);
    for room in &report.rooms {
        push(
            &mut page,
            format_args!("<section><h2>{}</h2>", escaped(&room.name)),
        );
        plain_table(&rows(room), &mut page);
        page.push_str("<h3>Menard's figures</h3>");
        plain_table(&menard_rows(room), &mut page);
        page.push_str("</section>\n");
    }
    let terms = FIGURES.iter().chain(&MENARD);
    glossary(terms.map(|figure| (figure.name, figure.about)), &mut page);
    page.push_str(END);
    page
}
