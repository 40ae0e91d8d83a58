//! A file that appears when it is whole.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::format::Format;
use crate::plan::Plan;
use crate::write::{self, Moment, Sheet, Sink};
use crate::{ExportError, FileReport, Result, Who};

/// A file under another name until it is whole. It vanishes if it never becomes so.
pub(crate) struct Draft<'a> {
    format: Format,
    people: Vec<Who>,
    first: u64,
    last: u64,
    sink: Option<Box<dyn Sink + 'a>>,
    part: PathBuf,
    path: PathBuf,
}

impl<'a> Draft<'a> {
    pub(crate) fn open(format: Format, sheet: Sheet<'a>, path: PathBuf) -> Result<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let part = path.with_file_name(format!(".{name}.part"));
        let file = File::create(&part).map_err(ExportError::write(&part))?;
        let mut draft = Self {
            format,
            people: sheet.who().cloned().collect(),
            first: sheet.first,
            last: sheet.last,
            sink: None,
            part,
            path,
        };
        let sink = write::open(format, sheet, BufWriter::new(file));
        draft.sink = Some(sink.map_err(ExportError::write(&draft.path))?);
        Ok(draft)
    }

    pub(crate) fn moment(&mut self, moment: &Moment) -> Result<()> {
        match &mut self.sink {
            Some(sink) if (self.first..=self.last).contains(&moment.frame) => {
                sink.moment(moment).map_err(ExportError::write(&self.path))
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn finish(mut self, plan: &Plan) -> Result<FileReport> {
        if let Some(sink) = self.sink.take() {
            sink.finish().map_err(ExportError::write(&self.path))?;
        }
        let bytes = settled(&self.part).map_err(ExportError::write(&self.part))?;
        fs::rename(&self.part, &self.path).map_err(ExportError::write(&self.path))?;
        let [from_timecode, timecode_rate] = plan.timecode(self.first);
        Ok(FileReport {
            path: std::mem::take(&mut self.path),
            format: self.format,
            people: std::mem::take(&mut self.people),
            from_s: plan.seconds(self.first),
            from_utc: plan.civil(self.first),
            from_timecode,
            timecode_rate,
            frames: self.last - self.first + 1,
            bytes,
        })
    }
}

/// Makes sure that the file is on the disk, so that a power cut leaves no empty one under its name. Gives its size, bytes.
fn settled(part: &Path) -> io::Result<u64> {
    // Windows flushes only what may be written.
    let file = OpenOptions::new().write(true).open(part)?;
    file.sync_all()?;
    Ok(file.metadata()?.len())
}

impl Drop for Draft<'_> {
    fn drop(&mut self) {
        // What was finished has its own name by now; for the rest there is nobody to tell.
        let _ = fs::remove_file(&self.part);
    }
}
