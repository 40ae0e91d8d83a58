//! Tables of joints, RFC 4180: wide (a row for each person and frame) or tidy (a row for each joint).
//!
//! A joint that is missing has empty cells in a wide table and no row in a tidy one. `time_s` counts from the take's start,
//! `unix_ns` from 1970; `timecode` is the room's, empty in takes that have none. Hands are
//! `open` or `closed`, or empty while no sensor has said anything of them.

use std::io::{self, Write};

use posefuse_skeleton::{Joint, JointState, Provenance, Room};

use super::{Figure, Moment, Out, Sheet, Sink};

/// Which table.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Layout {
    Wide,
    Tidy,
}

pub(super) struct Csv<'a> {
    sheet: Sheet<'a>,
    layout: Layout,
    out: Out,
}

impl<'a> Csv<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, layout: Layout, mut out: Out) -> io::Result<Self> {
        let unit = sheet.space.unit;
        write!(out, "frame,time_s,unix_ns,timecode,person")?;
        match layout {
            Layout::Wide => {
                for joint in Joint::ALL {
                    for axis in ["x", "y", "z"] {
                        write!(out, ",{joint}_{axis}_{unit}")?;
                    }
                    write!(out, ",{joint}_confidence,{joint}_provenance")?;
                }
                write!(out, ",hand_left,hand_right")?;
            }
            Layout::Tidy => {
                write!(
                    out,
                    ",joint,x_{unit},y_{unit},z_{unit},sigma_{unit},confidence,provenance,hand"
                )?;
            }
        }
        writeln!(out)?;
        Ok(Self { sheet, layout, out })
    }

    fn key(&mut self, frame: u64, figure: &Figure) -> io::Result<()> {
        let plan = self.sheet.plan;
        let (seconds, unix_ns) = (plan.seconds(frame), plan.unix_ns(frame));
        let who = &plan.people[figure.person].who;
        let [timecode, _] = plan.timecode(frame);
        write!(self.out, "{frame},{seconds:.6},{unix_ns},{timecode},{who}")
    }

    fn place(&mut self, state: &JointState<Room>) -> io::Result<()> {
        let space = self.sheet.space;
        let at = space.vector(state.position.vector());
        let decimals = space.unit.decimals();
        write!(
            self.out,
            ",{:.decimals$},{:.decimals$},{:.decimals$}",
            at.x, at.y, at.z
        )
    }

    fn wide(&mut self, frame: u64, figure: &Figure) -> io::Result<()> {
        self.key(frame, figure)?;
        for joint in Joint::ALL {
            match &figure.skeleton[joint] {
                Some(state) => {
                    self.place(state)?;
                    let (trust, how) = (state.confidence.get(), provenance(state.provenance));
                    write!(self.out, ",{trust:.3},{how}")?;
                }
                None => write!(self.out, ",,,,,")?,
            }
        }
        writeln!(self.out, ",{},{}", figure.hand(0), figure.hand(1))
    }

    fn tidy(&mut self, frame: u64, figure: &Figure) -> io::Result<()> {
        let unit = self.sheet.space.unit;
        for (joint, state) in figure.skeleton.iter() {
            self.key(frame, figure)?;
            write!(self.out, ",{joint}")?;
            self.place(state)?;
            let (sigma, decimals) = (state.sigma_m() * unit.per_metre(), unit.decimals());
            let (trust, how) = (state.confidence.get(), provenance(state.provenance));
            let hand = figure.hand_of(joint);
            writeln!(self.out, ",{sigma:.decimals$},{trust:.3},{how},{hand}")?;
        }
        Ok(())
    }
}

/// Where a joint's place comes from, in a word.
pub(super) fn provenance(provenance: Provenance) -> &'static str {
    match provenance {
        Provenance::Measured(_) => "measured",
        Provenance::Predicted(_) => "predicted",
        Provenance::Repaired => "repaired",
    }
}

impl Sink for Csv<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        for figure in &moment.people {
            match self.layout {
                Layout::Wide => self.wide(moment.frame, figure)?,
                Layout::Tidy => self.tidy(moment.frame, figure)?,
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.flush()
    }
}
