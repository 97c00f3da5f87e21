//! The calls on units of WebAssembly modules: what a library gets by its tables of functions, a module gets through
//! the sandbox.
//!
//! A module that was stopped in the middle of a call is in no state to go on. Its instance is dropped, and the next
//! call makes another one, as if nothing had been.

use super::fault::Fault;
use super::lent_sink::LentSink;
use super::outputs::Outputs;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::CloudView;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::job::JobHost;
use surfelshop_api::tool::EditHeader;
use surfelshop_sandbox::{BatchTaker, Host, Instance, Lent, Limits, Module, Stop, TileCall};

/// A unit of a module, with the instances of it that no call uses. There are several where a tracer works on several
/// threads at once, which a module cannot.
pub(super) struct Sandboxed {
    module: &'static Module,
    unit: u32,
    /// What instances are made from, msgpack.
    info: Vec<u8>,
    minor: u16,
    idle: Mutex<Vec<Instance>>,
}

/// Has a unit of a module describe itself.
pub(super) fn describe(module: &Module, unit: u32, outputs: &mut Outputs) -> Result<(), Fault> {
    let instance = Instance::new(module, Limits::default());
    let status = instance.and_then(|mut instance| instance.describe(unit, &mut Calls::of(outputs)));
    ended(status, outputs)
}

/// How a call ended.
fn ended(status: Result<i32, Stop>, outputs: &Outputs) -> Result<(), Fault> {
    match status {
        Ok(status) => outputs.check(status),
        Err(stop) => Err(fault(stop, outputs)),
    }
}

fn fault(stop: Stop, outputs: &Outputs) -> Fault {
    let said = outputs.line();
    match stop {
        // What a panic said before it gave up.
        Stop::Trapped(_) if !said.is_empty() => Fault::Panic(said),
        Stop::Trapped(line) => Fault::Panic(line),
        Stop::Misbehaved(line) => Fault::Misbehaved(line),
        Stop::Cancelled | Stop::Impossible(_) => Fault::Error(stop.to_string()),
    }
}

impl Sandboxed {
    /// Makes an instance of a unit.
    pub(super) fn create(module: &'static Module, unit: u32, info: Vec<u8>) -> Result<Self, Fault> {
        let mut made = Self { module, unit, info, minor: 0, idle: Mutex::default() };
        let instance = made.instance()?;
        made.minor = instance.minor();
        made.idle = Mutex::new(vec![instance]);
        Ok(made)
    }

    /// The minor version of the interface that its table says it speaks.
    pub(super) fn minor(&self) -> u16 {
        self.minor
    }

    /// Another instance of the unit.
    fn instance(&self) -> Result<Instance, Fault> {
        let mut outputs = Outputs::default();
        let made = Instance::new(self.module, Limits::default());
        let mut instance = made.map_err(|stop| fault(stop, &outputs))?;
        let created = instance.create(self.unit, &self.info, &mut Calls::of(&mut outputs));
        let is_there = created.as_ref().is_ok_and(|(_, is_there)| *is_there);
        ended(created.map(|(status, _)| status), &outputs)?;
        if !is_there {
            return Err(Fault::Misbehaved("it made no instance and gave no reason".to_owned()));
        }
        Ok(instance)
    }

    /// Makes a call on an instance that nobody uses.
    fn call(
        &self,
        call: impl FnOnce(&mut Instance) -> Result<i32, Stop>,
    ) -> Result<Result<i32, Stop>, Fault> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = idle().pop();
        let mut instance = match taken {
            Some(instance) => instance,
            None => self.instance()?,
        };
        let status = call(&mut instance);
        if status.is_ok() {
            idle().push(instance);
        }
        Ok(status)
    }

    pub(super) fn frame(&mut self, request: &[u8], outputs: &mut Outputs) -> Result<(), Fault> {
        let status = self.call(|instance| instance.frame(request, &mut Calls::of(outputs)))?;
        ended(status, outputs)
    }

    pub(super) fn tile(&self, call: TileCall<'_>, job: &dyn JobHost) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let mut calls = Calls { job: Some(job), ..Calls::of(&mut outputs) };
        let status = self.call(|instance| instance.tile(call, &mut calls))?;
        ended(status, &outputs)
    }

    pub(super) fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let mut calls = Calls { job: Some(job), ..Calls::of(&mut outputs) };
        let status = self.call(|instance| instance.run(request, cloud, &mut calls))?;
        ended(status, &outputs)
    }

    pub(super) fn read(
        &mut self,
        request: &[u8],
        (name, file): (&str, &dyn FileHost),
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let clouds = Some(LentSink::new(clouds));
        let mut calls =
            Calls { job: Some(job), file: Some(file), clouds, ..Calls::of(&mut outputs) };
        let status = self.call(|instance| instance.file(request, Lent::Read(name), &mut calls))?;
        ended(status, &outputs)
    }

    pub(super) fn write(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        (name, file): (&str, &dyn FileHost),
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault> {
        let mut calls =
            Calls { job: Some(job), file: Some(file), source: Some(clouds), ..Calls::of(outputs) };
        let status =
            self.call(|instance| instance.file(request, Lent::Written(name), &mut calls))?;
        ended(status, outputs)
    }
}

