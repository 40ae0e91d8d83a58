//! What is to be exported, and how: checked before anything is read.

use crate::Axes;
use crate::format::Format;
use crate::preset::Preset;
use crate::space::{Space, Unit};
use crate::{ExportError, Names, Result, Source};
use posefuse_kinematics::Config;

/// What is to be exported, and how. What is `None` follows the preset, then the format's custom.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The tool that it is for.
    pub preset: Option<Preset>,
    /// The kinds of files; empty: the preset's.
    pub formats: Vec<Format>,
    /// Fused people, sensors' bodies or the truth.
    pub source: Source,
    /// The numbers of the people; empty: all.
    pub people: Vec<u64>,
    /// The span, seconds since the take's start; `None`: from its beginning, to its end.
    pub from_s: Option<f64>,
    /// See `from_s`.
    pub to_s: Option<f64>,
    /// Frames per second.
    pub rate_hz: Option<f64>,
    /// The longest gap that is interpolated across, seconds. Joints are missing in longer ones.
    pub max_gap_s: f64,
    /// Who is there for less is left out, seconds.
    pub least_s: f64,
    /// Which way axes point.
    pub axes: Option<Axes>,
    /// What lengths are counted in.
    pub unit: Option<Unit>,
    /// What bones are called.
    pub names: Option<Names>,
    /// Whether joints that no sensor measured with trust are left out of tables, TRC and C3D. Rigs need all.
    pub only_measured: bool,
    /// Whether every file goes from the first person's first frame to the last one's last, so that several files of a take
    /// line up; otherwise each person's file is as long as they were there.
    pub whole: bool,
    /// How rigs are moved, and hands are told open from closed.
    pub bodies: Config,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            preset: None,
            formats: Vec::new(),
            source: Source::Fused,
            people: Vec::new(),
            from_s: None,
            to_s: None,
            rate_hz: None,
            max_gap_s: 0.2,
            least_s: 1.0,
            axes: None,
            unit: None,
            names: None,
            only_measured: false,
            whole: false,
            bodies: Config::default(),
        }
    }
}

impl Options {
    /// Options for a tool.
    pub fn of_preset(preset: Preset) -> Self {
        Self {
            preset: Some(preset),
            rate_hz: preset.rate_hz(),
            ..Self::default()
        }
    }

    /// Options for one kind of file.
    pub fn of_format(format: Format) -> Self {
        Self {
            formats: vec![format],
            ..Self::default()
        }
    }

    /// The kinds of files, each once.
    pub fn formats(&self) -> Vec<Format> {
        let usual = self.preset.map(Preset::format);
        let usual = usual.filter(|_| self.formats.is_empty());
        let mut formats = Vec::new();
        for &format in self.formats.iter().chain(&usual) {
            if !formats.contains(&format) {
                formats.push(format);
            }
        }
        formats
    }

    /// What bones are called.
    pub fn names(&self) -> Names {
        let preset = self.preset.map(Preset::names);
        self.names.or(preset).unwrap_or(Names::MotionBuilder)
    }

    /// The axes and the unit of a format's files.
    pub fn space(&self, format: Format) -> Space {
        let usual = match self.preset {
            Some(preset) => preset.space(format),
            None => format.usual_space(),
        };
        Space {
            axes: self.axes.unwrap_or(usual.axes),
            unit: self.unit.unwrap_or(usual.unit),
        }
    }

    /// Whether a file with a rig is asked for.
    pub(crate) fn needs_rig(&self) -> bool {
        self.formats().iter().any(|format| format.is_rig())
    }

    /// Refuses what cannot be, and what readers would misunderstand.
    ///
    /// # Errors
    /// [`ExportError::Option`], which says what to write instead.
    pub fn check(&self) -> Result<()> {
        let refuse = |message: String| Err(ExportError::Option(message));
        if let Err(error) = self.bodies.validate() {
            return refuse(format!("bodies: {error}"));
        }
        let formats = self.formats();
        if formats.is_empty() {
            return refuse(
                "say for which tool (a preset) or as which kind of file (a format)".to_owned(),
            );
        }
        for format in &formats {
            if let Some(objection) = format.objection(self.space(*format)) {
                return refuse(objection);
            }
        }
        if self.names.is_some() && !self.needs_rig() {
            return refuse(format!(
                "names are those of bones; {} holds joints, which keep their names",
                formats
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(" and ")
            ));
        }
        for (what, value, low, high) in [
            ("rate", self.rate_hz, 1.0, 1000.0),
            ("longest gap", Some(self.max_gap_s), 0.0, 10.0),
            ("least time", Some(self.least_s), 0.0, 86_400.0),
            ("begin", self.from_s, 0.0, 1e6),
            ("end", self.to_s, 0.0, 1e6),
        ] {
            if let Some(value) = value.filter(|value| !(low..=high).contains(value)) {
                return refuse(format!(
                    "the {what} must lie between {low} and {high}, found {value}"
                ));
            }
        }
        match (self.from_s, self.to_s) {
            (from, Some(to)) if to <= from.unwrap_or(0.0) => refuse(format!(
                "the span ends at {to} s, which is not after its begin at {} s",
                from.unwrap_or(0.0)
            )),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_holds_with_every_format() {
        for preset in Preset::ALL {
            Options::of_preset(*preset).check().unwrap();
            for format in Format::ALL {
                let options = Options {
                    formats: vec![*format],
                    ..Options::of_preset(*preset)
                };
                options.check().unwrap();
            }
        }
    }

    #[test]
    fn a_format_that_is_named_twice_counts_once() {
        let mut options = Options::of_preset(Preset::Blender);
        assert_eq!(options.formats(), [Preset::Blender.format()]);
        options.formats = vec![Format::Csv, Format::Bvh, Format::Csv];
        assert_eq!(options.formats(), [Format::Csv, Format::Bvh]);
    }

    #[test]
    fn what_readers_would_misunderstand_is_refused_with_the_way_out() {
        let with = |change: &dyn Fn(&mut Options)| {
            let mut options = Options::of_format(Format::Bvh);
            change(&mut options);
            options.check().unwrap_err().to_string()
        };
        assert!(with(&|o| o.axes = Some(Axes::Unity)).contains("use `y-up`"));
        assert!(with(&|o| o.formats = vec![]).contains("preset"));
        assert!(
            with(&|o| {
                o.formats = vec![Format::Glb];
                o.unit = Some(Unit::Centimetre)
            })
            .contains("always")
        );
        assert!(
            with(&|o| {
                o.formats = vec![Format::Trc];
                o.names = Some(Names::Mixamo)
            })
            .contains("joints")
        );
        assert!(with(&|o| o.rate_hz = Some(0.0)).contains("between 1 and 1000"));
        assert!(with(&|o| o.rate_hz = Some(f64::NAN)).contains("between"));
        assert!(
            with(&|o| {
                o.from_s = Some(5.0);
                o.to_s = Some(5.0)
            })
            .contains("not after")
        );
    }
}
