use proptest::prelude::*;

use super::*;

fn sensor(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

fn sighting(index: usize, position: [f64; 3], confidence: f64) -> Sighting {
    let angle = index as f64;
    Sighting {
        sensor: sensor(index),
        position: position.into(),
        confidence,
        origin: Vector3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.5),
        age_s: 0.0,
    }
}

fn config(method: FuseMethod) -> FuseConfig {
    FuseConfig {
        method,
        ..FuseConfig::default()
    }
}

const METHODS: [FuseMethod; 2] = [FuseMethod::Average, FuseMethod::Weighted];

#[test]
fn average_drops_guesses_while_anyone_is_sure() {
    let seen = [
        sighting(0, [0.0, 0.0, 1.0], 1.0),
        sighting(1, [1.0, 0.0, 1.0], 0.5),
    ];
    let fused = fuse(&seen, &config(FuseMethod::Average)).unwrap();
    assert_eq!(fused.position, Vector3::new(0.0, 0.0, 1.0));
    assert_eq!(
        fused.provenance,
        Provenance::Measured(SensorSet::only(sensor(0)))
    );
    let fused = fuse(&seen[1..], &config(FuseMethod::Average)).unwrap();
    assert_eq!(
        fused.provenance,
        Provenance::Predicted(SensorSet::only(sensor(1)))
    );
}

#[test]
fn weighted_trusts_the_nearer_sensor_more() {
    let mut near = sighting(0, [0.0, 0.0, 1.0], 1.0);
    let mut far = sighting(1, [0.0, 0.1, 1.0], 1.0);
    near.origin = Vector3::new(-2.0, 0.0, 1.0);
    far.origin = Vector3::new(-6.0, 0.0, 1.0);
    let fused = fuse(&[near, far], &config(FuseMethod::Weighted)).unwrap();
    assert!(fused.position.y < 0.05, "{:?}", fused.position);
}

proptest! {
    #[test]
    fn laws(
        seen in prop::collection::vec(([-2.0..2.0f64, -2.0..2.0, 0.0..2.0], 0.0..=1.0f64), 1..6),
        shift in [-5.0..5.0f64, -5.0..5.0, -5.0..5.0],
        turn in -3.0..3.0f64,
    ) {
        let seen: Vec<Sighting> = seen.into_iter().enumerate().map(|(i, (p, c))| sighting(i, p, c)).collect();
        let room = nalgebra::Isometry3::new(shift.into(), Vector3::z() * turn);
        for method in METHODS {
            let config = config(method);
            let fused = fuse(&seen, &config).unwrap();
            prop_assert!(fused.position.iter().all(|c| c.is_finite()));
            prop_assert!(fused.covariance.cholesky().is_some(), "covariance is not positive");

            let mut other_way = seen.clone();
            other_way.reverse();
            let reversed = fuse(&other_way, &config).unwrap();
            prop_assert!((reversed.position - fused.position).norm() < 1e-9);

            let moved: Vec<Sighting> = seen.iter().map(|s| Sighting {
                position: room.transform_point(&s.position.into()).coords,
                origin: room.transform_point(&s.origin.into()).coords,
                ..*s
            }).collect();
            let there = fuse(&moved, &config).unwrap();
            let expected = room.transform_point(&fused.position.into()).coords;
            prop_assert!((there.position - expected).norm() < 1e-9);

            let twice: Vec<Sighting> = seen.iter().flat_map(|s| [*s, *s]).collect();
            let doubled = fuse(&twice, &config).unwrap();
            prop_assert!((doubled.position - fused.position).norm() < 1e-9);
            prop_assert!((doubled.confidence - fused.confidence).abs() < 1e-9);
            prop_assert!((doubled.covariance * 2.0 - fused.covariance).norm() < 1e-9);
        }
    }
}
