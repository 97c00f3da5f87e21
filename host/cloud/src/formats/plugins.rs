//! What reading and writing need of formats that are plugins: who finds and runs them is above this crate.

use crate::error::ReadFault;
use std::sync::{Arc, Mutex};
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost, FileHost, PointNode};
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
    /// Of a file whose points lie in an octree the nodes that are wanted; all points where there is no list.
    pub nodes: Option<&'a [PointNode]>,
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

    /// Whether a format takes grids with their empty places when it writes.
    fn takes_grids(&self, _id: &str) -> bool {
        false
    }

    /// Which files a format reads that lie beside the one it is asked to read: names, or `*` with what they end with.
    fn beside(&self, _id: &str) -> Vec<String> {
        Vec::new()
    }

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
