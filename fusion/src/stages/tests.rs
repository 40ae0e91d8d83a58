use nalgebra::Vector3;
use posefuse_skeleton::{
    Confidence, Joint, JointState, Position, SensorId, SensorSet, Skeleton, Track,
};

use super::*;

const PERIOD_NS: i64 = 33_333_333;

fn frame(index: i64, people: &[(u64, Skeleton<posefuse_skeleton::Room>)]) -> RoomFrame {
    let track = |(id, skeleton): &(u64, Skeleton<_>)| Track {
        id: TrackId(*id),
        since: Timestamp::ZERO,
        sensors: SensorSet::EMPTY,
        skeleton: skeleton.clone(),
        hands: [None; 2],
    };
    RoomFrame {
        number: 0,
        time: Timestamp::from_ns(index * PERIOD_NS),
        look_ahead_ns: 0,
        tracks: people.iter().map(track).collect(),
    }
}

fn skeleton(joints: &[(Joint, Vector3<f64>)]) -> Skeleton<posefuse_skeleton::Room> {
    let sensor = SensorId::new(0).unwrap();
    let state = |p: &Vector3<f64>| {
        JointState::measured(Position::from_vector(*p), 0.01, Confidence::FULL, sensor)
    };
    joints.iter().map(|(joint, p)| (*joint, state(p))).collect()
}

fn head(z: f64) -> Skeleton<posefuse_skeleton::Room> {
    skeleton(&[(Joint::Head, Vector3::new(0.0, 0.0, z))])
}

fn smooth(filter: SmoothFilter) -> SmoothConfig {
    SmoothConfig {
        filter,
        ..SmoothConfig::default()
    }
}

const FILTERS: [SmoothFilter; 3] = [
    SmoothFilter::SavitzkyGolay,
    SmoothFilter::OneEuro,
    SmoothFilter::Holt,
];

fn collect(pipeline: &mut Pipeline, frames: impl IntoIterator<Item = RoomFrame>) -> Vec<RoomFrame> {
    let mut out = Vec::new();
    for frame in frames {
        pipeline.push(frame, &mut |frame| out.push(frame));
    }
    pipeline.flush(&mut |frame| out.push(frame));
    out
}

/// Noise that repeats, about 1 cm.
fn noise(index: i64) -> f64 {
    ((index * 7919 % 17) as f64 / 8.0 - 1.0) * 0.01
}

#[test]
fn every_filter_gives_every_frame_once_with_its_own_time_and_less_noise() {
    for filter in FILTERS {
        let mut pipeline = Pipeline::new(&[Stage::Smooth(smooth(filter))]);
        let out = collect(
            &mut pipeline,
            (0..120).map(|i| frame(i, &[(1, head(1.7 + noise(i)))])),
        );
        let times: Vec<i64> = out.iter().map(|f| f.time.ns() / PERIOD_NS).collect();
        assert_eq!(times, (0..120).collect::<Vec<_>>(), "{filter:?}");
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            let squares: Vec<f64> = values.map(|v| v * v).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let raw = rms(&mut (20..120).map(noise));
        let left = rms(&mut out[20..].iter().map(|f| {
            f.tracks[0]
                .skeleton
                .position(Joint::Head)
                .unwrap()
                .vector()
                .z
                - 1.7
        }));
        assert!(left < 0.8 * raw, "{filter:?}: {left} of {raw}");
    }
}

#[test]
fn every_filter_follows_a_steady_walk() {
    for filter in FILTERS {
        let mut pipeline = Pipeline::new(&[Stage::Smooth(smooth(filter))]);
        let walk = |i: i64| i as f64 * 0.04;
        let out = collect(
            &mut pipeline,
            (0..90).map(|i| frame(i, &[(1, head(walk(i)))])),
        );
        for (i, f) in out.iter().enumerate().skip(60) {
            let lag_m = walk(i as i64)
                - f.tracks[0]
                    .skeleton
                    .position(Joint::Head)
                    .unwrap()
                    .vector()
                    .z;
            assert!(lag_m.abs() < 0.05, "{filter:?} lags {lag_m} m at 1.2 m/s");
        }
    }
}

