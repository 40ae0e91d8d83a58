//! A rig as file formats nest it: each bone with those it carries. A bone that carries none only marks an end.

use nalgebra::Vector3;
use posefuse_kinematics::Rig;

/// The bones of one person by what hangs on what; indices are those of the rig.
pub(super) struct Tree {
    /// For each bone those that it carries.
    pub(super) children: Vec<Vec<usize>>,
    /// The bone that carries all.
    pub(super) root: usize,
}

impl Tree {
    pub(super) fn of(rig: &Rig) -> Self {
        let mut children = vec![Vec::new(); rig.bones.len()];
        for (index, bone) in rig.bones.iter().enumerate() {
            if let Some(parent) = bone.parent {
                children[parent].push(index);
            }
        }
        Self { children, root: 0 }
    }

    /// Whether a bone only marks where the one before it ends: it does not turn.
    pub(super) fn is_end(&self, bone: usize) -> bool {
        self.children[bone].is_empty()
    }
}

/// The origins of all bones in the rest pose, room metres, from the floor below the person.
pub(super) fn rest_origins(rig: &Rig) -> Vec<Vector3<f64>> {
    let mut origins: Vec<Vector3<f64>> = Vec::with_capacity(rig.bones.len());
    for bone in &rig.bones {
        let carrier = bone
            .parent
            .map_or_else(Vector3::zeros, |parent| origins[parent]);
        origins.push(carrier + bone.offset);
    }
    origins
}
