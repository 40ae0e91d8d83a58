//! A table of a rig's bones: a row for each bone of each person and frame, RFC 4180.
//!
//! `x y z` is where a bone begins; `qx qy qz qw` turns its axes of the T-pose (those of the room, for every bone) to what they
//! are now. A frame without a pose has no rows. It is what every other file with a rig is measured against.

use std::io::{self, Write};

use super::{Moment, Out, Sheet, Sink};

pub(super) struct Bones<'a> {
    sheet: Sheet<'a>,
    out: Out,
}

impl<'a> Bones<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, mut out: Out) -> io::Result<Self> {
        let unit = sheet.space.unit;
        writeln!(
            out,
            "frame,time_s,unix_ns,timecode,person,bone,parent,x_{unit},y_{unit},z_{unit},qx,qy,qz,qw"
        )?;
        Ok(Self { sheet, out })
    }

    /// The rows of one of the file's people.
    fn rows(&mut self, index: usize, moment: &Moment) -> io::Result<()> {
        let person = self.sheet.people[index];
        let Some(pose) = moment.pose_of(person) else {
            return Ok(());
        };
        let (plan, space, names) = (self.sheet.plan, self.sheet.space, self.sheet.names);
        let rig = self.sheet.rig(index)?;
        let (seconds, unix_ns) = (plan.seconds(moment.frame), plan.unix_ns(moment.frame));
        let [timecode, _] = plan.timecode(moment.frame);
        let (frame, who) = (moment.frame, &plan.people[person].who);
        let decimals = space.unit.decimals();
        for (bone, (origin, turned)) in rig.bones.iter().zip(rig.place(pose)) {
            let parent = bone.parent.map(|parent| &rig.bones[parent].name);
            let parent = parent.map_or_else(String::new, |name| names.of_bone(name));
            let (at, turned) = (space.vector(origin.vector()), space.axes.rotation(&turned));
            writeln!(
                self.out,
                "{frame},{seconds:.6},{unix_ns},{timecode},{who},{},{parent},{:.decimals$},{:.decimals$},{:.decimals$},\
                 {:.7},{:.7},{:.7},{:.7}",
                names.of_bone(&bone.name),
                at.x,
                at.y,
                at.z,
                turned.i,
                turned.j,
                turned.k,
                turned.w
            )?;
        }
        Ok(())
    }
}

impl Sink for Bones<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        (0..self.sheet.people.len()).try_for_each(|index| self.rows(index, moment))
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.flush()
    }
}
