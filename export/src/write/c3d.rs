//! C3D, the binary format of gait labs (c3d.org user guide): blocks of 512 bytes, a header, parameters, then points.
//!
//! Little-endian (Intel), coordinates as floats, told by a negative `POINT:SCALE`. A point that is missing has residual -1.
//! The residual of one that is there is the standard deviation of its place in the file's unit, 0 where no sensor
//! measured it. Several people: points are named `person:joint`, told by `SUBJECTS:USES_PREFIXES`.

use std::io::{self, Write};

use posefuse_skeleton::{Joint, JointState, Provenance, Room};

use super::{Moment, Out, Sheet, Sink};

const BLOCK: usize = 512;
/// The header's and a parameter's counts of frames end here.
const MOST_FRAMES: u64 = 65_535;
/// A dimension of a parameter is one byte.
const MOST_LABELS: usize = 255;

pub(super) struct C3d<'a> {
    sheet: Sheet<'a>,
    out: Out,
}

impl<'a> C3d<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, mut out: Out) -> io::Result<Self> {
        let (parameters, data_start) = parameters(&sheet).finished()?;
        out.write_all(&header(&sheet, data_start))?;
        out.write_all(&parameters)?;
        Ok(Self { sheet, out })
    }

    fn point(&mut self, state: Option<&JointState<Room>>) -> io::Result<()> {
        let (at, residual) = match state {
            None => ([0.0; 3], -1.0),
            Some(state) => {
                let measured = matches!(state.provenance, Provenance::Measured(_));
                // Millimetres, whatever the unit: `POINT:SCALE` says so. It is a byte of the fourth number, of which the
                // other one names cameras: 1 to 127 are safe.
                let residual = (state.sigma_m() * 1e3).round().clamp(1.0, 127.0);
                let at = self.sheet.space.vector(state.position.vector());
                (at.into(), if measured { residual } else { 0.0 })
            }
        };
        for value in at.into_iter().chain([residual]) {
            self.out.write_all(&(value as f32).to_le_bytes())?;
        }
        Ok(())
    }
}

impl Sink for C3d<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        for index in 0..self.sheet.people.len() {
            let person = self.sheet.people[index];
            let figure = moment.figure(person);
            for joint in Joint::ALL {
                self.point(figure.and_then(|figure| figure.skeleton[joint].as_ref()))?;
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        let points = self.sheet.people.len() * Joint::ALL.len();
        let bytes = self.sheet.frames() as usize * points * 16;
        let rest = bytes.next_multiple_of(BLOCK) - bytes;
        self.out.write_all(&vec![0; rest])?;
        self.out.flush()
    }
}

fn points(sheet: &Sheet) -> usize {
    sheet.people.len() * Joint::ALL.len()
}

/// The first block: 256 words.
/// Negative: coordinates are floats. Its size is what a residual of 1 is: a millimetre in the file's unit.
fn scale(sheet: &Sheet) -> f32 {
    (-1e-3 * sheet.space.unit.per_metre()) as f32
}

fn header(sheet: &Sheet, data_start: u16) -> Vec<u8> {
    let mut header = vec![0; BLOCK];
    let mut word = |number: usize, value: [u8; 2]| {
        header[2 * (number - 1)..2 * number].copy_from_slice(&value);
    };
    let frames = sheet.frames().min(MOST_FRAMES) as u16;
    let scale = scale(sheet).to_le_bytes();
    let rate = (sheet.plan.grid.rate_hz as f32).to_le_bytes();
    word(1, [2, 0x50]);
    word(2, (points(sheet) as u16).to_le_bytes());
    word(4, 1u16.to_le_bytes());
    word(5, frames.to_le_bytes());
    word(7, [scale[0], scale[1]]);
    word(8, [scale[2], scale[3]]);
    word(9, data_start.to_le_bytes());
    word(11, [rate[0], rate[1]]);
    word(12, [rate[2], rate[3]]);
    // Labels of events have four letters, though there are none.
    word(150, 12_345u16.to_le_bytes());
    header
}

