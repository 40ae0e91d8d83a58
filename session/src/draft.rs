//! A take in the making that can be made again: until it is whole it has a name that is no take's and that the next
//! start throws away.

use std::io;
use std::sync::Arc;

use crate::name::{REWRITTEN, file_of};
use crate::storage::{Append, Storage};

/// `NAME.mcap.new`; dropped before it is whole, it is removed.
pub(crate) struct Draft {
    storage: Arc<dyn Storage>,
    name: String,
    whole: bool,
}

impl Draft {
    /// Creates the file. One that a crash left behind is thrown away; one that somebody is writing is an error.
    pub(crate) fn create(
        storage: &Arc<dyn Storage>,
        name: &str,
    ) -> io::Result<(Self, Box<dyn Append>)> {
        let file = format!("{name}{REWRITTEN}");
        let target = match storage.create(&file) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                if storage.is_being_written(&file)? {
                    let problem = format!("{file} is being written just now; try again later");
                    return Err(io::Error::new(io::ErrorKind::ResourceBusy, problem));
                }
                storage.remove(&file)?;
                storage.create(&file)?
            }
            created => created?,
        };
        let draft = Self {
            storage: storage.clone(),
            name: name.to_owned(),
            whole: false,
        };
        Ok((draft, target))
    }

    /// Puts it in the place of the take of its name, in one step.
    pub(crate) fn replace(mut self) -> io::Result<()> {
        self.storage.rename(&self.file(), &self.take()?)?;
        self.whole = true;
        Ok(())
    }

    /// Makes it a take; `ErrorKind::AlreadyExists` if there is one of its name.
    pub(crate) fn publish(mut self) -> io::Result<()> {
        self.storage.rename_new(&self.file(), &self.take()?)?;
        self.whole = true;
        Ok(())
    }

    fn file(&self) -> String {
        format!("{}{REWRITTEN}", self.name)
    }

    fn take(&self) -> io::Result<String> {
        file_of(&self.name).map_err(io::Error::other)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.whole {
            // Where this fails the next start does it.
            let _ = self.storage.remove(&self.file());
        }
    }
}
