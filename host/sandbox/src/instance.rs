//! A module with a memory of its own, and how its functions run.

use crate::arena::{Arena, with_margin};
use crate::function::{self, HostFunction, Request};
use crate::host::Host;
use crate::layout::{FORMATS_LEN, PAIR_LEN, TABLE_LEN, u16_at, u32_at};
use crate::module::Module;
use crate::read::{FUNCTIONS, MEMORY};
use crate::stop::Stop;
use std::time::{Duration, Instant};
use surfelshop_api::abi::{format_table, table};
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};
use wasmi::{
    Func, Linker, Memory, Nullable, Ref, ResumableCall, Store, StoreLimits, StoreLimitsBuilder,
    Table, TrapCode, Val,
};

/// Steps between two looks at the clock and at whether somebody asked to stop: about a hundredth of a second, a tenth where
/// each call clears as many variables as a function may have.
const SLICE: u64 = 1_000_000;
/// Most steps of what a module starts with before anything of it is called, which compilers leave empty.
const START_STEPS: u64 = 20_000_000;
/// How deep calls of the module within calls of the host within calls of the module may go. Two are needed: a loop
/// body that the host calls, and the sink that a refusal is written to.
const MAX_NESTED: u32 = 4;
/// What a call of the host costs, in steps: about as long as the module's own code takes for as many.
const REQUEST_STEPS: u64 = 500;
/// Most steps of setting memory aside.
const ALLOC_STEPS: u64 = 30_000_000;
/// The function of a module that sets memory aside, which is called where there is one. Some allocators take all of
/// the memory that is there when they are first asked.
const ALLOC: &str = "surfelshop_alloc";
/// Most elements of a function table.
const MAX_TABLE: usize = 100_000;

/// How much a module may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most bytes of its memory, what the host lends it included.
    pub memory: usize,
    /// Most steps of a call that no job goes with: of describing itself, making an instance and describing a
    /// frame, each. A step is about an instruction. Jobs run until they end or are asked to stop.
    pub steps: u64,
    /// How long such a call may take: some steps are longer than others.
    pub time: Duration,
    /// How long a job may go on once it was asked to stop.
    pub grace: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        let (time, grace) = (Duration::from_secs(4), Duration::from_secs(1));
        Self { memory: 1 << 30, steps: 1_000_000_000, time, grace }
    }
}

/// How long a call may go on.
#[derive(Debug)]
pub(crate) enum Pace {
    /// So many steps more, until then.
    Steps(u64, Instant),
    /// Until somebody asks to stop, and then a while.
    Job(Option<Instant>),
}

/// The functions of a module by their places in its function table.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Functions {
    pub(crate) describe: u32,
    pub(crate) create: u32,
    pub(crate) frame: u32,
    pub(crate) tile: u32,
    pub(crate) run: u32,
    /// Of formats, where it has any.
    pub(crate) files: Option<[u32; 2]>,
}

/// A module at work, in a memory of its own.
pub struct Instance {
    store: Store<StoreLimits>,
    memory: Memory,
    table: Table,
    /// Where the host's functions begin in it.
    first_host: u32,
    alloc: Option<Func>,
    pub(crate) functions: Functions,
    pub(crate) arena: Arena,
    /// Where its unit's instance is, once it was made.
    pub(crate) unit: u32,
    /// Room for the points that a format writes: address and length.
    pub(crate) batch: Option<(u32, usize)>,
    pub(crate) lent: crate::calls::HeldClouds,
    limits: Limits,
    minor: u16,
}

impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Instance").field("functions", &self.functions).finish_non_exhaustive()
    }
}

