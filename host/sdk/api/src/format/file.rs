//! Bytes of a file that the host lends for a call.

use super::file_beside::{FileBeside, Part, WithFilesBeside};
use crate::error::{Error, Result};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::sync::Arc;

/// Who has the bytes of a file.
pub trait FileHost: Send + Sync {
    /// Length in bytes; of a file that is written, as far as it was.
    fn length(&self) -> u64;

    /// Reads bytes from an offset; returns how many, fewer than the buffer has only at the end.
    ///
    /// # Errors
    /// Where the system refuses, or the call that the file was lent for has ended.
    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize>;

    /// Writes bytes at an offset; the file grows where it ends before.
    ///
    /// # Errors
    /// As [`read_at`](Self::read_at), and where the file is only read.
    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let _nothing_written = (offset, bytes);
        Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is only read"))
    }

    /// The files of its folder that may be read with it. Came while ABI 3.11 was current.
    fn beside(&self) -> Vec<FileBeside> {
        Vec::new()
    }
}

/// A file to read. Clones share it; all of them stop working when the call ends that it was lent for.
/// It can be read from several threads at once.
#[derive(Clone)]
pub struct FileSource {
    host: Arc<dyn FileHost>,
    name: Arc<str>,
}

impl FileSource {
    /// A file of this name, without its folder.
    #[must_use]
    pub fn new(host: Arc<dyn FileHost>, name: &str) -> Self {
        Self { host, name: name.into() }
    }

    /// A file in memory, for tests of formats.
    #[must_use]
    pub fn of_bytes(bytes: Vec<u8>, name: &str) -> Self {
        Self::new(Arc::new(MemoryFile(bytes)), name)
    }

    /// Several files of a folder in memory, for tests of formats: the first is read, the others lie beside it.
    ///
    /// # Panics
    /// Where there is none.
    #[must_use]
    pub fn of_files(files: Vec<(&str, Vec<u8>)>) -> Self {
        let mut files = files.into_iter();
        let (name, bytes) = files.next().expect("a file");
        let memory = |bytes| -> Arc<dyn FileHost> { Arc::new(MemoryFile(bytes)) };
        let beside = files.map(|(name, bytes)| (name.to_owned(), memory(bytes))).collect();
        Self::new(Arc::new(WithFilesBeside::new(memory(bytes), beside)), name)
    }

    /// The file's name, without its folder.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A file of the same folder, of those that [`FileTypes::beside`](super::FileTypes::beside) names; where none has
    /// this name, one in another case. Came while ABI 3.11 was current.
    ///
    /// # Errors
    /// Where no such file is there, or the format did not say that it reads it.
    pub fn beside(&self, name: &str) -> Result<Self> {
        let files = self.host.beside();
        let alike = || files.iter().find(|file| file.name.eq_ignore_ascii_case(name));
        let found = files.iter().find(|file| file.name == name).or_else(alike).cloned();
        let missing = || {
            let name = name.escape_debug();
            Error::new(format!("expected the file `{name}` beside it, found none that may be read"))
        };
        let FileBeside { name, at, length } = found.ok_or_else(missing)?;
        let part = Part { host: Arc::clone(&self.host), at, length };
        Ok(Self::new(Arc::new(part), &name))
    }

    /// Length in bytes.
    #[must_use]
    pub fn length(&self) -> u64 {
        self.host.length()
    }

