//! Opening a browser, where there is a screen for one.

use std::process::{Command, Stdio};

/// Opens `url` in the user's browser. Whether that could be tried; a browser that fails later is not our matter.
pub(super) fn open(url: &str) -> bool {
    let (program, needs_screen) = if cfg!(target_os = "macos") {
        ("open", false)
    } else {
        ("xdg-open", true)
    };
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if needs_screen && !set("DISPLAY") && !set("WAYLAND_DISPLAY") {
        return false;
    }
    let opener = Command::new(program)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut opener) = opener else { return false };
    // Somebody has to take note of its end.
    let waiting = std::thread::Builder::new()
        .name("browser".into())
        .spawn(move || opener.wait());
    waiting.is_ok()
}