impl Instance {
    /// Gives a module a memory and a function table, and runs what it starts with.
    ///
    /// # Errors
    /// Where that goes wrong, the module wants more than the limits, or its tables of functions are no good.
    pub fn new(module: &Module, limits: Limits) -> Result<Self, Stop> {
        let module = &module.module;
        let bounds = StoreLimitsBuilder::new()
            .memory_size(limits.memory)
            .table_elements(MAX_TABLE)
            .instances(1)
            .memories(1)
            .tables(4)
            .build();
        let mut store = Store::new(module.engine(), bounds);
        store.limiter(|bounds| bounds);
        store.set_fuel(START_STEPS).map_err(|error| Stop::of(&error))?;
        let made = Linker::new(module.engine()).instantiate_and_start(&mut store, module);
        let made = made.map_err(|error| match error.as_trap_code() {
            Some(TrapCode::OutOfFuel) => Stop::Trapped(format!(
                "it ran for more than {START_STEPS} steps before anything was called"
            )),
            _ => Stop::of(&error),
        })?;
        let lacks = |name: &str| Stop::misbehaved(format!("it does not export `{name}`"));
        let memory = made.get_memory(&store, MEMORY).ok_or_else(|| lacks(MEMORY))?;
        let table = made.get_table(&store, FUNCTIONS).ok_or_else(|| lacks(FUNCTIONS))?;
        let address = |store: &Store<StoreLimits>, name| {
            let value = made.get_global(store, name)?.get(store).i32();
            value.map(|value| value as u32)
        };
        let (plugin, files) =
            (address(&store, table::SYMBOL), address(&store, format_table::SYMBOL));
        let plugin = plugin.ok_or_else(|| lacks(table::SYMBOL))?;
        let alloc = made.get_func(&store, ALLOC);
        let first_host = lend_functions(&mut store, table)?;
        let mut instance = Self {
            store,
            memory,
            table,
            first_host,
            alloc,
            functions: Functions::default(),
            arena: Arena::default(),
            unit: 0,
            batch: None,
            lent: Default::default(),
            limits,
            minor: 0,
        };
        (instance.functions, instance.minor) = instance.read_tables(plugin, files)?;
        Ok(instance)
    }

    /// The minor version of the interface that its table says it speaks.
    #[must_use]
    pub fn minor(&self) -> u16 {
        self.minor
    }

    fn read_tables(&self, plugin: u32, files: Option<u32>) -> Result<(Functions, u16), Stop> {
        let head = |at: u32, magic: [u8; 8], len: usize, what: &str| {
            let bytes = self.slice(at, len as u32)?;
            let (size, version) = (u32_at(bytes, 8), (u16_at(bytes, 12), u16_at(bytes, 14)));
            if bytes[..8] != magic {
                return Err(Stop::misbehaved(format!("the magic bytes of its {what} are wrong")));
            }
            if version.0 != ABI_MAJOR || version.1 > ABI_MINOR {
                let (major, minor) = version;
                return Err(Stop::misbehaved(format!(
                    "its {what} speaks ABI {major}.{minor}, this host {ABI_MAJOR}.{ABI_MINOR}"
                )));
            }
            if (size as usize) < len {
                let line = format!("its {what} has {size} bytes, expected {len}");
                return Err(Stop::misbehaved(line));
            }
            Ok(bytes)
        };
        let bytes = head(plugin, table::MAGIC, TABLE_LEN, "function table")?;
        let minor = u16_at(bytes, 14);
        let at = |i: usize| u32_at(bytes, 16 + 4 * i);
        let [describe, create, frame, tile, run] = [0, 1, 3, 4, 5].map(at);
        let files = match files {
            None => None,
            Some(files) => {
                let bytes = head(files, format_table::MAGIC, FORMATS_LEN, "table of formats")?;
                Some([u32_at(bytes, 16), u32_at(bytes, 20)])
            }
        };
        Ok((Functions { describe, create, frame, tile, run, files }, minor))
    }

    /// The place of a function of the host in the module's function table.
    pub(crate) fn place_of(&self, function: HostFunction) -> u32 {
        self.first_host + function as u32
    }

    /// How long a call without a job may go on.
    pub(crate) fn steps(&self) -> Pace {
        Pace::Steps(self.limits.steps, Instant::now() + self.limits.time)
    }

    #[cfg(test)]
    pub(crate) fn memory_len(&self) -> usize {
        self.memory.data_size(&self.store)
    }

