//! Files of the system that are read and written at any place.

use std::fs::File;
use std::io;
use surfelshop_api::format::FileHost;

/// A file of the system as formats are lent it.
pub struct SystemFile {
    file: File,
    length: u64,
}

impl SystemFile {
    /// A file to read, of the length it has now.
    #[must_use]
    pub fn new(file: File, length: u64) -> Self {
        Self { file, length }
    }
}

#[cfg(unix)]
fn read_once(file: &File, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_once(file: &File, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, offset)
}

#[cfg(unix)]
pub(crate) fn write_all_at(file: &File, offset: u64, bytes: &[u8]) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

#[cfg(windows)]
pub(crate) fn write_all_at(file: &File, mut offset: u64, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        let written = std::os::windows::fs::FileExt::seek_write(file, bytes, offset)?;
        if written == 0 {
            return Err(io::ErrorKind::WriteZero.into());
        }
        offset += written as u64;
        bytes = &bytes[written..];
    }
    Ok(())
}

/// Fills a buffer from an offset as far as the file goes.
pub(crate) fn read_at(file: &File, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    let mut found = 0;
    while found < buffer.len() {
        let Some(place) = offset.checked_add(found as u64) else { break };
        match read_once(file, place, &mut buffer[found..]) {
            Ok(0) => break,
            Ok(n) => found += n,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

impl FileHost for SystemFile {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        // Offsets beyond what systems have are beyond every file's end.
        if offset >= self.length {
            return Ok(0);
        }
        // No more than it had when it was opened, should it have grown.
        let left = usize::try_from(self.length - offset).unwrap_or(usize::MAX);
        let len = buffer.len().min(left);
        read_at(&self.file, offset, &mut buffer[..len])
    }
}
