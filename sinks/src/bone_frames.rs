//! A person's bones as a tree of frames: for viewers and robots that know frames rather than skeletons.

use posefuse_kinematics::Figure;
use posefuse_proto::foxglove::{Child, ROOM, entity_id};

/// All bones, parents first, e.g. `person-1/Hips` in the room and `person-1/Spine` in that.
pub(crate) fn bones_of(figure: &Figure) -> impl Iterator<Item = Child> {
    let person = entity_id(figure.id);
    let bones = figure.rig.bones.iter().zip(&figure.pose.rotations);
    bones.map(move |(bone, rotation)| {
        let of = |name: &str| format!("{person}/{name}");
        let (parent, origin) = match bone.parent {
            None => (ROOM.to_owned(), figure.pose.root.vector()),
            Some(parent) => (of(&figure.rig.bones[parent].name), bone.offset),
        };
        Child {
            name: of(&bone.name),
            parent,
            origin,
            rotation: *rotation,
        }
    })
}
