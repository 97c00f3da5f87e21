//! The host's half of the plugin boundary: the safe calls a host makes into a loaded plugin.
//!
//! The C structures and the plugin's half are in [`surfelshop_api::abi`]. A call encodes its request
//! as msgpack with named fields, lends columns and pixels for its duration, and collects what the
//! plugin writes to the host's sinks, within limits. A [`Fault`] says how a call failed.

#![expect(
    unsafe_code,
    reason = "the C boundary itself: functions of a plugin's table are called, and what it lends is read"
)]

mod calls;
mod clouds;
mod decode;
mod fault;
mod format;
mod instance;
mod job;
mod lent;
mod lent_sink;
mod native;
mod outputs;
mod plugin;
mod request;
#[cfg(feature = "sandbox")]
mod sandboxed;

#[cfg(unix)]
pub(crate) use calls::{Apart, Calls, NamedFile, TileCall};
pub use decode::decode;
pub use fault::Fault;
pub use instance::Instance;
#[cfg(unix)]
pub(crate) use lent::Lent;
#[cfg(unix)]
pub(crate) use lent_sink::{LentSink, of_aligned};
#[cfg(unix)]
pub(crate) use outputs::Outputs;
pub use plugin::Plugin;

/// Most bytes a plugin may write in one call, and of a graph's data or a computation's buffers.
pub const MAX_OUTPUT_BYTES: usize = 1 << 30;
/// Most bytes of the structure of a graph: hundreds of the longest shaders that are compiled.
pub const MAX_STRUCTURE_BYTES: usize = 16 << 20;
/// Most bytes of a unit's description.
const MAX_DESCRIPTION_BYTES: usize = 1 << 20;
/// Most bytes of a line that says what went wrong; what is longer is cut.
const MAX_ERROR_BYTES: usize = 4 << 10;
