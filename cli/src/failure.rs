//! How a command ends: with an outcome, or with an error that becomes one clear line and an exit code.

use std::fmt;
use std::io;

use crate::output;

/// How a command that did not fail outright ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Everything was done.
    Done,
    /// The command worked, its answer is "no": a failed calibration, a room with faults.
    Failed,
    /// Done, but something was lost or is weak; what it is has been said.
    DoneWithLoss,
}

impl Outcome {
    /// The process's exit code.
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::DoneWithLoss => 3,
        }
    }
}

/// An error in what the person wrote: the command line or a configuration file. Exit code 2.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// An error in what the person wrote.
pub(crate) fn usage(message: impl fmt::Display) -> anyhow::Error {
    anyhow::Error::new(Usage(message.to_string()))
}

/// Says what went wrong and gives the exit code. A reader that closed our stdout (`| head`) is no error.
pub(crate) fn report(error: &anyhow::Error) -> u8 {
    let closed = |cause: &(dyn std::error::Error + 'static)| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe)
    };
    if error.chain().any(closed) {
        return 0;
    }
    output::error(&in_words(error));
    let wrong_usage = error.chain().any(|cause| cause.is::<Usage>());
    if wrong_usage { 2 } else { 1 }
}

/// The error and its causes on one line. A cause that the error names already is not said again.
pub(crate) fn in_words(error: &anyhow::Error) -> String {
    let mut words = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if words.is_empty() {
            words = cause;
        } else if !words.contains(&cause) {
            words = format!("{words}: {cause}");
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use anyhow::{Context, anyhow};

    use super::*;

    #[test]
    fn each_cause_is_said_once() {
        let error: anyhow::Error = Err::<(), _>(anyhow!("disk gone"))
            .context("cannot write: disk gone; plug it in")
            .context("the take `a`")
            .unwrap_err();
        assert_eq!(
            in_words(&error),
            "the take `a`: cannot write: disk gone; plug it in"
        );
    }
}
