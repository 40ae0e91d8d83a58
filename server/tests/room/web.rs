//! The one port: pages, metrics, who may call, limits.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use posefuse_proto::v1;
use posefuse_server::{ServerError, bind};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::fixture::{config, memory, start, start_with};

/// Sends a request as it stands and gives the whole answer.
async fn ask(address: SocketAddr, request: &str) -> String {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    let read = tokio::time::timeout(Duration::from_secs(5), stream.read_to_end(&mut answer)).await;
    read.expect("no end of the answer").unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

async fn get(address: SocketAddr, path: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    ask(address, &request).await
}

#[tokio::test]
async fn pages_come_with_their_headers_and_metrics_with_the_room() {
    let server = start().await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    agent.walk(0..10).await;
    agent.acked(9).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    let page = get(server.address, "/").await;
    assert!(
        page.starts_with("HTTP/1.1 200") && page.to_lowercase().contains("<!doctype html>"),
        "{page}"
    );
    for header in [
        "content-security-policy: default-src 'self'",
        "style-src 'self';",
        "x-content-type-options: nosniff",
    ] {
        assert!(page.contains(header), "{page}");
    }
    // What that policy forbids, the page must not need.
    assert!(
        !page.contains("<style") && !page.contains(" style="),
        "{page}"
    );
    for path in [
        "/no-such-page",
        "/../Cargo.toml",
        "/assets/../../server/Cargo.toml",
    ] {
        let missing = get(server.address, path).await;
        assert!(missing.starts_with("HTTP/1.1 404"), "{path}: {missing}");
    }
    let metrics = get(server.address, "/metrics").await;
    assert!(
        metrics.contains("posefuse_sensor_connected{sensor=\"left\"} 1"),
        "{metrics}"
    );
    let uncalibrated = "posefuse_rejected_total{sensor=\"left\",reason=\"uncalibrated\"} 10";
    assert!(metrics.contains(uncalibrated), "{metrics}");
    assert!(
        metrics.contains("posefuse_frames_total 0") && metrics.trim_end().ends_with("# EOF"),
        "{metrics}"
    );
    server.stop().await;
}

/// A gRPC-Web call of `GetStatus`, as a browser sends it.
fn web_call(host: &str, headers: &str) -> String {
    format!(
        "POST /posefuse.v1.Room/GetStatus HTTP/1.1\r\nHost: {host}\r\n{headers}Connection: close\r\n\
         Content-Type: application/grpc-web+proto\r\nContent-Length: 5\r\n\r\n\0\0\0\0\0"
    )
}

async fn only_known_names_get_pages(address: SocketAddr, own: &str) {
    for (host, allowed) in [(own, true), ("evil.test", false), ("", false)] {
        let page = format!(
            "GET / HTTP/1.1\r\nHost: {host}\r\nOrigin: http://evil.test\r\nConnection: close\r\n\r\n"
        );
        let answer = ask(address, &page).await;
        assert_eq!(
            answer.starts_with("HTTP/1.1 200"),
            allowed,
            "{host}: {answer}"
        );
    }
    let two =
        format!("GET / HTTP/1.1\r\nHost: {own}\r\nHost: evil.test\r\nConnection: close\r\n\r\n");
    assert!(!ask(address, &two).await.starts_with("HTTP/1.1 200"));
}

#[tokio::test]
async fn only_this_machine_s_own_pages_may_call() {
    let mut config = config();
    config.net.allowed_hosts = vec!["studio.test".to_owned()];
    let server = start_with(config, memory(), memory()).await;
    let address = server.address;
    let port = address.port();
    let own = format!("127.0.0.1:{port}");
    let origin = |origin: &str| format!("Origin: {origin}\r\n");
    let calls = [
        (own.clone(), String::new(), true),
        (
            own.clone(),
            origin(&format!("http://127.0.0.1:{port}")),
            true,
        ),
        (
            format!("localhost:{port}"),
            origin(&format!("http://localhost:{port}")),
            true,
        ),
        (
            format!("studio.test:{port}"),
            origin(&format!("https://studio.test:{port}")),
            true,
        ),
        (
            own.clone(),
            "Sec-Fetch-Site: same-origin\r\n".to_owned(),
            true,
        ),
        (
            own.clone(),
            "Sec-Fetch-Site: cross-site\r\n".to_owned(),
            false,
        ),
        (own.clone(), origin("http://evil.test"), false),
        (own.clone(), origin("null"), false),
        (own.clone(), origin("http://127.0.0.1:1"), false),
        (
            own.clone(),
            origin(&format!("http://localhost:{port}")),
            false,
        ),
        (format!("evil.test:{port}"), String::new(), false),
        (
            format!("evil.test:{port}"),
            origin(&format!("http://evil.test:{port}")),
            false,
        ),
        (format!("127.0.0.1.evil.test:{port}"), String::new(), false),
    ];
    for (host, headers, allowed) in calls {
        let answer = ask(address, &web_call(&host, &headers)).await;
        let expected = if allowed {
            "HTTP/1.1 200"
        } else {
            "HTTP/1.1 403"
        };
        assert!(answer.starts_with(expected), "{host} {headers}: {answer}");
        let got_status = answer.contains("grpc-status:0") || answer.contains("grpc-status: 0");
        assert_eq!(got_status, allowed, "{host} {headers}: {answer}");
    }
    only_known_names_get_pages(address, &own).await;
    server.stop().await;
}

#[tokio::test]
async fn silent_connections_are_closed_and_do_not_keep_others_out() {
    let mut config = config();
    config.net.head_timeout_ms = 300;
    config.net.max_connections = 20;
    let server = start_with(config, memory(), memory()).await;
    let mut silent = Vec::new();
    for half in [
        "",
        "GET / HT",
        "PRI * HTTP/2.0",
        "GET / HTTP/1.1\r\nHost: x\r\n",
    ] {
        let mut stream = TcpStream::connect(server.address).await.unwrap();
        stream.write_all(half.as_bytes()).await.unwrap();
        silent.push((half, stream));
    }
    for (half, mut stream) in silent {
        let began = Instant::now();
        let closed =
            tokio::time::timeout(Duration::from_secs(3), stream.read(&mut [0; 4096])).await;
        assert!(closed.is_ok(), "`{half}` is held for {:?}", began.elapsed());
    }
    // As many as there may be, and one more: it is closed at once; with room again, the next is served.
    let mut full = Vec::new();
    for _ in 0..20 {
        full.push(TcpStream::connect(server.address).await.unwrap());
    }
    tokio::time::sleep(Duration::from_millis(50)).await;
    let mut extra = TcpStream::connect(server.address).await.unwrap();
    let read = tokio::time::timeout(Duration::from_millis(200), extra.read(&mut [0; 16])).await;
    assert!(matches!(read, Ok(Ok(0) | Err(_))), "{read:?}");
    drop(full);
    tokio::time::sleep(Duration::from_millis(100)).await;
    assert!(
        get(server.address, "/metrics")
            .await
            .contains("posefuse_connections_refused_total 1")
    );
    server.stop().await;
}

#[tokio::test]
async fn a_peer_that_answers_no_ping_is_noticed_within_two_seconds() {
    let server = start().await;
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    // HTTP/2's preface with empty SETTINGS, then nothing: as after a pulled cable.
    let preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
    stream.write_all(preface).await.unwrap();
    let began = Instant::now();
    let mut answer = Vec::new();
    let end = stream.read_to_end(&mut answer);
    let ended = tokio::time::timeout(Duration::from_secs(4), end).await;
    let took = began.elapsed();
    assert!(
        ended.is_ok() && took < Duration::from_millis(2200),
        "{took:?}"
    );
    assert!(
        took > Duration::from_millis(1000),
        "closed after {took:?}, before a ping could be answered"
    );
    server.stop().await;
}

#[tokio::test]
async fn oversized_messages_are_refused_and_the_server_goes_on() {
    let server = start().await;
    let mut room = server.room().await;
    let request = v1::StartTakeRequest {
        notes: "x".repeat(400 * 1024),
        ..Default::default()
    };
    let status = room.start_take(request).await.unwrap_err();
    assert_eq!(status.code(), tonic::Code::OutOfRange, "{status:?}");
    room.get_status(v1::GetStatusRequest {}).await.unwrap();
    server.stop().await;
}

#[tokio::test]
async fn a_port_in_use_and_an_open_address_are_named_with_the_remedy() {
    let server = start().await;
    let mut config = config();
    config.listen = server.address;
    let error = bind(&config).await.unwrap_err();
    assert!(matches!(error, ServerError::PortInUse(_)));
    let text = error.to_string();
    assert!(
        text.contains(&server.address.port().to_string()) && text.contains("`listen ="),
        "{text}"
    );

    config.listen = "0.0.0.0:0".parse().unwrap();
    let text = bind(&config).await.unwrap_err().to_string();
    assert!(
        text.contains("not encrypted") && text.contains("allow_remote = true"),
        "{text}"
    );
    config.allow_remote = true;
    bind(&config).await.unwrap();
    server.stop().await;
}

#[tokio::test]
async fn the_configuration_in_force_can_be_read() {
    let mut config = config();
    config.fusion.intake.rate_hz = 77.0;
    let server = start_with(config.clone(), memory(), memory()).await;
    let answer = server
        .room()
        .await
        .get_config(v1::GetConfigRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(
        posefuse_server::Config::from_toml(&answer.toml).unwrap(),
        config
    );
    server.stop().await;
}
