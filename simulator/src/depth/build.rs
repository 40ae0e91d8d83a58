//! How a person is built and dressed: what of their looks does not follow from their bones.

use crate::random::{Purpose, Stream};

/// Shares are of an average person's; lengths are metres for somebody 1.75 m tall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Build {
    /// Girth of the trunk.
    pub trunk: f64,
    /// Breadth of chest and shoulders, beside the bones.
    pub chest: f64,
    /// Girth of arms and legs.
    pub limbs: f64,
    /// Size of the head.
    pub head: f64,
    /// How far the belly stands out.
    pub belly_m: f64,
    /// How far the breast stands out.
    pub breast_m: f64,
    /// Thickness of what is worn over trunk and arms.
    pub coat_m: f64,
    /// The same for the legs.
    pub trousers_m: f64,
    /// How much wider than the leg trousers are at the ankle.
    pub flare_m: f64,
    /// A skirt: how much of the way to the ankles it covers.
    pub skirt: Option<f64>,
    /// Thickness of the hair.
    pub hair_m: f64,
    /// How far it falls below the neck.
    pub long_hair_m: f64,
    /// Share of pixels that dark hair swallows.
    pub hair_holes: f64,
    /// How thick soles are.
    pub soles_m: f64,
    /// Size of the hands.
    pub hand: f64,
    /// How far the fingers of an open hand point apart: the outer ones from straight ahead, radians.
    pub fingers_apart: f64,
    /// How far they are bent at each joint, radians: an open hand is hardly ever flat.
    pub fingers_bent: f64,
    /// How loose a closed hand is: 0 clenched, 1 barely closed.
    pub fist_loose: f64,
}

impl Default for Build {
    fn default() -> Self {
        Self {
            trunk: 1.0,
            chest: 1.0,
            limbs: 1.0,
            head: 1.0,
            belly_m: 0.0,
            breast_m: 0.0,
            coat_m: 0.005,
            trousers_m: 0.005,
            flare_m: 0.0,
            skirt: None,
            hair_m: 0.012,
            long_hair_m: 0.0,
            hair_holes: 0.3,
            soles_m: 0.01,
            hand: 1.0,
            fingers_apart: 0.15,
            fingers_bent: 0.15,
            fist_loose: 0.2,
        }
    }
}

impl Build {
    /// Person number `person` of `seed`: thin or heavy, broad or narrow, in tight or wide clothes.
    pub fn seeded(seed: u64, person: usize) -> Self {
        let mut stream = Stream::new(seed, Purpose::Build, &[person as u64]);
        let mut about = |mean: f64, deviation: f64, low: f64, high: f64| {
            (mean + deviation * stream.normal()).clamp(low, high)
        };
        let weight = about(0.0, 1.0, -1.6, 2.4);
        let mut build = Self {
            trunk: 1.0 + 0.1 * weight + about(0.0, 0.03, -0.06, 0.06),
            chest: 1.0 + 0.04 * weight + about(0.0, 0.05, -0.1, 0.1),
            limbs: 1.0 + 0.08 * weight + about(0.0, 0.06, -0.1, 0.15),
            head: about(1.0, 0.04, 0.92, 1.08),
            belly_m: (0.02 * weight + about(0.0, 0.015, -0.02, 0.04)).clamp(0.0, 0.09),
            breast_m: about(0.0, 0.025, 0.0, 0.06),
            coat_m: about(0.008, 0.01, 0.0, 0.035),
            trousers_m: about(0.008, 0.008, 0.0, 0.03),
            flare_m: about(0.01, 0.015, 0.0, 0.05),
            hair_m: about(0.015, 0.01, 0.0, 0.045),
            soles_m: about(0.012, 0.008, 0.0, 0.03),
            ..Self::default()
        };
        if stream.chance(0.14) {
            build.skirt = Some(stream.between(0.35, 0.9));
        }
        if stream.chance(0.3) {
            build.long_hair_m = stream.between(0.02, 0.25);
        }
        if stream.chance(0.6) {
            build.hair_holes = stream.between(0.05, 0.9);
        }
        build.hand = (1.0 + 0.05 * stream.normal()).clamp(0.88, 1.14);
        build.fingers_apart = stream.between(0.0, 0.35);
        build.fingers_bent = stream.between(0.0, 0.55);
        build.fist_loose = stream.uniform() * stream.uniform();
        build
    }
}

/// Whether the left and the right hand of person `person` of `seed` are closed at `seconds`: each opens and closes now and
/// then, every 1.2 to 4 s, and is closed a third of the time.
pub fn hands_closed(seed: u64, person: usize, seconds: f64) -> [bool; 2] {
    [0, 1].map(|side| {
        let mut habits = Stream::new(seed, Purpose::Grip, &[person as u64, side]);
        let every = habits.between(1.2, 4.0);
        let spell = (seconds / every + habits.uniform()).floor();
        let tags = [person as u64, side, 1, spell as i64 as u64];
        Stream::new(seed, Purpose::Grip, &tags).chance(1.0 / 3.0)
    })
}

/// How far person `person` of `seed` has the head turned left at `seconds`, radians; joints do not tell.
pub(super) fn head_turn(seed: u64, person: usize, seconds: f64) -> f64 {
    let mut habits = Stream::new(seed, Purpose::Grip, &[person as u64, 2]);
    let mut turn = 0.0;
    for hz in [0.11, 0.23] {
        let phase = habits.uniform();
        turn += 0.22 * (std::f64::consts::TAU * (hz * seconds + phase)).sin();
    }
    turn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_differ_and_stay_themselves() {
        assert_eq!(Build::seeded(3, 0), Build::seeded(3, 0));
        let trunks: Vec<f64> = (0..40).map(|i| Build::seeded(3, i).trunk).collect();
        let (low, high) = trunks
            .iter()
            .fold((9.0f64, 0.0f64), |(l, h), t| (l.min(*t), h.max(*t)));
        assert!(low < 0.92 && high > 1.12, "{low} {high}");
    }

    #[test]
    fn hands_are_closed_a_third_of_the_time_and_for_more_than_a_moment() {
        let states: Vec<[bool; 2]> = (0..60_000)
            .map(|i| hands_closed(5, i / 3000, (i % 3000) as f64 / 30.0))
            .collect();
        let closed = states.iter().filter(|state| state[0]).count() as f64 / 60_000.0;
        assert!((0.25..0.42).contains(&closed), "{closed}");
        let changes = states.windows(2).filter(|w| w[0][1] != w[1][1]).count();
        assert!((200..1100).contains(&changes), "{changes}");
    }
}
