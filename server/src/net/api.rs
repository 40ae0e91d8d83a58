//! `/api`: starting and stopping takes, and the room's state, as JSON over plain HTTP, for programs without gRPC.
//!
//! Errors are answered as `{"error": "what to do"}` with a status that fits: 400 the request, 404 no such take, 409 not now,
//! 503 the server is stopping, 507 the disk is full, 500 anything else.

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, State};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Router};
use http::StatusCode;
use http::header::{CACHE_CONTROL, CONTENT_TYPE};
use posefuse_proto::v1;
use serde::Deserialize;
use serde_json::{Value, json};
use tonic::{Code, Status};

use super::Peer;
use crate::room::{Order, RoomService, Way};

/// Largest body of a request, bytes.
const MAX_BODY: usize = 64 * 1024;

pub(super) fn routes() -> Router<RoomService> {
    Router::new()
        .route("/api/status", get(status))
        .route("/api/takes/start", post(start))
        .route("/api/takes/stop", post(stop))
        .layer(DefaultBodyLimit::max(MAX_BODY))
}

/// What a start may be told; an empty body is `{}`.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Start {
    name: String,
    slate: String,
    notes: String,
}

async fn start(
    State(room): State<RoomService>,
    peer: Option<Extension<Peer>>,
    body: Bytes,
) -> Response {
    let start = match body.trim_ascii() {
        b"" => Ok(Start::default()),
        text => serde_json::from_slice(text),
    };
    let Start { name, slate, notes } = match start {
        Ok(start) => start,
        Err(error) => {
            let words = format!(
                "the body must be JSON such as {{\"name\": \"walk\", \"slate\": \"12A\", \"notes\": \"\"}}: {error}"
            );
            room.0.not_an_order(Way::Http, words.clone());
            return refusal(&Status::invalid_argument(words));
        }
    };
    let order = Order::Start(v1::StartTakeRequest { name, slate, notes });
    ordered(&room, peer, order).await
}

async fn stop(State(room): State<RoomService>, peer: Option<Extension<Peer>>) -> Response {
    ordered(&room, peer, Order::Stop).await
}

async fn ordered(room: &RoomService, peer: Option<Extension<Peer>>, order: Order) -> Response {
    let peer = peer.map(|Extension(Peer(address))| address);
    match room.0.order(Way::Http, peer, order).await {
        Ok(take) => answer(StatusCode::OK, &take_to_json(&take)),
        Err(status) => refusal(&status),
    }
}

async fn status(State(room): State<RoomService>) -> Response {
    let status = room.status();
    let sensors = status.sensors.iter().map(|sensor| {
        json!({
            "name": sensor.info.as_ref().map_or("", |info| info.name.as_str()),
            "state": word(sensor.state().as_str_name(), "SENSOR_STATE_"),
            "calibrated": sensor.calibrated,
            "muted": sensor.muted,
            "frames_per_second": sensor.frames_per_second,
            "trouble": sensor.trouble,
        })
    });
    let sinks = status.sinks.iter().map(|sink| {
        let state = match sink.state() {
            v1::SinkState::Unspecified => "always".to_owned(),
            state => word(state.as_str_name(), "SINK_STATE_"),
        };
        json!({
            "name": sink.name, "state": state, "place": sink.place, "clients": sink.clients,
            "delivered": sink.delivered, "dropped": sink.dropped, "trouble": sink.trouble,
        })
    });
    let unix_ns = status.time_ns.saturating_add(status.unix_offset_ns);
    let body = json!({
        "version": status.server_version,
        "unix_ns": unix_ns,
        "timecode": status.timecode,
        "timecode_rate": status.timecode_rate,
        "recording": status.recording.as_ref().map(take_to_json),
        "calibrating": status.calibrating,
        "people": status.people,
        "frames_per_second": status.frames_per_second,
        "sensors": sensors.collect::<Vec<_>>(),
        "sinks": sinks.collect::<Vec<_>>(),
        "disk_free_bytes": status.disk_free_bytes,
        "troubles": status.troubles,
    });
    answer(StatusCode::OK, &body)
}

fn take_to_json(take: &v1::Take) -> Value {
    json!({
        "name": take.name,
        "slate": take.slate,
        "notes": take.notes,
        "state": word(take.state().as_str_name(), "TAKE_STATE_"),
        "started": take.started,
        "start_unix_ns": take.start_unix_ns,
        "timecode": take.timecode,
        "timecode_rate": take.timecode_rate,
        "seconds": take.duration_ns as f64 * 1e-9,
        "bytes": take.size_bytes,
        "frames": take.frames,
        "people": take.people,
        "sensors": take.sensors,
        "dropped": take.dropped,
        "trouble": take.trouble,
    })
}

/// The word of an enumeration's value, e.g. `live` of `SENSOR_STATE_LIVE`.
fn word(name: &str, prefix: &str) -> String {
    name.trim_start_matches(prefix).to_ascii_lowercase()
}

fn refusal(status: &Status) -> Response {
    let code = match status.code() {
        Code::InvalidArgument => StatusCode::BAD_REQUEST,
        Code::NotFound => StatusCode::NOT_FOUND,
        Code::FailedPrecondition | Code::AlreadyExists => StatusCode::CONFLICT,
        Code::ResourceExhausted => StatusCode::INSUFFICIENT_STORAGE,
        Code::Unavailable => StatusCode::SERVICE_UNAVAILABLE,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    };
    answer(code, &json!({ "error": status.message() }))
}

fn answer(code: StatusCode, body: &Value) -> Response {
    let headers = [
        (CONTENT_TYPE, "application/json"),
        (CACHE_CONTROL, "no-store"),
    ];
    (code, headers, format!("{body}\n")).into_response()
}
