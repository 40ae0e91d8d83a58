//! What people and scripts read: results on stdout, remarks on stderr, both through here.
//!
//! A closed stdout comes back as an `io::Error` of kind `BrokenPipe`, which ends the command silently.

use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;

use serde::Serialize;

use crate::global::{Global, When};
use crate::progress;

static COLOUR: OnceLock<When> = OnceLock::new();

/// Notes the global options. Called once, before anything is printed.
pub(crate) fn init(global: &Global) {
    // A second call would come from a test only; the first one counts.
    let _ = COLOUR.set(global.color);
}

/// Whether to colour an output that is or is not a terminal.
pub(crate) fn coloured(terminal: &bool) -> bool {
    match COLOUR.get().copied().unwrap_or_default() {
        When::Always => true,
        When::Never => false,
        When::Auto => *terminal && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty()),
    }
}

/// How a piece of text stands out.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Style {
    Bold,
    Good,
    Bad,
    Doubtful,
    Faint,
}

/// `text` in `style`, if stdout is coloured.
pub(crate) fn paint(style: Style, text: &str) -> String {
    paint_if(coloured(&io::stdout().is_terminal()), style, text)
}

/// `text` in `style`, if stderr is coloured.
pub(crate) fn paint_err(style: Style, text: &str) -> String {
    paint_if(coloured(&io::stderr().is_terminal()), style, text)
}

fn paint_if(colour: bool, style: Style, text: &str) -> String {
    if !colour {
        return text.to_owned();
    }
    let code = match style {
        Style::Bold => "1",
        Style::Good => "32",
        Style::Bad => "31",
        Style::Doubtful => "33",
        Style::Faint => "2",
    };
    format!("\x1b[{code}m{text}\x1b[0m")
}

/// Prints one line of results.
pub(crate) fn line(text: impl AsRef<str>) -> io::Result<()> {
    progress::suspended(|| {
        let mut out = io::stdout().lock();
        writeln!(out, "{}", text.as_ref())?;
        out.flush()
    })
}

/// Prints `value` as one line of JSON.
pub(crate) fn json(value: &impl Serialize) -> anyhow::Result<()> {
    Ok(line(serde_json::to_string(value)?)?)
}

/// Prints `value` as JSON over several lines: a whole answer, not one of a stream.
pub(crate) fn json_pretty(value: &impl Serialize) -> anyhow::Result<()> {
    Ok(line(serde_json::to_string_pretty(value)?)?)
}

/// A remark for a person at the terminal, on stderr. Never fails: nobody depends on it.
pub(crate) fn note(text: impl AsRef<str>) {
    progress::suspended(|| {
        let _ = writeln!(io::stderr(), "{}", text.as_ref());
    });
}

/// A remark that something is not as it should be.
pub(crate) fn warn(text: &str) {
    let colour = coloured(&io::stderr().is_terminal());
    note(format!(
        "{} {text}",
        paint_if(colour, Style::Doubtful, "warning:")
    ));
}

/// What made the command fail.
pub(crate) fn error(text: &str) {
    let colour = coloured(&io::stderr().is_terminal());
    note(format!("{} {text}", paint_if(colour, Style::Bad, "error:")));
}

/// Lays rows out in columns, the first row being the headings. Colours do not count as width.
pub(crate) fn table(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns)
        .map(|c| {
            rows.iter()
                .filter_map(|row| row.get(c))
                .map(|cell| width(cell))
                .max()
                .unwrap_or(0)
        })
        .collect();
    rows.iter()
        .map(|row| {
            let cells = row.iter().zip(&widths).map(|(cell, wide)| {
                format!("{cell}{}", " ".repeat(wide.saturating_sub(width(cell))))
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        })
        .collect()
}

/// Prints [`table`].
pub(crate) fn print_table(rows: &[Vec<String>]) -> io::Result<()> {
    table(rows).iter().try_for_each(line)
}

/// Characters on the screen: escape sequences take none.
fn width(text: &str) -> usize {
    let mut escaped = false;
    text.chars()
        .filter(|c| {
            let hidden = escaped || *c == '\x1b';
            escaped = hidden && *c != 'm';
            !hidden
        })
        .count()
}

/// `1.2 MB` and the like, powers of 1000.
pub(crate) fn bytes(count: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    if unit == 0 || value >= 99.5 {
        format!("{value:.0} {}", units[unit])
    } else {
        format!("{value:.1} {}", units[unit])
    }
}

/// `1:02:03`, or `2:03` below an hour.
pub(crate) fn duration(seconds: f64) -> String {
    let s = seconds.max(0.0).round() as u64;
    let (hours, minutes, seconds) = (s / 3600, s / 60 % 60, s % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

/// `1 sensor`, `2 sensors`.
pub(crate) fn sensors(count: usize) -> String {
    match count {
        1 => "1 sensor".to_owned(),
        n => format!("{n} sensors"),
    }
}

/// `1 person`, `2 people`.
pub(crate) fn people(count: u32) -> String {
    match count {
        0 => "nobody".to_owned(),
        1 => "1 person".to_owned(),
        n => format!("{n} people"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_whatever_the_colour() {
        let rows = [
            vec!["name".to_owned(), "state".to_owned(), "x".to_owned()],
            vec![
                "a".to_owned(),
                paint_if(true, Style::Good, "ok"),
                "y".to_owned(),
            ],
        ];
        let lines = table(&rows);
        assert_eq!(lines[0], "name  state  x");
        assert_eq!(lines[1], "a     \x1b[32mok\x1b[0m     y");
    }

    #[test]
    fn sizes_and_times_read_well() {
        assert_eq!(bytes(999), "999 B");
        assert_eq!(bytes(1_234_567), "1.2 MB");
        assert_eq!(bytes(999_900), "1.0 MB");
        assert_eq!(duration(3723.4), "1:02:03");
        assert_eq!(duration(9.6), "0:10");
    }
}
