//! What the fit may turn: one freedom per axis, in an order in which what carries comes first.

use nalgebra::{UnitQuaternion, Vector3};

use crate::bones::{ARMS, BONE_COUNT, BONES, HIPS, LEGS, SPINE};
use crate::config::ExtraConfig;
use crate::posture::{Posture, TURNS, Turn};

/// Stands for "nothing".
pub(super) const NONE: usize = usize::MAX;
/// At least as many as there are freedoms with everything on (49).
pub(super) const MOST: usize = 52;

/// One way in which the body can move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Freedom {
    /// The bone that moves, with all that it carries.
    pub(super) bone: usize,
    /// Which of the root's coordinates, of a ball's own axes, or of the bone's hinges.
    pub(super) index: usize,
    /// Whether it moves the root along instead of turning about an axis.
    pub(super) shifts: bool,
    /// The next freedom that carries it, or [`NONE`].
    pub(super) carrier: usize,
}

/// All freedoms of a body: a tree, carriers first.
#[derive(Clone, Debug)]
pub(super) struct Freedoms {
    pub(super) list: Vec<Freedom>,
    /// For each bone its first freedom that turns it, or [`NONE`].
    pub(super) first: [usize; BONE_COUNT],
}

impl Freedoms {
    /// Those that the configuration leaves.
    pub(super) fn new(extra: &ExtraConfig) -> Self {
        let mut list: Vec<Freedom> = Vec::with_capacity(MOST);
        let mut push = |bone, index, shifts, carrier: &mut usize| {
            list.push(Freedom {
                bone,
                index,
                shifts,
                carrier: *carrier,
            });
            *carrier = list.len() - 1;
        };
        let mut first = [NONE; BONE_COUNT];
        // Of each bone the last freedom that moves it.
        let mut last = [NONE; BONE_COUNT];
        for axis in 0..3 {
            push(HIPS, axis, true, &mut last[HIPS]);
        }
        for bone in 0..BONE_COUNT {
            let mut carrier = match bone {
                HIPS => last[HIPS],
                _ => last[BONES[bone].parent],
            };
            let before = carrier;
            let turns = match TURNS[bone] {
                Turn::Ball => 3,
                Turn::Hinges(hinges) if is_free(bone, extra) => hinges.len(),
                _ => 0,
            };
            for index in 0..turns {
                push(bone, index, false, &mut carrier);
                if index == 0 {
                    first[bone] = carrier;
                }
            }
            debug_assert!(turns > 0 || carrier == before);
            last[bone] = carrier;
        }
        Self { list, first }
    }

    /// The posture moved by `step` (metres, radians), one number per freedom.
    pub(super) fn moved(&self, posture: &Posture, step: &[f64; MOST]) -> Posture {
        let mut moved = posture.clone();
        for (freedom, step) in self.list.iter().zip(step) {
            if freedom.shifts {
                moved.root[freedom.index] += step;
            } else if let Turn::Hinges(_) = TURNS[freedom.bone] {
                moved.angles[freedom.bone][freedom.index] += step;
            }
        }
        for (bone, turn) in TURNS.iter().enumerate() {
            if matches!(turn, Turn::Ball) {
                let at = self.first[bone];
                let turn = Vector3::new(step[at], step[at + 1], step[at + 2]);
                let turned = moved.balls[bone] * UnitQuaternion::from_scaled_axis(turn);
                moved.balls[bone] = UnitQuaternion::new_normalize(turned.into_inner());
            }
        }
        moved
    }
}

/// Toes are never fitted: nothing is seen of them. They follow from the floor.
fn is_free(bone: usize, extra: &ExtraConfig) -> bool {
    let of_arms =
        |wanted: fn(&crate::bones::ArmBones) -> usize| ARMS.iter().any(|arm| wanted(arm) == bone);
    if bone == SPINE {
        extra.spine
    } else if of_arms(|arm| arm.clavicle) {
        extra.clavicles
    } else if of_arms(|arm| arm.fingers) {
        extra.fingers
    } else {
        LEGS.iter().all(|leg| leg.toes != bone)
    }
}
