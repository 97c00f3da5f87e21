//! The C form of files and clouds that the host lends to formats, and the calls on formats.

use super::fault::Fault;
use super::instance::Instance;
use super::job::raw_job;
use super::outputs::Outputs;
use super::request::encode;
use crate::boundary::clouds::{raw_cloud, raw_columns};
use core::ffi::c_void;
use std::cell::RefCell;
use std::slice;
use surfelshop_api::abi::format_table::{
    END, HEADER_CHANNEL, LINES_CHANNEL, RawCloudSink, RawCloudSource, RawFile, ReadCall,
};
use surfelshop_api::abi::table::{Bytes, RawCloud, RawColumn, Sink, channel, status};
use surfelshop_api::columns::{Element, Values as ColumnValues};
use surfelshop_api::format::{CloudHeader, CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::Values;

/// Most bytes of the header of a cloud; coordinate systems and comments take a few thousand.
const MAX_HEADER_BYTES: usize = 16 << 20;

/// Columns of a cloud that are taken.
const MAX_COLUMNS: usize = 4096;

/// A file as it is lent to a format.
struct LentFile<'a> {
    host: &'a dyn FileHost,
}

impl LentFile<'_> {
    fn raw(&self, name: &str) -> RawFile {
        let context = std::ptr::from_ref(self).cast_mut().cast();
        RawFile { context, name: Bytes::of(name.as_bytes()), length, read_at, write_at }
    }
}

/// Writes a line to the error channel of a plugin's sink.
fn say(sink: Sink, line: &str) -> i32 {
    // SAFETY: the plugin's sink lives for the call.
    unsafe { (sink.write)(sink.context, channel::ERROR, Bytes::of(line.as_bytes())) };
    status::ERROR
}

unsafe extern "C" fn length(context: *mut c_void) -> u64 {
    // SAFETY: the context is the `LentFile` of this call, alive for it.
    unsafe { &*context.cast::<LentFile<'_>>() }.host.length()
}

unsafe extern "C" fn read_at(
    context: *mut c_void,
    offset: u64,
    buffer: *mut u8,
    len: usize,
    n_read: *mut usize,
    sink: Sink,
) -> i32 {
    if len == 0 {
        // SAFETY: the plugin passes a place for a number.
        unsafe { *n_read = 0 };
        return status::OK;
    }
    // SAFETY: the context is the `LentFile` of this call; the plugin lends `len` bytes for it. They may not
    // be initialised, so they are filled before they are lent on.
    let (file, buffer) = unsafe {
        std::ptr::write_bytes(buffer, 0, len);
        (&*context.cast::<LentFile<'_>>(), slice::from_raw_parts_mut(buffer, len))
    };
    match file.host.read_at(offset, buffer) {
        Ok(found) => {
            // SAFETY: the plugin passes a place for a number.
            unsafe { *n_read = found };
            status::OK
        }
        Err(error) => say(sink, &error.to_string()),
    }
}

unsafe extern "C" fn write_at(context: *mut c_void, offset: u64, bytes: Bytes, sink: Sink) -> i32 {
    // SAFETY: the context is the `LentFile` of this call; the plugin lends the bytes for it.
    let (file, bytes) = unsafe { (&*context.cast::<LentFile<'_>>(), bytes.as_slice()) };
    match file.host.write_at(offset, bytes) {
        Ok(()) => status::OK,
        Err(error) => say(sink, &error.to_string()),
    }
}

/// A sink of clouds as it is lent to a format.
pub(super) struct LentSink<'a> {
    host: &'a mut dyn CloudSinkHost,
    header: Option<CloudHeader>,
    /// Columns whose bytes a plugin passed at an address that is none of their type.
    aligned: Vec<Vec<u64>>,
}

impl<'a> LentSink<'a> {
    pub(super) fn new(host: &'a mut dyn CloudSinkHost) -> Self {
        Self { host, header: None, aligned: Vec::new() }
    }

    pub(super) fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        if header.len() > MAX_HEADER_BYTES {
            let found = header.len();
            return Err(format!(
                "a header has {found} bytes, at most {MAX_HEADER_BYTES} are taken"
            ));
        }
        let header: CloudHeader = rmp_serde::from_slice(header)
            .map_err(|error| format!("the header of a cloud is unreadable: {error}"))?;
        if header.columns.len() > MAX_COLUMNS {
            let found = header.columns.len();
            return Err(format!("a cloud has {found} columns, at most {MAX_COLUMNS} are taken"));
        }
        let wanted = self.host.begin(&header).map_err(|error| error.to_string())?;
        self.header = Some(header);
        Ok(wanted)
    }

    pub(super) fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        let Some(header) = &self.header else {
            return Err("a batch came before the header of its cloud".to_owned());
        };
        if columns.len() != header.columns.len() {
            let (expected, found) = (header.columns.len(), columns.len());
            return Err(format!("a batch: expected {expected} columns, found {found}"));
        }
        self.aligned.clear();
        self.aligned.resize_with(columns.len(), Vec::new);
        let mut values = Vec::with_capacity(columns.len());
        for ((column, &bytes), aligned) in header.columns.iter().zip(columns).zip(&mut self.aligned)
        {
            let size = column.element.size();
            if !bytes.len().is_multiple_of(size) {
                return Err(format!(
                    "column `{}` of a batch: expected whole values of {size} bytes, found {} bytes",
                    column.name,
                    bytes.len()
                ));
            }
            values.push(typed(column.element, bytes, aligned));
        }
        self.host.batch(&values).map_err(|error| error.to_string())
    }

    pub(super) fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        self.host.faces(triangles).map_err(|error| error.to_string())
    }

    pub(super) fn warn(&mut self, line: &[u8]) {
        let text = String::from_utf8_lossy(&line[..line.len().min(super::MAX_ERROR_BYTES)]);
        self.host.warn(&super::outputs::one_line(&text));
    }
}

