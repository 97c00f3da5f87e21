//! Has the system load libraries.
//!
//! While a library's initialisers run, the system's loader is locked. Where they never end, nothing
//! can be loaded or unloaded any more, not even what a graphics driver is made of, and the usual
//! end of the process waits for the loader for ever; [`leave`] does not.

#![expect(unsafe_code, reason = "runs the code of a library that was inspected before")]

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use surfelshop_api::abi::host_side::{Fault, Plugin};
use surfelshop_api::abi::table::{self, PluginTable};

/// Libraries that are being loaded now.
static OPENING: AtomicUsize = AtomicUsize::new(0);

/// Whether the system is still loading a library: a program that ends then ends with [`leave`],
/// before it lets go of its graphics device.
#[must_use]
pub fn loader_is_busy() -> bool {
    OPENING.load(Ordering::Relaxed) > 0
}

/// Ends the process without what usually happens at its end.
pub fn leave(code: i32) -> ! {
    #[cfg(unix)]
    {
        unsafe extern "C" {
            fn _exit(code: core::ffi::c_int) -> !;
        }
        // SAFETY: the C library's function of this name takes any number and needs nothing.
        unsafe { _exit(code) }
    }
    #[cfg(not(unix))]
    {
        let _without_code = code;
        std::process::abort()
    }
}

/// Why a library could not be opened.
pub(super) enum OpenError {
    /// The system refused; says why.
    System(String),
    /// Its function table is wrong.
    Plugin(Fault),
}

/// Loads a library for the rest of the process's life and checks its function table.
pub(super) fn open(path: &Path) -> Result<Plugin, OpenError> {
    let system = |error: libloading::Error| OpenError::System(one_line(&error));
    OPENING.fetch_add(1, Ordering::Relaxed);
    let library = open_library(path);
    OPENING.fetch_sub(1, Ordering::Relaxed);
    let library = library.map_err(system)?;
    // Plugins leave behind threads, thread-local values and function pointers, so a library is
    // never unloaded, not even one that turns out to be useless.
    let library = Box::leak(Box::new(library));
    // SAFETY: the symbol's address is taken and nothing is read through it here.
    let symbol = unsafe { library.get::<*const PluginTable>(table::SYMBOL) }.map_err(system)?;
    let table: *const PluginTable = *symbol;
    if table.is_null() || !table.is_aligned() {
        let line = format!("its function table lies at the impossible address {table:p}");
        return Err(OpenError::Plugin(Fault::Misbehaved(line)));
    }
    // SAFETY: inspection found room for a whole table at this symbol inside one segment of the
    // library, and the library stays loaded.
    unsafe { Plugin::from_table(table) }.map_err(OpenError::Plugin)
}

#[cfg(unix)]
fn open_library(path: &Path) -> Result<libloading::os::unix::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // With `RTLD_NOW` a missing function is an error here rather than the end of the process at
    // its first call.
    // SAFETY: this runs the library's initialisers. Native plugins are trusted like any program;
    // the bytes are those inspected, in a file nobody else writes to.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }
}

#[cfg(windows)]
fn open_library(path: &Path) -> Result<libloading::os::windows::Library, libloading::Error> {
    // SAFETY: this runs the library's initialisers. Native plugins are trusted like any program;
    // the bytes are those inspected, in a file nobody else writes to.
    unsafe { libloading::os::windows::Library::new(path) }
}

fn one_line(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    if let Some(source) = error.source() {
        text = format!("{text}: {source}");
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
