//! The functions of the host as a module calls them.

use std::fmt;
use wasmi::ValType::{self, F64, I32, I64};
use wasmi::{Func, FuncType, Store, StoreLimits, Val};

/// A function that the host lends by its place in the module's own function table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum HostFunction {
    Write,
    Progress,
    Cancelled,
    Stage,
    Parallel,
    Compute,
    Length,
    ReadAt,
    WriteAt,
    Begin,
    Batch,
    Faces,
    Warn,
    NextCloud,
    NextBatch,
}

/// A call of a host's function, which the module waits for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub(crate) function: HostFunction,
    /// As bits.
    arguments: [u64; 6],
}

impl Request {
    /// A whole number or an address.
    pub(crate) fn word(&self, i: usize) -> u32 {
        self.arguments[i] as u32
    }

    pub(crate) fn long(&self, i: usize) -> u64 {
        self.arguments[i]
    }

    pub(crate) fn float(&self, i: usize) -> f64 {
        f64::from_bits(self.arguments[i])
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "it called `{:?}` of the host", self.function)
    }
}

impl wasmi::errors::HostError for Request {}

/// All of them in their order, with the types of their arguments and of what they return. Structures that C passes by
/// value are addresses here.
pub(crate) const ALL: [(HostFunction, &[ValType], Option<ValType>); 15] = [
    (HostFunction::Write, &[I32, I32, I32], None),
    (HostFunction::Progress, &[I32, F64, I32], None),
    (HostFunction::Cancelled, &[I32], Some(I32)),
    (HostFunction::Stage, &[I32, I32, I32, I32, I32], Some(I32)),
    (HostFunction::Parallel, &[I32, I32, F64, F64, I32, I32], Some(I32)),
    (HostFunction::Compute, &[I32, I32, I32, I32, I32, I32], Some(I32)),
    (HostFunction::Length, &[I32], Some(I64)),
    (HostFunction::ReadAt, &[I32, I64, I32, I32, I32, I32], Some(I32)),
    (HostFunction::WriteAt, &[I32, I64, I32, I32], Some(I32)),
    (HostFunction::Begin, &[I32, I32, I32], Some(I32)),
    (HostFunction::Batch, &[I32, I32, I32, I32], Some(I32)),
    (HostFunction::Faces, &[I32, I32, I32, I32], Some(I32)),
    (HostFunction::Warn, &[I32, I32], None),
    (HostFunction::NextCloud, &[I32, I32], Some(I32)),
    (HostFunction::NextBatch, &[I32, I32, I32], Some(I32)),
];

/// Makes a function that interrupts the module with a request, to be answered from outside.
pub(crate) fn make(
    store: &mut Store<StoreLimits>,
    (function, takes, returns): (HostFunction, &[ValType], Option<ValType>),
) -> Func {
    let ty = FuncType::new(takes.iter().copied(), returns);
    Func::new(store, ty, move |_module, passed, _answer| {
        let mut arguments = [0; 6];
        for (argument, value) in arguments.iter_mut().zip(passed) {
            *argument = match value {
                Val::I32(value) => u64::from(*value as u32),
                Val::I64(value) => *value as u64,
                Val::F64(value) => value.to_bits(),
                _ => 0,
            };
        }
        Err(wasmi::Error::host(Request { function, arguments }))
    })
}
