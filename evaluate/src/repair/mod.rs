//! How well joints that no sensor saw are filled in: every model on the same gaps in recordings that taught none of them.
//!
//! A part of the body is hidden for a while, and a model says where it was: live from the poses up to each hidden one, or
//! offline from those after the gap, too. The model runs through [`OcclusionModel`], so that what ships is measured; what
//! the engine adds (how a measured joint comes back without a jump) is not part of it. Everything that is not hidden is
//! known exactly.

mod aims;
mod gaps;
mod motion;
mod riding;
mod score;
mod split;
mod table;
mod trial;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};

use posefuse_fusion::OcclusionModel;
use serde::Serialize;

use crate::aims::Aim;
use crate::parallel::in_parallel;
use gaps::{Gap, gaps};
use motion::Pose;
use score::Score;

pub use gaps::{BodyPart, GAPS_S};
pub use motion::Motion;
pub use riding::Riding;
pub use score::Figures;
pub use split::{Split, Tests};
pub use table::{FIGURES, Figure, rows};

/// Of the poses of a gap so many count as one, but for those at its ends.
const EVERY_POSE: usize = 3;
/// With `quick`: of the poses, and of the gaps.
const QUICK_EVERY_POSE: usize = 6;
const QUICK_EVERY_GAP: usize = 6;

/// A model that is compared.
pub struct Contender {
    /// It.
    pub model: Box<dyn OcclusionModel>,
    /// What it is, in one line.
    pub about: String,
    /// Whether it is one of the simple ones, which the others have to beat.
    pub simple: bool,
    /// Whether it is what runs unless told otherwise, live or offline.
    pub default: bool,
}

/// What is compared on what.
pub struct Trials<'a> {
    /// The recordings.
    pub motions: &'a [Motion],
    /// Fewer gaps and fewer poses of each: for a first look.
    pub quick: bool,
    /// How many models are worked on at once.
    pub threads: usize,
}

/// The result: what scripts get as JSON and what people get as tables or as a page.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// What it is about.
    pub title: String,
    /// What was done, in sentences.
    pub about: Vec<String>,
    /// One for each model.
    pub models: Vec<ModelRun>,
    /// What hidden joints truly do at the seams.
    pub truth: Vec<Figures>,
    /// What is to be reached, and whether it is.
    pub aims: Vec<Aim>,
}

/// One model on all gaps.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModelRun {
    /// Its name.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Whether it knows nothing of what comes after a pose.
    pub live: bool,
    /// See [`Contender`].
    pub simple: bool,
    /// See [`Contender`].
    pub default: bool,
    /// What a pose costs on one core, microseconds.
    pub us_per_pose: Option<f64>,
    /// One for each kind of recording, part of the body and length of gap.
    pub figures: Vec<Figures>,
}

impl RepairReport {
    /// A page that stands by itself: no script, no font, no picture from anywhere else.
    pub fn html(&self) -> String {
        crate::report::repair_html(self)
    }
}

impl ModelRun {
    /// Its figures on these gaps.
    pub fn of(&self, tests: Tests, part: BodyPart, gap_s: f64) -> Option<&Figures> {
        let own = |figures: &&Figures| {
            (figures.tests, figures.part, figures.gap_s) == (tests, part, gap_s)
        };
        self.figures.iter().find(own)
    }
}

/// A kind of gap: in which recordings, which part of the body, and for how long (number in [`GAPS_S`]).
type Kind = (Tests, BodyPart, usize);

/// What is hidden in which poses.
type Cases<'a> = BTreeMap<Kind, Vec<(Gap, &'a [Pose])>>;

impl Trials<'_> {
    /// Lets each model fill every gap. `progress` hears how many models are done; it may be called from several threads.
    pub fn run(
        &self,
        contenders: Vec<Contender>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> RepairReport {
        // Every motion as it is and mirrored.
        let poses: Vec<[Vec<Pose>; 2]> = self
            .motions
            .iter()
            .map(|motion| [motion.poses(false), motion.poses(true)])
            .collect();
        let cases = self.cases(&poses);
        let truth = cases.iter().map(|(kind, cases)| {
            let mut score = Score::default();
            for (gap, poses) in cases {
                trial::truth(poses, gap, &mut score);
            }
            figures(kind, &score)
        });
        let done = AtomicUsize::new(0);
        let contenders: Vec<Mutex<Contender>> = contenders.into_iter().map(Mutex::new).collect();
        let models = in_parallel(contenders.len(), self.threads, &|index| {
            let mut own = contenders[index]
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            let run = self.one(&mut own, &cases);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            run
        });
        RepairReport {
            title: "Joints that no sensor saw".to_owned(),
            about: self.about(),
            aims: aims::check(&models),
            truth: truth.collect(),
            models,
        }
    }

    fn one(&self, contender: &mut Contender, cases: &Cases) -> ModelRun {
        let every = if self.quick {
            QUICK_EVERY_POSE
        } else {
            EVERY_POSE
        };
        let mut all = Score::default();
        let figures = cases.iter().map(|(kind, cases)| {
            let mut score = Score::default();
            for (gap, poses) in cases {
                trial::run(contender.model.as_mut(), poses, gap, every, &mut score);
            }
            all.merge(&score);
            figures(kind, &score)
        });
        let figures = figures.collect();
        ModelRun {
            name: contender.model.name().to_owned(),
            about: contender.about.clone(),
            live: contender.model.needs().after == 0,
            simple: contender.simple,
            default: contender.default,
            us_per_pose: all.busy_s.mean().map(|seconds| seconds * 1e6),
            figures,
        }
    }

    fn cases<'a>(&self, poses: &'a [[Vec<Pose>; 2]]) -> Cases<'a> {
        let every = if self.quick { QUICK_EVERY_GAP } else { 1 };
        let mut cases = Cases::new();
        for tests in Tests::ALL {
            let own: Vec<(usize, &Motion)> = self
                .motions
                .iter()
                .enumerate()
                .filter(|(_, motion)| motion.tests == tests)
                .collect();
            let motions: Vec<&Motion> = own.iter().map(|(_, motion)| *motion).collect();
            for part in BodyPart::ALL {
                for (length, gap_s) in GAPS_S.into_iter().enumerate() {
                    let found = gaps(&motions, part, gap_s, every);
                    let with_poses = found.into_iter().map(|gap| {
                        let [as_is, mirrored] = &poses[own[gap.motion].0];
                        let poses = if gap.mirrored { mirrored } else { as_is };
                        (gap, poses.as_slice())
                    });
                    cases.insert((tests, part, length), with_poses.collect());
                }
            }
        }
        cases
    }

    fn about(&self) -> Vec<String> {
        let told = |tests: Tests| {
            let own = || {
                self.motions
                    .iter()
                    .filter(move |motion| motion.tests == tests)
            };
            let minutes = own().map(Motion::duration_s).sum::<f64>() / 60.0;
            let mut names: Vec<&str> = own().map(|motion| motion.name.as_str()).collect();
            names.dedup();
            format!(
                "{} ({} recordings, {minutes:.1} minutes)",
                tests.name(),
                names.len()
            )
        };
        vec![
            format!(
                "Joints are hidden in {} and in {}; no model was taught with any of them.",
                told(Tests::HeldOut),
                told(Tests::Unseen)
            ),
            "Live models see the poses up to the one they fill in, offline models also those after the gap. All that is not \
             hidden is known exactly."
                .to_owned(),
        ]
    }
}

fn figures((tests, part, length): &Kind, score: &Score) -> Figures {
    Figures::new(*tests, *part, GAPS_S[*length], score)
}

#[cfg(test)]
mod tests;