/// Bytes as values of a type; copied where their address is none of its.
fn typed<'a>(element: Element, bytes: &'a [u8], aligned: &'a mut Vec<u64>) -> ColumnValues<'a> {
    let bytes = if bytes.as_ptr().align_offset(element.size()) == 0 {
        bytes
    } else {
        aligned.resize(bytes.len().div_ceil(8), 0);
        let copy = bytemuck::cast_slice_mut(aligned.as_mut_slice());
        let copy: &mut [u8] = &mut copy[..bytes.len()];
        copy.copy_from_slice(bytes);
        &*copy
    };
    match element {
        Element::I8 => ColumnValues::I8(bytemuck::cast_slice(bytes)),
        Element::U8 => ColumnValues::U8(bytes),
        Element::I16 => ColumnValues::I16(bytemuck::cast_slice(bytes)),
        Element::U16 => ColumnValues::U16(bytemuck::cast_slice(bytes)),
        Element::I32 => ColumnValues::I32(bytemuck::cast_slice(bytes)),
        Element::U32 => ColumnValues::U32(bytemuck::cast_slice(bytes)),
        Element::F32 => ColumnValues::F32(bytemuck::cast_slice(bytes)),
        Element::F64 => ColumnValues::F64(bytemuck::cast_slice(bytes)),
    }
}

/// The sink of a call; a plugin that calls it from several threads at once is refused.
type SinkCell<'a> = RefCell<LentSink<'a>>;

