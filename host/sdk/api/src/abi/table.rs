//! The C structures of the boundary. They change with the ABI major version alone: rows of an array and
//! functions of the table have a fixed size on both sides. What is added within it travels as msgpack.

use core::ffi::c_void;

/// Name of the exported [`PluginTable`].
pub const SYMBOL: &str = "SURFELSHOP_PLUGIN";
/// First bytes of the table.
pub const MAGIC: [u8; 8] = *b"SURFELP\0";

/// Borrowed bytes; valid for the duration of the call.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Bytes {
    /// First byte; may be dangling where `len` is 0.
    pub ptr: *const u8,
    /// Number of bytes.
    pub len: usize,
}

/// What bytes written to a [`Sink`] are.
pub mod channel {
    /// One readable line that says what went wrong.
    pub const ERROR: u32 = 1;
    /// A unit's self-description, msgpack of [`Description`](super::super::plugin_side::Description).
    pub const DESCRIPTION: u32 = 2;
    /// The structure of a graph, msgpack of [`Structure`](crate::graph::Structure).
    pub const STRUCTURE: u32 = 3;
    /// The bytes of a graph's uniforms and uploads.
    pub const DATA: u32 = 4;
    /// The bytes of the first buffer of a computation; those of the others follow.
    pub const BUFFERS: u32 = 16;
}

/// Where a plugin writes what it produces; the host owns the memory.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Sink {
    /// Passed back to `write`.
    pub context: *mut c_void,
    /// Takes a copy of the bytes for a channel; replaces what the channel held.
    pub write: unsafe extern "C" fn(context: *mut c_void, channel: u32, bytes: Bytes),
}

/// How a call ended.
pub mod status {
    /// As asked.
    pub const OK: i32 = 0;
    /// Not as asked; the error channel says why.
    pub const ERROR: i32 = 1;
    /// The plugin's code panicked; the error channel says where.
    pub const PANIC: i32 = 2;
}

/// One column of a cloud; values stay the host's.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawColumn {
    /// UTF-8 name.
    pub name: Bytes,
    /// Code of the [`Element`](crate::columns::Element).
    pub element: u32,
    /// Elements per surfel.
    pub components: u32,
    /// Changes whenever the values change.
    pub generation: u64,
    /// First element, aligned for its type.
    pub values: *const c_void,
    /// Number of elements.
    pub len: usize,
}

/// A cloud; columns stay the host's.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawCloud {
    /// World position that positions are relative to.
    pub origin: [f64; 3],
    /// Number of surfels.
    pub len: usize,
    /// First column.
    pub columns: *const RawColumn,
    /// Number of columns.
    pub n_columns: usize,
    /// First triangle: indices of three surfels.
    pub faces: *const [u32; 3],
    /// Number of triangles.
    pub n_faces: usize,
    /// The cloud's own box: the middle, the largest extent, and the rotation as a quaternion x, y,
    /// z, w.
    pub object: [f64; 8],
}

/// A running job's line to the host.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawJob {
    /// Passed back to the functions.
    pub context: *mut c_void,
    /// Takes progress in [0, 1] and a UTF-8 message.
    pub progress: unsafe extern "C" fn(context: *mut c_void, fraction: f64, message: Bytes),
    /// Returns 1 where the user asked to stop, else 0.
    pub cancelled: unsafe extern "C" fn(context: *mut c_void) -> u32,
    /// Takes an edit: msgpack of [`EditHeader`](crate::tool::EditHeader) and little-endian values.
    /// Returns a status; on failure the reason is written to the sink.
    pub stage: unsafe extern "C" fn(
        context: *mut c_void,
        header: Bytes,
        values: *const Bytes,
        n_values: usize,
        sink: Sink,
    ) -> i32,
    /// Calls `work` with ranges, start and end, that cover `0..count` without overlap, on any
    /// threads; progress goes from `from` to `to`. Returns 1 where ranges were left out since the
    /// user asked to stop, else 0. `work` does not unwind.
    pub parallel: unsafe extern "C" fn(
        context: *mut c_void,
        count: usize,
        from: f64,
        to: f64,
        work: unsafe extern "C" fn(work_context: *const c_void, start: usize, end: usize),
        work_context: *const c_void,
    ) -> u32,
    /// Runs a graph's structure and data on the device and writes the bytes of the buffers, named
    /// by their positions, to the channels [`channel::BUFFERS`] and following. Returns a status; on
    /// failure the reason is written to the sink.
    pub compute: unsafe extern "C" fn(
        context: *mut c_void,
        structure: Bytes,
        data: Bytes,
        buffers: *const u32,
        n_buffers: usize,
        sink: Sink,
    ) -> i32,
}

/// The one exported symbol with functions.
///
/// Every function returns a [`status`] and writes what it produces to the sink. Units are named by
/// their position in the manifest.
#[repr(C)]
pub struct PluginTable {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// Size of this structure in bytes, as the plugin was built.
    pub size: u32,
    /// ABI major version.
    pub abi_major: u16,
    /// ABI minor version.
    pub abi_minor: u16,
    /// Writes the unit's description.
    pub describe: unsafe extern "C" fn(unit: u32, sink: Sink) -> i32,
    /// Makes an instance from msgpack of [`HostInfo`](crate::HostInfo).
    pub create:
        unsafe extern "C" fn(unit: u32, host: Bytes, out: *mut *mut c_void, sink: Sink) -> i32,
    /// Ends an instance.
    pub destroy: unsafe extern "C" fn(instance: *mut c_void, sink: Sink) -> i32,
    /// Describes a frame from msgpack of [`FrameRequest`](crate::FrameRequest).
    pub frame: unsafe extern "C" fn(instance: *mut c_void, request: Bytes, sink: Sink) -> i32,
    /// Traces a tile into `pixels`, four floats each. Texels of the environment are three floats.
    pub tile: unsafe extern "C" fn(
        instance: *const c_void,
        request: Bytes,
        clouds: *const RawCloud,
        n_clouds: usize,
        texels: *const [f32; 3],
        n_texels: usize,
        tile: *const crate::tool::Tile,
        pixels: *mut f32,
        n_floats: usize,
        job: *const RawJob,
        sink: Sink,
    ) -> i32,
    /// Runs a tool with msgpack of [`Values`](crate::params::Values), or of a [`StrokeCall`](crate::StrokeCall) where
    /// it says that it is handled.
    pub run: unsafe extern "C" fn(
        instance: *mut c_void,
        values: Bytes,
        cloud: *const RawCloud,
        job: *const RawJob,
        sink: Sink,
    ) -> i32,
}
