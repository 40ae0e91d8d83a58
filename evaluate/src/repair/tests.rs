//! Gaps are where they should be, windows tell nothing that is hidden, and a known model gets a known figure.

use std::ops::Range;

use nalgebra::Vector3;
use posefuse_fusion::{Fill, ModelError, Needs, Window};
use posefuse_simulator::motion::{Cast, Clip, Performance};
use posefuse_skeleton::{Joint, JointMap};

use super::*;

/// Where it was last seen, a little higher; looks at no more than it should.
struct Raised {
    by_m: f64,
    after: usize,
}

impl OcclusionModel for Raised {
    fn name(&self) -> &str {
        "raised"
    }

    fn needs(&self) -> Needs {
        Needs {
            before: 45,
            after: self.after,
            rate_hz: 30.0,
        }
    }

    fn fill(
        &mut self,
        window: &Window,
        wanted: Range<usize>,
    ) -> Result<Vec<JointMap<Fill>>, ModelError> {
        assert_eq!(wanted.start, 45);
        assert!(self.after > 0 || window.poses.len() == 46);
        let fill = |index: usize| {
            let pose = &window.poses[index];
            let hidden = Joint::ALL
                .into_iter()
                .filter(|j| pose[*j as usize].weight < 1.0);
            hidden
                .map(|joint| {
                    let known = &pose[joint as usize];
                    let before = window.poses[index - 1][joint as usize];
                    assert!(before.weight == 1.0 || before.position == known.position);
                    let fill = Fill {
                        position: known.position + Vector3::z() * self.by_m,
                        sigma_m: 10.0,
                        rotation: None,
                    };
                    (joint, fill)
                })
                .collect()
        };
        Ok(wanted.map(fill).collect())
    }
}

fn motions(still: bool) -> Vec<Motion> {
    let performance = Performance::procedural(Cast {
        seed: 4,
        people: 1,
        area_m: 3.0,
        hugs: false,
        situation: posefuse_simulator::Situation::Everyday,
        away_s: 1.0,
    });
    let pose = |index: usize| performance.pose(0, if still { 3.0 } else { index as f64 / 60.0 });
    let frames = (0..600).map(pose).collect();
    let clip = Clip::new("walk", 60.0, frames).unwrap();
    let mut motions = Motion::of(clip.clone(), "a/walk.bvh", Tests::HeldOut);
    motions.extend(Motion::of(clip, "b/walk.bvh", Tests::Unseen));
    motions
}

fn report(by_m: f64, still: bool) -> RepairReport {
    let motions = motions(still);
    assert_eq!(motions.len(), 2, "nothing in it jumps");
    let trials = Trials {
        motions: &motions,
        quick: false,
        threads: 2,
    };
    let contender = |after: usize, simple: bool, by_m: f64| Contender {
        model: Box::new(Raised { by_m, after }),
        about: String::new(),
        simple,
        default: !simple,
    };
    let contenders = vec![
        contender(0, true, 2.0 * by_m),
        contender(0, false, by_m),
        contender(20, true, 2.0 * by_m),
    ];
    trials.run(contenders, &|_| {})
}

#[test]
fn a_known_fault_gives_a_known_figure() {
    let report = report(0.05, true);
    for model in &report.models {
        let by_mm = if model.simple { 100.0 } else { 50.0 };
        assert_eq!(model.figures.len(), 32);
        for found in &model.figures {
            assert!(found.gaps > 3, "{found:?}");
            assert!((found.mean_mm.unwrap() - by_mm).abs() < 1e-6, "{found:?}");
            assert!((found.p95_mm.unwrap() - by_mm).abs() < 0.6);
            // One step of 5 cm up or down is in both triples.
            let step = by_mm * 1e-3 * 900.0;
            assert!(
                (found.entering_mps2.unwrap() - step).abs() < 1e-6,
                "{found:?}"
            );
            assert!(
                (found.leaving_mps2.unwrap() - step).abs() < 1e-6,
                "{found:?}"
            );
            assert_eq!((found.within, found.filled), (Some(1.0), Some(1.0)));
            // Bones within the part stay as they are, the one to the body does not.
            assert!((1.0..by_mm).contains(&found.bones_mm.unwrap()), "{found:?}");
        }
    }
    let still = |f: &Figures| f.entering_mps2 == Some(0.0) && f.leaving_mps2 == Some(0.0);
    assert!(report.truth.iter().all(still));
    // Half of the simple method's error; of the offline ones none is more than simple.
    assert_eq!(report.aims.len(), 24);
    assert!(
        report
            .aims
            .iter()
            .all(|aim| aim.met && (aim.value.unwrap() - 0.5).abs() < 1e-9)
    );
}

