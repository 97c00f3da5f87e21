//! Has the system load libraries.
//!
//! While a library's initialisers run, the system's loader is locked. Where they never end, nothing
//! can be loaded or unloaded any more, not even what a graphics driver is made of, and the usual
//! end of the process waits for the loader for ever; [`leave`] does not.

#![expect(unsafe_code, reason = "runs the code of a library that was inspected before")]

use crate::boundary::{Fault, Plugin};
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use surfelshop_api::abi::format_table::{self, FormatTable};
use surfelshop_api::abi::table::{self, PluginTable};
use surfelshop_cloud::files::return_to_folder;

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

/// Whether the program is ending in order.
static ENDING: AtomicBool = AtomicBool::new(false);

/// The files whose code has run in this process.
static RAN: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Lasts as long as the program is meant to: where code of a plugin calls `exit` before, that is said in a line,
/// and the exit code is 1.
#[must_use]
#[derive(Debug)]
pub struct ExitGuard(());

impl Drop for ExitGuard {
    fn drop(&mut self) {
        ENDING.store(true, Ordering::Relaxed);
    }
}

/// Notices from now on that code of a plugin ends the process by `exit`. What ends it at once, such as `_exit`,
/// nothing in the process can notice.
pub fn guard_exit() -> ExitGuard {
    unsafe extern "C" {
        fn atexit(at_exit: extern "C" fn()) -> core::ffi::c_int;
    }
    extern "C" fn at_exit() {
        if ENDING.load(Ordering::Relaxed) {
            return;
        }
        // A thread that was ended in the middle may hold it.
        let ran = RAN.try_lock().map(|ran| ran.join(", ")).unwrap_or_default();
        let line = format!(
            "surfelshop: code of a plugin ended the program by calling exit(); loaded are {ran}\n"
        );
        // With the standard error closed there is nobody left to tell.
        drop(std::io::stderr().write_all(line.as_bytes()));
        leave(1)
    }
    // SAFETY: the C library's function of this name takes the address of a function without arguments, which
    // is there for as long as the process; that function does not unwind: what it calls does not panic.
    let _full = unsafe { atexit(at_exit) };
    ExitGuard(())
}

/// Why a library could not be opened.
pub(crate) enum OpenError {
    /// The system refused; says why.
    System(String),
    /// Its function table is wrong.
    Plugin(Fault),
}

/// Loads a library for the rest of the process's life and checks its function table; `name` is what a person
/// knows its file by.
pub(crate) fn open(path: &Path, name: &Path) -> Result<Plugin, OpenError> {
    let name = name.display().to_string();
    let mut ran = RAN.lock().unwrap_or_else(PoisonError::into_inner);
    ran.retain(|other| *other != name);
    ran.push(name);
    drop(ran);
    let system = |error: libloading::Error| OpenError::System(one_line(&error));
    OPENING.fetch_add(1, Ordering::Relaxed);
    let library = open_library(path);
    OPENING.fetch_sub(1, Ordering::Relaxed);
    return_to_folder();
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
    let plugin = unsafe { Plugin::from_table(table) }.map_err(OpenError::Plugin)?;
    // SAFETY: the symbol's address is taken and nothing is read through it here.
    let Ok(symbol) = (unsafe { library.get::<*const FormatTable>(format_table::SYMBOL) }) else {
        return Ok(plugin);
    };
    let table: *const FormatTable = *symbol;
    if table.is_null() || !table.is_aligned() {
        let line = format!("its table of formats lies at the impossible address {table:p}");
        return Err(OpenError::Plugin(Fault::Misbehaved(line)));
    }
    // SAFETY: inspection found room for a whole table at this symbol, too.
    unsafe { plugin.with_formats(table) }.map_err(OpenError::Plugin)
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
