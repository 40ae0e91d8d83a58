//! Planning over the wire: before calibration, with the room's own sensors, and what is refused.

use posefuse_proto::v1::{self, PlanRoomRequest, PlannedSensor, Vector3};
use tonic::Code;

use crate::fixture::{assert_refused, calibrated, start};

fn sensor(name: &str, model: &str, position: [f64; 3], looks_at: [f64; 3]) -> PlannedSensor {
    let [position, looks_at] = [position, looks_at].map(|[x, y, z]| Some(Vector3 { x, y, z }));
    PlannedSensor {
        name: name.to_owned(),
        model: model.to_owned(),
        position,
        looks_at,
    }
}

#[tokio::test]
async fn a_room_is_planned_before_there_is_anything_in_it() {
    let server = start().await;
    let mut room = server.room().await;
    let empty = room.plan_room(PlanRoomRequest::default()).await.unwrap();
    let empty = empty.into_inner();
    assert!(empty.sensors.is_empty() && empty.notes[0].contains("calibrate"));
    assert!(empty.models.iter().any(|model| model == "Kinect v2"));

    let request = PlanRoomRequest {
        suggest_model: "Kinect v2".to_owned(),
        place: 3,
        ..PlanRoomRequest::default()
    };
    let plan = room.plan_room(request).await.unwrap().into_inner();
    assert_eq!(plan.sensors.len(), 3);
    let cells = (plan.columns * plan.rows) as usize;
    let whole = plan.whole.as_ref().unwrap();
    assert!(
        plan.layers
            .iter()
            .chain([whole])
            .all(|l| l.counts.len() == cells)
    );
    let two = whole.counts.iter().filter(|count| **count >= 2).count();
    assert!((whole.shares[1] - two as f64 / cells as f64).abs() < 1e-12);
    let next = plan.suggestion.unwrap();
    assert_eq!(next.two_before, whole.shares[1]);
    assert!(next.two_after > next.two_before && next.words.contains("Kinect v2"));
    server.stop().await;
}

#[tokio::test]
async fn the_room_s_own_sensors_count_and_planned_ones_beside_them() {
    let server = start().await;
    let mut room = server.room().await;
    let _left = server.agent("left").await;
    calibrated(&mut room, &["left", "away"]).await;
    let request = PlanRoomRequest {
        planned: vec![
            sensor("k1", "Kinect v1", [3.0, -2.0, 1.2], [2.0, 0.0, 0.9]),
            sensor("k2", "Xtion", [3.0, 2.0, 1.8], [2.0, 0.0, 0.9]),
        ],
        ..PlanRoomRequest::default()
    };
    let plan = room.plan_room(request.clone()).await.unwrap().into_inner();
    let names: Vec<_> = plan
        .sensors
        .iter()
        .map(|s| (s.name.as_str(), s.planned))
        .collect();
    assert_eq!(
        names,
        [("away", false), ("left", false), ("k1", true), ("k2", true)]
    );
    let assumed: Vec<_> = plan.sensors.iter().map(|s| s.assumed).collect();
    assert_eq!(
        assumed,
        [true, false, false, false],
        "nobody has said what `away` is"
    );
    let strong: Vec<_> = plan
        .interferences
        .iter()
        .filter(|i| i.severity == "strong")
        .collect();
    assert_eq!(strong.len(), 1);
    assert_eq!((strong[0].a.as_str(), strong[0].b.as_str()), ("k1", "k2"));

    let alone = PlanRoomRequest {
        planned_only: true,
        ..request
    };
    let alone = room.plan_room(alone).await.unwrap().into_inner();
    assert_eq!(alone.sensors.len(), 2);
    server.stop().await;
}

#[tokio::test]
async fn whoever_changes_a_plan_quickly_gets_every_answer() {
    let server = start().await;
    let asked = (1..=6).map(async |place| {
        let request = PlanRoomRequest {
            suggest_model: "Kinect v2".to_owned(),
            place,
            ..PlanRoomRequest::default()
        };
        let plan = server.room().await.plan_room(request).await.unwrap();
        plan.into_inner().sensors.len()
    });
    let placed = futures_util::future::join_all(asked).await;
    assert_eq!(placed, [1, 2, 3, 4, 5, 6]);
    server.stop().await;
}

#[tokio::test]
async fn what_cannot_be_planned_is_refused_with_the_reason() {
    let server = start().await;
    let mut room = server.room().await;
    let good = || sensor("a", "Kinect v2", [0.0, 0.0, 1.0], [2.0, 0.0, 1.0]);
    let with = |planned: Vec<PlannedSensor>| PlanRoomRequest {
        planned,
        ..PlanRoomRequest::default()
    };
    let mut refused = async |request: PlanRoomRequest, says: &[&str]| {
        assert_refused(room.plan_room(request).await, Code::InvalidArgument, says);
    };
    let mut odd = good();
    odd.model = "Kinect v9".to_owned();
    refused(with(vec![odd]), &["`Kinect v9`", "Kinect v2"]).await;
    refused(with(vec![good(), good()]), &["two sensors", "`a`"]).await;
    let mut stuck = good();
    stuck.looks_at = stuck.position;
    refused(with(vec![stuck]), &["`a`", "two places"]).await;
    let mut far = good();
    far.position = Some(Vector3 {
        x: f64::NAN,
        y: 0.0,
        z: 0.0,
    });
    refused(with(vec![far]), &["`position`"]).await;
    refused(with(vec![good(); 33]), &["33", "32"]).await;
    let flat = PlanRoomRequest {
        area: Some(v1::PlanArea {
            min_x: 0.0,
            max_x: 0.0,
            min_y: 0.0,
            max_y: 4.0,
        }),
        ..PlanRoomRequest::default()
    };
    refused(flat, &["0.5 to 50 m"]).await;
    server.stop().await;
}
