//! Takes in a folder of the disk. Linux keeps space ahead with `fallocate`; locks are advisory and end with the process.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustix::fs::{CWD, FallocateFlags, RenameFlags};
use rustix::io::Errno;

use super::{Append, ReadAt, Storage, Stored, check};
use crate::{Result, TakeError};

/// A folder of the file system.
#[derive(Clone, Debug)]
pub struct DiskStorage {
    folder: PathBuf,
}

impl DiskStorage {
    /// The folder, created if it is not there; an error says so if nothing can be written to it.
    pub fn new(folder: impl AsRef<Path>) -> Result<Self> {
        let folder = folder.as_ref().to_owned();
        Self::probe(&folder).map_err(|source| TakeError::Folder {
            place: folder.display().to_string(),
            source,
        })?;
        Ok(Self { folder })
    }

    /// The folder as it is, for reading: nothing is created or tried.
    pub fn for_reading(folder: impl AsRef<Path>) -> Self {
        Self {
            folder: folder.as_ref().to_owned(),
        }
    }

    fn probe(folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        let probe = folder.join(format!(".probe-{}", std::process::id()));
        File::create(&probe)?;
        fs::remove_file(&probe)
    }

    fn path(&self, file: &str) -> io::Result<PathBuf> {
        check(file)?;
        Ok(self.folder.join(file))
    }
}

impl Storage for DiskStorage {
    fn create(&self, file: &str) -> io::Result<Box<dyn Append>> {
        let path = self.path(file)?;
        let file = OpenOptions::new()
            .append(true)
            .create_new(true)
            .open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            // Without locks a take in the making is not told from one that was cut off; recording goes on.
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(error) => return Err(error.into()),
        }
        self.sync()?;
        Ok(Box::new(DiskAppend { file }))
    }

    fn open(&self, file: &str) -> io::Result<Arc<dyn ReadAt>> {
        Ok(Arc::new(DiskRead(File::open(self.path(file)?)?)))
    }

    fn is_being_written(&self, file: &str) -> io::Result<bool> {
        match File::open(self.path(file)?)?.try_lock_shared() {
            Ok(()) => Ok(false),
            Err(TryLockError::WouldBlock) => Ok(true),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                Ok(false)
            }
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn list(&self) -> io::Result<Vec<Stored>> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let Ok(file) = entry.file_name().into_string() else {
                continue;
            };
            if check(&file).is_err() {
                continue;
            }
            match fs::metadata(entry.path()) {
                Ok(about) if about.is_file() => files.push(Stored {
                    file,
                    size_bytes: about.len(),
                }),
                // A file that went while we looked, or a folder: neither is a take.
                _ => continue,
            }
        }
        files.sort_by(|a, b| a.file.cmp(&b.file));
        Ok(files)
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        fs::rename(self.path(from)?, self.path(to)?)?;
        self.sync()
    }

    fn rename_new(&self, from: &str, to: &str) -> io::Result<()> {
        let (from, to) = (self.path(from)?, self.path(to)?);
        match rustix::fs::renameat_with(CWD, &from, CWD, &to, RenameFlags::NOREPLACE) {
            // This file system cannot do both in one step.
            Err(Errno::INVAL | Errno::NOSYS) if !to.try_exists()? => fs::rename(from, to)?,
            Err(Errno::INVAL | Errno::NOSYS) => return Err(io::ErrorKind::AlreadyExists.into()),
            renamed => renamed?,
        }
        self.sync()
    }

    fn remove(&self, file: &str) -> io::Result<()> {
        fs::remove_file(self.path(file)?)
    }

    fn free_bytes(&self) -> io::Result<u64> {
        let about = rustix::fs::statvfs(&self.folder)?;
        Ok(about.f_bavail.saturating_mul(about.f_frsize))
    }

    fn sync(&self) -> io::Result<()> {
        File::open(&self.folder)?.sync_all()
    }

    fn place(&self) -> String {
        self.folder.display().to_string()
    }
}

struct DiskAppend {
    file: File,
}

impl Append for DiskAppend {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.file.sync_data()
    }

    fn reserve(&mut self, total_bytes: u64) -> io::Result<()> {
        let from = self.file.metadata()?.len();
        if total_bytes <= from {
            return Ok(());
        }
        let space = total_bytes - from;
        rustix::fs::fallocate(&self.file, FallocateFlags::KEEP_SIZE, from, space)?;
        Ok(())
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.file.set_len(length)
    }
}

struct DiskRead(File);

impl ReadAt for DiskRead {
    fn length(&self) -> io::Result<u64> {
        Ok(self.0.metadata()?.len())
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<()> {
        self.0.read_exact_at(buffer, offset)
    }
}
