//! Who may call: keeps other web sites in the operator's browser away, and labels what pages may do.
//!
//! - `Host` must name this machine (a foreign name that resolves here is DNS rebinding): else 403.
//! - A request that changes something, or speaks gRPC-Web, must come from this server's own pages if it comes from a
//!   page at all (`Origin`, `Sec-Fetch-Site`): else 403. Programs send neither header and pass.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http::header::{self, HeaderName, HeaderValue};
use http::uri::Authority;
use http::{Method, StatusCode};

/// What a page may load and do: its own files, nothing else, nobody may frame it.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; \
    style-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The names by which this server may be called.
#[derive(Debug)]
pub(super) struct Hosts {
    listen: IpAddr,
    names: Vec<String>,
}

impl Hosts {
    pub(super) fn new(listen: IpAddr, names: &[String]) -> Self {
        Self {
            listen,
            names: names.iter().map(|name| name.to_ascii_lowercase()).collect(),
        }
    }

    /// Whether `host` (without port) is this machine. An address cannot be rebound, so where the server listens on
    /// every address, any address will do.
    fn allow(&self, host: &str) -> bool {
        let host = host.to_ascii_lowercase();
        if host == "localhost" || self.names.contains(&host) {
            return true;
        }
        let bare = host.trim_start_matches('[').trim_end_matches(']');
        bare.parse::<IpAddr>().is_ok_and(|ip| {
            ip.to_canonical().is_loopback() || ip == self.listen || super::is_any(self.listen)
        })
    }
}

/// Lets a request pass or answers 403 with the reason.
pub(super) async fn guard(
    State(hosts): State<Arc<Hosts>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match refusal(&hosts, &request) {
        None => next.run(request).await,
        Some(reason) => {
            tracing::warn!(path = request.uri().path(), reason, "a request was refused");
            (StatusCode::FORBIDDEN, reason).into_response()
        }
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn refusal(hosts: &Hosts, request: &Request) -> Option<&'static str> {
    let Some(authority) = authority(request) else {
        return Some("the request names no host, or several");
    };
    if !hosts.allow(authority.host()) {
        return Some(
            "this server is not known by that name: use its address, or add the name to `allowed_hosts` under `[net]`",
        );
    }
    let headers = request.headers();
    let grpc_web = headers
        .get(header::CONTENT_TYPE)
        .is_some_and(|kind| kind.as_bytes().starts_with(b"application/grpc-web"));
    if matches!(*request.method(), Method::GET | Method::HEAD) && !grpc_web {
        return None;
    }
    let from_elsewhere = headers
        .get_all(header::ORIGIN)
        .iter()
        .any(|origin| !same_origin(origin, &authority));
    let fetched = headers.get("sec-fetch-site").map(HeaderValue::as_bytes);
    let cross_site = fetched.is_some_and(|site| site != b"same-origin" && site != b"none");
    (from_elsewhere || cross_site).then_some("this call comes from a page of another web site")
}

/// The host a request is meant for: `Host`, `:authority`, or both if they agree.
fn authority(request: &Request) -> Option<Authority> {
    let in_uri = request.uri().authority().cloned();
    let mut in_headers = request.headers().get_all(header::HOST).iter();
    let in_header = match in_headers.next() {
        Some(value) => Some(Authority::try_from(value.as_bytes()).ok()?),
        None => None,
    };
    if in_headers.next().is_some() {
        return None;
    }
    match (in_uri, in_header) {
        (Some(uri), Some(header)) => (uri == header).then_some(uri),
        (one, other) => one.or(other),
    }
}

fn same_origin(origin: &HeaderValue, authority: &Authority) -> bool {
    let Ok(origin) = origin.to_str() else {
        return false;
    };
    let rest = origin
        .strip_prefix("http://")
        .or_else(|| origin.strip_prefix("https://"));
    rest.is_some_and(|rest| rest.eq_ignore_ascii_case(authority.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_this_machine_and_no_other() {
        let hosts = Hosts::new("127.0.0.1".parse().unwrap(), &["Studio.local".into()]);
        for own in [
            "localhost",
            "LOCALHOST",
            "127.0.0.1",
            "127.8.0.1",
            "[::1]",
            "studio.local",
        ] {
            assert!(hosts.allow(own), "{own} was refused");
        }
        for foreign in [
            "evil.example",
            "localhost.evil.example",
            "10.0.0.5",
            "0.0.0.0",
            "",
        ] {
            assert!(!hosts.allow(foreign), "{foreign} was let in");
        }
        let open = Hosts::new("0.0.0.0".parse().unwrap(), &[]);
        assert!(open.allow("10.0.0.5") && !open.allow("evil.example"));
    }

    #[test]
    fn an_origin_is_the_same_only_with_its_port() {
        let authority: Authority = "127.0.0.1:7400".parse().unwrap();
        let same =
            |origin: &'static str| same_origin(&HeaderValue::from_static(origin), &authority);
        assert!(same("http://127.0.0.1:7400"));
        for foreign in [
            "http://127.0.0.1:8080",
            "http://evil.example",
            "null",
            "http://127.0.0.1:7400.evil.example",
        ] {
            assert!(!same(foreign), "{foreign} passed");
        }
    }
}
