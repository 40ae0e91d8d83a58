//! The question after a walk: put it in force, walk again, or keep what there is.

use std::io::{self, BufRead, Write};

use anyhow::Context;
use tokio_util::sync::CancellationToken;

/// What a person wants done with a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decision {
    /// Put it in force.
    Accept,
    /// Walk again.
    Repeat,
    /// Leave the one in force as it is.
    Keep,
}

/// Asks at the terminal until the answer can be understood. A signal, or the end of the input, keeps what there is.
pub(super) async fn decision(
    may_accept: bool,
    stop: &CancellationToken,
) -> anyhow::Result<Decision> {
    // No bar is shown any more, and a read that never ends must hold nothing that others need.
    let asked = tokio::task::spawn_blocking(move || {
        ask(may_accept, &mut io::stdin().lock(), &mut io::stderr())
    });
    tokio::select! {
        () = stop.cancelled() => Ok(Decision::Keep),
        answer = asked => Ok(answer.context("asking")??),
    }
}

fn ask(may_accept: bool, input: &mut impl BufRead, out: &mut impl Write) -> io::Result<Decision> {
    let question = if may_accept {
        "put it in force? [y]es, [r]epeat the walk, [k]eep the old one: "
    } else {
        "[r]epeat the walk, [k]eep the old one: "
    };
    loop {
        write!(out, "{question}")?;
        out.flush()?;
        let mut answer = String::new();
        if input.read_line(&mut answer)? == 0 {
            writeln!(out)?;
            return Ok(Decision::Keep);
        }
        match answer.trim().to_ascii_lowercase().as_str() {
            "y" | "yes" | "a" | "accept" if may_accept => return Ok(Decision::Accept),
            "r" | "repeat" => return Ok(Decision::Repeat),
            "k" | "keep" | "n" | "no" | "q" => return Ok(Decision::Keep),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(may_accept: bool, typed: &str) -> Decision {
        ask(may_accept, &mut typed.as_bytes(), &mut Vec::new()).unwrap()
    }

    #[test]
    fn only_a_clear_yes_accepts_and_a_failed_one_cannot_be() {
        assert_eq!(answer(true, "y\n"), Decision::Accept);
        assert_eq!(answer(true, "\nwhat?\nYes\n"), Decision::Accept);
        assert_eq!(answer(true, "\n\n"), Decision::Keep);
        assert_eq!(answer(true, "r\n"), Decision::Repeat);
        assert_eq!(answer(false, "y\nk\n"), Decision::Keep);
        assert_eq!(answer(false, "y"), Decision::Keep);
    }
}
