//! The room: whether a server answers, and what it says of its sensors.

use std::net::ToSocketAddrs;
use std::time::Duration;

use posefuse_proto::v1::{RoomStatus, SensorState, SensorStatus};
use tokio::net::{TcpListener, TcpStream};

use super::Finding;
use crate::failure::in_words;
use crate::room::{self, ServerUrl};

/// What the finding about the server itself is called.
const SERVER: &str = "server";
/// Latency from capture to server, and error of a clock mapping, from which on fusing suffers.
const LATENCY_DOUBTFUL_MS: f64 = 100.0;
const CLOCK_ERROR_DOUBTFUL_MS: f64 = 8.0;
/// Share of lost frames that a network should not exceed.
const LOST_DOUBTFUL: f64 = 0.02;
/// Distance to the fused joints from which on a sensor has probably been moved.
const RESIDUAL_DOUBTFUL_MM: f64 = 120.0;

/// What is to be said of the room, and of the calibration in force if a server answers.
pub(super) async fn examine(url: &ServerUrl) -> (Vec<Finding>, Option<Finding>) {
    match room::connect_with_status(url).await {
        Ok((_, status)) => {
            let found = format!("posefuse {} answers at {url}", status.server_version);
            let mut findings = vec![Finding::good(SERVER, found)];
            findings.extend(version(&status));
            findings.extend(state(&status));
            (findings, Some(calibration(&status)))
        }
        Err(error) => (no_server(url, &error).await, None),
    }
}

fn calibration(status: &RoomStatus) -> Finding {
    let what = "calibration";
    let Some(calibration) = &status.calibration else {
        let found = "the server has none in force: `posefuse calibrate` makes one";
        return Finding::unknown(what, found);
    };
    let names: Vec<&str> = calibration
        .sensors
        .iter()
        .map(|pose| pose.sensor.as_str())
        .collect();
    let made = match calibration.created.as_str() {
        "" => "an unknown time",
        created => created,
    };
    let found = format!("in force, of {made}, for {}", names.join(", "));
    Finding::good(what, found)
}

async fn no_server(url: &ServerUrl, error: &anyhow::Error) -> Vec<Finding> {
    let what = SERVER;
    let (host, port) = url.host_and_port();
    let addresses: Vec<_> = (host.as_str(), port)
        .to_socket_addrs()
        .map(Iterator::collect)
        .unwrap_or_default();
    let Some(address) = addresses.first() else {
        return vec![Finding::bad(
            what,
            format!("`{host}` is no known host"),
            "check --server URL",
        )];
    };
    let taken = tokio::time::timeout(Duration::from_secs(2), TcpStream::connect(address)).await;
    if matches!(taken, Ok(Ok(_))) {
        let remedy = format!(
            "end the program that has port {port} (`ss -ltnp` names it), or use another: posefuse server --listen 127.0.0.1:{}",
            port.wrapping_add(1).max(1024)
        );
        return vec![Finding::bad(what, in_words(error), remedy)];
    }
    if !address.ip().is_loopback() {
        let remedy = "start it there with `posefuse server`, and see that no firewall is between";
        return vec![Finding::bad(
            what,
            format!("no server answers at {url}"),
            remedy,
        )];
    }
    match TcpListener::bind(address).await {
        Ok(_) => vec![Finding::unknown(
            what,
            format!("none runs at {url}; its port is free"),
        )],
        Err(error) => {
            let remedy = "choose another port: posefuse server --listen 127.0.0.1:PORT";
            vec![Finding::bad(
                what,
                format!("port {port} cannot be listened on: {error}"),
                remedy,
            )]
        }
    }
}

fn version(status: &RoomStatus) -> Option<Finding> {
    let ours = env!("CARGO_PKG_VERSION");
    (status.server_version != ours).then(|| {
        let found = format!("the server is {}, this is {ours}", status.server_version);
        Finding::doubtful(
            "versions",
            found,
            "install the same version on every computer of the room",
        )
    })
}

