//! Ways to make bodies: what ships, and each of its functions off by itself.

use posefuse_kinematics::{Config, LookAt, Start};

/// The name of people as they were fused, without a body.
pub const AS_FUSED: &str = "as fused";
/// The name of what ships.
pub const SHIPS: &str = "ships";

/// A way to make a body of a fused person.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Short, unique.
    pub name: String,
    /// What it is, in one line.
    pub about: String,
    /// What the solver is told; `None` leaves people as they were fused.
    pub config: Option<Config>,
}

/// A name, what it is, and what it changes in what ships.
type Change = (&'static str, &'static str, fn(&mut Config));

const CHANGES: [Change; 15] = [
    ("bones", "bone by bone instead of the fit", |c| {
        c.fit.enabled = false;
    }),
    (
        "from-skeleton",
        "the fit begins at the fused skeleton (Menard's other way), not at the frame before",
        |c| c.fit.start = Start::Skeleton,
    ),
    ("no-robust", "far joints count in full", |c| {
        c.fit.robust = false;
    }),
    (
        "no-steady",
        "weights follow covariances at once, however they jump",
        |c| c.fit.steady_s = 0.0,
    ),
    ("no-sudden", "joints may change their speed at once", |c| {
        c.fit.sudden_dps2 = 0.0;
        c.fit.sudden_mps2 = 0.0;
    }),
    ("no-limits", "no anatomical ranges", |c| {
        c.limits.enabled = false;
    }),
    ("no-hold", "straight limbs keep no twist", |c| {
        c.hold.enabled = false;
    }),
    ("no-feet", "feet are not kept still", |c| {
        c.feet.enabled = false;
    }),
    ("no-hands", "hands have no state", |c| {
        c.hands.enabled = false;
    }),
    ("no-spine", "the spine bends in one place", |c| {
        c.extra.spine = false;
    }),
    ("no-clavicles", "stiff shoulders", |c| {
        c.extra.clavicles = false;
    }),
    ("no-fingers", "stiff fingers", |c| c.extra.fingers = false),
    ("no-toes", "stiff toes", |c| c.extra.toes = false),
    (
        "look-auto",
        "the head turns to hands, near or far; off in what ships",
        |c| c.look.at = LookAt::Auto,
    ),
    (
        "look-nod",
        "the same with up to 30 degrees of nodding",
        |c| {
            c.look.at = LookAt::Auto;
            c.look.nod_deg = 30.0;
        },
    ),
];

/// All variants: the people as fused first, then what ships, then each of its functions by itself off or otherwise.
pub fn variants() -> Vec<Variant> {
    let variant = |name: &str, about: &str, config| Variant {
        name: name.to_owned(),
        about: about.to_owned(),
        config,
    };
    let first = [
        variant(AS_FUSED, "positions as fused, no body", None),
        variant(
            SHIPS,
            "the fit with all that is on by default",
            Some(Config::default()),
        ),
    ];
    let changed = CHANGES.into_iter().map(|(name, about, change)| {
        let mut config = Config::default();
        change(&mut config);
        variant(name, about, Some(config))
    });
    first.into_iter().chain(changed).collect()
}
