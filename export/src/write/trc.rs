//! TRC, the text format of marker trajectories that OpenSim reads: three lines of header, two of labels, one a frame.
//!
//! A missing joint is three `NaN`: an empty triple at a line's end would be an error there. Times count from the take's
//! start, so that several people's files share one clock.

use std::io::{self, Write};

use posefuse_skeleton::Joint;

use super::{Moment, Out, Sheet, Sink};

pub(super) struct Trc<'a> {
    sheet: Sheet<'a>,
    out: Out,
}

impl<'a> Trc<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, mut out: Out) -> io::Result<Self> {
        let who = sheet.who().map(ToString::to_string).collect::<String>();
        let (take, rate) = (&sheet.plan.header.name, sheet.plan.grid.rate_hz);
        let (frames, markers, unit) = (sheet.frames(), Joint::ALL.len(), sheet.space.unit);
        writeln!(out, "PathFileType\t4\t(X/Y/Z)\t{take}-{who}.trc")?;
        writeln!(
            out,
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
        )?;
        writeln!(
            out,
            "{rate}\t{rate}\t{frames}\t{markers}\t{unit}\t{rate}\t1\t{frames}"
        )?;
        let labels: Vec<&str> = Joint::ALL.iter().map(|joint| joint.name()).collect();
        writeln!(out, "Frame#\tTime\t{}", labels.join("\t\t\t"))?;
        let axes: Vec<String> = (1..=markers).map(|n| format!("X{n}\tY{n}\tZ{n}")).collect();
        writeln!(out, "\t\t{}", axes.join("\t"))?;
        Ok(Self { sheet, out })
    }
}

impl Sink for Trc<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        let Sheet {
            plan, first, space, ..
        } = &self.sheet;
        let decimals = space.unit.decimals();
        write!(
            self.out,
            "{}\t{:.6}",
            moment.frame - first + 1,
            plan.seconds(moment.frame)
        )?;
        let figure = moment.figure(self.sheet.people[0]);
        let skeleton = figure.map(|figure| &figure.skeleton);
        for joint in Joint::ALL {
            match skeleton.and_then(|skeleton| skeleton.position(joint)) {
                Some(position) => {
                    let at = space.vector(position.vector());
                    write!(
                        self.out,
                        "\t{:.decimals$}\t{:.decimals$}\t{:.decimals$}",
                        at.x, at.y, at.z
                    )?;
                }
                None => write!(self.out, "\tNaN\tNaN\tNaN")?,
            }
        }
        writeln!(self.out)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.flush()
    }
}
