//! Something recorded that methods are compared on: engine inputs that can be read again and again, and the truth if
//! there is one.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use anyhow::{Context, bail};
use posefuse_evaluate::{
    Group, Judge, Judged, LeftOut, Method, RecordedTruth, Run, Truth, fuse, leave_one_out,
    left_out_alike,
};
use posefuse_fusion::Input;
use posefuse_skeleton::{Calibration, JointMap, Timestamp};

/// Inputs in the order in which the engine takes them, with their server times.
pub(super) type Inputs = Box<dyn Iterator<Item = anyhow::Result<(Timestamp, Input)>>>;

/// A take or a recording.
pub(super) struct Material {
    pub(super) name: String,
    pub(super) note: String,
    /// Reads it from its beginning.
    pub(super) open: Box<dyn Fn() -> anyhow::Result<Inputs> + Send + Sync>,
    pub(super) truth: RecordedTruth,
}

/// When observations begin and end.
struct Span {
    first: Timestamp,
    last: Timestamp,
    /// When a sensor last saw anybody.
    last_body: Option<Timestamp>,
}

impl Material {
    /// Fuses it with each method. `progress` hears of each that is done.
    pub(super) fn judged(
        &self,
        methods: &[Method],
        skip_s: f64,
        progress: &dyn Fn(),
    ) -> anyhow::Result<Vec<Judged>> {
        let span = self.span()?;
        let from = span.first.plus_ns((skip_s * 1e9) as i64);
        if from >= span.last {
            bail!(
                "`{}` lasts {:.1} s, and --skip leaves nothing of it",
                self.name,
                span.last.since_seconds(span.first)
            );
        }
        let one = |method: &Method| {
            let judged = self.one(method, from, &span);
            progress();
            judged
        };
        let judged: anyhow::Result<Vec<(Judged, LeftOut)>> = methods.iter().map(one).collect();
        let (mut judged, left_out): (Vec<Judged>, Vec<LeftOut>) = judged?.into_iter().unzip();
        let alike = left_out_alike(&left_out);
        for (judged, alike) in judged.iter_mut().zip(&alike) {
            judged.tally.merge(alike);
        }
        Ok(judged)
    }

    /// What one method is worth; without truth also how far its people are from sensors that were left out.
    fn one(
        &self,
        method: &Method,
        from: Timestamp,
        span: &Span,
    ) -> anyhow::Result<(Judged, LeftOut)> {
        let failed = Rc::new(RefCell::new(None));
        let truth: Option<&dyn Truth> = match self.truth.is_empty() {
            true => None,
            false => Some(&self.truth),
        };
        let mut judge = Judge::new(truth, from);
        let inputs = self.inputs(method, &failed);
        let busy = fuse(method, inputs, &mut |frame| judge.add(frame));
        let mut judged = judge.finish();
        let left_out = match truth {
            Some(_) => LeftOut::default(),
            None => leave_one_out(method, &mut || self.inputs(method, &failed), from),
        };
        if let Some(error) = failed.take() {
            return Err(error).with_context(|| format!("`{}`", self.name));
        }
        let tally = &mut judged.tally;
        if tally.track_frames == 0 {
            bail!("`{}`: {}", self.name, nobody(method, from, span));
        }
        if method.smooth {
            // Nobody waited for these frames.
            tally.look_ahead = Default::default();
        }
        tally.busy_s = busy.as_secs_f64();
        tally.live_s = span.last.since_seconds(span.first);
        Ok((judged, left_out))
    }

    /// The inputs as this method is to have them; the first error ends them.
    fn inputs(
        &self,
        method: &Method,
        failed: &Rc<RefCell<Option<anyhow::Error>>>,
    ) -> impl Iterator<Item = (Timestamp, Input)> + use<> {
        let (failed, poses_only) = (Rc::clone(failed), method.poses_only);
        let opened = (self.open)().unwrap_or_else(|error| Box::new(std::iter::once(Err(error))));
        opened.map_while(move |input| match input {
            Ok((time, Input::Calibration(calibration))) if poses_only => {
                let poses = Calibration {
                    ray_bias_m: JointMap::empty(),
                    joint_offsets_m: BTreeMap::new(),
                    ..(*calibration).clone()
                };
                Some((time, Input::Calibration(Arc::new(poses))))
            }
            Ok(input) => Some(input),
            Err(error) => {
                failed.replace(Some(error));
                None
            }
        })
    }

    fn span(&self) -> anyhow::Result<Span> {
        let mut span: Option<Span> = None;
        let mut calibrated = false;
        for input in (self.open)()? {
            let (time, input) = input?;
            calibrated |= matches!(input, Input::Calibration(_));
            if let Input::Observation(observation) = input {
                let span = span.get_or_insert(Span {
                    first: time,
                    last: time,
                    last_body: None,
                });
                span.last = span.last.max(time);
                if !observation.bodies.is_empty() {
                    span.last_body = Some(time);
                }
            }
        }
        let Some(span) = span else {
            bail!(
                "`{}` holds no sensor's frames: there is nothing to fuse",
                self.name
            );
        };
        if !calibrated {
            bail!(
                "`{}` holds no calibration, so nobody can be fused; {NOBODY}",
                self.name
            );
        }
        Ok(span)
    }
}

/// Less than this says nothing of a calibration: people are followed only after they were seen for a moment.
const MOMENT_S: f64 = 1.0;

/// Why a method fuses nobody from `from` on, and what to do.
fn nobody(method: &Method, from: Timestamp, span: &Span) -> String {
    let (all, left) = (
        span.last.since_seconds(span.first),
        span.last.since_seconds(from),
    );
    if left < MOMENT_S {
        return format!(
            "it lasts {all:.1} s, of which --skip leaves {left:.1} s, too little for {} to fuse anybody; skip less or \
             record longer",
            method.name
        );
    }
    match span.last_body {
        Some(seen) if seen >= from => format!("{} fuses nobody; {NOBODY}", method.name),
        _ => format!(
            "{} fuses nobody, because no sensor saw anybody in the {left:.1} s that --skip leaves of it; record with \
             somebody in the room",
            method.name
        ),
    }
}

/// What can be done where nobody is fused.
const NOBODY: &str = "make a calibration from its walk (`posefuse calibrate --from TAKE --out room.toml`) and give it: \
                      --calibration room.toml";

/// One group per material, after one of all together where there are several.
pub(super) fn groups(methods: &[Method], judged: &[(&Material, Vec<Judged>)]) -> Vec<Group> {
    let of = |name: String, note: String, of: &[(&Material, Vec<Judged>)]| {
        let run = |(index, method): (usize, &Method)| {
            Run::new(method, of.iter().filter_map(|(_, runs)| runs.get(index)))
        };
        Group {
            name,
            note,
            runs: methods.iter().enumerate().map(run).collect(),
        }
    };
    let mut groups = Vec::new();
    if judged.len() > 1 {
        let name = format!("all {} together", judged.len());
        groups.push(of(name, String::new(), judged));
    }
    for one in judged {
        let material = one.0;
        groups.push(of(
            material.name.clone(),
            material.note.clone(),
            std::slice::from_ref(one),
        ));
    }
    groups
}
