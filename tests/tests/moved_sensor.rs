//! A sensor is moved while the room works: it is named, it can be calibrated anew alone, and never while a take runs. The
//! real server and agents in simulated time.

use std::time::Duration;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_proto::v1;
use posefuse_skeleton::SensorId;
use posefuse_tests::account::sensor;
use posefuse_tests::simulated::{Lab, Plan, sensor_name};
use tonic::Code;

const S: Duration = Duration::from_secs(1);
/// Which sensor is moved.
const MOVED: usize = 1;

fn lab(seed: u64) -> Lab {
    let mut plan = Plan::new(seed, 4);
    plan.rate_hz = 15.0;
    plan.tick = Duration::from_millis(5);
    Lab::new(&plan)
}

/// 4 cm to its right and 1 degree about its vertical.
fn bump() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.04, 0.0, 0.0),
        UnitQuaternion::from_scaled_axis(Vector3::y() * 1_f64.to_radians()),
    )
}

fn recalibrate(lab: &mut Lab, dry_run: bool) -> v1::CalibrateResult {
    let request = v1::RecalibrateSensorRequest {
        sensor: sensor_name(MOVED),
        dry_run,
    };
    lab.ask(|mut room| Box::pin(async move { room.recalibrate_sensor(request).await }))
}

fn alarms(lab: &mut Lab) -> Vec<String> {
    let status = lab.status();
    let alarmed = |sensor: &&v1::SensorStatus| sensor.drift.is_some_and(|drift| drift.alarm);
    let name = |sensor: &v1::SensorStatus| sensor.info.clone().unwrap_or_default().name;
    status.sensors.iter().filter(alarmed).map(name).collect()
}

/// Where the calibration in force puts each sensor.
fn places(lab: &mut Lab) -> Vec<(String, Vector3<f64>)> {
    let calibration = lab.ask(|mut room| {
        Box::pin(async move { room.get_calibration(v1::GetCalibrationRequest {}).await })
    });
    let place = |pose: v1::SensorPose| {
        let at = pose.room_from_sensor?.translation?;
        Some((pose.sensor, Vector3::new(at.x, at.y, at.z)))
    };
    calibration.sensors.into_iter().filter_map(place).collect()
}

#[test]
fn a_moved_sensor_is_named_and_calibrated_anew_alone_but_not_while_a_take_runs() {
    let mut lab = lab(3);
    lab.start_agents(170.0);
    lab.run_for(60 * S);
    assert_eq!(alarms(&mut lab), [""; 0], "nobody has moved anything");

    lab.start_take("bumped");
    lab.move_sensor(MOVED, bump());
    let began = lab.now();
    while alarms(&mut lab).is_empty() {
        assert!(lab.now() - began < 15 * S, "not named within 15 s");
        lab.run_for(S);
    }
    println!("named after {:?}", lab.now() - began);
    assert_eq!(alarms(&mut lab), [sensor_name(MOVED)]);
    lab.run_for(15 * S);
    assert_eq!(alarms(&mut lab), [sensor_name(MOVED)], "and nobody else");
    let status = lab.status();
    let trouble = &sensor(&status, &sensor_name(MOVED)).trouble;
    assert!(
        trouble.contains("has moved by") && trouble.contains("posefuse calibrate --sensor cam2"),
        "{trouble}"
    );

    let before = places(&mut lab);
    let request = v1::RecalibrateSensorRequest {
        sensor: sensor_name(MOVED),
        dry_run: false,
    };
    let refused =
        lab.ask_in_vain(|mut room| Box::pin(async move { room.recalibrate_sensor(request).await }));
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(
        refused.message().contains("a take is being recorded"),
        "{refused:?}"
    );
    lab.stop_take();
    let events: Vec<_> = lab.take("bumped").events().map(Result::unwrap).collect();
    let moved = events.iter().find(|event| event.kind == "sensor-moved");
    assert_eq!(moved.expect("the take says it").sensor, sensor_name(MOVED));

    let dry = recalibrate(&mut lab, true);
    assert!(dry.calibration.is_some() && !dry.in_force, "{dry:?}");
    assert_eq!(places(&mut lab), before, "a dry run changes nothing");
    let result = recalibrate(&mut lab, false);
    assert_ne!(
        result.verdict(),
        v1::Verdict::Failed,
        "{:?}",
        result.reasons
    );
    assert!(result.in_force);
    for ((name, before), (_, after)) in before.iter().zip(places(&mut lab)) {
        let moved_mm = (before - after).norm() * 1e3;
        if *name == sensor_name(MOVED) {
            assert!((15.0..70.0).contains(&moved_mm), "{name} by {moved_mm} mm");
        } else {
            assert_eq!(moved_mm, 0.0, "{name} stays");
        }
    }
    lab.run_for(30 * S);
    assert_eq!(alarms(&mut lab), [""; 0], "all is well again");
}

#[test]
fn a_muted_sensor_says_so_and_stays_muted_when_its_agent_comes_back() {
    let mut lab = lab(4);
    lab.start_agents(20.0);
    lab.run_for(5 * S);
    let mute = |sensor: &str, muted: bool| v1::MuteSensorRequest {
        sensor: sensor.to_owned(),
        muted,
    };
    let unknown = mute("door", true);
    let refused =
        lab.ask_in_vain(|mut room| Box::pin(async move { room.mute_sensor(unknown).await }));
    assert_eq!(refused.code(), Code::NotFound);
    assert!(refused.message().contains("`cam1`"), "{refused:?}");

    lab.start_take("muted");
    let request = mute(&sensor_name(0), true);
    lab.ask(|mut room| Box::pin(async move { room.mute_sensor(request).await }));
    lab.run_for(2 * S);
    lab.partition(0);
    lab.run_for(3 * S);
    lab.repair(0);
    lab.run_for(3 * S);
    let status = lab.status();
    assert!(sensor(&status, &sensor_name(0)).muted);
    assert!(!sensor(&status, &sensor_name(1)).muted);
    lab.stop_take();
    let info = sensor(&status, &sensor_name(0)).info.clone();
    let number = info.expect("its greeting").id as usize;
    let last = lab
        .take("muted")
        .frames()
        .map(Result::unwrap)
        .last()
        .expect("frames");
    let muted = SensorId::new(number).expect("a number");
    assert!(
        last.tracks
            .iter()
            .all(|track| !track.sensors.contains(muted)),
        "its frames are still fused"
    );

    let request = mute(&sensor_name(0), false);
    lab.ask(|mut room| Box::pin(async move { room.mute_sensor(request).await }));
    let status = lab.status();
    assert!(!sensor(&status, &sensor_name(0)).muted);
}
