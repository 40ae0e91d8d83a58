//! What is wrong with a sensor, each source with its own switch.

use serde::{Deserialize, Serialize};

use crate::scenario::{ScenarioError, check};

/// The error sources. 0 or `false` switches one off, and leaves the random numbers of the others as they were.
///
/// Lateral is across the ray from the sensor, axial along it. "Per axis" figures are standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorErrors {
    /// White noise as a multiple of Nguyen et al. (2012): lateral 1.5 * 0.8 * z / 585 m per axis, axial
    /// 0.0012 + 0.0019 (z - 0.4)^2 m.
    pub white_noise: f64,
    /// Slow noise across the ray, per axis.
    pub correlated_lateral_mm: f64,
    /// Slow noise along the ray at 3 m; grows in proportion to the distance.
    pub correlated_axial_mm: f64,
    /// How long the slow noise remembers: time constant of the first-order process.
    pub correlated_tau_s: f64,
    /// Where a tracker takes a joint to be in the body, per axis and joint: the same for all sensors.
    pub body_bias_mm: f64,
    /// How far towards the sensor a joint is reported (the skin is seen): mean over the joints.
    pub ray_bias_mm: f64,
    /// How much that differs from joint to joint.
    pub ray_bias_spread_mm: f64,
    /// What one sensor adds to that on its own, per axis and joint.
    pub sensor_bias_mm: f64,
    /// How far the joints of trackers of another model lie from where the usual ones take them, per axis of the joint's
    /// local axes: the same for all sensors of that model ([`Scenario::other_models`](crate::Scenario)).
    pub definition_mm: f64,
    /// Whether bodies hide joints: the own one and those of others.
    pub occlusion: bool,
    /// Error of a hidden joint per axis; it adds up down the chain of hidden joints.
    pub hidden_error_mm: f64,
    /// How long that error remembers.
    pub hidden_tau_s: f64,
    /// Share of hidden joints that are reported with full confidence all the same.
    pub overconfident: f64,
    /// Whether joints outside of 57 x 43 degrees, or out of range, are missing.
    pub field_of_view: bool,
    /// Joints that jump by 10 to 30 cm for 3 to 15 frames with full confidence: how many per second.
    pub spikes_per_s: f64,
    /// Probability that left and right are swapped when a person shows the sensor their back.
    pub swaps: f64,
    /// Whether a swap may take only the arms or only the legs, and shakes them.
    pub imperfect_swaps: bool,
    /// The clock's offset is anywhere up to this, either way.
    pub clock_offset_ms: f64,
    /// The clock's drift is anywhere up to this, either way.
    pub clock_drift_ppm: f64,
    /// Jitter of the time stamps, standard deviation.
    pub clock_jitter_ms: f64,
    /// Time from the capture to the agent.
    pub delay_ms: f64,
    /// How much longer it may take, standard deviation (one-sided).
    pub delay_jitter_ms: f64,
    /// Share of frames that never arrive.
    pub drops: f64,
    /// Share of frames that repeat the bodies of the one before.
    pub stale: f64,
    /// How often a minute, 0 to 6, frames are held up on their way and then come all at once.
    pub bursts_per_min: f64,
    /// For how long they are held up.
    pub burst_ms: f64,
    /// How often a minute, 0 to 6, nothing is captured for a while.
    pub gaps_per_min: f64,
    /// For how long.
    pub gap_ms: f64,
    /// Share of frames that come after the one that was captured after them.
    pub reordered: f64,
    /// How often a minute, 0 to 6, the tracker takes a piece of furniture for somebody who sits, for 2 to 5 s. Each
    /// sensor has its own piece, which stands still at the edge of the area.
    pub furniture_per_min: f64,
    /// Whether there is a mirror, 1.2 m wide and 2 m high, in the room: who sees somebody in it takes that for
    /// somebody behind it.
    pub mirror: bool,
    /// Growth of the white noise of a structured-light sensor with each other one in the room; a twentieth of the
    /// growth is the share of joints lost.
    pub interference: f64,
}

impl Default for SensorErrors {
    /// The figures that the project's method comparison was made with.
    fn default() -> Self {
        Self {
            white_noise: 1.0,
            correlated_lateral_mm: 6.0,
            correlated_axial_mm: 10.0,
            correlated_tau_s: 0.4,
            body_bias_mm: 10.0,
            ray_bias_mm: 15.0,
            ray_bias_spread_mm: 6.0,
            definition_mm: 30.0,
            occlusion: true,
            hidden_error_mm: 90.0,
            hidden_tau_s: 0.5,
            overconfident: 0.2,
            field_of_view: true,
            spikes_per_s: 0.15,
            swaps: 0.7,
            clock_offset_ms: 50.0,
            clock_drift_ppm: 50.0,
            clock_jitter_ms: 2.0,
            delay_ms: 15.0,
            delay_jitter_ms: 3.0,
            drops: 0.02,
            interference: 0.35,
            ..Self::none()
        }
    }
}