    /// Reads bytes from an offset; returns how many, fewer than the buffer has only at the end.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<usize> {
        Ok(self.host.read_at(offset, buffer)?)
    }

    /// Fills a buffer from an offset.
    ///
    /// # Errors
    /// Where the file ends before, or the system refuses.
    pub fn read_exact_at(&self, offset: u64, buffer: &mut [u8]) -> Result<()> {
        let found = self.read_at(offset, buffer)?;
        if found == buffer.len() {
            return Ok(());
        }
        Err(Error::new(format!(
            "expected {} bytes from byte {offset}, found {found}: the file is cut short",
            buffer.len()
        )))
    }

    /// So many bytes from an offset, which are checked against the file's length before memory is taken.
    ///
    /// # Errors
    /// Where the file ends before, or the system refuses.
    pub fn bytes_at(&self, offset: u64, len: u64) -> Result<Vec<u8>> {
        let left = self.length().saturating_sub(offset);
        if len > left {
            return Err(Error::new(format!(
                "expected {len} bytes from byte {offset}, found {left}: the file is cut short"
            )));
        }
        let len = usize::try_from(len)?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(len)?;
        bytes.resize(len, 0);
        self.read_exact_at(offset, &mut bytes)?;
        Ok(bytes)
    }

    /// The file as a stream from its beginning, not buffered. It may be moved to other threads.
    #[must_use]
    pub fn stream(&self) -> FileStream {
        FileStream { host: Arc::clone(&self.host), place: 0 }
    }
}

/// A file to write, empty at first. The host puts it in the place of an old one when the call has ended well.
#[derive(Clone)]
pub struct FileSink {
    host: Arc<dyn FileHost>,
    name: Arc<str>,
}

impl FileSink {
    /// A file to write, of this name without its folder.
    #[must_use]
    pub fn new(host: Arc<dyn FileHost>, name: &str) -> Self {
        Self { host, name: name.into() }
    }

    /// The file's name, without its folder: formats of several endings are told by it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Writes bytes at an offset; the file grows where it ends before.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write_at(&self, offset: u64, bytes: &[u8]) -> Result<()> {
        Ok(self.host.write_at(offset, bytes)?)
    }

    /// The file as a stream from its beginning, not buffered. It may be moved to other threads.
    #[must_use]
    pub fn stream(&self) -> FileStream {
        FileStream { host: Arc::clone(&self.host), place: 0 }
    }
}

/// A place in a file: reads, writes where the file is written, and seeks.
#[derive(Clone)]
pub struct FileStream {
    host: Arc<dyn FileHost>,
    place: u64,
}

impl std::fmt::Debug for FileStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FileStream").field("place", &self.place).finish_non_exhaustive()
    }
}

impl Read for FileStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let found = self.host.read_at(self.place, buffer)?;
        self.place += found as u64;
        Ok(found)
    }
}

impl Write for FileStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.host.write_at(self.place, bytes)?;
        self.place += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for FileStream {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(back) => self.host.length().checked_add_signed(back),
            SeekFrom::Current(by) => self.place.checked_add_signed(by),
        };
        let before = || io::Error::new(io::ErrorKind::InvalidInput, "a place before the file");
        self.place = place.ok_or_else(before)?;
        Ok(self.place)
    }
}

/// Bytes in memory as a file.
struct MemoryFile(Vec<u8>);

impl FileHost for MemoryFile {
    fn length(&self) -> u64 {
        self.0.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let start = usize::try_from(offset).unwrap_or(usize::MAX).min(self.0.len());
        let len = buffer.len().min(self.0.len() - start);
        buffer[..len].copy_from_slice(&self.0[start..start + len]);
        Ok(len)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn announced_lengths_are_checked_before_memory_is_taken() {
        let file = FileSource::of_bytes(b"abcdef".to_vec(), "a.bin");
        assert_eq!(file.bytes_at(2, 3).unwrap(), b"cde");
        let line = file.bytes_at(2, u64::MAX).unwrap_err().to_string();
        assert!(line.contains("found 4") && line.contains("cut short"), "{line}");
        let mut stream = file.stream();
        stream.seek(SeekFrom::End(-2)).unwrap();
        let mut rest = String::new();
        stream.read_to_string(&mut rest).unwrap();
        assert_eq!(rest, "ef");
        assert!(stream.write(b"x").is_err() && stream.seek(SeekFrom::Current(-7)).is_err());
        assert_eq!(file.read_at(u64::MAX, &mut [0; 4]).unwrap(), 0);
    }
}
