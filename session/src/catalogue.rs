//! The takes of a folder: listing, naming, changing what the user wrote about one.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use mcap::records::{Record, op};

use crate::container::{Container, Scan, check_start, read_record};
use crate::draft::Draft;
use crate::header::START;
use crate::info::END;
use crate::name::{EXTENSION, REWRITTEN, check_take_name, file_of};
use crate::rewrite;
use crate::storage::{Storage, Stored};
use crate::{Result, TakeError, TakeHeader, TakeInfo, TakeReader, TakeState};

/// What the user can change about a take; `None` leaves it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TakeChange {
    /// A new slate.
    pub slate: Option<String>,
    /// New notes.
    pub notes: Option<String>,
}

/// The takes of a folder.
pub struct Catalogue;

impl Catalogue {
    /// All takes, the latest first. Reads each one's index and descriptions, not its messages.
    pub fn list(storage: &dyn Storage) -> Result<Vec<TakeInfo>> {
        let files = storage.list().map_err(|source| TakeError::Folder {
            place: storage.place(),
            source,
        })?;
        let is_take = |stored: &Stored| Some(stored.file.strip_suffix(EXTENSION)?.to_owned());
        let mut takes: Vec<_> = files
            .iter()
            .filter_map(is_take)
            .map(|name| Self::info(storage, &name))
            .collect();
        takes.sort_by(|a, b| (&b.started, &b.name).cmp(&(&a.started, &a.name)));
        Ok(takes)
    }

    /// One take's list entry; what cannot be read is [`TakeState::Damaged`] and says why.
    pub fn info(storage: &dyn Storage, name: &str) -> TakeInfo {
        match TakeReader::open(storage, name) {
            Ok(take) => take.info().clone(),
            Err(TakeError::Unfinished(_)) => unfinished(storage, name),
            Err(error) => TakeInfo {
                trouble: error.to_string(),
                ..unfinished(storage, name)
            },
        }
    }

    /// `wanted`, or `wanted-2`, `wanted-3` ... if takes have those names.
    pub fn unused_name(storage: &dyn Storage, wanted: &str) -> Result<String> {
        check_take_name(wanted)?;
        let files = storage.list().map_err(|source| TakeError::Folder {
            place: storage.place(),
            source,
        })?;
        let is_used = |name: &str| {
            let [take, draft] = [EXTENSION, REWRITTEN].map(|ending| format!("{name}{ending}"));
            let is_there = |file: &str| files.iter().any(|stored| stored.file == file);
            let is_being_made =
                || is_there(&draft) && storage.is_being_written(&draft).unwrap_or(true);
            is_there(&take) || is_being_made()
        };
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let name = std::iter::once(wanted.to_owned())
            .chain(numbered)
            .find(|name| !is_used(name));
        let name = name.unwrap_or_default();
        check_take_name(&name)?;
        Ok(name)
    }

    /// Changes a finished take's slate or notes. The take is written anew and put in its place in one step.
    pub fn update(storage: &Arc<dyn Storage>, name: &str, change: &TakeChange) -> Result<TakeInfo> {
        TakeReader::open(&**storage, name)?;
        let file = file_of(name)?;
        let io = |error: io::Error| TakeError::io("change", name)(error);
        let write = |error| io(io::Error::other(error));
        let source = storage.open(&file).map_err(io)?;
        let edit = |metadata: &mut BTreeMap<String, String>| {
            for (key, value) in [("slate", &change.slate), ("notes", &change.notes)] {
                if let Some(value) = value {
                    metadata.insert(key.to_owned(), value.clone());
                }
            }
        };
        let (draft, target) = Draft::create(storage, name).map_err(io)?;
        let mut out = Container::new(target).map_err(write)?;
        let found = rewrite::copy(&*source, name, &mut out, &edit)?;
        if let Some(loss) = found.losses.first() {
            return Err(TakeError::damaged(name, loss.clone()));
        }
        out.metadata(END, found.end.unwrap_or_default())
            .map_err(write)?;
        out.finish().map_err(io)?;
        draft.replace().map_err(io)?;
        Ok(Self::info(&**storage, name))
    }
}

/// A take without an end: what its first records tell.
fn unfinished(storage: &dyn Storage, name: &str) -> TakeInfo {
    let mut info = beginning(storage, name).unwrap_or_else(|error| TakeInfo {
        name: name.to_owned(),
        trouble: error.to_string(),
        ..TakeInfo::default()
    });
    let file = format!("{name}{EXTENSION}");
    let length = storage.open(&file).and_then(|file| file.length());
    info.size_bytes = length.unwrap_or(0);
    if storage.is_being_written(&file).unwrap_or(false) {
        info.state = TakeState::Recording;
        return info;
    }
    info.state = TakeState::Damaged;
    if info.trouble.is_empty() {
        info.trouble = "it was cut off; it is repaired when the server starts next".to_owned();
    }
    info
}

fn beginning(storage: &dyn Storage, name: &str) -> Result<TakeInfo> {
    let file = storage
        .open(&file_of(name)?)
        .map_err(TakeError::io("open", name))?;
    let length = file.length().map_err(TakeError::io("read", name))?;
    check_start(&*file, name, length)?;
    let mut scan = Scan::new(&*file, name, mcap::MAGIC.len() as u64, length);
    while let Some(record) = scan.next()? {
        if record.opcode == op::CHUNK {
            break;
        }
        if record.opcode != op::METADATA {
            continue;
        }
        if let Record::Metadata(metadata) = read_record(&*file, name, record)?
            && metadata.name == START
        {
            return Ok(TakeInfo::begun(
                &TakeHeader::from_metadata(name, &metadata.metadata)?.0,
            ));
        }
    }
    Err(TakeError::damaged(
        name,
        "nothing of a take's beginning can be read",
    ))
}
