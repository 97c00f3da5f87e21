//! Plugins at work: found, judged, loaded, called within time, switched off after faults, loaded
//! again; tools over clouds, and tracers over pictures.
//!
//! [`plugins`] finds and loads units, [`boundary`] calls into them, `isolate` does so in processes of their own, [`tools`] runs tools over clouds
//! and [`trace`] tracers over pictures.
//!
//! Invariants: this crate opens no device; `unsafe` code is in [`boundary`] and in the file that maps
//! a library, and nowhere else of the host.

pub mod boundary;
pub mod formats;
#[cfg(unix)]
pub mod isolate;
pub mod plugins;
pub mod tools;
pub mod trace;
