//! The C form of files and clouds that the host lends to formats, and the calls on formats.

use super::calls::NamedFile;
use super::fault::Fault;
use super::instance::Instance;
use super::job::raw_job;
use super::lent_sink::{LentSink, MAX_COLUMNS};
use super::native::Native;
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
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::Values;

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

impl Native {
    /// Has a format read a file: its clouds go into a sink.
    pub(super) fn read_file(
        &mut self,
        request: &[u8],
        (name, file): NamedFile<'_>,
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let table = self.formats()?;
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
                self.pointer(),
                Bytes::of(request),
                &raw const file,
                &raw const sink,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }

    /// Has a format write clouds to a file.
    pub(super) fn write_file(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        (name, file): NamedFile<'_>,
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault> {
        let table = self.formats()?;
        let lent = LentFile { host: file };
        let file = lent.raw(name);
        let mut source = LentSource { host: clouds, columns: Vec::new() };
        let context = std::ptr::from_mut(&mut source).cast();
        let clouds = RawCloudSource { context, next_cloud, next_batch };
        let job = raw_job(&job);
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (table.write)(
                self.pointer(),
                Bytes::of(request),
                &raw const clouds,
                &raw const file,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
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
        self.calls().read(&encode(call)?, (name, file), clouds, job)
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
        let mut outputs = Outputs::default();
        self.calls().write(&encode(values)?, clouds, (name, file), job, &mut outputs)?;
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
