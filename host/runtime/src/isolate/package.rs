//! A library whose code runs in processes of its own.

use super::calls::{Isolated, Limit, call};
use super::message::Order;
use super::process::Process;
use crate::boundary::{Apart, Fault, Instance, Lent, Outputs};
use crate::plugins::{PrivateCopy, Timeouts};
use std::os::unix::ffi::OsStrExt as _;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// A library, as the bytes that were judged.
pub(crate) struct Package {
    bytes: Vec<u8>,
    /// The file as people know it.
    path: PathBuf,
    pub(super) timeouts: Timeouts,
    /// Processes that have loaded it and made no instance.
    idle: Mutex<Vec<Process>>,
}

impl Package {
    /// Has a process load a library, which tells whether it can.
    ///
    /// # Errors
    /// Where no process can be started, or it cannot load the library, or crashes over that.
    pub(crate) fn open(bytes: Vec<u8>, path: PathBuf, timeouts: Timeouts) -> Result<Self, Fault> {
        let package = Self { bytes, path, timeouts, idle: Mutex::default() };
        let process = package.start()?;
        package.put_back(process);
        Ok(package)
    }

    /// A process that has loaded it and made no instance.
    pub(super) fn process(&self) -> Result<Process, Fault> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.map_or_else(|| self.start(), Ok)
    }

    fn put_back(&self, process: Process) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(process);
    }

    fn start(&self) -> Result<Process, Fault> {
        let mut process = Process::start()?;
        let copy = PrivateCopy::write(&self.path, &self.bytes).map_err(|error| {
            Fault::Error(format!("it cannot be copied to the folder for temporary files: {error}"))
        })?;
        let parts = [copy.path().as_os_str().as_bytes(), self.path.as_os_str().as_bytes()];
        let mut outputs = Outputs::default();
        let limit = Limit::Within(self.timeouts.load);
        let loaded =
            call(&mut process, (&Order::Load, &parts), limit, &mut Lent::of(&mut outputs))?;
        copy.loaded();
        loaded.map(|_| process)
    }
}

impl Apart for Package {
    fn describe(&self, unit: u32, outputs: &mut Outputs) -> Result<(), Fault> {
        let mut process = self.process()?;
        let limit = Limit::Within(self.timeouts.load);
        let order = (&Order::Describe(unit), &[][..]);
        let described = call(&mut process, order, limit, &mut Lent::of(outputs))?;
        self.put_back(process);
        described.map(|_| ())
    }

    fn create(&'static self, unit: u32, info: Vec<u8>) -> Result<Instance, Fault> {
        Isolated::create(self, unit, info).map(Instance::new)
    }

    fn is_sandboxed(&self) -> bool {
        false
    }
}
