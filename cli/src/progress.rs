//! Progress on stderr: bars where it is a terminal, nothing where it is not.

use std::sync::LazyLock;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// All bars of this process, so that lines of text can be written above them.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// Runs `write` with the bars off the screen.
pub(crate) fn suspended<T>(write: impl FnOnce() -> T) -> T {
    BARS.suspend(write)
}

/// Whether bars are shown at all.
pub(crate) fn visible() -> bool {
    !BARS.is_hidden()
}

/// A bar that goes to `length`, with what is being done before it.
pub(crate) fn bar(length: u64, what: &str) -> ProgressBar {
    let bar = BARS.add(ProgressBar::new(length));
    bar.set_style(style("{prefix:>12} [{bar:30}] {percent:>3}% {msg}"));
    bar.set_prefix(what.to_owned());
    bar
}

/// A line of text that changes, with a mark that it is alive.
pub(crate) fn spinner(what: &str) -> ProgressBar {
    let bar = BARS.add(ProgressBar::new_spinner());
    bar.set_style(style("{prefix:>12} {spinner} {wide_msg}"));
    bar.set_prefix(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// A line of text below a bar.
pub(crate) fn detail(what: &str) -> ProgressBar {
    let bar = BARS.add(ProgressBar::new_spinner());
    bar.set_style(style("{prefix:>12} {wide_msg}"));
    bar.set_prefix(what.to_owned());
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ")
}
