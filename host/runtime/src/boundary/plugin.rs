//! A plugin whose code is in memory: its table, checked, and the calls that make instances.

use super::calls::Apart;
use super::fault::Fault;
use super::instance::Instance;
use super::native::Native;
use super::outputs::Outputs;
use super::request::encode;
use core::ffi::c_void;
use core::mem::offset_of;
use std::fmt;
use surfelshop_api::HostInfo;
use surfelshop_api::abi::format_table::{self, FormatTable};
use surfelshop_api::abi::plugin_format;
use surfelshop_api::abi::plugin_side::{self, Description, Package};
use surfelshop_api::abi::table::{Bytes, MAGIC, PluginTable, channel};
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};

/// A plugin whose code is in memory.
#[derive(Clone, Copy)]
pub struct Plugin(Code);

#[derive(Clone, Copy)]
enum Code {
    /// Functions of a library, or of this program.
    Native(Tables),
    /// A WebAssembly module, or a library in a process of its own; it stays as libraries do.
    Apart(&'static dyn Apart),
}

/// The tables of functions of a library.
#[derive(Clone, Copy)]
pub(super) struct Tables {
    pub(super) plugin: &'static PluginTable,
    pub(super) formats: Option<&'static FormatTable>,
}

impl Plugin {
    /// A plugin registered in this program with [`static_plugin!`](surfelshop_api::static_plugin!).
    #[must_use]
    pub fn of<P: Package>() -> Self {
        let formats = Some(const { &plugin_format::format_table() });
        Self(Code::Native(Tables { plugin: const { &plugin_side::table::<P>() }, formats }))
    }

    /// A plugin whose code does not run in the memory of this program.
    pub(crate) fn apart(code: impl Apart + 'static) -> Self {
        Self(Code::Apart(Box::leak(Box::new(code))))
    }

    /// Whether it runs in a sandbox, so that nobody needs to trust it.
    #[must_use]
    pub fn is_sandboxed(&self) -> bool {
        matches!(self.0, Code::Apart(code) if code.is_sandboxed())
    }

    /// The plugin with the functions of its formats, from the address of their table.
    ///
    /// # Errors
    /// Where the table's magic, size or version is not this host's, or a function is missing.
    ///
    /// # Safety
    /// As [`from_table`](Self::from_table), of a [`FormatTable`].
    pub unsafe fn with_formats(self, table: *const FormatTable) -> Result<Self, Fault> {
        let misbehaved = |line: String| Err(Fault::Misbehaved(line));
        // SAFETY: at least eight bytes are readable, by the caller's promise.
        if unsafe { (*table).magic } != format_table::MAGIC {
            return misbehaved("the magic bytes of its table of formats are wrong".to_owned());
        }
        // SAFETY: with the right magic, the fixed head of the table is readable.
        let (size, plugin) = unsafe { ((*table).size, ((*table).abi_major, (*table).abi_minor)) };
        if plugin.0 != ABI_MAJOR || plugin.1 > ABI_MINOR {
            return misbehaved(format!(
                "its table of formats speaks ABI {}.{}, this host {ABI_MAJOR}.{ABI_MINOR}",
                plugin.0, plugin.1
            ));
        }
        if (size as usize) < size_of::<FormatTable>() {
            return misbehaved(format!(
                "its table of formats has {size} bytes, expected {}",
                size_of::<FormatTable>()
            ));
        }
        let functions =
            [("read", offset_of!(FormatTable, read)), ("write", offset_of!(FormatTable, write))];
        for (name, offset) in functions {
            // SAFETY: magic, version and size say that a whole table is there; a function is a pointer of
            // it, which other languages can leave null.
            let function = unsafe { table.byte_add(offset).cast::<*const c_void>().read() };
            if function.is_null() {
                return misbehaved(format!(
                    "its table of formats has no `{name}`; one that it does without returns an error"
                ));
            }
        }
        let Code::Native(tables) = self.0 else {
            return misbehaved("it has a table of formats and none of functions".to_owned());
        };
        // SAFETY: the whole table is there, with no function missing, and it stays.
        Ok(Self(Code::Native(Tables { formats: Some(unsafe { &*table }), ..tables })))
    }

