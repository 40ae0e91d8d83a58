//! Parquet: the tidy table as columns (apache/parquet-format), without compression.
//!
//! A row for each joint that is there. What repeats from row to row (frame, times, person, joint) is a dictionary with
//! runs, so that it takes next to nothing; places are single precision. Memory holds one row group.

mod column;
mod thrift;

use std::io::{self, Write};

use posefuse_skeleton::{Joint, JointState, Room};

use self::column::{Column, Kind, Value};
use self::thrift::Record;
use super::csv::provenance;
use super::{Moment, Out, Sheet, Sink};

const MAGIC: &[u8; 4] = b"PAR1";
/// Rows of a row group: a few megabytes.
const GROUP_ROWS: u64 = 1 << 17;
const UTF8: i32 = 0;
const REQUIRED: i32 = 0;

pub(super) struct Parquet<'a> {
    sheet: Sheet<'a>,
    out: Out,
    columns: Vec<Column>,
    /// Rows of the group so far, and of the groups before.
    rows: u64,
    rows_before: u64,
    offset: u64,
    groups: Vec<Record>,
}

impl<'a> Parquet<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, mut out: Out) -> io::Result<Self> {
        out.write_all(MAGIC)?;
        let unit = sheet.space.unit;
        let columns = vec![
            Column::repeating("frame", Kind::Int),
            Column::repeating("time_s", Kind::Double),
            Column::repeating("unix_ns", Kind::Long),
            Column::repeating("person", Kind::Text),
            Column::repeating("joint", Kind::Text),
            Column::floats(format!("x_{unit}")),
            Column::floats(format!("y_{unit}")),
            Column::floats(format!("z_{unit}")),
            Column::floats(format!("sigma_{unit}")),
            Column::floats("confidence"),
            Column::repeating("provenance", Kind::Text),
            Column::repeating("hand", Kind::Text),
        ];
        let offset = MAGIC.len() as u64;
        Ok(Self {
            sheet,
            out,
            columns,
            rows: 0,
            rows_before: 0,
            offset,
            groups: Vec::new(),
        })
    }

    fn row(
        &mut self,
        frame: u64,
        who: &str,
        (joint, hand): (Joint, &str),
        state: &JointState<Room>,
    ) {
        let plan = self.sheet.plan;
        let at = self.sheet.space.vector(state.position.vector());
        let sigma = state.sigma_m() * self.sheet.space.unit.per_metre();
        let [
            frames,
            seconds,
            unix,
            people,
            joints,
            x,
            y,
            z,
            sigmas,
            trusts,
            hows,
            hands,
        ] = &mut self.columns[..]
        else {
            return;
        };
        frames.push(Value::Int(i32::try_from(frame).unwrap_or(i32::MAX)));
        seconds.push(Value::Double(plan.seconds(frame)));
        unix.push(Value::Long(plan.unix_ns(frame)));
        people.push(Value::Text(who));
        joints.push(Value::Text(joint.name()));
        for (column, value) in [(x, at.x), (y, at.y), (z, at.z), (sigmas, sigma)] {
            column.push_float(value as f32);
        }
        trusts.push_float(state.confidence.get());
        hows.push(Value::Text(provenance(state.provenance)));
        hands.push(Value::Text(hand));
        self.rows += 1;
    }

    fn close_group(&mut self) -> io::Result<()> {
        if self.rows == 0 {
            return Ok(());
        }
        let (mut chunks, mut bytes) = (Vec::new(), 0);
        for column in &mut self.columns {
            let chunk = column.write(self.rows, self.offset, &mut self.out)?;
            self.offset += chunk.bytes;
            bytes += chunk.bytes;
            chunks.push(chunk.record);
        }
        let group = Record::default().records(1, chunks);
        self.groups
            .push(group.long(2, bytes as i64).long(3, self.rows as i64));
        self.rows_before += std::mem::take(&mut self.rows);
        Ok(())
    }

    /// The columns' names and kinds.
    fn schema(&self) -> Vec<Record> {
        let root = Record::default()
            .text(4, "table")
            .int(5, self.columns.len() as i32);
        let column = |column: &Column| {
            let element = Record::default()
                .int(1, column.kind as i32)
                .int(3, REQUIRED);
            let element = element.text(4, &column.name);
            match column.kind {
                Kind::Text => element.int(6, UTF8),
                _ => element,
            }
        };
        std::iter::once(root)
            .chain(self.columns.iter().map(column))
            .collect()
    }
}

impl Sink for Parquet<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        for figure in &moment.people {
            let who = self.sheet.plan.people[figure.person].who.to_string();
            for (joint, state) in figure.skeleton.iter() {
                let hand = figure.hand_of(joint);
                self.row(moment.frame, &who, (joint, hand), state);
            }
        }
        match self.rows >= GROUP_ROWS {
            true => self.close_group(),
            false => Ok(()),
        }
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.close_group()?;
        let plan = self.sheet.plan;
        let fact = |key: &str, value: &str| Record::default().text(1, key).text(2, value);
        let [timecode, rate] = plan.timecode(self.sheet.first);
        let facts = vec![
            fact("take", &plan.header.name),
            fact("start_utc", &plan.civil(self.sheet.first)),
            fact("start_timecode", &timecode),
            fact("timecode_rate", &rate),
            fact("frames_per_second", &plan.grid.rate_hz.to_string()),
        ];
        let end = Record::default()
            .int(1, 1)
            .records(2, self.schema())
            .long(3, self.rows_before as i64)
            .records(4, std::mem::take(&mut self.groups))
            .records(5, facts)
            .text(6, concat!("posefuse export ", env!("CARGO_PKG_VERSION")))
            .finished();
        self.out.write_all(&end)?;
        self.out.write_all(&(end.len() as u32).to_le_bytes())?;
        self.out.write_all(MAGIC)?;
        self.out.flush()
    }
}