#[test]
fn longer_gaps_are_harder_and_everything_is_told() {
    let report = report(0.0, false);
    let model = &report.models[0];
    for part in BodyPart::ALL {
        let error = |gap_s| {
            model
                .of(Tests::HeldOut, part, gap_s)
                .unwrap()
                .mean_mm
                .unwrap()
        };
        assert!(2.0 * error(0.2) < error(1.0), "{part:?}");
    }
    assert!(report.truth.iter().all(|f| f.entering_mps2.unwrap() > 0.0));
    let rows = rows(&report, Tests::Unseen, &FIGURES[3]);
    assert_eq!(rows.len(), 2 + 3 + 1);
    assert!(rows.iter().all(|row| row.len() == 17));
    assert!(rows[4][0].contains("offline") && rows[5][0] == "(truth)");
    let again = self::report(0.0, false);
    assert_eq!(again.models[2].figures, report.models[2].figures);
}

#[test]
fn against_a_person_who_only_turns_and_walks_nothing_is_lost_by_riding_along() {
    let still = &motions(true)[0].poses(false)[0];
    let turned = |index: usize| {
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), index as f64 * 0.02);
        let walk = Vector3::new(0.03 * index as f64, 0.0, 0.0);
        let joints = Joint::ALL.into_iter().map(|joint| {
            let at = turn * still[joint as usize] + walk;
            (joint, posefuse_skeleton::Position::from_vector(at))
        });
        joints.collect()
    };
    let clip = Clip::new("x", 30.0, (0..200).map(turned).collect()).unwrap();
    let trials = Trials {
        motions: &Motion::of(clip, "x", Tests::Unseen),
        quick: true,
        threads: 1,
    };
    let contenders = Riding::ALL.map(|model| Contender {
        model: Box::new(model),
        about: model.about().to_owned(),
        simple: true,
        default: false,
    });
    for model in &trials.run(contenders.into(), &|_| {}).models {
        for part in BodyPart::ALL {
            let found = model.of(Tests::Unseen, part, 2.0).unwrap();
            assert!(found.mean_mm.unwrap() < 1e-6, "{} {found:?}", model.name);
        }
    }
}

#[test]
fn a_jump_and_a_stretched_bone_cut_a_recording() {
    let clip = |fault: &dyn Fn(
        usize,
        &mut JointMap<posefuse_skeleton::Position<posefuse_skeleton::Room>>,
    )| {
        let still = motions(true);
        let poses = still[0].poses(false);
        let frames = (0..150).map(|index| {
            let mut joints = Joint::ALL
                .into_iter()
                .map(|j| {
                    (
                        j,
                        posefuse_skeleton::Position::from_vector(poses[0][j as usize]),
                    )
                })
                .collect();
            fault(index, &mut joints);
            joints
        });
        let clip = Clip::new("x", 30.0, frames.collect()).unwrap();
        let cut = Motion::of(clip, "x", Tests::Unseen);
        cut.iter().map(Motion::count).collect::<Vec<_>>()
    };
    let up = Vector3::z();
    assert_eq!(clip(&|_, _| {}), [150]);
    let jumped = clip(&|index, joints| {
        if index >= 60 {
            *joints = joints.map(|_, at| at.moved(up));
        }
    });
    assert_eq!(jumped, [60, 90]);
    let stretched = clip(&|index, joints| {
        if (100..104).contains(&index) {
            joints[Joint::HandLeft] = joints[Joint::HandLeft].map(|at| at.moved(up * 0.3));
        }
    });
    assert_eq!(stretched, [100, 46]);
    let missing = clip(&|index, joints| {
        if index == 40 {
            joints[Joint::Head] = None;
        }
    });
    assert_eq!(missing, [40, 109]);
}
