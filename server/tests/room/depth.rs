//! Depth previews: asked for while somebody watches, checked, never in the way of frames.

use std::time::Duration;

use posefuse_proto::v1::{self, SensorState};
use tonic::{Code, Streaming};

use crate::fixture::{Agent, Server, assert_refused, hello, person, start, status_when};

const CAMERA: v1::CameraInfo = v1::CameraInfo {
    fov_horizontal_deg: 57.0,
    fov_vertical_deg: 43.0,
    near_m: 0.5,
    far_m: 4.5,
    depth_preview: true,
};

async fn join(server: &Server, name: &str, run_id: u64, camera: Option<v1::CameraInfo>) -> Agent {
    let hello = v1::Hello {
        camera,
        ..hello(name, run_id)
    };
    Agent::join(server.address, hello).await.unwrap()
}

/// An image of 4 x 3 pixels, all so far away.
fn preview(millimetres: u16) -> v1::DepthPreview {
    v1::DepthPreview {
        sensor: "an agent cannot say who it is here".to_owned(),
        captured_ns: i64::from(millimetres),
        width: 4,
        height: 3,
        millimetres: millimetres.to_le_bytes().repeat(12),
        camera: Some(v1::Intrinsics {
            fx: 4.0,
            fy: 4.0,
            cx: 1.5,
            cy: 1.0,
        }),
        bodies: vec![person(0.0)],
    }
}

async fn watch(server: &Server, sensor: &str, max_rate_hz: f64) -> Streaming<v1::DepthPreview> {
    let request = v1::WatchDepthRequest {
        sensor: sensor.to_owned(),
        max_rate_hz,
        more_sensors: Vec::new(),
    };
    let mut room = server.room().await;
    room.watch_depth(request).await.unwrap().into_inner()
}

async fn next(stream: &mut Streaming<v1::DepthPreview>) -> v1::DepthPreview {
    let message = tokio::time::timeout(Duration::from_secs(5), stream.message());
    message.await.unwrap().unwrap().unwrap()
}

#[tokio::test]
async fn an_agent_is_asked_for_previews_only_while_somebody_watches_and_for_as_many_as_the_keenest()
{
    let server = start().await;
    let mut agent = join(&server, "left", 1, Some(CAMERA)).await;
    assert_eq!(*agent.previews_hz.borrow(), 0.0);
    let mut slow = watch(&server, "left", 2.0).await;
    agent.asked(2.0).await;
    let mut keen = watch(&server, "left", 5000.0).await;
    agent.asked(10.0).await;

    agent.preview(preview(1234)).await;
    for stream in [&mut slow, &mut keen] {
        let seen = next(stream).await;
        assert_eq!((seen.sensor.as_str(), seen.captured_ns), ("left", 1234));
        assert_eq!(seen.millimetres, preview(1234).millimetres);
        assert_eq!(seen.bodies[0].positions.len(), 75);
    }
    drop(keen);
    agent.asked(2.0).await;
    // A frame on the slow stream lets the server see that its reader is gone.
    drop(slow);
    agent.asked(0.0).await;
    server.stop().await;
}

