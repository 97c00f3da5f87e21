//! Opening files, and replacing them atomically.
//!
//! Only regular files are read: a pipe would keep the reader waiting for ever, and a device has no end. Files
//! are written beside their target and renamed when they are whole, so that a failure, a signal or a crash
//! leaves what stood there before; nothing but a regular file is replaced, and the new one has the rights of
//! the old.
//!
//! Invariants: no call here waits for another program to write or read; a file that is being written has a
//! name that starts with [`PREFIX`] and ends with [`SUFFIX`] and is locked, and such files that nobody holds
//! are removed by the next one who writes into the folder.

use crate::formats::positioned;
use crate::memory::{OutOfMemory, with_room};
use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_api::format::FileHost;
use tempfile::NamedTempFile;

/// How the name of a file starts that is being written.
pub const PREFIX: &str = ".surfelshop-";
/// How it ends.
pub const SUFFIX: &str = ".part";

/// Why a file was not opened or read, without its name.
#[derive(Debug, thiserror::Error)]
pub enum OpenFault {
    /// The system refused.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// It is no regular file.
    #[error("expected a file, found {found}; name the file itself")]
    NotAFile {
        /// What it is.
        found: &'static str,
    },
    /// It is longer than it may be.
    #[error("expected at most {most} bytes, found {found}")]
    TooLong {
        /// Bytes that are allowed.
        most: u64,
        /// Bytes found, at least.
        found: u64,
    },
    /// It does not fit into memory.
    #[error("cannot be read: {0}")]
    Memory(#[from] OutOfMemory),
}

impl From<io::Error> for OpenFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// The folder that the program was started in.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// Keeps the folder that the program is in now: names are of this one from now on, wherever code of others takes
/// the program.
pub fn keep_folder() {
    if let Ok(folder) = std::env::current_dir() {
        // The first one counts.
        drop(FOLDER.set(folder));
    }
}

/// Takes the program back to the folder of [`keep_folder`]: for after code of others has run, which may have gone
/// elsewhere. A folder that is gone meanwhile is left as it is.
pub fn return_to_folder() {
    if let Some(folder) = FOLDER.get()
        && std::env::current_dir().ok().as_ref() != Some(folder)
    {
        drop(std::env::set_current_dir(folder));
    }
}

/// A name as it was meant when the program was started.
pub(crate) fn absolute(path: &Path) -> PathBuf {
    match FOLDER.get() {
        Some(folder) => folder.join(path),
        None => path.to_owned(),
    }
}

/// What something that is no regular file is called; `None` for a regular file.
fn other_kind(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        None
    } else if kind.is_dir() {
        Some("a folder")
    } else {
        Some("a pipe or device")
    }
}

/// Opens a regular file to be read; also what the system says of it.
///
/// # Errors
/// Where it cannot be opened or is no regular file; does not wait for what is none.
pub fn open(path: &Path) -> Result<(File, Metadata), OpenFault> {
    let path = &absolute(path);
    // Asked before, since to open a device may do something.
    if let Some(found) = other_kind(&path.metadata()?) {
        return Err(OpenFault::NotAFile { found });
    }
    let mut options = OpenOptions::new();
    options.read(true);
    // And after, since it may have been exchanged; without this flag a pipe would wait for a writer.
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    }
    let file = options.open(path)?;
    let metadata = file.metadata()?;
    match other_kind(&metadata) {
        Some(found) => Err(OpenFault::NotAFile { found }),
        None => Ok((file, metadata)),
    }
}

/// The contents of a regular file of at most `most` bytes.
///
/// # Errors
/// Where it cannot be opened or read, is no regular file, is longer, or does not fit into memory.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, OpenFault> {
    let (file, metadata) = open(path)?;
    let found = metadata.len();
    if found > most {
        return Err(OpenFault::TooLong { most, found });
    }
    // Small files may grow while they are read; long ones have room for what they announce.
    let mut bytes = with_room(usize::try_from(found).unwrap_or(usize::MAX))?;
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 {
        found if found > most => Err(OpenFault::TooLong { most, found }),
        _ => Ok(bytes),
    }
}

