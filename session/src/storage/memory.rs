//! Takes in memory: for rooms in a simulated network, and for disks that fill up or lose power on command.

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};

use super::{Append, ReadAt, Storage, Stored, check};

/// A folder in memory. Clones share their files.
#[derive(Clone, Debug, Default)]
pub struct MemoryStorage {
    disk: Arc<Mutex<Disk>>,
}

#[derive(Debug, Default)]
struct Disk {
    files: BTreeMap<String, Arc<Mutex<Contents>>>,
    /// Bytes the disk holds; `None`: as many as memory does.
    capacity: Option<u64>,
    /// Bytes that others occupy.
    others: u64,
    can_reserve: bool,
}

#[derive(Clone, Debug, Default)]
struct Contents {
    bytes: Vec<u8>,
    synced: usize,
    reserved: u64,
    being_written: bool,
}

impl Contents {
    fn occupied(&self) -> u64 {
        self.reserved.max(self.bytes.len() as u64)
    }
}

fn full() -> io::Error {
    io::Error::from(io::ErrorKind::StorageFull)
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Disk {
    fn free(&self) -> u64 {
        let used: u64 = self.files.values().map(|file| lock(file).occupied()).sum();
        match self.capacity {
            Some(capacity) => capacity.saturating_sub(used + self.others),
            None => u64::MAX / 2,
        }
    }

    fn find(&self, file: &str) -> io::Result<&Arc<Mutex<Contents>>> {
        check(file)?;
        self.files
            .get(file)
            .ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        let contents = self.find(from)?.clone();
        self.files.remove(from);
        self.files.insert(to.to_owned(), contents);
        Ok(())
    }
}

impl MemoryStorage {
    /// An empty folder without bounds.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty folder on a disk of `bytes`; `can_reserve` says whether space can be set aside on it.
    pub fn with_capacity(bytes: u64, can_reserve: bool) -> Self {
        let storage = Self::new();
        let mut disk = lock(&storage.disk);
        (disk.capacity, disk.can_reserve) = (Some(bytes), can_reserve);
        drop(disk);
        storage
    }

    /// From now on others occupy `bytes` of the disk, or what they can get.
    pub fn occupied_by_others(&self, bytes: u64) {
        let mut disk = lock(&self.disk);
        disk.others = 0;
        disk.others = bytes.min(disk.free());
    }

    /// The folder as a power cut would leave it now: of each file what had been synced, all locks gone.
    pub fn after_power_cut(&self) -> Self {
        let disk = lock(&self.disk);
        let kept = |(name, file): (&String, &Arc<Mutex<Contents>>)| {
            let file = lock(file);
            let bytes = file.bytes[..file.synced].to_vec();
            (name.clone(), bytes)
        };
        Self::holding(disk.files.iter().map(kept))
    }

    /// The folder as the end of this process would leave it: everything written, all locks gone.
    pub fn after_kill(&self) -> Self {
        let disk = lock(&self.disk);
        let kept = |(name, file): (&String, &Arc<Mutex<Contents>>)| {
            (name.clone(), lock(file).bytes.clone())
        };
        Self::holding(disk.files.iter().map(kept))
    }

    /// A folder with these files.
    pub fn holding(files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Self {
        let storage = Self::new();
        for (name, bytes) in files {
            let synced = bytes.len();
            let contents = Contents {
                bytes,
                synced,
                ..Default::default()
            };
            lock(&storage.disk)
                .files
                .insert(name, Arc::new(Mutex::new(contents)));
        }
        storage
    }

    /// A file's bytes.
    pub fn read(&self, file: &str) -> io::Result<Vec<u8>> {
        let disk = lock(&self.disk);
        let contents = lock(disk.find(file)?).bytes.clone();
        Ok(contents)
    }
}

impl Storage for MemoryStorage {
    fn create(&self, file: &str) -> io::Result<Box<dyn Append>> {
        check(file)?;
        let mut disk = lock(&self.disk);
        if disk.files.contains_key(file) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let contents = Contents {
            being_written: true,
            ..Default::default()
        };
        let contents = Arc::new(Mutex::new(contents));
        disk.files.insert(file.to_owned(), contents.clone());
        Ok(Box::new(MemoryAppend {
            disk: self.disk.clone(),
            contents,
        }))
    }

    fn open(&self, file: &str) -> io::Result<Arc<dyn ReadAt>> {
        Ok(Arc::new(MemoryRead(lock(&self.disk).find(file)?.clone())))
    }

    fn is_being_written(&self, file: &str) -> io::Result<bool> {
        let disk = lock(&self.disk);
        let being_written = lock(disk.find(file)?).being_written;
        Ok(being_written)
    }

    fn list(&self) -> io::Result<Vec<Stored>> {
        let stored = |(name, file): (&String, &Arc<Mutex<Contents>>)| Stored {
            file: name.clone(),
            size_bytes: lock(file).bytes.len() as u64,
        };
        Ok(lock(&self.disk).files.iter().map(stored).collect())
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        check(to)?;
        lock(&self.disk).rename(from, to)
    }

    fn rename_new(&self, from: &str, to: &str) -> io::Result<()> {
        check(to)?;
        let mut disk = lock(&self.disk);
        if disk.files.contains_key(to) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        disk.rename(from, to)
    }

    fn remove(&self, file: &str) -> io::Result<()> {
        let mut disk = lock(&self.disk);
        disk.find(file)?;
        disk.files.remove(file);
        Ok(())
    }

    fn free_bytes(&self) -> io::Result<u64> {
        Ok(lock(&self.disk).free())
    }

    fn sync(&self) -> io::Result<()> {
        Ok(())
    }

    fn place(&self) -> String {
        "memory".to_owned()
    }
}

struct MemoryAppend {
    disk: Arc<Mutex<Disk>>,
    contents: Arc<Mutex<Contents>>,
}

impl Append for MemoryAppend {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let free = lock(&self.disk).free();
        let mut contents = lock(&self.contents);
        let room = free + contents.occupied() - contents.bytes.len() as u64;
        let taken = bytes.len().min(usize::try_from(room).unwrap_or(usize::MAX));
        contents.bytes.extend_from_slice(&bytes[..taken]);
        if taken < bytes.len() {
            Err(full())
        } else {
            Ok(())
        }
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut contents = lock(&self.contents);
        contents.synced = contents.bytes.len();
        Ok(())
    }

    fn reserve(&mut self, total_bytes: u64) -> io::Result<()> {
        let (free, can_reserve) = {
            let disk = lock(&self.disk);
            (disk.free(), disk.can_reserve || disk.capacity.is_none())
        };
        if !can_reserve {
            return Err(io::ErrorKind::Unsupported.into());
        }
        let mut contents = lock(&self.contents);
        if total_bytes > contents.occupied() + free {
            return Err(full());
        }
        contents.reserved = contents.reserved.max(total_bytes);
        Ok(())
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        let mut contents = lock(&self.contents);
        contents.bytes.truncate(length as usize);
        contents.synced = contents.synced.min(contents.bytes.len());
        contents.reserved = length;
        Ok(())
    }
}

impl Drop for MemoryAppend {
    fn drop(&mut self) {
        lock(&self.contents).being_written = false;
    }
}

struct MemoryRead(Arc<Mutex<Contents>>);

impl ReadAt for MemoryRead {
    fn length(&self) -> io::Result<u64> {
        Ok(lock(&self.0).bytes.len() as u64)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<()> {
        let contents = lock(&self.0);
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let end = start.saturating_add(buffer.len());
        let slice = contents
            .bytes
            .get(start..end)
            .ok_or(io::ErrorKind::UnexpectedEof)?;
        buffer.copy_from_slice(slice);
        Ok(())
    }
}