impl SensorErrors {
    /// Perfect sensors: every joint of everybody, exactly, at once, by a true clock.
    pub fn none() -> Self {
        Self {
            white_noise: 0.0,
            correlated_lateral_mm: 0.0,
            correlated_axial_mm: 0.0,
            correlated_tau_s: 0.4,
            body_bias_mm: 0.0,
            ray_bias_mm: 0.0,
            ray_bias_spread_mm: 0.0,
            sensor_bias_mm: 0.0,
            definition_mm: 0.0,
            occlusion: false,
            hidden_error_mm: 0.0,
            hidden_tau_s: 0.5,
            overconfident: 0.0,
            field_of_view: false,
            spikes_per_s: 0.0,
            swaps: 0.0,
            imperfect_swaps: false,
            clock_offset_ms: 0.0,
            clock_drift_ppm: 0.0,
            clock_jitter_ms: 0.0,
            delay_ms: 0.0,
            delay_jitter_ms: 0.0,
            drops: 0.0,
            stale: 0.0,
            bursts_per_min: 0.0,
            burst_ms: 250.0,
            gaps_per_min: 0.0,
            gap_ms: 600.0,
            reordered: 0.0,
            furniture_per_min: 0.0,
            mirror: false,
            interference: 0.0,
        }
    }

    /// The default figures and everything else that real rooms add: biases of single sensors, imperfect swaps,
    /// stale frames.
    pub fn harsh() -> Self {
        Self {
            sensor_bias_mm: 8.0,
            imperfect_swaps: true,
            stale: 0.06,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ScenarioError> {
        let sizes = [
            ("errors.white_noise", self.white_noise),
            ("errors.correlated_lateral_mm", self.correlated_lateral_mm),
            ("errors.correlated_axial_mm", self.correlated_axial_mm),
            ("errors.body_bias_mm", self.body_bias_mm),
            ("errors.ray_bias_mm", self.ray_bias_mm),
            ("errors.ray_bias_spread_mm", self.ray_bias_spread_mm),
            ("errors.sensor_bias_mm", self.sensor_bias_mm),
            ("errors.definition_mm", self.definition_mm),
            ("errors.hidden_error_mm", self.hidden_error_mm),
            ("errors.spikes_per_s", self.spikes_per_s),
            ("errors.clock_offset_ms", self.clock_offset_ms),
            ("errors.clock_drift_ppm", self.clock_drift_ppm),
            ("errors.clock_jitter_ms", self.clock_jitter_ms),
            ("errors.delay_ms", self.delay_ms),
            ("errors.delay_jitter_ms", self.delay_jitter_ms),
            ("errors.interference", self.interference),
        ];
        for (field, size) in sizes {
            check(
                (0.0..=1e5).contains(&size),
                field,
                "0 (off) to 100000",
                size,
            )?;
        }
        let times = [
            ("errors.correlated_tau_s", self.correlated_tau_s),
            ("errors.hidden_tau_s", self.hidden_tau_s),
        ];
        for (field, time) in times {
            check(
                (0.001..=1000.0).contains(&time),
                field,
                "0.001 to 1000 (seconds)",
                time,
            )?;
        }
        let spells = [
            ("errors.burst_ms", self.burst_ms),
            ("errors.gap_ms", self.gap_ms),
        ];
        for (field, length) in spells {
            check(
                (1.0..=5000.0).contains(&length),
                field,
                "1 to 5000 (milliseconds)",
                length,
            )?;
        }
        let rates = [
            ("errors.bursts_per_min", self.bursts_per_min),
            ("errors.gaps_per_min", self.gaps_per_min),
            ("errors.furniture_per_min", self.furniture_per_min),
        ];
        for (field, rate) in rates {
            check((0.0..=6.0).contains(&rate), field, "0 (off) to 6", rate)?;
        }
        let shares = [
            ("errors.overconfident", self.overconfident),
            ("errors.swaps", self.swaps),
            ("errors.drops", self.drops),
            ("errors.stale", self.stale),
            ("errors.reordered", self.reordered),
        ];
        for (field, share) in shares {
            check((0.0..=1.0).contains(&share), field, "0 (off) to 1", share)?;
        }
        Ok(())
    }
}