/// Where a path leads that is written to: links are followed, to a file that need not be there yet.
fn target(path: &Path) -> PathBuf {
    // As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let path = absolute(path);
    let mut target = path.clone();
    for _ in 0..MOST_LINKS {
        if let Ok(resolved) = target.canonicalize() {
            return resolved;
        }
        let Ok(next) = fs::read_link(&target) else { return target };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    path
}

/// Where the file of this name would be written: the folder and name that links lead to.
///
/// # Errors
/// One line after the file's name where what stands there is no regular file or is write-protected.
pub fn replaceable(path: &Path) -> Result<PathBuf, io::Error> {
    let target = target(path);
    match target.metadata() {
        Ok(old) => match other_kind(&old) {
            Some(found) => Err(io::Error::other(format!(
                "expected a file to replace, found {found}; name a file"
            ))),
            None if old.permissions().readonly() => Err(io::Error::other(
                "the file is write-protected; make it writable, or name another",
            )),
            None => Ok(target),
        },
        Err(_) => Ok(target),
    }
}

/// The folder a file lies in.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Files that this process is writing, which [`abandon`] removes.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the unfinished files of this process: for a program that is about to end without the usual
/// clean-up. Nobody makes another for as long as the answer lives. A thread that a file system holds up is not
/// waited for.
#[must_use = "another thread may go on writing once it is dropped"]
pub fn abandon() -> impl Sized {
    const LONGEST: Duration = Duration::from_secs(1);
    let began = Instant::now();
    let unfinished = loop {
        match UNFINISHED.try_lock() {
            Ok(unfinished) => break Some(unfinished),
            Err(std::sync::TryLockError::Poisoned(error)) => break Some(error.into_inner()),
            Err(std::sync::TryLockError::WouldBlock) if began.elapsed() > LONGEST => break None,
            Err(std::sync::TryLockError::WouldBlock) => std::thread::sleep(LONGEST / 1000),
        }
    };
    for path in unfinished.iter().flat_map(|paths| paths.iter()) {
        // Nobody is left to tell.
        drop(fs::remove_file(path));
    }
    unfinished
}

/// Replaces a file, or makes it: what `write` writes gets the file's name when it is whole. An old file's
/// rights are kept.
///
/// # Errors
/// Where what stands there is not to be replaced, the system refuses, or `write` fails; what stood there still
/// does then.
pub fn replace<E>(
    path: &Path,
    write: impl FnOnce(&mut dyn io::Write) -> Result<(), E>,
    failed: impl Fn(io::Error) -> E,
) -> Result<(), E> {
    let target = replaceable(path).map_err(&failed)?;
    let mut out = BufWriter::with_capacity(1 << 18, beside(&target).map_err(&failed)?);
    write(&mut out)?;
    let file = out.into_inner().map_err(|error| failed(error.into_error()))?;
    file.finish(&target).map_err(failed)
}

/// Replaces a file, or makes it, as [`replace`]; it is written at any place of it, and may be read meanwhile.
///
/// # Errors
/// As [`replace`].
pub fn replace_at<T, E>(
    path: &Path,
    write: impl FnOnce(Arc<dyn FileHost>) -> Result<T, E>,
    failed: impl Fn(io::Error) -> E,
) -> Result<T, E> {
    let target = replaceable(path).map_err(&failed)?;
    let file = beside(&target).map_err(&failed)?;
    let lent = match &file.file {
        Some(file) => file.as_file().try_clone().map_err(&failed)?,
        None => return Err(failed(io::Error::other("the file is gone"))),
    };
    let value = write(Arc::new(WrittenFile { file: lent, length: AtomicU64::new(0) }))?;
    file.finish(&target).map_err(failed)?;
    Ok(value)
}

/// A file that is being written, as formats are lent it.
struct WrittenFile {
    file: File,
    length: AtomicU64,
}

impl FileHost for WrittenFile {
    fn length(&self) -> u64 {
        self.length.load(Ordering::Relaxed)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        positioned::read_at(&self.file, offset, buffer)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let end = offset.checked_add(bytes.len() as u64);
        let end = end.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        positioned::write_all_at(&self.file, offset, bytes)?;
        self.length.fetch_max(end, Ordering::Relaxed);
        Ok(())
    }
}

/// Replaces a file by these bytes.
///
/// # Errors
/// As [`replace`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace(path, |out| out.write_all(bytes), |error| error)
}

