//! One running `posefuse` process.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::posefuse;

/// A process that ends with its test, however that ends. What it says goes to a file.
pub struct Program {
    child: Child,
    lines: Receiver<String>,
    log: PathBuf,
}

impl Program {
    /// Starts `posefuse ARGUMENTS`; stderr goes to `FOLDER/NAME.log`.
    pub fn start(folder: &Path, name: &str, arguments: &[&str]) -> Self {
        let log = folder.join(format!("{name}.log"));
        let file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&log);
        let mut child = Command::new(posefuse())
            .args(arguments)
            // `--exit-with-parent` looks at this pipe.
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(file.expect("a log file"))
            .env("POSEFUSE_LOG", "info")
            .spawn()
            .expect("the program starts");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let (to_us, lines) = channel();
        // Reads all the time, so that a full pipe never holds the program up.
        std::thread::spawn(move || {
            stdout
                .lines()
                .map_while(Result::ok)
                .try_for_each(|line| to_us.send(line))
        });
        Self { child, lines, log }
    }

    /// The next line of its standard output; waits for at most 10 s.
    pub fn line(&self) -> String {
        let line = self.lines.recv_timeout(Duration::from_secs(10));
        line.unwrap_or_else(|_| panic!("the program prints nothing more:\n{}", self.said()))
    }

    /// Everything it said on stderr so far.
    pub fn said(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, signal).expect("a process of ours");
    }

    /// Stops it, as a debugger or a suspended laptop does.
    pub fn freeze(&self) {
        self.signal(Signal::STOP);
    }

    /// Lets it go on.
    pub fn thaw(&self) {
        self.signal(Signal::CONT);
    }

    /// Ends it in the middle of whatever it does.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Asks it to end, and waits.
    pub fn end(&mut self) -> ExitStatus {
        self.signal(Signal::TERM);
        let deadline = Instant::now() + Duration::from_secs(20);
        while Instant::now() < deadline {
            if let Some(status) = self.child.try_wait().expect("a process of ours") {
                return status;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("the program did not end within 20 s:\n{}", self.said());
    }

    /// Whether it still runs.
    pub fn runs(&mut self) -> bool {
        self.child.try_wait().expect("a process of ours").is_none()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.kill();
    }
}