    /// Most bytes that its memory may have.
    pub(crate) fn most_memory(&self) -> usize {
        self.limits.memory
    }

    /// Bytes of its memory.
    pub(crate) fn slice(&self, address: u32, len: u32) -> Result<&[u8], Stop> {
        let (start, memory) = (address as usize, self.memory.data(&self.store));
        memory.get(start..start.saturating_add(len as usize)).ok_or_else(|| {
            Stop::misbehaved(format!("it named {len} bytes at {address}, outside its memory"))
        })
    }

    /// The same to be written.
    pub(crate) fn slice_mut(&mut self, address: u32, len: usize) -> Result<&mut [u8], Stop> {
        let (start, memory) = (address as usize, self.memory.data_mut(&mut self.store));
        memory.get_mut(start..start.saturating_add(len)).ok_or_else(|| {
            Stop::misbehaved(format!("it named {len} bytes at {address}, outside its memory"))
        })
    }

    /// The two words of a `Bytes` or a `Sink`.
    pub(crate) fn pair(&self, address: u32) -> Result<(u32, u32), Stop> {
        let bytes = self.slice(address, PAIR_LEN as u32)?;
        Ok((u32_at(bytes, 0), u32_at(bytes, 4)))
    }

    /// What a `Bytes` names.
    pub(crate) fn named(&self, address: u32) -> Result<&[u8], Stop> {
        let (start, len) = self.pair(address)?;
        if len == 0 { Ok(&[]) } else { self.slice(start, len) }
    }

