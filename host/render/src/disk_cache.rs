//! Things on disk that could be made again: what took a while is found by the next start.
//!
//! Invariants: a file is whole or is taken for none: it is written aside and renamed, and begins
//! with its length and a sum of its contents; nothing that is wrong with a file or folder is a
//! failure, since the caller can make the thing again; the folder stays below a size.

use siphasher::sip128::SipHasher13;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use surfelshop_cloud::files;

const MAGIC: &[u8; 16] = b"surfelshop st 2\n";
/// Bytes before the contents: these, their length, and their sum.
const HEAD: usize = 16 + 8 + 16;

/// How names of files end that are being written.
const UNFINISHED: &str = ".part";

/// Most bytes of all files; the ones used longest ago go first.
const MOST_BYTES: u64 = 256 << 20;

/// Largest thing that is stored: a map of 2048 x 2048 texels of three floats, and some more.
const LARGEST: u64 = 64 << 20;

/// A folder of such things.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiskCache {
    folder: PathBuf,
    /// Most bytes of all files.
    room: u64,
}

impl DiskCache {
    /// One in a folder, which is made with the first thing.
    #[must_use]
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), room: MOST_BYTES }
    }

    /// The file of a name: a sum of it, so that any text will do.
    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{:032x}", sum(name.as_bytes())))
    }

    /// What is stored under a name; `None` where there is nothing, or nothing whole.
    #[must_use]
    pub fn load(&self, name: &str) -> Option<Vec<u8>> {
        let path = self.path(name);
        let mut bytes = files::read(&path, LARGEST + HEAD as u64).ok()?;
        let length = u64::from_le_bytes(bytes.get(16..24)?.try_into().ok()?);
        let expected = u128::from_le_bytes(bytes.get(24..HEAD)?.try_into().ok()?);
        let contents = bytes.get(HEAD..)?;
        let whole = bytes.starts_with(MAGIC)
            && contents.len() as u64 == length
            && sum(contents) == expected;
        if !whole {
            return None;
        }
        // Used now: others go before it. A folder that does not allow it loses only that.
        if let Ok(file) = fs::File::options().append(true).open(&path) {
            drop(file.set_modified(SystemTime::now()));
        }
        bytes.drain(..HEAD);
        Some(bytes)
    }

    /// Stores something under a name, instead of what was there.
    pub fn save(&self, name: &str, contents: &[u8]) {
        if contents.len() as u64 > LARGEST {
            return;
        }
        if let Err(error) = self.try_to_save(name, contents) {
            tracing::debug!(%error, folder = %self.folder.display(), "not stored");
        }
    }

    fn try_to_save(&self, name: &str, contents: &[u8]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        self.make_room(contents.len() as u64);
        let mut file = tempfile::Builder::new().suffix(UNFINISHED).tempfile_in(&self.folder)?;
        file.write_all(MAGIC)?;
        file.write_all(&(contents.len() as u64).to_le_bytes())?;
        file.write_all(&sum(contents).to_le_bytes())?;
        file.write_all(contents)?;
        file.persist(self.path(name))?;
        Ok(())
    }

    /// Removes what was used longest ago until so many bytes fit.
    fn make_room(&self, bytes: u64) {
        let Ok(listing) = self.folder.read_dir() else { return };
        let mut files: Vec<(SystemTime, u64, PathBuf)> = listing
            .flatten()
            .filter_map(|found| {
                let metadata = found.metadata().ok().filter(fs::Metadata::is_file)?;
                let time = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                Some((time, metadata.len(), found.path())).filter(|(_, _, path)| is_own(path))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(_, length, _)| length).sum();
        for (_, length, path) in files {
            if total + bytes <= self.room {
                return;
            }
            drop(fs::remove_file(path));
            total -= length;
        }
    }
}

/// Whether a file's name is one that a store gives, finished or left behind by a crash.
fn is_own(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let finished = name.len() == 32 && name.bytes().all(|byte| byte.is_ascii_hexdigit());
    finished || name.ends_with(UNFINISHED)
}

/// A sum over bytes: against mistakes, not against forgery.
fn sum(bytes: &[u8]) -> u128 {
    SipHasher13::new().hash(bytes).as_u128()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Invariant: what is stored for the next start is whole or taken for nothing
    #[test]
    fn what_is_stored_is_found_until_something_is_wrong_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let store = DiskCache::in_folder(folder.path().join("deep/er"));
        assert_eq!(store.load("a"), None);
        store.save("a", b"one");
        store.save("b/..//\0", &[7; 1000]);
        assert_eq!(store.load("a").unwrap(), b"one");
        assert_eq!(store.load("b/..//\0").unwrap(), [7; 1000]);
        store.save("a", b"");
        assert_eq!(store.load("a").unwrap(), b"");
        let path = store.path("b/..//\0");
        let good = fs::read(&path).unwrap();
        for length in [0, 10, HEAD, good.len() - 1] {
            fs::write(&path, &good[..length]).unwrap();
            assert_eq!(store.load("b/..//\0"), None, "{length} bytes");
        }
        for at in (0..good.len()).step_by(7) {
            let mut bad = good.clone();
            bad[at] ^= 1;
            fs::write(&path, bad).unwrap();
            assert_eq!(store.load("b/..//\0"), None, "byte {at}");
        }
    }

    #[test]
    fn what_was_used_longest_ago_makes_room() {
        let folder = tempfile::tempdir().unwrap();
        let store = DiskCache { room: 5000, ..DiskCache::in_folder(folder.path()) };
        fs::write(folder.path().join("not ours"), "").unwrap();
        let large = vec![1; 1000];
        for name in ["a", "b", "c", "d"] {
            store.save(name, &large);
            std::thread::sleep(std::time::Duration::from_millis(20));
            assert!(store.load("a").is_some());
        }
        // With their heads four of them fit; `b` is the oldest: `a` was used since.
        store.save("e", &large);
        assert!(store.load("b").is_none() && store.load("a").is_some());
        assert!(folder.path().join("not ours").exists());
    }
}
