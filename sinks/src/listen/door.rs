//! Who may come in: programs, and pages of this machine or of sites that were allowed. A page from elsewhere in the operator's
//! browser must not read people's movements. A browser names a page's site in `Origin` and no page can change that; programs
//! name none, or `file://` when they are made of web pages, as no site can. So a name that is made to lead here (DNS rebinding) is of no use to a page: its own site is still not allowed.

use std::net::IpAddr;

use tokio_tungstenite::tungstenite::http::{HeaderMap, Uri, header};

/// Why whoever sends these headers may not come in, if so.
pub(super) fn refusal(headers: &HeaderMap, allowed: &[String]) -> Option<&'static str> {
    let mut origins = headers.get_all(header::ORIGIN).iter();
    let origin = origins.next()?;
    if origin == "file://" && origins.next().is_none() {
        return None;
    }
    let known = origin.to_str().is_ok_and(|origin| {
        allowed
            .iter()
            .any(|other| other.eq_ignore_ascii_case(origin))
            || is_of_this_machine(origin)
    });
    (!known || origins.next().is_some()).then_some(
        "pages of this web site may not read people's movements: add its origin to `allowed_origins` of the sink to let them",
    )
}

fn is_of_this_machine(origin: &str) -> bool {
    let Ok(uri) = origin.parse::<Uri>() else {
        return false;
    };
    let host = uri.host().unwrap_or_default();
    let address = host.trim_start_matches('[').trim_end_matches(']');
    let is_web = matches!(uri.scheme_str(), Some("http" | "https"));
    let is_ours = |ip: IpAddr| ip.to_canonical().is_loopback();
    is_web && (host.eq_ignore_ascii_case("localhost") || address.parse().is_ok_and(is_ours))
}

/// Why a setting is no origin, if so.
pub(super) fn not_an_origin(origin: &str) -> Option<String> {
    let is_one = || {
        let (scheme, rest) = origin.split_once("://")?;
        let plain = |text: &str| !text.is_empty() && !text.contains(['/', '?', '#', '@', '*', ' ']);
        (plain(scheme) && plain(rest)).then_some(())
    };
    // What browsers say of pages from files, and of sandboxes that any site can make.
    (origin != "null" && is_one().is_none()).then(|| {
        format!(
            "origins such as \"https://example.org\" or \"http://studio.local:8080\", without a path, or \"null\" for pages from files, which lets every web site in; found `{origin}`"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio_tungstenite::tungstenite::http::HeaderValue;

    fn comes_in(origins: &[&'static str]) -> bool {
        let mut headers = HeaderMap::new();
        for origin in origins {
            headers.append(header::ORIGIN, HeaderValue::from_static(origin));
        }
        refusal(&headers, &["https://Studio.example".to_owned()]).is_none()
    }

    #[test]
    fn programs_and_own_pages_come_in_and_pages_from_elsewhere_do_not() {
        assert!(comes_in(&[]));
        for own in [
            "http://localhost:5173",
            "https://127.0.0.1",
            "http://[::1]:8080",
            "https://studio.example",
            "file://",
        ] {
            assert!(comes_in(&[own]), "{own} was refused");
        }
        for foreign in [
            "null",
            "",
            "https://evil.example",
            "http://localhost.evil.example",
            "http://127.0.0.1.evil.example:7401",
            "http://localhost@evil.example",
            "http://10.0.0.5",
            "file://localhost",
            "https://studio.example:444",
        ] {
            assert!(!comes_in(&[foreign]), "{foreign} was let in");
        }
        assert!(!comes_in(&["http://localhost", "https://evil.example"]));
        assert!(!comes_in(&["file://", "https://evil.example"]));
        assert!(!comes_in(&["https://studio.example", "http://localhost"]));
    }

    #[test]
    fn settings_are_origins() {
        for good in [
            "null",
            "https://app.foxglove.dev",
            "http://studio.local:8080",
        ] {
            assert_eq!(not_an_origin(good), None);
        }
        for bad in [
            "",
            "*",
            "example.org",
            "https://example.org/",
            "https://*.example.org",
        ] {
            assert!(not_an_origin(bad).is_some(), "{bad}");
        }
    }
}
