//! What a perfect observer would know of the sensors: which joints each truly sees, with how much noise, and which
//! part of the error no sensor can see.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Sensor};

use super::noise::{Biases, body_axes, definitions, interference, is_other_model, white_sigma_m};
use super::occlusion::{Flesh, across};
use super::{JOINTS_TO_HOLD, Seen, Sight};
use crate::world::{TruePerson, World};

impl World {
    /// For each person, in order of their ids, the joints that sensor `index` truly sees at `seconds`: in view and not
    /// hidden. With each comes the covariance of the sensor's white and slow noise there, room axes, m^2. Nobody is
    /// seen of whom too little is in sight for a tracker to hold on to.
    ///
    /// # Panics
    /// If `index` is not below [`World::sensor_count`].
    pub fn sightings(&self, index: usize, seconds: f64) -> Vec<JointMap<Matrix3<f64>>> {
        let room_from_sensor = self.room_from_sensor(index);
        let sensor_from_room = room_from_sensor.inverse();
        let errors = &self.scenario().errors;
        let people: Vec<JointMap<Position<Sensor>>> = self
            .truth(seconds)
            .iter()
            .map(|person| person.joints.map(|_, p| sensor_from_room.apply(*p)))
            .collect();
        let desk = Flesh::desk(self.scenario(), index, &sensor_from_room);
        let flesh: Vec<Flesh> = people.iter().map(Flesh::new).chain(desk).collect();
        let seen = |(person, joints): (usize, &JointMap<Position<Sensor>>)| {
            let sight = Sight::of(joints, &flesh, person, errors);
            if sight.clear() < JOINTS_TO_HOLD.min(joints.len()) {
                return JointMap::empty();
            }
            joints.filter_map(|joint, position| {
                let clearly = sight.0[joint] == Some(Seen::Clearly);
                clearly.then(|| {
                    let covariance = self.noise_covariance(index, position.vector());
                    room_from_sensor.rotate_covariance(&covariance)
                })
            })
        };
        people.iter().enumerate().map(seen).collect()
    }

    /// White and slow noise together of a joint at `at` in the sensor's frame, m^2, its axes.
    fn noise_covariance(&self, index: usize, at: Vector3<f64>) -> Matrix3<f64> {
        let errors = &self.scenario().errors;
        let (lateral, axial) = white_sigma_m(at.z);
        let scale = errors.white_noise * (1.0 + interference(self.scenario(), index as u64));
        let slow_lateral = errors.correlated_lateral_mm * 1e-3;
        let slow_axial = errors.correlated_axial_mm * 1e-3 * at.z / 3.0;
        let across_ray = (lateral * scale).powi(2) + slow_lateral.powi(2);
        let along_ray = (axial * scale).powi(2) + slow_axial.powi(2);
        let ahead = at.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        let (right, down) = across(ahead);
        (right * right.transpose() + down * down.transpose()) * across_ray
            + ahead * ahead.transpose() * along_ray
    }

    /// Everybody as all trackers together take them to be: displaced by the bias of the body, which is the same for
    /// every sensor and so cannot be seen by any. Like [`World::truth`] otherwise.
    pub fn reported_truth(&self, seconds: f64) -> Vec<TruePerson> {
        let mut people = self.truth(seconds);
        let errors = &self.scenario().errors;
        if errors.body_bias_mm == 0.0 {
            return people;
        }
        let count = self.performance().people();
        let biases = Biases::new(self.scenario().seed, 0, count, errors);
        for person in &mut people {
            let axes = body_axes(&person.joints);
            let Some(bias) = biases.body.get(person.id as usize - 1) else {
                continue;
            };
            person.joints = person
                .joints
                .map(|joint, position| position.moved(axes * bias[joint as usize]));
        }
        people
    }

    /// Whether sensor `index` is of another model, with its own idea of the joints.
    pub fn is_other_model(&self, index: usize) -> bool {
        is_other_model(self.scenario(), index)
    }

    /// Where every joint truly lies from what trackers of the other model call by its name, metres, local axes: what a
    /// perfect calibration of a mixed room would find.
    pub fn true_joint_offsets_m(&self) -> JointMap<Vector3<f64>> {
        let offsets = definitions(self.scenario());
        Joint::ALL
            .into_iter()
            .map(|joint| (joint, -offsets[joint as usize]))
            .collect()
    }

    /// How far towards its sensor every joint is truly reported, metres: what a perfect calibration would find.
    pub fn true_ray_bias_m(&self) -> JointMap<f64> {
        let biases = Biases::new(self.scenario().seed, 0, 0, &self.scenario().errors);
        Joint::ALL
            .into_iter()
            .map(|joint| (joint, biases.ray[joint as usize]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Scenario, SensorErrors, SimSensor};

    #[test]
    fn noise_is_as_large_as_it_is_said_to_be() {
        let world = Arc::new(
            World::new(&Scenario {
                sensors: 1,
                errors: SensorErrors {
                    white_noise: 1.0,
                    correlated_lateral_mm: 6.0,
                    correlated_axial_mm: 10.0,
                    ..SensorErrors::none()
                },
                ..Scenario::default()
            })
            .unwrap(),
        );
        let mut sensor = SimSensor::new(Arc::clone(&world), 0);
        let (mut found, mut said) = (0.0, 0.0);
        for _ in 0..600 {
            let frame = sensor.next_frame();
            let seconds = frame.at_ns as f64 * 1e-9;
            let truth = &world.truth(seconds)[0];
            let sightings = &world.sightings(0, seconds)[0];
            for (joint, covariance) in sightings.iter() {
                let raw = frame.bodies[0].joints[joint as usize].unwrap();
                let at = world.room_from_sensor(0).apply(raw.position);
                found += (at.vector() - truth.joints[joint].unwrap().vector()).norm_squared();
                said += covariance.trace();
            }
        }
        let ratio = found / said;
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }

    #[test]
    fn perfectly_placed_sensors_differ_from_the_truth_by_what_is_called_reported() {
        let errors = SensorErrors {
            body_bias_mm: 10.0,
            ray_bias_mm: 15.0,
            ray_bias_spread_mm: 6.0,
            ..SensorErrors::none()
        };
        let world = Arc::new(
            World::new(&Scenario {
                people: 2,
                errors,
                ..Scenario::default()
            })
            .unwrap(),
        );
        let mut sensor = SimSensor::new(Arc::clone(&world), 1);
        let frame = sensor.next_frame();
        let reported = world.reported_truth(frame.at_ns as f64 * 1e-9);
        let towards = world.true_ray_bias_m();
        for (body, person) in frame.bodies.iter().zip(&reported) {
            for (raw, joint) in body.joints.iter().zip(Joint::ALL) {
                let expected = world
                    .room_from_sensor(1)
                    .inverse()
                    .apply(person.joints[joint].unwrap());
                let found = raw.unwrap().position;
                let moved = found.moved(found.vector().normalize() * towards[joint].unwrap());
                assert!(moved.distance(expected) < 1e-3, "{joint}");
            }
        }
    }
}
