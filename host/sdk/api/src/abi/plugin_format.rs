//! Formats inside a plugin: files and clouds that the host lends, as the author has them.

use crate::abi::format_table::{
    END, FormatTable, HEADER_CHANNEL, LINES_CHANNEL, MAGIC, RawCloudSink, RawCloudSource, RawFile,
    ReadCall,
};
use crate::abi::plugin_job::{RemoteJob, Written};
use crate::abi::plugin_side::{Created, Package, cloud_view, guarded, write};
use crate::abi::table::{Bytes, RawCloud, RawJob, Sink, status};
use crate::columns::{CloudView, Values};
use crate::error::Result;
use crate::format::{
    CloudHeader, CloudSink, CloudSinkHost, CloudSource, CloudSourceHost, FileBeside, FileHost,
    FileSink, FileSource,
};
use crate::job::Job;
use crate::manifest::{ABI_MAJOR, ABI_MINOR};
use core::ffi::c_void;
use std::io;
use std::mem::MaybeUninit;
use std::sync::{Arc, PoisonError, RwLock};

/// The table of any package's formats.
#[must_use]
pub const fn format_table() -> FormatTable {
    table_of(ABI_MINOR)
}

/// The table of the formats of a package that names the oldest minor version that will do. ABI 3.10.
#[must_use]
pub const fn package_format_table<P: Package>() -> FormatTable {
    table_of(P::MINOR)
}

const fn table_of(abi_minor: u16) -> FormatTable {
    FormatTable {
        magic: MAGIC,
        size: size_of::<FormatTable>() as u32,
        abi_major: ABI_MAJOR,
        abi_minor,
        read,
        write: write_file,
    }
}

unsafe extern "C" fn read(
    instance: *mut c_void,
    request: Bytes,
    file: *const RawFile,
    clouds: *const RawCloudSink,
    job: *const RawJob,
    sink: Sink,
) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let call: ReadCall = rmp_serde::from_slice(unsafe { request.as_slice() })?;
        // SAFETY: the host passes a valid file, sink and job for the duration of the call.
        let (file, raw, job) = unsafe { (*file, *clouds, *job) };
        // SAFETY: the pointer comes from `create`; the host makes one such call at a time.
        let created = unsafe { &mut *instance.cast::<Created>() };
        let lent = Lent::new(file, call.beside)?;
        let mut remote = RemoteSink(raw);
        let mut clouds =
            CloudSink::new(&mut remote, call.columns.as_deref()).with_nodes(call.nodes.as_deref());
        let source = FileSource::new(lent.file(), &lent.name);
        let remote_job = RemoteJob { raw: job, minor: created.minor };
        created.unit.read(&call.values, &source, &mut clouds, &Job::new(&remote_job))
    })
}

unsafe extern "C" fn write_file(
    instance: *mut c_void,
    values: Bytes,
    clouds: *const RawCloudSource,
    file: *const RawFile,
    job: *const RawJob,
    sink: Sink,
) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let values = rmp_serde::from_slice(unsafe { values.as_slice() })?;
        // SAFETY: the host passes a valid file, source and job for the duration of the call.
        let (file, raw, job) = unsafe { (*file, *clouds, *job) };
        // SAFETY: the pointer comes from `create`; the host makes one such call at a time.
        let created = unsafe { &mut *instance.cast::<Created>() };
        let lent = Lent::new(file, Vec::new())?;
        let mut remote = RemoteSource(raw);
        let mut clouds = CloudSource::new(&mut remote);
        let file = FileSink::new(lent.file(), &lent.name);
        let remote_job = RemoteJob { raw: job, minor: created.minor };
        let lines = created.unit.write(&values, &mut clouds, &file, &Job::new(&remote_job))?;
        write(sink, LINES_CHANNEL, &rmp_serde::to_vec_named(&lines)?);
        Ok(())
    })
}

/// A file for the time of a call. Streams of it may outlive the call; they are refused from then on.
struct Lent {
    remote: Arc<RemoteFile>,
    name: String,
}

impl Lent {
    fn new(raw: RawFile, beside: Vec<FileBeside>) -> Result<Self> {
        // SAFETY: the host lends the name for the call.
        let name = std::str::from_utf8(unsafe { raw.name.as_slice() })?.to_owned();
        let lent = RwLock::new(Some(Shared(raw)));
        Ok(Self { remote: Arc::new(RemoteFile { lent, beside }), name })
    }

