//! Plugins that are WebAssembly modules, run without trust.
//!
//! A module exports what a native library does, [the same C structures](surfelshop_api::abi::table) as a
//! compiler for `wasm32` lays them out: a table of functions, and requests and answers in memory. It imports
//! nothing. What it may ask of the host are functions that the host puts into the module's own function table
//! and names in the structures that it lends for a call, so there is no file, clock or network that it could
//! name.
//!
//! [`read`] says what a module is by its sections, and runs nothing. A [`Module`] is compiled once; each
//! [`Instance`] has a memory of its own. Calls are cut into slices of so many steps, between which the host
//! looks whether somebody asked to stop ([`Limits`]).
//!
//! Invariants: no `unsafe` code; every address and length that a module passes is checked against its memory
//! before it is read or written; whatever a module does ends its call with a [`Stop`] and nothing else; the
//! host's stack does not grow with what a module calls.

mod answer;
mod arena;
mod calls;
mod clouds;
mod function;
mod host;
mod instance;
mod layout;
mod module;
mod read;
mod stop;
#[cfg(test)]
mod tests;

pub use calls::{Lent, TileCall};
pub use host::{BatchTaker, Host};
pub use instance::{Instance, Limits};
pub use module::{Module, n_compiled};
pub use read::{MAX_MODULE_LEN, Unfit, is_module, read};
pub use stop::Stop;