/// Runs a call of the plugin on the sink.
///
/// # Safety
/// The context is the `SinkCell` of this call.
unsafe fn on_sink(
    context: *mut c_void,
    sink: Sink,
    call: impl FnOnce(&mut LentSink<'_>) -> Result<i32, String>,
) -> i32 {
    // SAFETY: by the caller's promise.
    let cell = unsafe { &*context.cast::<SinkCell<'_>>() };
    match cell.try_borrow_mut() {
        Ok(mut lent) => call(&mut lent).unwrap_or_else(|line| say(sink, &line)),
        Err(_in_use) => say(sink, "the clouds are called from within a call"),
    }
}

unsafe extern "C" fn begin(context: *mut c_void, header: Bytes, sink: Sink) -> i32 {
    // SAFETY: the plugin lends the header for the call, and passes the context it was given.
    unsafe {
        let header = header.as_slice();
        on_sink(context, sink, |lent| Ok(if lent.begin(header)? { status::OK } else { END }))
    }
}

unsafe extern "C" fn batch(
    context: *mut c_void,
    values: *const Bytes,
    n_values: usize,
    sink: Sink,
) -> i32 {
    if n_values > MAX_COLUMNS {
        return say(sink, "a batch of more columns than are taken");
    }
    // SAFETY: the plugin lends `n_values` columns for the call, and passes the context it was given.
    unsafe {
        let values = if n_values == 0 { &[] } else { slice::from_raw_parts(values, n_values) };
        let values: Vec<&[u8]> = values.iter().map(|column| column.as_slice()).collect();
        on_sink(context, sink, |lent| lent.batch(&values).map(|()| status::OK))
    }
}

unsafe extern "C" fn faces(
    context: *mut c_void,
    triangles: *const [u32; 3],
    n_triangles: usize,
    sink: Sink,
) -> i32 {
    // SAFETY: the plugin lends `n_triangles` triangles for the call, and passes the context it was given.
    unsafe {
        let triangles =
            if n_triangles == 0 { &[] } else { slice::from_raw_parts(triangles, n_triangles) };
        on_sink(context, sink, |lent| lent.faces(triangles).map(|()| status::OK))
    }
}

unsafe extern "C" fn warn(context: *mut c_void, line: Bytes) {
    // SAFETY: the plugin lends the line for the call, and passes the context it was given.
    let (cell, line) = unsafe { (&*context.cast::<SinkCell<'_>>(), line.as_slice()) };
    if let Ok(lent) = cell.try_borrow_mut().as_mut() {
        lent.warn(line);
    }
}

/// A source of clouds as it is lent to a format.
struct LentSource<'a> {
    host: &'a mut dyn CloudSourceHost,
    /// The columns of the batch that was handed over last.
    columns: Vec<RawColumn>,
}

unsafe extern "C" fn next_cloud(context: *mut c_void, sink: Sink) -> i32 {
    // SAFETY: the context is the source of this call, used by one thread at a time.
    let lent = unsafe { &mut *context.cast::<LentSource<'_>>() };
    let header = match lent.host.next_cloud() {
        Ok(Some(header)) => rmp_serde::to_vec_named(&header).map_err(|error| error.to_string()),
        Ok(None) => return END,
        Err(error) => Err(error.to_string()),
    };
    match header {
        Ok(bytes) => {
            // SAFETY: the plugin's sink lives for the call.
            unsafe { (sink.write)(sink.context, HEADER_CHANNEL, Bytes::of(&bytes)) };
            status::OK
        }
        Err(line) => say(sink, &line),
    }
}

unsafe extern "C" fn next_batch(context: *mut c_void, out: *mut RawCloud, sink: Sink) -> i32 {
    // SAFETY: the context is the source of this call, used by one thread at a time.
    let lent = unsafe { &mut *context.cast::<LentSource<'_>>() };
    match lent.host.next_batch() {
        Ok(Some(batch)) => {
            lent.columns = raw_columns(&batch);
            // SAFETY: the plugin passes a place for a batch. What it points to belongs to the source, and stays
            // until this is called again.
            unsafe { out.write(raw_cloud(&batch, &lent.columns)) };
            status::OK
        }
        Ok(None) => END,
        Err(error) => say(sink, &error.to_string()),
    }
}

impl Instance {
    /// Has a format read a file: its clouds go into a sink. ABI 3.8.
    ///
    /// # Errors
    /// Where the plugin fails, or has no formats.
    pub fn read(
        &mut self,
        call: &ReadCall,
        (name, file): (&str, &dyn FileHost),
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let request = encode(call)?;
        let native = match self.held() {
            Ok(native) => native,
            Err(sandboxed) => return sandboxed.read(&request, (name, file), clouds, job),
        };
        let table = native.formats()?;
        let lent = LentFile { host: file };
        let file = lent.raw(name);
        let cell: SinkCell<'_> = RefCell::new(LentSink::new(clouds));
        let context = std::ptr::from_ref(&cell).cast_mut().cast();
        let sink = RawCloudSink { context, begin, batch, faces, warn };
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (table.read)(
                native.pointer(),
                Bytes::of(&request),
                &raw const file,
                &raw const sink,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }

    /// Has a format write clouds to a file; what it cannot hold comes back in lines. ABI 3.8.
    ///
    /// # Errors
    /// Where the plugin fails, or has no formats.
    pub fn write(
        &mut self,
        values: &Values,
        clouds: &mut dyn CloudSourceHost,
        (name, file): (&str, &dyn FileHost),
        job: &dyn JobHost,
    ) -> Result<Vec<String>, Fault> {
        let values = encode(values)?;
        let mut outputs = Outputs::default();
        let native = match self.held() {
            Ok(native) => native,
            Err(sandboxed) => {
                sandboxed.write(&values, clouds, (name, file), job, &mut outputs)?;
                return lines(&mut outputs);
            }
        };
        let table = native.formats()?;
        let lent = LentFile { host: file };
        let file = lent.raw(name);
        let mut source = LentSource { host: clouds, columns: Vec::new() };
        let context = std::ptr::from_mut(&mut source).cast();
        let clouds = RawCloudSource { context, next_cloud, next_batch };
        let job = raw_job(&job);
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (table.write)(
                native.pointer(),
                Bytes::of(&values),
                &raw const clouds,
                &raw const file,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)?;
        lines(&mut outputs)
    }
}

/// What a file that was written cannot hold.
fn lines(outputs: &mut Outputs) -> Result<Vec<String>, Fault> {
    let lines = outputs.take(LINES_CHANNEL);
    if lines.is_empty() {
        return Ok(Vec::new());
    }
    rmp_serde::from_slice(&lines)
        .map_err(|error| Fault::Misbehaved(format!("what it says is unreadable: {error}")))
}