    fn file(&self) -> Arc<dyn FileHost> {
        self.remote.clone()
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        // Waits for reads under way on other threads.
        *self.remote.lent.write().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// The host's functions of a file.
struct Shared(RawFile);

// SAFETY: the host allows these functions to be called from any thread.
unsafe impl Send for Shared {}
// SAFETY: as above, from several at once.
unsafe impl Sync for Shared {}

/// The file of a host while it is lent; nothing after that.
struct RemoteFile {
    lent: RwLock<Option<Shared>>,
    beside: Vec<FileBeside>,
}

impl RemoteFile {
    fn with<T>(&self, call: impl FnOnce(&RawFile) -> io::Result<T>) -> io::Result<T> {
        let lent = self.lent.read().unwrap_or_else(PoisonError::into_inner);
        let ended = || io::Error::other("the call that the file was lent for has ended");
        call(&lent.as_ref().ok_or_else(ended)?.0)
    }
}

/// What the host wrote, as an error of the system.
fn refused(written: &Written) -> io::Error {
    io::Error::other(written.error().message().to_owned())
}

impl FileHost for RemoteFile {
    fn length(&self) -> u64 {
        // SAFETY: the host's function takes its own context, which is alive while the file is lent.
        self.with(|raw| Ok(unsafe { (raw.length)(raw.context) })).unwrap_or(0)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let (written, mut n_read) = (Written::default(), 0);
        let (first, len) = (buffer.as_mut_ptr(), buffer.len());
        let status = self.with(|raw| {
            // SAFETY: the context is alive while the file is lent; buffer, number and sink live for the call.
            Ok(unsafe {
                (raw.read_at)(raw.context, offset, first, len, &raw mut n_read, written.sink())
            })
        })?;
        if status == status::OK { Ok(n_read.min(len)) } else { Err(refused(&written)) }
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let written = Written::default();
        let status = self.with(|raw| {
            // SAFETY: the context is alive while the file is lent; bytes and sink live for the call.
            Ok(unsafe { (raw.write_at)(raw.context, offset, Bytes::of(bytes), written.sink()) })
        })?;
        if status == status::OK { Ok(()) } else { Err(refused(&written)) }
    }

    fn beside(&self) -> Vec<FileBeside> {
        self.beside.clone()
    }
}

/// The host's sink of clouds.
struct RemoteSink(RawCloudSink);

/// Whether a call ended well; `END` is no failure.
fn ended(status: i32, written: &Written) -> Result<bool> {
    match status {
        status::OK => Ok(true),
        END => Ok(false),
        _ => Err(written.error()),
    }
}

impl CloudSinkHost for RemoteSink {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        let header = rmp_serde::to_vec_named(header)?;
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows the header and the sink.
        let status = unsafe { (self.0.begin)(self.0.context, Bytes::of(&header), written.sink()) };
        ended(status, &written)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        let columns: Vec<Bytes> = values
            .iter()
            .map(|values| Bytes {
                ptr: values.as_ptr().cast(),
                len: values.len() * values.element().size(),
            })
            .collect();
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows the values and the sink.
        let status = unsafe {
            let (first, count) = (columns.as_ptr(), columns.len());
            (self.0.batch)(self.0.context, first, count, written.sink())
        };
        ended(status, &written).map(drop)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows the triangles and the sink.
        let status = unsafe {
            let (first, count) = (triangles.as_ptr(), triangles.len());
            (self.0.faces)(self.0.context, first, count, written.sink())
        };
        ended(status, &written).map(drop)
    }

    fn warn(&mut self, line: &str) {
        // SAFETY: the host's function takes its own context and borrows the line.
        unsafe { (self.0.warn)(self.0.context, Bytes::of(line.as_bytes())) };
    }
}

/// The host's source of clouds.
struct RemoteSource(RawCloudSource);

impl CloudSourceHost for RemoteSource {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows the sink.
        let status = unsafe { (self.0.next_cloud)(self.0.context, written.sink()) };
        match ended(status, &written)? {
            true => Ok(Some(rmp_serde::from_slice(&written.take(HEADER_CHANNEL))?)),
            false => Ok(None),
        }
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let written = Written::default();
        let mut batch = MaybeUninit::<RawCloud>::uninit();
        // SAFETY: the host's function takes its own context, stores a whole batch where it returns OK, and
        // borrows the sink.
        let status =
            unsafe { (self.0.next_batch)(self.0.context, batch.as_mut_ptr(), written.sink()) };
        match ended(status, &written)? {
            // SAFETY: the host has stored a batch, which it keeps until the next call; `self` is borrowed
            // until then.
            true => Ok(Some(unsafe { cloud_view(batch.assume_init_ref()) }?)),
            false => Ok(None),
        }
    }
}