    /// A plugin from the address of its exported table.
    ///
    /// # Errors
    /// Where the table's magic, size or version is not this host's.
    ///
    /// # Safety
    /// `table` points to a [`PluginTable`] (or to something that starts with eight other bytes)
    /// that stays in memory, with the code it points to, until the process ends.
    pub unsafe fn from_table(table: *const PluginTable) -> Result<Self, Fault> {
        let misbehaved = |line: String| Err(Fault::Misbehaved(line));
        // SAFETY: at least eight bytes are readable, by the caller's promise.
        if unsafe { (*table).magic } != MAGIC {
            return misbehaved("the function table's magic bytes are wrong".to_owned());
        }
        // SAFETY: with the right magic, the fixed head of the table is readable.
        let (size, plugin) = unsafe { ((*table).size, ((*table).abi_major, (*table).abi_minor)) };
        if plugin.0 != ABI_MAJOR || plugin.1 > ABI_MINOR {
            return misbehaved(format!(
                "its function table speaks ABI {}.{}, this host {ABI_MAJOR}.{ABI_MINOR}",
                plugin.0, plugin.1
            ));
        }
        if (size as usize) < size_of::<PluginTable>() {
            return misbehaved(format!(
                "its function table has {size} bytes, expected {}",
                size_of::<PluginTable>()
            ));
        }
        let functions = [
            ("describe", offset_of!(PluginTable, describe)),
            ("create", offset_of!(PluginTable, create)),
            ("destroy", offset_of!(PluginTable, destroy)),
            ("frame", offset_of!(PluginTable, frame)),
            ("tile", offset_of!(PluginTable, tile)),
            ("run", offset_of!(PluginTable, run)),
        ];
        for (name, offset) in functions {
            // SAFETY: magic, version and size say that a whole table is there; a function is a pointer of
            // it, which other languages can leave null.
            let function = unsafe { table.byte_add(offset).cast::<*const c_void>().read() };
            if function.is_null() {
                return misbehaved(format!(
                    "its function table has no `{name}`; one that a plugin does without returns an error"
                ));
            }
        }
        // SAFETY: the whole table is there, with no function missing, and it stays.
        Ok(Self(Code::Native(Tables { plugin: unsafe { &*table }, formats: None })))
    }

    /// Has a unit describe itself, by its position in the manifest.
    pub(crate) fn description(&self, unit: u32, outputs: &mut Outputs) -> Result<(), Fault> {
        match self.0 {
            Code::Native(tables) => {
                // SAFETY: the table's functions may be called with a sink that lives for the call.
                let status = unsafe { (tables.plugin.describe)(unit, outputs.sink()) };
                outputs.check(status)
            }
            Code::Apart(code) => code.describe(unit, outputs),
        }
    }

    /// What a unit says of itself, by its position in the manifest.
    ///
    /// # Errors
    /// Where the plugin fails or writes something that is no description.
    pub fn describe(&self, unit: u32) -> Result<Description, Fault> {
        let mut outputs = Outputs::default();
        self.description(unit, &mut outputs)?;
        let misbehaved = |what: &dyn fmt::Display| {
            Fault::Misbehaved(format!("its description is no good: {what}"))
        };
        let written = outputs.channel(channel::DESCRIPTION);
        if written.is_empty() {
            return Err(Fault::Misbehaved("it wrote no description".to_owned()));
        }
        let description: Description =
            rmp_serde::from_slice(written).map_err(|error| misbehaved(&error))?;
        description.check().map_err(|line| misbehaved(&line))?;
        Ok(description)
    }

    /// Makes an instance of a unit, by its position in the manifest.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn create(&self, unit: u32, host: &HostInfo) -> Result<Instance, Fault> {
        self.create_from(unit, encode(host)?)
    }

    /// The same from what it is made from, msgpack.
    pub(crate) fn create_from(&self, unit: u32, info: Vec<u8>) -> Result<Instance, Fault> {
        let tables = match self.0 {
            Code::Native(tables) => tables,
            Code::Apart(code) => return code.create(unit, info),
        };
        let mut outputs = Outputs::default();
        let mut instance = std::ptr::null_mut();
        // SAFETY: bytes, place and sink live for the call.
        let status = unsafe {
            (tables.plugin.create)(unit, Bytes::of(&info), &raw mut instance, outputs.sink())
        };
        outputs.check(status)?;
        if instance.is_null() {
            return Err(Fault::Misbehaved("it made no instance and gave no reason".to_owned()));
        }
        Ok(Instance::new(Native::new(tables, instance)))
    }
}
