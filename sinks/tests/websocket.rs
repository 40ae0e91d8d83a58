//! The listeners, from the fusion thread's tap to clients that are not ours: a client library's, and one that misbehaves.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod websocket_room;

use std::time::Duration;

use futures_util::SinkExt;
use posefuse_sinks::SinkState;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_tungstenite::tungstenite::{self, Message};
use websocket_room::{Client, Room, binary, connect, texts};

fn status(refused: tungstenite::Error) -> (u16, String) {
    let tungstenite::Error::Http(response) = refused else {
        panic!("expected an answer, found {refused}");
    };
    let words = response.body().clone().unwrap_or_default();
    (
        response.status().as_u16(),
        String::from_utf8(words).unwrap(),
    )
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_gets_everybody_as_they_come_move_and_go() {
    let room = Room::open("websocket", |_| {}).await;
    let mut client = room.client("/?bodies=1").await;
    let reader = tokio::spawn(async move { texts(&mut client, |m| m["number"] == 119).await });
    room.play(
        |second| if second < 2.0 { vec![0] } else { vec![0, 1] },
        0..90,
    );
    room.play(|_| vec![1], 90..120);
    let messages = reader.await.unwrap();
    let hello = &messages[0];
    assert_eq!(hello["type"], "hello");
    assert_eq!(hello["axes"]["z"], "up");
    assert_eq!(hello["joints"].as_array().unwrap().len(), 25);
    let frames: Vec<&Value> = messages.iter().filter(|m| m["type"] == "frame").collect();
    assert_eq!(frames[0]["joined"], json!([1]));
    let joins: Vec<&Value> = frames
        .iter()
        .filter(|m| m["joined"] == json!([2]))
        .copied()
        .collect();
    assert_eq!(joins.len(), 1);
    for frame in &frames {
        let number = frame["number"].as_u64().unwrap();
        let unix_ns: i64 = frame["unix_ns"].as_str().unwrap().parse().unwrap();
        assert_eq!(unix_ns, websocket_room::unix_ns(number));
        for person in frame["people"].as_array().unwrap() {
            let index = person["id"].as_u64().unwrap() as usize - 1;
            let truth = room.truth(index, number);
            let joints = person["joints"].as_object().unwrap();
            assert_eq!(joints.len(), 25);
            for (joint, at) in truth.iter() {
                for (axis, value) in at.vector().iter().enumerate() {
                    let told = joints[joint.name()][axis].as_f64().unwrap();
                    assert!(
                        (told - value).abs() <= 0.5e-4 + 1e-9,
                        "{joint:?} {told} {value}"
                    );
                }
                assert_eq!(person["provenance"][joint.name()], "measured");
            }
        }
    }
    bodies_hang_together(&messages);
    room.sinks.stop().await;
}

/// Bones placed by what was told of the rig end where the joints are.
fn bodies_hang_together(messages: &[Value]) {
    let rig = messages.iter().find(|m| m["type"] == "rig").unwrap();
    let bones = rig["bones"].as_array().unwrap();
    assert_eq!(bones[0]["parent"], Value::Null);
    let last = messages.last().unwrap();
    let body = &last["people"][0]["body"];
    let turns = body["rotations"].as_object().unwrap();
    assert_eq!(turns.len(), bones.len());
    for turn in turns.values() {
        let squares = turn.as_array().unwrap().iter();
        let length: f64 = squares.map(|part| part.as_f64().unwrap().powi(2)).sum();
        assert!((length - 1.0).abs() < 1e-4, "{turn}");
    }
    // Hips are within a hand of the base of the spine.
    let (root, base) = (&body["root"], &last["people"][0]["joints"]["SpineBase"]);
    for axis in 0..3 {
        assert!((root[axis].as_f64().unwrap() - base[axis].as_f64().unwrap()).abs() < 0.15);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_from_elsewhere_wrong_wishes_and_too_many_are_refused_in_words() {
    let room = Room::open("websocket", |config| config.websocket.max_clients = 1).await;
    let refused = |path: &'static str, origin: Option<&'static str>| {
        let address = room.address;
        async move { status(connect(address, path, origin, &[]).await.unwrap_err()) }
    };
    let (code, words) = refused("/", Some("https://evil.example")).await;
    assert_eq!(code, 403);
    assert!(words.contains("allowed_origins"), "{words}");
    assert_eq!(refused("/", Some("null")).await.0, 403);
    let (code, words) = refused("/?bodies=maybe", None).await;
    assert_eq!(code, 400);
    assert!(words.contains("bodies=1"), "{words}");
    let own = connect(room.address, "/", Some("http://localhost:5173"), &[]).await;
    let own = own.unwrap();
    let (code, words) = refused("/", None).await;
    assert_eq!(code, 503);
    assert!(words.contains("max_clients"), "{words}");
    assert_eq!(room.status().clients, Some(1));
    drop(own);
    room.wait_for(|status| status.clients == Some(0)).await;
    assert!(connect(room.address, "/", None, &[]).await.is_ok());
    room.sinks.stop().await;
}

/// Comes in as a client does, and reads nothing ever.
async fn staring(room: &Room) -> tokio::net::TcpStream {
    let mut stream = tokio::net::TcpStream::connect(room.address).await.unwrap();
    let request = format!(
        "GET /?bodies=1 HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n",
        room.address
    );
    stream.write_all(request.as_bytes()).await.unwrap();
    stream
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_takes_nothing_is_cut_and_costs_the_others_nothing() {
    let room = Room::open("websocket", |_| {}).await;
    let mut still = staring(&room).await;
    let mut good = room.client("/?bodies=1").await;
    room.wait_for(|status| status.clients == Some(2)).await;
    let reader = tokio::spawn(async move {
        let messages = texts(&mut good, |m| m["number"].as_u64() >= Some(149)).await;
        (messages, good)
    });
    for frame in 0..150 {
        room.play(|_| vec![0, 1], frame..frame + 1);
        tokio::time::sleep(Duration::from_millis(33)).await;
    }
    let (messages, _stays) = reader.await.unwrap();
    let frames = messages.iter().filter(|m| m["type"] == "frame").count();
    assert!(frames >= 145, "the good client got {frames} of 150");
    room.wait_for(|status| status.clients == Some(1)).await;
    // What was written before the cut is still there, then the end.
    let mut rest = Vec::new();
    let _ = still.read_to_end(&mut rest).await;
    room.sinks.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_websocket_or_too_long_ends_that_connection_only() {
    let room = Room::open("websocket", |_| {}).await;
    let mut good = room.client("/").await;
    let mut noise = tokio::net::TcpStream::connect(room.address).await.unwrap();
    noise.write_all(&[0x16; 4096]).await.unwrap();
    let mut long: Client = room.client("/").await;
    let _ = long.send(Message::text("x".repeat(1 << 20))).await;
    room.wait_for(|status| status.clients == Some(1)).await;
    room.play(|_| vec![0], 0..3);
    let messages = texts(&mut good, |m| m["number"] == 2).await;
    assert_eq!(messages.len(), 4);
    room.sinks.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_in_use_is_told_and_taken_once_it_is_free() {
    let room = Room::open("websocket", |_| {}).await;
    let second = Room::on("websocket", room.address, |_| {});
    second
        .wait_for(|status| status.state == SinkState::Failing)
        .await;
    let trouble = second.status().trouble;
    assert!(trouble.contains("another `listen`"), "{trouble}");
    room.sinks.stop().await;
    second.wait_until_it_listens().await;
    second.sinks.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn foxglove_gets_what_it_subscribes_to_and_is_told_who_left() {
    let room = Room::open("foxglove", |_| {}).await;
    let refused = connect(room.address, "/", None, &["graphql-ws"]).await;
    assert_eq!(status(refused.unwrap_err()).0, 400);
    for protocol in ["foxglove.websocket.v1", "foxglove.sdk.v1"] {
        let client = connect(room.address, "/", None, &["other", protocol]).await;
        assert_eq!(client.unwrap().1.as_deref(), Some(protocol));
    }
    let client = connect(room.address, "/", None, &["foxglove.sdk.v1"]).await;
    let mut client = client.unwrap().0;
    let greeting = texts(&mut client, |m| m["op"] == "advertise").await;
    assert_eq!(greeting[0]["capabilities"], json!(["time"]));
    let topics: Vec<&Value> = greeting[1]["channels"].as_array().unwrap().iter().collect();
    assert_eq!(topics[0]["topic"], "/scene");
    for wish in [
        json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 1}, {"id": 8, "channelId": 9}]}),
        json!({"op": "getParameters"}),
    ] {
        client.send(Message::text(wish.to_string())).await.unwrap();
    }
    let answers = texts(&mut client, |m| m["level"] == 1).await;
    assert_eq!(answers[0]["level"], 2);
    room.play(|_| vec![0, 1], 0..20);
    room.play(|_| vec![1], 20..22);
    // Opcode, subscription, time, payload: messages of the scene only, the time beside each.
    let messages = binary(&mut client, 44).await;
    let data: Vec<&Vec<u8>> = messages.iter().filter(|m| m[0] == 1).collect();
    assert_eq!(data.len(), 22);
    let times: Vec<&Vec<u8>> = messages.iter().filter(|m| m[0] == 2).collect();
    for (number, (data, time)) in data.iter().zip(&times).enumerate() {
        assert_eq!(data[1..5], 7u32.to_le_bytes());
        assert_eq!(
            data[5..13],
            websocket_room::unix_ns(number as u64).to_le_bytes()
        );
        assert_eq!(data[5..13], time[1..9]);
    }
    // A deletion is field 1 of `SceneUpdate`, an entity field 2.
    let first_field = |data: &[u8]| data[13] >> 3;
    assert_eq!(first_field(data[19]), 2);
    assert_eq!(first_field(data[20]), 1);
    assert_eq!(first_field(data[21]), 2);
    room.sinks.stop().await;
}
