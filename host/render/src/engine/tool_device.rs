//! The device of tools: a headless engine that runs their graphs.

use crate::engine::{Engine, EngineOptions};
use crate::gpu::{Gpu, GpuOptions};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::{Error, Result};
use surfelshop_runtime::tools::{DeviceOpener, ToolDevice};

impl From<GpuOptions> for DeviceOpener {
    fn from(options: GpuOptions) -> Self {
        Self::new(move || {
            let failed = |error: &dyn std::fmt::Display| Error::new(error.to_string());
            let gpu = Gpu::headless(&options).map_err(|error| failed(&error))?;
            let engine = Engine::new(gpu, &EngineOptions::default());
            Ok(Box::new(engine.map_err(|error| failed(&error))?))
        })
    }
}

impl ToolDevice for Engine {
    fn describe(&self) -> String {
        self.gpu.describe()
    }

    fn compute(
        &mut self,
        graph: &EncodedGraph,
        buffers: &[u32],
        is_sandboxed: bool,
    ) -> Result<Vec<Vec<u8>>> {
        let computed = match is_sandboxed {
            true => self.compute_sandboxed(graph, buffers),
            false => Self::compute(self, graph, buffers),
        };
        computed.map_err(|error| Error::new(error.to_string()))
    }
}