/// What a call lends to a module.
struct Calls<'a> {
    outputs: &'a mut Outputs,
    job: Option<&'a dyn JobHost>,
    file: Option<&'a dyn FileHost>,
    clouds: Option<LentSink<'a>>,
    source: Option<&'a mut dyn CloudSourceHost>,
}

impl<'a> Calls<'a> {
    /// A call that lends a sink alone.
    fn of(outputs: &'a mut Outputs) -> Self {
        Self { outputs, job: None, file: None, clouds: None, source: None }
    }
}

/// What was lent, or the line that it was not.
fn lent<T>(lent: Option<T>) -> Result<T, String> {
    lent.ok_or_else(|| "this call lends no such thing".to_owned())
}

fn line(error: impl std::fmt::Display) -> String {
    error.to_string()
}

impl Host for Calls<'_> {
    fn write(&mut self, channel: u32, bytes: &[u8]) {
        self.outputs.write(channel, bytes);
    }

    fn cancelled(&mut self) -> bool {
        self.job.is_some_and(JobHost::cancelled)
    }

    fn progress(&mut self, fraction: f64, message: &[u8]) {
        if let Some(job) = self.job {
            job.progress(fraction, &String::from_utf8_lossy(message));
        }
    }

    fn stage(&mut self, header: &[u8], values: &[&[u8]]) -> Result<(), String> {
        let header: EditHeader = rmp_serde::from_slice(header)
            .map_err(|error| surfelshop_api::Error::from(error).message().to_owned())?;
        lent(self.job)?.stage(&header, values).map_err(|error| error.message().to_owned())
    }

    fn compute(
        &mut self,
        structure: &[u8],
        data: &[u8],
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, String> {
        let graph = EncodedGraph { structure: structure.to_vec(), data: data.to_vec() };
        let computed = lent(self.job)?.compute(&graph, buffers);
        computed.map_err(|error| error.message().to_owned())
    }

    fn length(&mut self) -> u64 {
        self.file.map_or(0, FileHost::length)
    }

    fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        match buffer.is_empty() {
            true => Ok(0),
            false => lent(self.file)?.read_at(offset, buffer).map_err(line),
        }
    }

    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), String> {
        lent(self.file)?.write_at(offset, bytes).map_err(line)
    }

    fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        lent(self.clouds.as_mut())?.begin(header)
    }

    fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        lent(self.clouds.as_mut())?.batch(columns)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        lent(self.clouds.as_mut())?.faces(triangles)
    }

    fn warn(&mut self, line: &[u8]) {
        if let Some(clouds) = &mut self.clouds {
            clouds.warn(line);
        }
    }

    fn next_cloud(&mut self) -> Result<Option<Vec<u8>>, String> {
        match lent(self.source.as_mut())?.next_cloud().map_err(line)? {
            Some(header) => rmp_serde::to_vec_named(&header).map(Some).map_err(line),
            None => Ok(None),
        }
    }

    fn next_batch(&mut self, take: &mut BatchTaker<'_>) -> Result<Result<bool, Stop>, String> {
        match lent(self.source.as_mut())?.next_batch().map_err(line)? {
            Some(batch) => Ok(take(&batch).map(|()| true)),
            None => Ok(Ok(false)),
        }
    }
}