#[tokio::test]
async fn a_slow_watcher_gets_the_newest_only_and_each_its_own_rate() {
    let server = start().await;
    let mut agent = join(&server, "left", 1, Some(CAMERA)).await;
    let mut slow = watch(&server, "left", 2.0).await;
    let mut quick = watch(&server, "left", 0.0).await;
    agent.asked(10.0).await;
    let sent = 20;
    for number in 0..sent {
        agent.preview(preview(1000 + number)).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    agent.frame(0, vec![person(0.0)]).await;
    let count = async |stream: &mut Streaming<v1::DepthPreview>| {
        let mut seen = 0;
        while tokio::time::timeout(Duration::from_millis(300), stream.message())
            .await
            .is_ok()
        {
            seen += 1;
        }
        seen
    };
    let (slow, quick) = (count(&mut slow).await, count(&mut quick).await);
    assert!((3..=6).contains(&slow), "{slow} of {sent} at 2 Hz in 2 s");
    assert!(quick >= 15, "{quick} of {sent}");
    server.stop().await;
}

#[tokio::test]
async fn previews_that_are_none_are_refused_counted_and_named_and_frames_go_on() {
    let server = start().await;
    let mut room = server.room().await;
    let mut agent = join(&server, "left", 1, Some(CAMERA)).await;
    let mut watcher = watch(&server, "left", 0.0).await;
    agent.asked(10.0).await;
    let mut body_of_24 = person(0.0);
    body_of_24.positions.truncate(72);
    let nonsense = [
        v1::DepthPreview {
            width: 0,
            ..preview(1)
        },
        v1::DepthPreview {
            width: 5000,
            height: 5000,
            ..preview(1)
        },
        v1::DepthPreview {
            width: u32::MAX,
            height: u32::MAX,
            ..preview(1)
        },
        v1::DepthPreview {
            width: 5,
            ..preview(1)
        },
        v1::DepthPreview {
            camera: None,
            ..preview(1)
        },
        v1::DepthPreview {
            camera: Some(v1::Intrinsics::default()),
            ..preview(1)
        },
        v1::DepthPreview {
            bodies: vec![body_of_24],
            ..preview(1)
        },
    ];
    let count = nonsense.len() as u64;
    for (number, wrong) in nonsense.into_iter().enumerate() {
        // More than ten a second would be left out unseen.
        tokio::time::sleep(Duration::from_millis(120)).await;
        agent.preview(wrong).await;
        agent.frame(number as u64, vec![person(0.0)]).await;
    }
    tokio::time::sleep(Duration::from_millis(120)).await;
    agent.preview(preview(777)).await;
    assert_eq!(
        next(&mut watcher).await.captured_ns,
        777,
        "only the good one"
    );
    let status = status_when(&mut room, |status| {
        status.sensors[0].rejected.get("bad-preview") == Some(&count)
    })
    .await;
    let sensor = &status.sensors[0];
    assert_eq!(sensor.frames_received, count);
    assert!(
        sensor.trouble.contains("depth preview"),
        "{}",
        sensor.trouble
    );
    server.stop().await;
}

#[tokio::test]
async fn who_has_no_previews_says_why_and_a_stream_outlives_its_agent() {
    let server = start().await;
    let mut room = server.room().await;
    let _plain = join(&server, "plain", 1, None).await;
    let mut ask = async |sensor: &str| {
        let request = v1::WatchDepthRequest {
            sensor: sensor.to_owned(),
            ..v1::WatchDepthRequest::default()
        };
        room.watch_depth(request).await
    };
    assert_refused(
        ask("plain").await,
        Code::FailedPrecondition,
        &["`plain`", "Kinect v2", "no depth images"],
    );
    assert_refused(ask("nobody").await, Code::NotFound, &["`nobody`"]);

    let mut agent = join(&server, "left", 1, Some(CAMERA)).await;
    let mut watcher = watch(&server, "left", 4.0).await;
    agent.asked(4.0).await;
    drop(agent);
    let mut room = server.room().await;
    status_when(&mut room, |status| {
        status.sensors[1].state() == SensorState::Disconnected
    })
    .await;
    let mut again = join(&server, "left", 1, Some(CAMERA)).await;
    again.asked(4.0).await;
    again.preview(preview(42)).await;
    assert_eq!(next(&mut watcher).await.captured_ns, 42);

    // An agent of the same name that has none ends it.
    drop(again);
    status_when(&mut room, |status| {
        status.sensors[1].state() == SensorState::Disconnected
    })
    .await;
    let _blind = join(&server, "left", 2, None).await;
    let end = watcher.message().await;
    assert_refused(end, Code::FailedPrecondition, &["`left`"]);
    server.stop().await;
}

#[tokio::test]
async fn several_sensors_come_on_one_stream_and_one_without_previews_is_named() {
    let server = start().await;
    let mut left = join(&server, "left", 1, Some(CAMERA)).await;
    let mut right = join(&server, "right", 1, Some(CAMERA)).await;
    let _plain = join(&server, "plain", 1, None).await;
    let mut room = server.room().await;
    let mut ask = async |more: &[&str]| {
        let request = v1::WatchDepthRequest {
            sensor: "left".to_owned(),
            max_rate_hz: 3.0,
            more_sensors: more.iter().map(|name| (*name).to_owned()).collect(),
        };
        room.watch_depth(request).await
    };
    assert_refused(
        ask(&["right", "plain"]).await,
        Code::FailedPrecondition,
        &["`plain`"],
    );
    let mut both = ask(&["right", "left"]).await.unwrap().into_inner();
    left.asked(3.0).await;
    right.asked(3.0).await;
    left.preview(preview(1)).await;
    right.preview(preview(2)).await;
    let mut seen = [next(&mut both).await, next(&mut both).await].map(|p| p.sensor);
    seen.sort();
    assert_eq!(seen, ["left", "right"]);
    drop(both);
    left.asked(0.0).await;
    right.asked(0.0).await;
    server.stop().await;
}

#[tokio::test]
async fn what_the_camera_sees_is_what_its_agent_says() {
    let server = start().await;
    let mut room = server.room().await;
    let _told = join(&server, "a-told", 1, Some(CAMERA)).await;
    let _table = join(&server, "b-table", 1, None).await;
    let half = v1::CameraInfo {
        fov_horizontal_deg: -1.0,
        far_m: f64::NAN,
        depth_preview: false,
        ..CAMERA
    };
    let _half = join(&server, "c-half", 1, Some(half)).await;
    let status = status_when(&mut room, |status| status.sensors.len() == 3).await;
    let view = |index: usize| {
        let s = &status.sensors[index];
        [s.fov_horizontal_deg, s.fov_vertical_deg, s.near_m, s.far_m]
    };
    assert_eq!(view(0), [57.0, 43.0, 0.5, 4.5]);
    assert_eq!(view(1), [70.6, 60.0, 0.5, 4.5]);
    assert_eq!(view(2), view(1), "what cannot be is taken from the model");
    let previews = [0, 1, 2].map(|index| status.sensors[index].depth_preview);
    assert_eq!(previews, [true, false, false]);
    server.stop().await;
}