    /// Writes bytes into its memory.
    pub(crate) fn put(&mut self, address: u32, bytes: &[u8]) -> Result<(), Stop> {
        self.slice_mut(address, bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }

    /// Room of the host's in its memory, until that is let go of.
    pub(crate) fn room(&mut self, len: usize) -> Result<u32, Stop> {
        if let Some(address) = self.arena.take(len) {
            return Ok(address);
        }
        match self.alloc {
            Some(alloc) => {
                let len = with_margin(len);
                let address = self.allocate(alloc, len)?;
                self.arena.add(address, len);
            }
            None => self.arena.grow((&mut self.store, self.memory), len)?,
        }
        self.arena.take(len).ok_or_else(|| Stop::misbehaved("its memory does not grow"))
    }

    /// Has the module's own allocator set bytes aside.
    fn allocate(&mut self, alloc: Func, len: u64) -> Result<u32, Stop> {
        let stop = |error: wasmi::Error| Stop::of(&error);
        let too_large = || {
            let mib = len.div_ceil(1 << 20);
            Stop::Impossible(format!("its memory has no room for {mib} MiB that it is to be lent"))
        };
        let asked = u32::try_from(len).map_err(|_beyond| too_large())?;
        let (left, mut address) = (self.store.get_fuel().map_err(stop)?, [Val::I32(0)]);
        self.store.set_fuel(ALLOC_STEPS).map_err(stop)?;
        let called = alloc.call(&mut self.store, &[Val::I32(asked as i32)], &mut address);
        called.map_err(|error| match error.as_trap_code() {
            Some(TrapCode::OutOfFuel) => Stop::Trapped(format!(
                "its `{ALLOC}` ran for more than {ALLOC_STEPS} steps, and was stopped"
            )),
            _ => stop(error),
        })?;
        self.store.set_fuel(left).map_err(stop)?;
        let address = address[0].i32().unwrap_or(0) as u32;
        if address == 0 {
            return Err(too_large());
        }
        self.slice(address, asked)?;
        Ok(address)
    }

    /// Copies bytes into room of the host's.
    pub(crate) fn lend(&mut self, bytes: &[u8]) -> Result<u32, Stop> {
        let address = self.room(bytes.len())?;
        self.put(address, bytes)?;
        Ok(address)
    }

    /// Gives the module more steps, or says that it has had enough.
    fn refill(&mut self, least: u64, pace: &mut Pace, host: &mut dyn Host) -> Result<(), Stop> {
        let slice = match pace {
            Pace::Steps(left, until) => {
                let stopped = |limit: String| {
                    Stop::Trapped(format!("it ran for more than {limit}, and was stopped"))
                };
                if *left == 0 || *left < least {
                    return Err(stopped(format!("{} steps", self.limits.steps)));
                }
                if Instant::now() >= *until {
                    return Err(stopped(format!("{} s", self.limits.time.as_secs_f64())));
                }
                let slice = SLICE.max(least).min(*left);
                *left -= slice;
                slice
            }
            Pace::Job(asked) => {
                let grace = self.limits.grace;
                if host.cancelled() && asked.get_or_insert_with(Instant::now).elapsed() >= grace {
                    return Err(Stop::Cancelled);
                }
                SLICE.max(least)
            }
        };
        self.store.set_fuel(slice).map_err(|error| Stop::of(&error))
    }

    /// Takes the steps that a request costs, at most those that the slice has left.
    pub(crate) fn charge(&mut self, bytes: usize) -> Result<(), Stop> {
        let left = self.store.get_fuel().map_err(|error| Stop::of(&error))?;
        let cost = REQUEST_STEPS + bytes as u64 / 16;
        self.store.set_fuel(left.saturating_sub(cost)).map_err(|error| Stop::of(&error))
    }

    fn function(&self, place: u32) -> Result<Func, Stop> {
        match self.table.get(&self.store, u64::from(place)) {
            Some(Ref::Func(Nullable::Val(function))) => Ok(function),
            _ => Err(Stop::misbehaved(format!("it named function {place}, and has none there"))),
        }
    }

    /// Starts a call from outside: with a slice of steps.
    pub(crate) fn start(&mut self, pace: &mut Pace, host: &mut dyn Host) -> Result<(), Stop> {
        self.refill(0, pace, host)
    }

    /// Calls a function and answers what it asks until it returns; nothing where it returns nothing.
    pub(crate) fn call<const N: usize>(
        &mut self,
        (place, arguments): (u32, &[Val]),
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<[i32; N], Stop> {
        if depth > MAX_NESTED {
            return Err(Stop::misbehaved("it calls the host within calls within calls"));
        }
        let function = self.function(place)?;
        let mut results = [const { Val::I32(0) }; N];
        let stop = |error: wasmi::Error| Stop::of(&error);
        let mut call =
            function.call_resumable(&mut self.store, arguments, &mut results).map_err(stop)?;
        loop {
            call = match call {
                ResumableCall::Finished => return Ok(results.map(|value| value.i32().unwrap_or(0))),
                ResumableCall::OutOfFuel(paused) => {
                    self.refill(paused.required_fuel(), pace, host)?;
                    paused.resume(&mut self.store, &mut results)
                }
                ResumableCall::HostTrap(paused) => {
                    let Some(&request) = paused.host_error().downcast_ref::<Request>() else {
                        return Err(Stop::of(&paused.into_host_error()));
                    };
                    let (answer, bytes) = self.answer(&request, pace, host, depth)?;
                    self.charge(bytes)?;
                    paused.resume(&mut self.store, answer.as_slice(), &mut results)
                }
            }
            .map_err(stop)?;
        }
    }
}

/// Adds the host's functions to a module's function table; returns where they begin.
fn lend_functions(store: &mut Store<StoreLimits>, table: Table) -> Result<u32, Stop> {
    let fixed =
        || Stop::misbehaved("its function table cannot grow: link it with --growable-table");
    let len = function::ALL.len() as u64;
    let null = Ref::Func(Nullable::Null);
    let first = table.grow(&mut *store, len, null).map_err(|_refused| fixed())?;
    for (i, function) in (first..).zip(function::ALL) {
        let function = function::make(store, function);
        table
            .set(&mut *store, i, Ref::Func(Nullable::Val(function)))
            .map_err(|_refused| fixed())?;
    }
    u32::try_from(first).map_err(|_beyond| fixed())
}
