//! The folder of takes, handed in: the disk, or memory for simulated rooms and for tests of failing disks.

mod disk;
mod memory;

use std::io;
use std::sync::Arc;

pub use disk::DiskStorage;
pub use memory::MemoryStorage;

/// A flat folder of files. File names are plain (`a-z A-Z 0-9 . _ -`); any other name is refused by every method.
pub trait Storage: Send + Sync {
    /// Creates a file for appending and locks it while the handle lives. Fails if the file exists.
    fn create(&self, file: &str) -> io::Result<Box<dyn Append>>;
    /// Opens a file for reading.
    fn open(&self, file: &str) -> io::Result<Arc<dyn ReadAt>>;
    /// Whether somebody holds the file's [`Append`] handle, in this process or another.
    fn is_being_written(&self, file: &str) -> io::Result<bool>;
    /// The files, in order of their names; what is no plain file is left out.
    fn list(&self) -> io::Result<Vec<Stored>>;
    /// Renames a file, over another one if that exists, so that a crash leaves the one or the other.
    fn rename(&self, from: &str, to: &str) -> io::Result<()>;
    /// Renames a file; `ErrorKind::AlreadyExists` if `to` exists.
    fn rename_new(&self, from: &str, to: &str) -> io::Result<()>;
    /// Removes a file.
    fn remove(&self, file: &str) -> io::Result<()>;
    /// Bytes that are free for this user.
    fn free_bytes(&self) -> io::Result<u64>;
    /// Makes creations, renames and removals durable.
    fn sync(&self) -> io::Result<()>;
    /// What to call this folder in a message.
    fn place(&self) -> String;
}

/// A file of the folder and its size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Its name.
    pub file: String,
    /// Its bytes.
    pub size_bytes: u64,
}

/// A file that grows at its end.
pub trait Append: Send {
    /// Appends all of `bytes`; after an error any part of them may be there.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// Makes everything appended durable.
    fn sync(&mut self) -> io::Result<()>;
    /// Sets space aside so that the file can grow to `total_bytes` whatever else fills the disk; its length stays.
    /// `ErrorKind::Unsupported` where the file system cannot.
    fn reserve(&mut self, total_bytes: u64) -> io::Result<()>;
    /// Cuts the file to `length` bytes and gives back what is set aside beyond.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

/// A file that is read anywhere.
pub trait ReadAt: Send + Sync {
    /// Its length now.
    fn length(&self) -> io::Result<u64>;
    /// Fills `buffer` from `offset` on; `ErrorKind::UnexpectedEof` if the file is shorter.
    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<()>;
}

fn check(file: &str) -> io::Result<()> {
    if crate::name::is_file_name(file) {
        return Ok(());
    }
    let shown: String = file.chars().take(150).collect();
    let problem = format!("`{shown}` is no name of a file in the take folder");
    Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
}
