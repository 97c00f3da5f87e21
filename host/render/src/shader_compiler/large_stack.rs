//! Compiling where there is room: shaders are text from third parties, and compilers recurse over it.

/// Stack of a compiling thread. The deepest text that is compiled takes under 200 MiB; pages that are not
/// touched cost nothing.
pub(crate) const STACK_BYTES: usize = 512 << 20;

/// Runs `work` on a thread with a large stack.
///
/// # Errors
/// Where the system gives no such thread, or `work` panics.
pub(crate) fn on_large_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name("shader compiler".to_owned())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, work)
            .map_err(|error| format!("no thread could be started to compile on: {error}"))?
            .join()
            .map_err(|_panic| "the shader compiler failed on this text".to_owned())
    })
}
