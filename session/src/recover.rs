//! Repairing takes that a crash, a power cut or a copy cut off.

use std::io;
use std::sync::Arc;

use crate::container::{Container, Index};
use crate::draft::Draft;
use crate::info::END;
use crate::name::{EXTENSION, REWRITTEN, file_of};
use crate::rewrite;
use crate::storage::{ReadAt, Storage};
use crate::{Result, TakeError, TakeInfo, TakeState};

/// What became of one take that had no end, or an unreadable one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovery {
    /// The take.
    pub name: String,
    /// What became of it.
    pub outcome: RecoveryOutcome,
}

/// What became of a take that had no end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecoveryOutcome {
    /// It has an end again.
    Recovered {
        /// Its list entry now.
        info: Box<TakeInfo>,
        /// Bytes of the file that could not be read.
        lost_bytes: u64,
    },
    /// It could not be repaired, is left as it was, and this is why.
    Damaged(String),
}

/// Repairs every take of the folder that has no end and that nobody is recording. Call it when a server starts.
///
/// A repaired take is written beside the old one and then put in its place in one step, so that a crash on the way
/// leaves the old one. Half-written files of an earlier attempt are removed first; nothing else is deleted.
pub fn recover(storage: &Arc<dyn Storage>) -> Result<Vec<Recovery>> {
    let folder = |source| TakeError::Folder {
        place: storage.place(),
        source,
    };
    let files = storage.list().map_err(folder)?;
    for draft in files
        .iter()
        .filter(|stored| stored.file.ends_with(REWRITTEN))
    {
        if !storage.is_being_written(&draft.file).unwrap_or(true) {
            storage.remove(&draft.file).map_err(folder)?;
        }
    }
    let mut recoveries = Vec::new();
    for stored in files {
        let Some(name) = stored.file.strip_suffix(EXTENSION) else {
            continue;
        };
        if let Some(outcome) = recover_one(storage, name) {
            recoveries.push(Recovery {
                name: name.to_owned(),
                outcome,
            });
        }
    }
    Ok(recoveries)
}

/// Repairs a take; `None`: there is nothing to repair.
fn recover_one(storage: &Arc<dyn Storage>, name: &str) -> Option<RecoveryOutcome> {
    let outcome = match open_cut_off(&**storage, name) {
        Ok(Some(file)) => {
            repair(storage, name, &*file).map(|(info, lost_bytes)| RecoveryOutcome::Recovered {
                info: Box::new(info),
                lost_bytes,
            })
        }
        Ok(None) => return None,
        Err(error) => Err(error),
    };
    Some(outcome.unwrap_or_else(|error| RecoveryOutcome::Damaged(error.to_string())))
}

fn open_cut_off(storage: &dyn Storage, name: &str) -> Result<Option<Arc<dyn ReadAt>>> {
    let file = file_of(name)?;
    let opened = storage.open(&file).map_err(TakeError::io("open", name))?;
    match Index::read(&*opened, name) {
        // An index that cannot be read is made anew from the records, like one that is missing.
        Err(TakeError::Unfinished(_) | TakeError::Damaged { .. }) => {}
        Err(error) => return Err(error),
        Ok(_) => return Ok(None),
    }
    let locked = storage
        .is_being_written(&file)
        .map_err(TakeError::io("open", name))?;
    Ok((!locked).then_some(opened))
}

fn repair(storage: &Arc<dyn Storage>, name: &str, file: &dyn ReadAt) -> Result<(TakeInfo, u64)> {
    let io = |error: io::Error| TakeError::io("recover", name)(error);
    let write = |error| io(io::Error::other(error));
    let (draft, target) = Draft::create(storage, name).map_err(io)?;
    let mut out = Container::new(target).map_err(write)?;
    let found = rewrite::copy(file, name, &mut out, &|_| {})?;
    let Some(header) = found.header else {
        return Err(TakeError::damaged(
            name,
            "nothing of a take's beginning can be read",
        ));
    };
    let mut info = TakeInfo::begun(&header);
    info.state = TakeState::Recovered;
    let start = header.unix_ns(posefuse_skeleton::Timestamp::from_ns(header.start_ns()));
    found.tally.tell(start, &mut info);
    info.trouble = match found.losses.first() {
        None => "it was cut off; everything in the file was kept".to_owned(),
        Some(first) => format!(
            "it was cut off; {} bytes could not be read: {first}",
            found.lost_bytes
        ),
    };
    out.metadata(END, info.to_metadata()).map_err(write)?;
    info.size_bytes = out.finish().map_err(io)?;
    draft.replace().map_err(io)?;
    Ok((info, found.lost_bytes))
}
