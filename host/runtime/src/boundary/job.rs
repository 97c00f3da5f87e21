//! The C form of a host's side of a job.

use core::ffi::c_void;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::abi::table::{Bytes, RawJob, Sink, channel, status};
use surfelshop_api::job::JobHost;
use surfelshop_api::tool::EditHeader;

/// The C form of a job; `job` must outlive every use of it.
pub(super) fn raw_job(job: &&dyn JobHost) -> RawJob {
    RawJob {
        context: std::ptr::from_ref(job).cast_mut().cast(),
        progress,
        cancelled,
        stage,
        parallel,
        compute,
    }
}

unsafe extern "C" fn progress(context: *mut c_void, fraction: f64, message: Bytes) {
    // SAFETY: the context is the reference passed to `raw_job`, alive for the call; the
    // plugin lends the message for the call.
    let (job, message) = unsafe { (*context.cast::<&dyn JobHost>(), message.as_slice()) };
    job.progress(fraction, &String::from_utf8_lossy(message));
}

unsafe extern "C" fn cancelled(context: *mut c_void) -> u32 {
    // SAFETY: the context is the reference passed to `raw_job`, alive for the call.
    u32::from(unsafe { *context.cast::<&dyn JobHost>() }.cancelled())
}

unsafe extern "C" fn stage(
    context: *mut c_void,
    header: Bytes,
    values: *const Bytes,
    n_values: usize,
    sink: Sink,
) -> i32 {
    // SAFETY: the context is the reference passed to `raw_job`; the plugin lends header and
    // values for the call.
    let (job, header, values) = unsafe {
        let values = match n_values {
            0 => &[],
            n => std::slice::from_raw_parts(values, n),
        };
        (*context.cast::<&dyn JobHost>(), header.as_slice(), values)
    };
    // SAFETY: as above.
    let values: Vec<&[u8]> = values.iter().map(|&value| unsafe { value.as_slice() }).collect();
    let staged = rmp_serde::from_slice::<EditHeader>(header)
        .map_err(surfelshop_api::Error::from)
        .and_then(|header| job.stage(&header, &values));
    match staged {
        Ok(()) => status::OK,
        Err(error) => {
            // SAFETY: the plugin's sink lives for the call.
            unsafe {
                (sink.write)(sink.context, channel::ERROR, Bytes::of(error.message().as_bytes()));
            }
            status::ERROR
        }
    }
}

unsafe extern "C" fn parallel(
    context: *mut c_void,
    count: usize,
    from: f64,
    to: f64,
    work: unsafe extern "C" fn(*const c_void, usize, usize),
    work_context: *const c_void,
) -> u32 {
    /// The plugin's loop body, which it allows to be called from any thread.
    struct Work(*const c_void);
    // SAFETY: the plugin's shim passes a `Sync` closure, and lends it for the call.
    unsafe impl Sync for Work {}
    impl Work {
        fn context(&self) -> *const c_void {
            self.0
        }
    }
    let lent = Work(work_context);
    // SAFETY: the context is the reference passed to `raw_job`, alive for the call.
    let job = unsafe { *context.cast::<&dyn JobHost>() };
    let all = job.parallel(count, from..to, &|range| {
        // SAFETY: the plugin's function takes its own context and does not unwind.
        unsafe { work(lent.context(), range.start, range.end) };
    });
    u32::from(!all)
}

unsafe extern "C" fn compute(
    context: *mut c_void,
    structure: Bytes,
    data: Bytes,
    buffers: *const u32,
    n_buffers: usize,
    sink: Sink,
) -> i32 {
    // SAFETY: the context is the reference passed to `raw_job`; the plugin lends the bytes and
    // the positions for the call.
    let (job, structure, data, buffers) = unsafe {
        let buffers = match n_buffers {
            0 => &[],
            n => std::slice::from_raw_parts(buffers, n),
        };
        (*context.cast::<&dyn JobHost>(), structure.as_slice(), data.as_slice(), buffers)
    };
    let graph = EncodedGraph { structure: structure.to_vec(), data: data.to_vec() };
    let computed = job.compute(&graph, buffers);
    // SAFETY: the plugin's sink lives for the call.
    let write = |channel, bytes: &[u8]| unsafe {
        (sink.write)(sink.context, channel, Bytes::of(bytes));
    };
    match computed {
        Ok(contents) => {
            for (channel, contents) in (channel::BUFFERS..).zip(&contents) {
                write(channel, contents);
            }
            status::OK
        }
        Err(error) => {
            write(channel::ERROR, error.message().as_bytes());
            status::ERROR
        }
    }
}
