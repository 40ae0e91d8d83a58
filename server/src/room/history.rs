//! The calibrations that are kept beside the one in force: one file for each that ever was, named by when it came.
//!
//! `calibration.toml` holds the one in force, `calibration.2026-01-01T10-00-00Z.toml` and the like a copy of each that
//! was put in force, `calibration.until-2026-...Z.toml` what somebody else had written into the file before one was.
//! The one in force is the copy with the same content. Pure functions over a [`Storage`]: they block.

use std::io;

use posefuse_calibration::from_toml;
use posefuse_session::Storage;
use posefuse_skeleton::Calibration;

/// So many are kept; the oldest go.
const MAX_KEPT: usize = 100;
/// Largest calibration file that is read, bytes.
const MAX_FILE: u64 = 1 << 20;
/// Ahead of the time in the name of what was in the file before.
const UNTIL: &str = "until-";

/// One that is kept.
pub(super) struct Kept {
    /// What to call it by.
    pub(super) name: String,
    /// Whether it is the one in the file.
    pub(super) in_force: bool,
    /// It, or why it cannot be used.
    pub(super) calibration: Result<Calibration, String>,
}

/// All that are kept, the newest first.
pub(super) fn list(storage: &dyn Storage, file: &str) -> io::Result<Vec<Kept>> {
    let in_force = read_bytes(storage, file)?;
    let kept = |name: String| {
        let bytes = read_bytes(storage, &file_of(file, &name));
        let is_same = |bytes: &Vec<u8>| in_force.as_ref() == Some(bytes);
        Kept {
            in_force: matches!(&bytes, Ok(Some(bytes)) if is_same(bytes)),
            calibration: parse(bytes).and_then(|found| found.ok_or_else(gone)),
            name,
        }
    };
    Ok(names(storage, file)?.into_iter().map(kept).collect())
}

/// One that is kept and its text; `None`: none has this name.
pub(super) fn find(
    storage: &dyn Storage,
    file: &str,
    name: &str,
) -> io::Result<Option<(String, Result<Calibration, String>)>> {
    if when(name).is_none() {
        return Ok(None);
    }
    let Some(bytes) = read_bytes(storage, &file_of(file, name))? else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Ok(Some((
        text,
        parse(Ok(Some(bytes))).and_then(|found| found.ok_or_else(gone)),
    )))
}

/// The calibration in `file`, if there is one; why it cannot be used otherwise.
pub(super) fn read(storage: &dyn Storage, file: &str) -> Result<Option<Calibration>, String> {
    parse(read_bytes(storage, file))
}

/// Keeps a copy of what is in `file`, if there is none yet: an earlier build, or a person, has put it there.
pub(super) fn adopt(storage: &dyn Storage, file: &str, now: &str) -> io::Result<()> {
    match read_bytes(storage, file)? {
        Some(bytes) => keep(storage, file, &bytes, &stamp(now)),
        None => Ok(()),
    }
}

/// Writes `text` to `file` in one step and keeps it; what the file held before is kept, too. `now` is RFC 3339.
pub(super) fn write(storage: &dyn Storage, file: &str, text: &str, now: &str) -> io::Result<()> {
    if let Some(old) = read_bytes(storage, file)?
        && old != text.as_bytes()
    {
        keep(storage, file, &old, &format!("{UNTIL}{}", stamp(now)))?;
    }
    keep(storage, file, text.as_bytes(), &stamp(now))?;
    put(storage, file, text.as_bytes())?;
    for name in names(storage, file)?.into_iter().skip(MAX_KEPT) {
        let old = file_of(file, &name);
        if read_bytes(storage, &old)?.as_deref() != Some(text.as_bytes()) {
            storage.remove(&old)?;
        }
    }
    storage.sync()
}

/// Keeps `bytes` under `name`, or a number after it, unless they are kept already.
fn keep(storage: &dyn Storage, file: &str, bytes: &[u8], name: &str) -> io::Result<()> {
    let known = names(storage, file)?;
    for name in &known {
        if read_bytes(storage, &file_of(file, name))?.as_deref() == Some(bytes) {
            return Ok(());
        }
    }
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    let mut free = std::iter::once(name.to_owned()).chain(numbered);
    match free.find(|name| !known.contains(name)) {
        Some(name) => put(storage, &file_of(file, &name), bytes),
        None => Ok(()),
    }
}

/// The names of all that are kept, the newest first.
fn names(storage: &dyn Storage, file: &str) -> io::Result<Vec<String>> {
    let head = format!("{}.", stem(file));
    let name = |stored: String| {
        let name = stored.strip_prefix(&head)?.strip_suffix(".toml")?;
        when(name).map(|_| name.to_owned())
    };
    let stored = storage.list()?.into_iter();
    let mut names: Vec<String> = stored.filter_map(|stored| name(stored.file)).collect();
    names.sort_by(|a, b| when(b).cmp(&when(a)));
    Ok(names)
}

/// When one with this name came, for sorting; `None`: no such name is ever given.
fn when(name: &str) -> Option<(&str, u64)> {
    let rest = name.strip_prefix(UNTIL).unwrap_or(name);
    let (time, number) = rest.split_at_checked(20)?;
    let is_time = time
        .bytes()
        .zip(*b"dddd-dd-ddTdd-dd-ddZ")
        .all(|(c, like)| match like {
            b'd' => c.is_ascii_digit(),
            like => c == like,
        });
    let number = match number {
        "" => 1,
        number => number.strip_prefix('-')?.parse().ok()?,
    };
    is_time.then_some((time, number))
}

