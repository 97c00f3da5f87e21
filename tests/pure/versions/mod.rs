//! What is promised to plugins that were built before: their libraries work, their graphs give the same
//! pictures, and nothing that they use goes away.

mod guide;
mod interface;
mod listing;
// Libraries are stored as they were built then, for one system.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod stored;