/// A parameter's value.
enum Value<'a> {
    Int(&'a [i16]),
    Float(&'a [f32]),
    /// A row of texts, or one.
    Texts(&'a [String]),
    Text(&'a str),
}

/// The parameter section under construction.
struct Section {
    bytes: Vec<u8>,
    group: i8,
    /// Where `POINT:DATA_START` has its value, which is known at the end.
    data_start: usize,
}

impl Section {
    fn group(&mut self, name: &str) {
        self.group += 1;
        self.bytes.extend([name.len() as u8, (-self.group) as u8]);
        self.bytes.extend(name.as_bytes());
        // From here to the next one: these two bytes and an empty description.
        self.bytes.extend(3i16.to_le_bytes());
        self.bytes.push(0);
    }

    fn parameter(&mut self, name: &str, value: &Value) {
        let (kind, dimensions, data) = encoded(value);
        self.bytes.extend([name.len() as u8, self.group as u8]);
        self.bytes.extend(name.as_bytes());
        let length = 2 + 2 + dimensions.len() + data.len() + 1;
        self.bytes.extend((length as i16).to_le_bytes());
        self.bytes.extend([kind as u8, dimensions.len() as u8]);
        self.bytes.extend(dimensions);
        if name == "DATA_START" {
            self.data_start = self.bytes.len();
        }
        self.bytes.extend(data);
        self.bytes.push(0);
    }
}

impl Section {
    /// The section in whole blocks, and the number of the block where points begin (the first is 1).
    fn finished(mut self) -> io::Result<(Vec<u8>, u16)> {
        // A name of length 0 ends the list.
        self.bytes.push(0);
        let length = self.bytes.len().next_multiple_of(BLOCK);
        let blocks = u8::try_from(length / BLOCK).map_err(|_| {
            io::Error::other("too many people for one C3D file; export fewer with --person")
        })?;
        self.bytes.resize(length, 0);
        self.bytes[2] = blocks;
        let data_start = 2 + u16::from(blocks);
        self.bytes[self.data_start..self.data_start + 2].copy_from_slice(&data_start.to_le_bytes());
        Ok((self.bytes, data_start))
    }
}

/// Kind, dimensions and bytes of a value.
fn encoded(value: &Value) -> (i8, Vec<u8>, Vec<u8>) {
    let many = |count: usize| {
        if count == 1 {
            Vec::new()
        } else {
            vec![count as u8]
        }
    };
    match value {
        Value::Int(values) => (
            2,
            many(values.len()),
            values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
        ),
        Value::Float(values) => (
            4,
            many(values.len()),
            values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
        ),
        Value::Text(text) => {
            let text = &text[..text.floor_char_boundary(MOST_LABELS)];
            (-1, vec![text.len() as u8], text.as_bytes().to_vec())
        }
        Value::Texts(texts) => {
            let longest = texts
                .iter()
                .map(String::len)
                .max()
                .unwrap_or(0)
                .min(MOST_LABELS);
            let padded = texts.iter().flat_map(|text| {
                let text = text.bytes().chain(std::iter::repeat(b' '));
                text.take(longest).collect::<Vec<u8>>()
            });
            (-1, vec![longest as u8, texts.len() as u8], padded.collect())
        }
    }
}

/// Groups and parameters, in whole blocks. `POINT:DATA_START` is still 0.
fn parameters(sheet: &Sheet) -> Section {
    let mut section = Section {
        bytes: vec![1, 0x50, 0, 84],
        group: 0,
        data_start: 0,
    };
    let frames = sheet.frames();
    section.group("POINT");
    section.parameter("USED", &Value::Int(&[points(sheet) as i16]));
    section.parameter("SCALE", &Value::Float(&[scale(sheet)]));
    section.parameter("RATE", &Value::Float(&[sheet.plan.grid.rate_hz as f32]));
    section.parameter("DATA_START", &Value::Int(&[0]));
    section.parameter(
        "FRAMES",
        &Value::Int(&[frames.min(MOST_FRAMES) as u16 as i16]),
    );
    if frames > MOST_FRAMES {
        section.parameter("LONG_FRAMES", &Value::Float(&[frames as f32]));
    }
    section.parameter("UNITS", &Value::Text(sheet.space.unit.name()));
    let labels = labels(sheet);
    for (index, some) in labels.chunks(MOST_LABELS).enumerate() {
        let number = if index == 0 {
            String::new()
        } else {
            (index + 1).to_string()
        };
        section.parameter(&format!("LABELS{number}"), &Value::Texts(some));
        let described = vec![String::from("-"); some.len()];
        section.parameter(&format!("DESCRIPTIONS{number}"), &Value::Texts(&described));
    }
    section.group("ANALOG");
    section.parameter("USED", &Value::Int(&[0]));
    section.parameter("RATE", &Value::Float(&[0.0]));
    section.parameter("GEN_SCALE", &Value::Float(&[1.0]));
    section.group("TRIAL");
    let halves = |number: u64| [(number & 0xffff) as u16 as i16, (number >> 16) as i16];
    section.parameter("ACTUAL_START_FIELD", &Value::Int(&halves(1)));
    section.parameter("ACTUAL_END_FIELD", &Value::Int(&halves(frames)));
    section.parameter(
        "CAMERA_RATE",
        &Value::Float(&[sheet.plan.grid.rate_hz as f32]),
    );
    section.group("SUBJECTS");
    let who: Vec<String> = sheet.who().map(ToString::to_string).collect();
    section.parameter("IS_STATIC", &Value::Int(&[0]));
    section.parameter("USED", &Value::Int(&[who.len() as i16]));
    section.parameter("USES_PREFIXES", &Value::Int(&[i16::from(who.len() > 1)]));
    section.parameter("NAMES", &Value::Texts(&who));
    section.group("MANUFACTURER");
    section.parameter("COMPANY", &Value::Text("Posefuse"));
    section.parameter("SOFTWARE", &Value::Text("posefuse export"));
    section.parameter("VERSION_LABEL", &Value::Text(env!("CARGO_PKG_VERSION")));
    section.group("POSEFUSE");
    section.parameter("TAKE", &Value::Text(&sheet.plan.header.name));
    section.parameter("START_UTC", &Value::Text(&sheet.plan.civil(sheet.first)));
    let [timecode, rate] = sheet.plan.timecode(sheet.first);
    section.parameter("START_TIMECODE", &Value::Text(&timecode));
    section.parameter("TIMECODE_RATE", &Value::Text(&rate));
    section.parameter(
        "START_S",
        &Value::Float(&[sheet.plan.seconds(sheet.first) as f32]),
    );
    section
}

/// The names of the points.
fn labels(sheet: &Sheet) -> Vec<String> {
    let one = sheet.people.len() == 1;
    let of_person = |who: &crate::Who| {
        let label = |joint: Joint| match one {
            true => joint.name().to_owned(),
            false => format!("{who}:{joint}"),
        };
        Joint::ALL.into_iter().map(label).collect::<Vec<_>>()
    };
    sheet.who().flat_map(of_person).collect()
}
