//! What watches over the code of plugins: how long it may take, what became of it so far, and which one was at
//! work when the program crashed.

mod crash_guard;
mod health;
mod hosted;
mod timeouts;

pub use crash_guard::{Crash, CrashGuard, CrashMark};
pub use health::{Disabled, PluginHealth, Record, STRIKES, UnitState};
pub use hosted::Hosted;
pub use timeouts::Timeouts;
pub(crate) use timeouts::on_own_thread;
pub(crate) use timeouts::within;
