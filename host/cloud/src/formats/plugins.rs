//! What reading and writing need of formats that are plugins: who finds and runs them is above this crate.

use crate::error::ReadFault;
use crate::formats::table_sink::TableSink;
use std::fs::File;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::params::Values as Parameters;
use surfelshop_geometry::Progress;

/// How a format is used for a file.
#[derive(Clone, Copy, Default)]
pub struct FormatCall<'a> {
    /// The file's name, without its folder.
    pub name: &'a str,
    /// Parameters that were set.
    pub values: Option<&'a Parameters>,
    /// Columns that are wanted; all where there is no list.
    pub columns: Option<&'a [String]>,
}

/// A sink that a format's thread and its caller share. The caller stops waiting for a format that hangs, and
/// leaves it the sink.
pub type SharedSink = Arc<Mutex<dyn CloudSinkHost + Send>>;

/// The formats at hand besides those that are built in.
pub trait Formats: Sync {
    /// The id of the format whose first bytes a file has; runs no code of a plugin.
    fn by_bytes(&self, head: &[u8]) -> Option<String>;

    /// The id of the format whose ending a name has; `written` asks for one that writes.
    fn by_name(&self, name: &str, written: bool) -> Option<String>;

    /// Whether a format takes several clouds, each with its pose, when it writes.
    fn takes_several(&self, id: &str) -> bool;

    /// Endings of the formats, `written` of those that write: for messages and dialogs.
    fn endings(&self, written: bool) -> Vec<String>;

    /// Reads a file into a sink.
    ///
    /// # Errors
    /// Where the plugin cannot be loaded, fails, hangs, or `progress` asked to stop.
    fn read(
        &self,
        id: &str,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        sink: SharedSink,
        progress: Progress<'_>,
    ) -> Result<(), ReadFault>;

    /// Writes clouds to a file, and says what the format cannot hold.
    ///
    /// # Errors
    /// A line, where the plugin cannot be loaded, fails, or hangs; [`WriteFault::Cancelled`] where `progress`
    /// asked to stop.
    fn write(
        &self,
        id: &str,
        clouds: Box<dyn CloudSourceHost + Send>,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault>;
}

/// Why a format wrote no file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WriteFault {
    /// A line.
    Line(String),
    /// It was asked to stop.
    Cancelled,
}

/// No formats but those that are built in.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoFormats;

impl Formats for NoFormats {
    fn by_bytes(&self, _head: &[u8]) -> Option<String> {
        None
    }

    fn by_name(&self, _name: &str, _written: bool) -> Option<String> {
        None
    }

    fn takes_several(&self, _id: &str) -> bool {
        false
    }

    fn endings(&self, _written: bool) -> Vec<String> {
        Vec::new()
    }

    fn read(
        &self,
        id: &str,
        _file: Arc<dyn FileHost>,
        _call: FormatCall<'_>,
        _sink: SharedSink,
        _progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        Err(ReadFault::Format { format: id.to_owned(), line: format!("there is no format `{id}`") })
    }

    fn write(
        &self,
        id: &str,
        _clouds: Box<dyn CloudSourceHost + Send>,
        _file: Arc<dyn FileHost>,
        _call: FormatCall<'_>,
        _progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault> {
        Err(WriteFault::Line(format!("there is no format `{id}`")))
    }
}

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
        read_at(&self.file, offset, buffer)
    }
}

/// A table sink that is lent to a format and taken back.
pub(crate) struct LentTable(Arc<Mutex<TableSink>>);

impl LentTable {
    pub(crate) fn new(sink: TableSink) -> Self {
        Self(Arc::new(Mutex::new(sink)))
    }

    pub(crate) fn shared(&self) -> SharedSink {
        Arc::new(Mutex::new(SinkOf(Arc::clone(&self.0))))
    }

    /// What came into it. A format that goes on for some reason is refused from now on.
    pub(crate) fn take(self) -> TableSink {
        let mut sink = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = std::mem::take(&mut *sink);
        sink.close();
        taken
    }
}

/// Hands everything on to a shared table.
struct SinkOf(Arc<Mutex<TableSink>>);

impl SinkOf {
    fn table(&self) -> std::sync::MutexGuard<'_, TableSink> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CloudSinkHost for SinkOf {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        self.table().begin(header)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> surfelshop_api::Result<()> {
        self.table().batch(values)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        self.table().faces(triangles)
    }

    fn warn(&mut self, line: &str) {
        self.table().warn(line);
    }
}