/// Opens a regular file to write behind what it holds, or makes it.
///
/// # Errors
/// Where what stands there is no regular file or is write-protected, or the system refuses.
pub fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).create(true).open(replaceable(path)?)
}

/// Says early, before long work, that a file could not be written.
///
/// # Errors
/// Where what stands there is not to be replaced, or its folder takes no new files.
pub fn check_writable(path: &Path) -> io::Result<()> {
    beside(&replaceable(path)?).map(drop)
}

/// A new file in the folder of `target`, with the rights and, where that is allowed, the owner of the file it
/// is to replace.
fn beside(target: &Path) -> io::Result<TemporaryFile> {
    let unfinished = TemporaryFile::create(folder_of(target))?;
    if let (Ok(old), Some(file)) = (target.metadata(), &unfinished.file) {
        #[cfg(unix)]
        {
            use std::os::unix::fs::{MetadataExt as _, fchown};
            // Each by itself: anybody may give a file to another group of theirs, and only a superuser to another
            // owner, who would otherwise take it away.
            drop(fchown(file.as_file(), None, Some(old.gid())));
            drop(fchown(file.as_file(), Some(old.uid()), None));
        }
        // Not every file system has rights; the file is whole without.
        drop(file.as_file().set_permissions(old.permissions()));
    }
    Ok(unfinished)
}

/// A file that is being written: has a name of its own until it is whole, is locked for as long, and is
/// removed where it is dropped before.
struct TemporaryFile {
    file: Option<NamedTempFile>,
    path: PathBuf,
}

impl TemporaryFile {
    fn create(folder: &Path) -> io::Result<Self> {
        remove_stale(folder);
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX);
        // Temporary files are private by default; a file that a user asked for has the usual rights.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        // Somebody who locks whatever appears in the folder is not waited for; the last one is written without.
        const MOST_NAMES: usize = 8;
        let mut n_names = 0;
        loop {
            n_names += 1;
            let mut known = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
            let file = builder.tempfile_in(folder)?;
            let path = file.path().to_owned();
            // Not every file system has locks; there nobody else removes the file either.
            let is_anothers = matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
            // Whoever cleans up may have been faster than the lock.
            if path.exists() && (!is_anothers || n_names == MOST_NAMES) {
                known.push(path.clone());
                return Ok(Self { file: Some(file), path });
            }
        }
    }

    /// Gives the file its name.
    fn finish(mut self, target: &Path) -> io::Result<()> {
        match self.file.take() {
            Some(file) => file.persist(target).map(drop).map_err(|error| error.error),
            None => Ok(()),
        }
    }
}

impl io::Write for TemporaryFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().map_or(Ok(0), |file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), io::Write::flush)
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let mut known = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|path| *path != self.path);
        drop(self.file.take());
    }
}

/// Removes what programs that were killed left unfinished in a folder: files of this program's names that
/// nobody holds.
fn remove_stale(folder: &Path) {
    let Ok(listing) = folder.read_dir() else { return };
    for found in listing.flatten() {
        let name = found.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with(PREFIX) || !name.ends_with(SUFFIX) {
            continue;
        }
        let path = found.path();
        // The entry itself and not what a link leads to.
        if !found.metadata().is_ok_and(|metadata| metadata.is_file()) {
            continue;
        }
        let Ok((file, _)) = open(&path) else { continue };
        // Its writer has it locked, and gives it another name before that ends.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock | TryLockError::Error(_))) {
            continue;
        }
        // Another program may be as fast; what cannot be removed stays.
        drop(fs::remove_file(&path));
    }
}

#[cfg(test)]
mod tests;