/// A time as part of a file's name.
fn stamp(rfc3339: &str) -> String {
    rfc3339.replace(':', "-")
}

fn stem(file: &str) -> &str {
    file.strip_suffix(".toml").unwrap_or(file)
}

fn file_of(file: &str, name: &str) -> String {
    format!("{}.{name}.toml", stem(file))
}

fn gone() -> String {
    "it has just been removed".to_owned()
}

fn parse(bytes: io::Result<Option<Vec<u8>>>) -> Result<Option<Calibration>, String> {
    let Some(bytes) = bytes.map_err(|error| error.to_string())? else {
        return Ok(None);
    };
    let text = String::from_utf8(bytes).map_err(|_| "it is not text".to_owned())?;
    let read = from_toml(&text).map_err(|error| error.to_string());
    read.map(Some)
}

fn read_bytes(storage: &dyn Storage, file: &str) -> io::Result<Option<Vec<u8>>> {
    let file = match storage.open(file) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let length = file.length()?;
    if length > MAX_FILE {
        return Err(io::Error::other(format!(
            "it has {length} bytes, far too many for a calibration"
        )));
    }
    let mut bytes = vec![0; length as usize];
    file.read_at(0, &mut bytes)?;
    Ok(Some(bytes))
}

/// Writes `bytes` beside `file`, then renames, so that a crash leaves the old or the new one.
fn put(storage: &dyn Storage, file: &str, bytes: &[u8]) -> io::Result<()> {
    let beside = format!("{file}.new");
    match storage.remove(&beside) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut new = storage.create(&beside)?;
    new.append(bytes)?;
    new.sync()?;
    drop(new);
    storage.rename(&beside, file)
}

#[cfg(test)]
mod tests {
    use posefuse_session::MemoryStorage;

    use super::*;

    const FILE: &str = "calibration.toml";

    fn kept(storage: &MemoryStorage) -> Vec<(String, bool)> {
        let list = list(storage, FILE).unwrap();
        list.into_iter()
            .map(|kept| (kept.name, kept.in_force))
            .collect()
    }

    fn second(number: usize) -> String {
        format!("2026-01-01T00:{:02}:{:02}Z", number / 60, number % 60)
    }

    #[test]
    fn each_is_kept_once_and_the_oldest_go() {
        let storage = MemoryStorage::new();
        write(&storage, FILE, "one", &second(0)).unwrap();
        write(&storage, FILE, "two", &second(0)).unwrap();
        assert_eq!(
            kept(&storage),
            [
                ("2026-01-01T00-00-00Z-2".to_owned(), true),
                ("2026-01-01T00-00-00Z".to_owned(), false)
            ]
        );
        write(&storage, FILE, "one", &second(5)).unwrap();
        assert_eq!(kept(&storage).len(), 2, "a restored one is not kept twice");
        assert!(kept(&storage)[1].1);
        for number in 10..160 {
            write(&storage, FILE, &format!("text {number}"), &second(number)).unwrap();
        }
        let all = kept(&storage);
        assert_eq!(all.len(), MAX_KEPT);
        assert_eq!(all[0], ("2026-01-01T00-02-39Z".to_owned(), true));
        assert_eq!(storage.read(FILE).unwrap(), b"text 159");
    }

    #[test]
    fn what_somebody_wrote_into_the_file_is_kept_and_other_files_are_left_alone() {
        let others = [
            "calibration.mine.toml",
            "calibration.toml.bak",
            "scene.mcap",
        ];
        let files = others.map(|file| (file.to_owned(), b"x".to_vec()));
        let storage = MemoryStorage::holding(files);
        put(&storage, FILE, b"by hand").unwrap();
        write(&storage, FILE, "new", &second(1)).unwrap();
        let names: Vec<_> = kept(&storage).into_iter().map(|(name, _)| name).collect();
        assert_eq!(
            names,
            ["2026-01-01T00-00-01Z", "until-2026-01-01T00-00-01Z"]
        );
        for other in others {
            assert!(storage.read(other).is_ok(), "{other}");
        }
        put(&storage, FILE, b"by hand again").unwrap();
        adopt(&storage, FILE, &second(2)).unwrap();
        assert_eq!(kept(&storage)[0], ("2026-01-01T00-00-02Z".to_owned(), true));
    }

    #[test]
    fn only_names_that_are_given_are_looked_up() {
        let storage = MemoryStorage::new();
        write(&storage, FILE, "one", &second(0)).unwrap();
        for name in [
            "",
            "..",
            "mine",
            "2026-01-01T00-00-00Z-",
            "../2026-01-01T00-00-00Z",
        ] {
            assert!(find(&storage, FILE, name).unwrap().is_none(), "{name}");
        }
        let (text, calibration) = find(&storage, FILE, "2026-01-01T00-00-00Z")
            .unwrap()
            .unwrap();
        assert_eq!(text, "one");
        assert!(calibration.unwrap_err().contains("not a calibration file"));
    }
}
