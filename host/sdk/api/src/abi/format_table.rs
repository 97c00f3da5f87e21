//! The C structures of file formats, beside those of [`table`](super::table). ABI 3.8.

use super::table::{Bytes, RawCloud, RawJob, Sink};
use core::ffi::c_void;

/// Name of the exported [`FormatTable`]; a plugin without formats has none.
pub const SYMBOL: &str = "SURFELSHOP_FORMATS";
/// First bytes of the table.
pub const MAGIC: [u8; 8] = *b"SURFELF\0";

/// What a call of a cloud sink or source returns besides a [`status`](super::table::status): there is no more, or
/// no more is wanted.
pub const END: i32 = 3;

/// Where `next_cloud` writes the header of a cloud, beside the channels of [`channel`](super::table::channel).
pub const HEADER_CHANNEL: u32 = 5;
/// Where [`FormatTable::write`] writes lines for people, msgpack of a list of strings.
pub const LINES_CHANNEL: u32 = 6;

/// A file that the host lends for a call. Its functions may be called from any thread.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawFile {
    /// Passed back to the functions.
    pub context: *mut c_void,
    /// The file's name without its folder, UTF-8.
    pub name: Bytes,
    /// Length in bytes; of a file that is written, as far as it was.
    pub length: unsafe extern "C" fn(context: *mut c_void) -> u64,
    /// Reads up to `len` bytes from an offset and stores how many were there, fewer only at the file's end.
    /// Returns a status; on failure the reason is written to the sink.
    pub read_at: unsafe extern "C" fn(
        context: *mut c_void,
        offset: u64,
        buffer: *mut u8,
        len: usize,
        n_read: *mut usize,
        sink: Sink,
    ) -> i32,
    /// Writes bytes at an offset. Returns a status; fails for a file that is read.
    pub write_at:
        unsafe extern "C" fn(context: *mut c_void, offset: u64, bytes: Bytes, sink: Sink) -> i32,
}

/// Where a format puts clouds. Its functions are called from one thread at a time.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawCloudSink {
    /// Passed back to the functions.
    pub context: *mut c_void,
    /// Takes msgpack of [`CloudHeader`](crate::format::CloudHeader). Returns a status, or [`END`] where the
    /// cloud's points are not wanted.
    pub begin: unsafe extern "C" fn(context: *mut c_void, header: Bytes, sink: Sink) -> i32,
    /// Takes the values of the next points: for each column of the header its bytes, in the machine's order,
    /// all components of a point together. Returns a status.
    pub batch: unsafe extern "C" fn(
        context: *mut c_void,
        values: *const Bytes,
        n_values: usize,
        sink: Sink,
    ) -> i32,
    /// Takes triangles: indices of three points. Returns a status.
    pub faces: unsafe extern "C" fn(
        context: *mut c_void,
        triangles: *const [u32; 3],
        n_triangles: usize,
        sink: Sink,
    ) -> i32,
    /// Takes a line of UTF-8 for people.
    pub warn: unsafe extern "C" fn(context: *mut c_void, line: Bytes),
}

/// Where a format takes the clouds that it writes. Its functions are called from one thread at a time.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawCloudSource {
    /// Passed back to the functions.
    pub context: *mut c_void,
    /// Writes msgpack of the next cloud's [`CloudHeader`](crate::format::CloudHeader) to
    /// [`HEADER_CHANNEL`]. Returns a status, or [`END`] after the last.
    pub next_cloud: unsafe extern "C" fn(context: *mut c_void, sink: Sink) -> i32,
    /// Stores the next points, which stay until the next call of this structure. Returns a status, or [`END`] after the
    /// last.
    pub next_batch:
        unsafe extern "C" fn(context: *mut c_void, batch: *mut RawCloud, sink: Sink) -> i32,
}

/// The functions of a plugin's formats. Instances are made and ended by the plugin's other table.
#[repr(C)]
pub struct FormatTable {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// Size of this structure in bytes, as the plugin was built.
    pub size: u32,
    /// ABI major version.
    pub abi_major: u16,
    /// ABI minor version.
    pub abi_minor: u16,
    /// Reads a file; `request` is msgpack of [`ReadCall`].
    pub read: unsafe extern "C" fn(
        instance: *mut c_void,
        request: Bytes,
        file: *const RawFile,
        clouds: *const RawCloudSink,
        job: *const RawJob,
        sink: Sink,
    ) -> i32,
    /// Writes a file; `values` is msgpack of [`Values`](crate::params::Values). What the format cannot hold is
    /// written to [`LINES_CHANNEL`].
    pub write: unsafe extern "C" fn(
        instance: *mut c_void,
        values: Bytes,
        clouds: *const RawCloudSource,
        file: *const RawFile,
        job: *const RawJob,
        sink: Sink,
    ) -> i32,
}

/// What a format is asked to read.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct ReadCall {
    /// The unit's parameters by id; missing ones have their default.
    pub values: crate::params::Values,
    /// The columns that somebody reads, by name; all where there is no list.
    pub columns: Option<Vec<String>>,
    /// Of a file whose points lie in an octree the nodes that are wanted; all points where there is no list. Came
    /// while ABI 3.8 was current.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<Vec<crate::format::PointNode>>,
    /// Files beside the one that is read, whose bytes lie behind its end. Came while ABI 3.11 was current.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<crate::format::FileBeside>,
}