#[test]
fn filters_restart_after_a_gap_in_time_or_in_the_joint() {
    for filter in FILTERS {
        let mut pipeline = Pipeline::new(&[Stage::Smooth(smooth(filter))]);
        let first = (0..10).map(|i| frame(i, &[(1, head(0.0))]));
        let after_pause = (40..50).map(|i| frame(i, &[(1, head(2.0))]));
        let unseen = (50..53).map(|i| frame(i, &[(1, skeleton(&[]))]));
        let back = (53..60).map(|i| frame(i, &[(1, head(5.0))]));
        let gone = (60..62).map(|i| frame(i, &[]));
        let again = (62..66).map(|i| frame(i, &[(1, head(9.0))]));
        let all = first
            .chain(after_pause)
            .chain(unseen)
            .chain(back)
            .chain(gone)
            .chain(again);
        let out = collect(&mut pipeline, all);
        for f in &out {
            let index = f.time.ns() / PERIOD_NS;
            let expected = match index {
                0..=9 => 0.0,
                10..=49 => 2.0,
                50..=59 => 5.0,
                _ => 9.0,
            };
            if let Some(z) = f
                .tracks
                .first()
                .and_then(|t| t.skeleton.position(Joint::Head))
            {
                assert!(
                    (z.vector().z - expected).abs() < 1e-9,
                    "{filter:?} frame {index}: {z:?}"
                );
            }
        }
        assert_eq!(out.len(), 10 + 10 + 3 + 7 + 2 + 4);
    }
}

#[test]
fn look_aheads_add_up_and_a_switched_off_stage_has_none() {
    let mut config = crate::Config::default();
    assert_eq!(config.look_ahead_frames(), 1);
    config.stages.push(Stage::Smooth(SmoothConfig {
        look_ahead: 3,
        ..SmoothConfig::default()
    }));
    assert_eq!(config.look_ahead_frames(), 4);
    let mut pipeline = Pipeline::new(&config.stages);
    let mut given = 0;
    for i in 0..10 {
        pipeline.push(frame(i, &[(1, head(1.0))]), &mut |_| given += 1);
    }
    assert_eq!(given, 7, "the stages' own look-ahead only");
    config
        .stages
        .iter_mut()
        .for_each(|stage| stage.set_enabled(false));
    assert_eq!(config.look_ahead_frames(), 1, "fusing's own");
    config.fuse.look_ahead = 0;
    assert_eq!(config.look_ahead_frames(), 0);
}

#[test]
fn bones_learn_a_length_and_draw_outliers_towards_it() {
    let mut pipeline = Pipeline::new(&[Stage::Bones(BonesConfig::default())]);
    let arm = |length: f64| {
        skeleton(&[
            (Joint::ElbowLeft, Vector3::new(0.0, 0.0, 1.0)),
            (Joint::WristLeft, Vector3::new(length, 0.0, 1.0)),
        ])
    };
    let mut frames: Vec<RoomFrame> = (0..100)
        .map(|i| frame(i, &[(1, arm(0.25 + noise(i)))]))
        .collect();
    frames.push(frame(100, &[(1, arm(0.31))]));
    let out = collect(&mut pipeline, frames);
    let length = |f: &RoomFrame| {
        let joint = |j| f.tracks[0].skeleton.position(j).unwrap();
        joint(Joint::ElbowLeft).distance(joint(Joint::WristLeft))
    };
    let spread = |from: usize| {
        out[from..100]
            .iter()
            .map(|f| (length(f) - 0.25).abs())
            .sum::<f64>()
            / (100 - from) as f64
    };
    let raw = (40..100).map(|i| noise(i).abs()).sum::<f64>() / 60.0;
    assert!(spread(40) < 0.7 * raw, "{} of {raw}", spread(40));
    assert!(length(&out[100]) < 0.295, "{}", length(&out[100]));
}

#[test]
fn what_is_remembered_of_people_goes_with_them() {
    let mut pipeline = Pipeline::new(&Stage::shipped());
    for id in 0..50 {
        pipeline.push(frame(id, &[(id as u64, head(1.0))]), &mut |_| {});
        pipeline.retain(&[TrackId(id as u64)]);
    }
    for stage in &pipeline.stages {
        let people = match stage {
            RoomStage::Bones(bones) => bones.people(),
            RoomStage::Smooth(smooth) => smooth.people(),
        };
        assert_eq!(people, 1);
    }
}
