//! Finds, checks and loads plugins.
//!
//! A file is read and judged before any of its code runs ([`inspect`]): whether it is a whole
//! shared library for this machine, whether it carries a plugin manifest, and whether it speaks
//! this host's ABI. [`SearchPath`] says where plugins lie, [`Registry`] lists what was found and
//! what was refused and why, and [`Registry::load`] brings a unit into memory.
//!
//! Programs that live on have more: a [`Watcher`] says when files change, [`UnitRef::reload`] takes
//! a rebuilt unit as far as a first graph while the old one runs on, [`PluginHealth`] keeps count of
//! failures and switches off what fails again and again, and [`CrashGuard`] tell the next start which
//! plugin was at work when the program crashed.
//!
//! Invariants: a library is never loaded from where it was found, but from a private copy of the
//! very bytes that were judged, so that a rebuild in place cannot pull the code from under the
//! program; a loaded library is never unloaded; nobody waits for a plugin's code longer than its
//! [`Timeouts`] lasts, unless a call says so; nothing about a plugin file, however damaged, is
//! an error of the scan; the order of the list depends on names and places alone.

mod binary;
mod copy;
mod discover;
mod find;
mod inspect;
mod load;
mod modules;
mod open;
mod registry;
mod reload;
mod suited;
mod trust;
mod watch;
mod watchdog;

#[cfg(unix)]
pub(crate) use copy::PrivateCopy;
pub use discover::{
    Origin, Place, SearchPath, cache_folder, has_library_extension, state_folder,
    user_plugins_folder,
};
pub use find::{FindError, UnitRef};
pub use inspect::{
    Contents, MAX_FILE_LEN, Refused, inspect, inspect_bytes, is_deceptive, is_package_id,
};
pub use load::{LoadError, LoadTimes, LoadedUnit};
pub use modules::{is_module, n_compiled};
pub use open::{ExitGuard, guard_exit, leave, loader_is_busy};
#[cfg(unix)]
pub(crate) use open::{OpenError, open};
pub use registry::{Entry, Registry, State};
pub use reload::{CarriedValues, ReloadTimes, Reloaded, keep_values};
pub use trust::{Trust, TrustState};
pub use watch::{Changed, QUIET, Watcher};
pub(crate) use watchdog::on_own_thread;
pub use watchdog::{
    Crash, CrashGuard, CrashMark, Disabled, Hosted, PluginHealth, Record, STRIKES, Timeouts,
    UnitState,
};
