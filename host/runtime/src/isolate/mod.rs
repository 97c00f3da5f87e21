//! Libraries in processes of their own.
//!
//! The program starts itself again ([`serve()`] is what that does), and has it load one library. Calls go there as messages
//! of bytes, and what the library asks of the host during a call comes back as messages. Whatever the library does to its
//! process, be it a crash, an abort, closed descriptors or another rounding mode, it does to no other.
//!
//! A process holds one instance. Where a call does not end well, its process is ended, and the next call starts
//! another one, as the sandbox does with its instances. A tracer gets as many processes as threads call it.
//!
//! Clouds are copied there and edits back, whole. Graphs that a tool has the device compute are run by the program.
//!
//! Invariants: nobody waits for a process longer than its [`Timeouts`](crate::plugins::Timeouts) says, after which it is
//! killed; a process whose program has ended ends itself; lengths that a process names take no memory before their
//! bytes are there.

mod calls;
mod clouds;
mod message;
mod package;
mod process;
mod remote;
mod serve;
mod wire;

pub use message::ARGUMENT;
pub(crate) use package::Package;
pub use process::use_program;
pub use serve::serve;
