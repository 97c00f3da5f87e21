//! The device that runs a tool's graphs, as far as tools need it: what draws is above this crate.

use std::fmt;
use std::sync::Arc;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::{Error, Result};

/// A device that runs the compute graphs of tools.
pub trait ToolDevice {
    /// What it is, in words.
    fn describe(&self) -> String;

    /// Runs a graph and gives the contents of these of its buffers, in this order; one of a sandboxed plugin within
    /// what such plugins may take.
    ///
    /// # Errors
    /// Where the graph is refused or the device fails.
    fn compute(
        &mut self,
        graph: &EncodedGraph,
        buffers: &[u32],
        is_sandboxed: bool,
    ) -> Result<Vec<Vec<u8>>>;
}

/// Opens a device.
type Open = dyn Fn() -> Result<Box<dyn ToolDevice>> + Send + Sync;

/// How a tool gets its device, which is opened when it asks for the first time.
#[derive(Clone)]
pub struct DeviceOpener(Arc<Open>);

impl DeviceOpener {
    /// One that calls this, on the tool's thread.
    pub fn new(open: impl Fn() -> Result<Box<dyn ToolDevice>> + Send + Sync + 'static) -> Self {
        Self(Arc::new(open))
    }

    pub(super) fn open(&self) -> Result<Box<dyn ToolDevice>> {
        (self.0)()
    }
}

impl Default for DeviceOpener {
    /// One that has no device.
    fn default() -> Self {
        Self::new(|| Err(Error::new("there is no device for graphs here")))
    }
}

impl fmt::Debug for DeviceOpener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("DeviceOpener")
    }
}
