//! Values on the command line, and what is said of those that are none.

use std::net::SocketAddr;
use std::str::FromStr;

/// A time in seconds.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    number(text, |s| s > 0.0 && s <= 86_400.0)
        .ok_or_else(|| "expected seconds, more than 0 and at most 86400".to_owned())
}

/// Frames per second; 0 has a meaning of its own.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    number(text, |rate| (0.0..=1000.0).contains(&rate))
        .ok_or_else(|| "expected frames per second, 0 to 1000".to_owned())
}

/// How many times faster than recorded.
pub(crate) fn speed(text: &str) -> Result<f64, String> {
    number(text, |speed| (0.01..=1000.0).contains(&speed))
        .ok_or_else(|| "expected a factor from 0.01 to 1000, like 0.5 or 2".to_owned())
}

/// The seconds that starts are aligned to.
pub(crate) fn align(text: &str) -> Result<f64, String> {
    number(text, |s| (0.0..=3600.0).contains(&s))
        .ok_or_else(|| "expected seconds, 0 to 3600".to_owned())
}

fn number(text: &str, holds: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| holds(*number))
}

/// A whole number within bounds.
pub(crate) fn whole<T>(low: T, high: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Copy + std::fmt::Display,
{
    move |text: &str| {
        let number = text.parse::<T>().ok();
        number
            .filter(|number| (low..=high).contains(number))
            .ok_or_else(|| format!("expected a whole number from {low} to {high}"))
    }
}

/// Where to listen.
pub(crate) fn listen(text: &str) -> Result<SocketAddr, String> {
    if let Ok(address) = text.parse() {
        return Ok(address);
    }
    let last = text.rsplit(':').next().unwrap_or_default();
    let port: u16 = last.parse().unwrap_or(7400);
    Err(format!(
        "expected ADDRESS:PORT with an IP address, like 127.0.0.1:{port}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_address_is_answered_with_one_that_is() {
        assert_eq!(listen("[::1]:7400").unwrap().port(), 7400);
        for (wrong, like) in [
            ("7421", "like 127.0.0.1:7421"),
            ("localhost:7500", "like 127.0.0.1:7500"),
            ("127.0.0.1", "like 127.0.0.1:7400"),
            (":99999", "like 127.0.0.1:7400"),
        ] {
            let error = listen(wrong).unwrap_err();
            assert!(error.ends_with(like), "{wrong}: {error}");
        }
    }

    #[test]
    fn numbers_out_of_bounds_or_none_at_all_are_told_the_bounds() {
        assert_eq!(whole(1, 64)("64"), Ok(64));
        for wrong in ["0", "65", "two", "1.5", ""] {
            let error = whole(1, 64)(wrong).unwrap_err();
            assert_eq!(error, "expected a whole number from 1 to 64");
        }
        for wrong in ["-1", "NaN", "inf", "x"] {
            assert!(seconds(wrong).is_err() && speed(wrong).is_err() && align(wrong).is_err());
        }
    }
}
