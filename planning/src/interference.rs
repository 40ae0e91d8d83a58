//! Which sensors disturb each other.
//!
//! Patterns of two structured-light sensors on one surface make holes and wrong depth in both (Mallick, Das and
//! Majumdar, "Study of interference noise in multi-Kinect set-up", VISAPP 2014); one that is shaken a little sees its own
//! dots still and the other's blurred (Butler et al., "Shake'n'Sense", CHI 2012). Sensors that measure light's travel time
//! add noise to each other now and then: with two Kinects v2 it comes irregularly and most of the time not at all
//! (Brogli, "Kinect sensor interference measurement", ETH Zurich 2016; Sarbolandi, Lefloch and Kolb, CVIU 2015); Azure
//! Kinects joined by a cable are kept apart by 160 us (Microsoft, "Synchronize multiple Azure Kinect DK devices").
//! Stereo cameras gain by each other's light (Grunnet-Jepsen et al., "Using the Intel RealSense depth cameras D4xx in
//! multi-camera configurations").

use posefuse_skeleton::Position;

use crate::view::slope;
use crate::{Light, View};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// A little noise now and then.
    Mild,
    /// Holes and wrong depth where both light.
    Strong,
}

impl Severity {
    /// Its name, as on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mild => "mild",
            Self::Strong => "strong",
        }
    }
}

/// Two sensors that can disturb each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Interference {
    /// Their numbers in the list of views.
    pub pair: [usize; 2],
    /// How much of the one's view, up to 2 m above the floor, the other lights too.
    pub shares: [f64; 2],
    /// Each looks into the other: stands within 30 degrees of its axis.
    pub facing: bool,
    /// How bad it is.
    pub severity: Severity,
    /// What to do, in words.
    pub advice: String,
}

/// An overlap smaller than this in both views is no trouble.
const SLIGHT: f64 = 0.05;
/// People are not higher, metres.
const CEILING_M: f64 = 2.0;
/// Points along the optical axis, and across.
const STEPS: [usize; 2] = [14, 14];

/// The pairs that can disturb each other, the worst first.
pub(crate) fn interferences(views: &[View]) -> Vec<Interference> {
    let mut found = Vec::new();
    for a in 0..views.len() {
        for b in a + 1..views.len() {
            found.extend(between([&views[a], &views[b]], [a, b]));
        }
    }
    let worst = |i: &Interference| i.shares[0].max(i.shares[1]);
    found.sort_by(|a, b| {
        b.severity
            .cmp(&a.severity)
            .then(worst(b).total_cmp(&worst(a)))
    });
    found
}

fn between(two: [&View; 2], pair: [usize; 2]) -> Option<Interference> {
    let severity = match two.map(|view| view.light) {
        [Light::Structured, Light::Structured] => Severity::Strong,
        [Light::TimeOfFlight, Light::TimeOfFlight] => Severity::Mild,
        _ => return None,
    };
    let shares = [overlap(two[0], two[1]), overlap(two[1], two[0])];
    let facing = [[two[0], two[1]], [two[1], two[0]]]
        .iter()
        .all(|[one, other]| one.stares_at(other.room_from_sensor.origin()));
    if shares.iter().all(|share| *share < SLIGHT) && !facing {
        return None;
    }
    Some(Interference {
        pair,
        shares,
        facing,
        severity,
        advice: advice(two, severity, facing),
    })
}

/// How much of `of`'s view up to the ceiling `by` lights too; each piece of its volume counts alike.
pub(crate) fn overlap(of: &View, by: &View) -> f64 {
    let cone = by.cone();
    let [near, far] = of.range_m;
    let [along, across] = STEPS;
    let middle = |step: usize, steps: usize| (step as f64 + 0.5) / steps as f64;
    let (mut all, mut both) = (0.0, 0.0);
    for depth in (0..along).map(|step| near + middle(step, along) * (far - near)) {
        for right in (0..across).map(|step| 2.0 * middle(step, across) - 1.0) {
            for down in (0..across).map(|step| 2.0 * middle(step, across) - 1.0) {
                let [x, y] = [right * slope(of.view_deg[0]), down * slope(of.view_deg[1])];
                let at = Position::new(x * depth, y * depth, depth);
                let at = of.room_from_sensor.apply(at);
                if !(0.0..=CEILING_M).contains(&at.vector().z) {
                    continue;
                }
                // The cone widens with the distance.
                let volume = depth * depth;
                all += volume;
                if cone.sees(at) {
                    both += volume;
                }
            }
        }
    }
    if all > 0.0 { both / all } else { 0.0 }
}

fn advice(two: [&View; 2], severity: Severity, facing: bool) -> String {
    let azure = two.iter().all(|view| {
        let model = view.model.to_ascii_lowercase();
        model.contains("azure") || model.contains("femto")
    });
    let mut advice = match severity {
        Severity::Strong => "both throw dots on the same surfaces, which makes holes and wrong depth: let them look from \
                             directions at right angles, or shake one of them a little with a small motor"
            .to_owned(),
        Severity::Mild if azure => "light of the one adds noise to the other unless a sync cable keeps their pulses at \
                                    least 160 us apart"
            .to_owned(),
        Severity::Mild => {
            "light of the one adds noise to the other now and then; mostly it is not seen".to_owned()
        }
    };
    if facing {
        advice.push_str("; they shine into each other, so turn or raise one of them");
    }
    advice
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::coverage::tests::view_of;

    fn view(model: &str, from: [f64; 3], target: [f64; 3]) -> View {
        view_of(Model::of(model).unwrap(), model, from, target)
    }

    #[test]
    fn a_sensor_lies_wholly_in_its_own_view_and_not_at_all_in_one_behind() {
        let a = view("Xtion", [0.0, 0.0, 1.0], [3.0, 0.0, 1.0]);
        assert_eq!(overlap(&a, &a), 1.0);
        let behind = view("Xtion", [0.0, 0.0, 1.0], [-3.0, 0.0, 1.0]);
        assert_eq!(overlap(&a, &behind), 0.0);
        assert_eq!(interferences(&[a, behind]), []);
    }

    #[test]
    fn structured_light_is_strong_travel_time_mild_and_stereo_nothing() {
        let pair = |model: &str| {
            let a = view(model, [-2.0, 0.0, 1.2], [0.0, 0.0, 0.9]);
            let b = view(model, [0.0, -2.0, 1.2], [0.0, 0.0, 0.9]);
            interferences(&[a, b])
        };
        let strong = &pair("Kinect v1")[0];
        assert_eq!((strong.severity, strong.facing), (Severity::Strong, false));
        assert!(
            strong.shares.iter().all(|share| (0.1..0.9).contains(share)),
            "{strong:?}"
        );
        assert!(
            (strong.shares[0] - strong.shares[1]).abs() < 0.02,
            "alike from both sides"
        );
        assert_eq!(pair("Kinect v2")[0].severity, Severity::Mild);
        assert!(pair("Azure Kinect")[0].advice.contains("160 us"));
        assert_eq!(pair("RealSense D455"), []);
    }

    #[test]
    fn sensors_that_look_at_each_other_are_told() {
        let a = view("Kinect v2", [-4.0, 0.0, 1.2], [4.0, 0.0, 1.2]);
        let b = view("Kinect v2", [4.0, 0.0, 1.2], [-4.0, 0.0, 1.2]);
        let found = interferences(&[a, b]);
        assert!(found[0].facing && found[0].advice.contains("into each other"));
    }
}
