//! A job inside a plugin: what the author calls, passed on to the host's C functions.

use crate::abi::encoded_graph::EncodedGraph;
use crate::abi::needed_minor::check_minor;
use crate::abi::plugin_side::{Panicked, aside};
use crate::abi::table::{Bytes, RawJob, Sink, channel, status};
use crate::error::{Error, Result};
use crate::job::JobHost;
use crate::manifest::ABI_MINOR;
use crate::tool::EditHeader;
use core::ffi::c_void;
use std::cell::RefCell;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The host's side of a job, called through its C functions.
pub(super) struct RemoteJob {
    pub(super) raw: RawJob,
    /// The oldest minor version of the ABI that the package says will do.
    pub(super) minor: u16,
}

impl JobHost for RemoteJob {
    fn progress(&self, fraction: f64, message: &str) {
        // SAFETY: the host's function takes its own context and borrows the message.
        unsafe { (self.raw.progress)(self.raw.context, fraction, Bytes::of(message.as_bytes())) };
    }

    fn cancelled(&self) -> bool {
        // SAFETY: the host's function takes its own context.
        unsafe { (self.raw.cancelled)(self.raw.context) != 0 }
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        if self.minor < 11 && matches!(header, EditHeader::Values(_) | EditHeader::Add(_)) {
            return Err(Error::new(format!(
                "values of some surfels and new surfels came with ABI 3.11; the plugin says that hosts of ABI 3.{} \
                 will do: raise `minor` of export_plugin!, or do without",
                self.minor
            )));
        }
        let header = rmp_serde::to_vec_named(header)?;
        let slices: Vec<Bytes> = values.iter().map(|value| Bytes::of(value)).collect();
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows header, slices and sink.
        let status = unsafe {
            (self.raw.stage)(
                self.raw.context,
                Bytes::of(&header),
                slices.as_ptr(),
                slices.len(),
                written.sink(),
            )
        };
        match status {
            status::OK => Ok(()),
            _ => Err(written.error()),
        }
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        let body = Body { work, panicked: Mutex::new(None), ended: AtomicBool::new(false) };
        // SAFETY: the host's function takes its own context; the body is `Sync`, lives for the
        // call and does not unwind.
        let left_out = unsafe {
            let context = (&raw const body).cast();
            let (from, to) = (share.start, share.end);
            (self.raw.parallel)(self.raw.context, count, from, to, call_body, context)
        };
        let panicked = body.panicked.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(panicked) = panicked {
            panicked.resume();
        }
        left_out == 0
    }

    fn compute(&self, graph: &EncodedGraph, buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        if self.minor < ABI_MINOR {
            check_minor(&rmp_serde::from_slice(&graph.structure)?, self.minor)?;
        }
        let written = Written::default();
        // SAFETY: the host's function takes its own context and borrows bytes, positions and sink.
        let status = unsafe {
            let (structure, data) = (Bytes::of(&graph.structure), Bytes::of(&graph.data));
            let (first, count) = (buffers.as_ptr(), buffers.len());
            (self.raw.compute)(self.raw.context, structure, data, first, count, written.sink())
        };
        match status {
            status::OK => {
                Ok((channel::BUFFERS..).zip(buffers).map(|(c, _)| written.take(c)).collect())
            }
            _ => Err(written.error()),
        }
    }
}

/// The body of a parallel loop and the first panic in it.
struct Body<'a> {
    work: &'a (dyn Fn(Range<usize>) + Sync),
    panicked: Mutex<Option<Panicked>>,
    /// Whether the ranges that come after a panic are left out.
    ended: AtomicBool,
}

unsafe extern "C" fn call_body(context: *const c_void, start: usize, end: usize) {
    // SAFETY: `parallel` passes a pointer to its own body, alive for the duration of the call.
    let body = unsafe { &*context.cast::<Body<'_>>() };
    if body.ended.load(Ordering::Relaxed) {
        return;
    }
    if let Err(panicked) = aside(|| (body.work)(start..end)) {
        body.ended.store(true, Ordering::Relaxed);
        let mut first = body.panicked.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(panicked);
    }
}

/// What the host wrote during one call.
#[derive(Default)]
pub(super) struct Written(RefCell<Vec<(u32, Vec<u8>)>>);

impl Written {
    pub(super) fn sink(&self) -> Sink {
        unsafe extern "C" fn write(context: *mut c_void, channel: u32, written: Bytes) {
            // SAFETY: the context is the `Written` whose sink this is, alive for the call and used
            // by the calling thread alone; the host keeps the bytes alive for the call.
            let (all, written) = unsafe { (&*context.cast::<Written>(), written.as_slice()) };
            all.0.borrow_mut().push((channel, written.to_vec()));
        }
        Sink { context: std::ptr::from_ref(self).cast_mut().cast(), write }
    }

    /// What was written to a channel the last time; empty where nothing was.
    pub(super) fn take(&self, channel: u32) -> Vec<u8> {
        let mut all = self.0.borrow_mut();
        let found = all.iter_mut().rev().find(|(other, _)| *other == channel);
        found.map(|(_, written)| std::mem::take(written)).unwrap_or_default()
    }

    pub(super) fn error(&self) -> Error {
        Error::new(String::from_utf8_lossy(&self.take(channel::ERROR)).into_owned())
    }
}