fn state(status: &RoomStatus) -> Vec<Finding> {
    let mut findings = Vec::new();
    if status.sensors.is_empty() {
        let remedy = "start an agent beside each sensor, e.g. posefuse agent sim --sensor 1";
        findings.push(Finding::doubtful("sensors", "none has joined", remedy));
    }
    findings.extend(status.sensors.iter().map(sensor));
    findings.extend(status.troubles.iter().map(|text| trouble("room", text)));
    for sink in status.sinks.iter().filter(|sink| sink.dropped > 0) {
        let found = format!(
            "{} of {} were dropped",
            sink.dropped,
            sink.dropped + sink.delivered
        );
        let remedy = "whoever takes them does not keep up: a slow disk, network or viewer";
        findings.push(Finding::doubtful(
            format!("output {}", sink.name),
            found,
            remedy,
        ));
    }
    findings
}

/// A trouble in the server's words: what is wrong and, after a semicolon, what to do.
fn trouble(what: &str, text: &str) -> Finding {
    let (found, remedy) = text.split_once("; ").unwrap_or((text, ""));
    Finding::doubtful(what, found, remedy)
}

fn sensor(sensor: &SensorStatus) -> Finding {
    let name = sensor.info.as_ref().map_or("?", |info| info.name.as_str());
    let what = format!("sensor {name}");
    let state = sensor.state();
    if state != SensorState::Live {
        let usual = match state {
            SensorState::Stalled => "connected, but no frame for a second",
            _ => "its agent is gone",
        };
        let found = match sensor.trouble.as_str() {
            "" => usual,
            trouble => trouble,
        };
        let remedy = remedy_for_state(state, name);
        return Finding::bad(what, found, remedy);
    }
    let doubts = doubts(sensor);
    if doubts.is_empty() {
        let latency = sensor.latency_ms.unwrap_or(0.0);
        let found = format!("live, {:.0} fps, {latency:.0} ms", sensor.frames_per_second);
        return Finding::good(what, found);
    }
    let found: Vec<&str> = doubts.iter().map(|(found, _)| found.as_str()).collect();
    let mut remedies: Vec<&str> = doubts.iter().map(|(_, remedy)| remedy.as_str()).collect();
    remedies.retain(|remedy| !remedy.is_empty());
    Finding::doubtful(what, found.join("; "), remedies.join("; "))
}

/// What is not well with a live sensor, each with a remedy.
fn doubts(sensor: &SensorStatus) -> Vec<(String, String)> {
    let mut doubts = Vec::new();
    let mut doubt = |holds: bool, found: String, remedy: &str| {
        if holds {
            doubts.push((found, remedy.to_owned()));
        }
    };
    let total = sensor.frames_received + sensor.frames_lost;
    let lost = sensor.frames_lost as f64 / total.max(1) as f64;
    let latency = sensor.latency_ms.unwrap_or(0.0);
    let clock_error = sensor.clock_error_ms.unwrap_or(0.0);
    let residual = sensor.residual_mm.unwrap_or(0.0);
    doubt(
        !sensor.calibrated,
        "is not calibrated".to_owned(),
        "posefuse calibrate",
    );
    doubt(
        latency > LATENCY_DOUBTFUL_MS,
        format!("frames take {latency:.0} ms to the server"),
        "use a cable instead of Wi-Fi, or a faster computer beside the sensor",
    );
    doubt(
        clock_error > CLOCK_ERROR_DOUBTFUL_MS,
        format!("its clock is known to {clock_error:.0} ms only"),
        "use a cable instead of Wi-Fi: probes take too long",
    );
    doubt(
        lost > LOST_DOUBTFUL,
        format!("{:.1} % of its frames got lost", 100.0 * lost),
        "the agent's computer or network does not keep up",
    );
    doubt(
        residual > RESIDUAL_DOUBTFUL_MM,
        format!("its joints lie {residual:.0} mm off the others'"),
        "it may have been moved: posefuse calibrate",
    );
    doubt(!sensor.trouble.is_empty(), sensor.trouble.clone(), "");
    doubts
}

fn remedy_for_state(state: SensorState, name: &str) -> String {
    match state {
        SensorState::Stalled => {
            format!("see that the sensor of `{name}` is plugged in and not used by another program")
        }
        _ => format!("start it again: posefuse agent SOURCE --name {name}"),
    }
}
