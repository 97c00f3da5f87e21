//! The calls on units of WebAssembly modules: what a library gets by its tables of functions, a module gets through
//! the sandbox.
//!
//! A module that was stopped in the middle of a call is in no state to go on. Its instance is dropped, and the next
//! call makes another one, as if nothing had been.

use super::calls::{Apart, Calls, NamedFile, TileCall};
use super::fault::Fault;
use super::instance::Instance;
use super::lent::Lent;
use super::lent_sink::LentSink;
use super::outputs::Outputs;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::CloudView;
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost};
use surfelshop_api::job::JobHost;
use surfelshop_sandbox::{self as sandbox, BatchTaker, Host, Limits, Module, Stop};

/// A unit of a module, with the instances of it that no call uses. There are several where a tracer works on several
/// threads at once, which a module cannot.
struct Sandboxed {
    module: &'static Module,
    unit: u32,
    /// What instances are made from, msgpack.
    info: Vec<u8>,
    minor: u16,
    idle: Mutex<Vec<sandbox::Instance>>,
}

impl Apart for Module {
    fn describe(&self, unit: u32, outputs: &mut Outputs) -> Result<(), Fault> {
        let instance = sandbox::Instance::new(self, Limits::default());
        let status = instance.and_then(|mut instance| instance.describe(unit, &mut asked(outputs)));
        ended(status, outputs)
    }

    fn create(&'static self, unit: u32, info: Vec<u8>) -> Result<Instance, Fault> {
        Sandboxed::create(self, unit, info).map(Instance::new)
    }

    fn is_sandboxed(&self) -> bool {
        true
    }
}

/// A call that lends a sink alone.
fn asked(outputs: &mut Outputs) -> SandboxHost<'_> {
    SandboxHost(Lent::of(outputs))
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
    fn create(module: &'static Module, unit: u32, info: Vec<u8>) -> Result<Self, Fault> {
        let mut made = Self { module, unit, info, minor: 0, idle: Mutex::default() };
        let instance = made.instance()?;
        made.minor = instance.minor();
        made.idle = Mutex::new(vec![instance]);
        Ok(made)
    }

    /// Another instance of the unit.
    fn instance(&self) -> Result<sandbox::Instance, Fault> {
        let mut outputs = Outputs::default();
        let made = sandbox::Instance::new(self.module, Limits::default());
        let mut instance = made.map_err(|stop| fault(stop, &outputs))?;
        let created = instance.create(self.unit, &self.info, &mut asked(&mut outputs));
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
        call: impl FnOnce(&mut sandbox::Instance) -> Result<i32, Stop>,
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
}

impl Calls for Sandboxed {
    fn minor(&self) -> u16 {
        self.minor
    }

    fn frame(&mut self, request: &[u8], outputs: &mut Outputs) -> Result<(), Fault> {
        let status = self.call(|instance| instance.frame(request, &mut asked(outputs)))?;
        ended(status, outputs)
    }

    fn tile(&self, call: TileCall<'_>, job: &dyn JobHost) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let mut asked = SandboxHost(Lent { job: Some(job), ..Lent::of(&mut outputs) });
        let TileCall { request, scene, tile, pixels } = call;
        let call = sandbox::TileCall { request, scene, tile, pixels };
        let status = self.call(|instance| instance.tile(call, &mut asked))?;
        ended(status, &outputs)
    }

    fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let mut asked = SandboxHost(Lent { job: Some(job), ..Lent::of(&mut outputs) });
        let status = self.call(|instance| instance.run(request, cloud, &mut asked))?;
        ended(status, &outputs)
    }

    fn read(
        &mut self,
        request: &[u8],
        (name, file): NamedFile<'_>,
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let clouds = Some(LentSink::new(clouds));
        let lent = Lent { job: Some(job), file: Some(file), clouds, ..Lent::of(&mut outputs) };
        let mut asked = SandboxHost(lent);
        let named = sandbox::Lent::Read(name);
        let status = self.call(|instance| instance.file(request, named, &mut asked))?;
        ended(status, &outputs)
    }

    fn write(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        (name, file): NamedFile<'_>,
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault> {
        let lent =
            Lent { job: Some(job), file: Some(file), source: Some(clouds), ..Lent::of(outputs) };
        let mut asked = SandboxHost(lent);
        let named = sandbox::Lent::Written(name);
        let status = self.call(|instance| instance.file(request, named, &mut asked))?;
        ended(status, outputs)
    }
}

/// What a call lends, as the sandbox asks for it.
struct SandboxHost<'a>(Lent<'a>);

impl Host for SandboxHost<'_> {
    fn write(&mut self, channel: u32, bytes: &[u8]) {
        self.0.outputs.write(channel, bytes);
    }

    fn cancelled(&mut self) -> bool {
        self.0.cancelled()
    }

    fn progress(&mut self, fraction: f64, message: &[u8]) {
        self.0.progress(fraction, message);
    }

    fn stage(&mut self, header: &[u8], values: &[&[u8]]) -> Result<(), String> {
        self.0.stage(header, values)
    }

    fn compute(
        &mut self,
        structure: &[u8],
        data: &[u8],
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, String> {
        self.0.compute(structure, data, buffers)
    }

    fn length(&mut self) -> u64 {
        self.0.length()
    }

    fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        self.0.read_at(offset, buffer)
    }

    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), String> {
        self.0.write_at(offset, bytes)
    }

    fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        self.0.begin(header)
    }

    fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        self.0.batch(columns)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        self.0.faces(triangles)
    }

    fn warn(&mut self, line: &[u8]) {
        self.0.warn(line);
    }

    fn next_cloud(&mut self) -> Result<Option<Vec<u8>>, String> {
        self.0.next_cloud()
    }

    fn next_batch(&mut self, take: &mut BatchTaker<'_>) -> Result<Result<bool, Stop>, String> {
        match self.0.next_batch()? {
            Some(batch) => Ok(take(&batch).map(|()| true)),
            None => Ok(Ok(false)),
        }
    }
}
