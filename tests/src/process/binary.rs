//! Where the program is.

use std::fs::File;
use std::path::PathBuf;
use std::process::Command;
use std::sync::LazyLock;

/// The `posefuse` program: `POSEFUSE` if that is set, else the one of this workspace and profile, built now.
pub fn posefuse() -> PathBuf {
    static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| match std::env::var_os("POSEFUSE") {
        Some(program) => program.into(),
        None => built(),
    });
    PROGRAM.clone()
}

/// Builds the program once for all tests of a run (each test is a process of its own).
fn built() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    // target/PROFILE/deps/TEST
    let folder = test.ancestors().nth(2).expect("a target folder");
    let program = folder.join("posefuse");
    let lock = File::create(folder.join("posefuse-tests.lock")).expect("a writable target folder");
    lock.lock().expect("a lock");
    let run = std::env::var("NEXTEST_RUN_ID").unwrap_or_default();
    let built_in = folder.join("posefuse-tests.run");
    if !run.is_empty() && std::fs::read_to_string(&built_in).is_ok_and(|built| built == run) {
        return program;
    }
    let mut build = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // As CI builds it, so that there it is built already.
    build.args(["build", "--quiet", "--workspace", "--bins"]);
    build.current_dir(env!("CARGO_MANIFEST_DIR"));
    if folder.ends_with("release") {
        build.arg("--release");
    }
    let status = build.status().expect("cargo runs");
    assert!(status.success(), "the program does not build");
    std::fs::write(built_in, run).expect("a writable target folder");
    program
}
