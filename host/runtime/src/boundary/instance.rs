//! An instance of a unit inside a plugin, and the calls on it.

use super::calls::{Calls, TileCall};
use super::fault::Fault;
use super::outputs::Outputs;
use super::request::{FrameCall, check_known, encode};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::abi::table::channel;
use surfelshop_api::frame::OnDevice;
use surfelshop_api::job::JobHost;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudView, FrameRequest, StrokeCall, Tile, Traced};

/// An instance of a unit inside a plugin, wherever its code runs; dropping it ends it there.
pub struct Instance(Box<dyn Calls>);

impl Instance {
    /// One that is called so.
    pub(crate) fn new(calls: impl Calls + 'static) -> Self {
        Self(Box::new(calls))
    }

    /// The same, for calls by bytes.
    pub(crate) fn calls(&mut self) -> &mut dyn Calls {
        &mut *self.0
    }

    /// Has a renderer describe a frame.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn frame(&mut self, request: &FrameRequest) -> Result<EncodedGraph, Fault> {
        self.frame_in_motion(request, 1)
    }

    /// Has a renderer describe a frame in which one surfel of `stride` is drawn
    /// ([`Graph::stride`](surfelshop_api::Graph::stride)); 0 is taken as 1. ABI 3.6.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn frame_in_motion(
        &mut self,
        request: &FrameRequest,
        stride: u32,
    ) -> Result<EncodedGraph, Fault> {
        self.frame_on_device(request, stride, &OnDevice::default())
    }

    /// The same where bytes of [resident](surfelshop_api::Graph::resident) buffers are on the device already. ABI 3.10.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn frame_on_device(
        &mut self,
        request: &FrameRequest,
        stride: u32,
        on_device: &OnDevice,
    ) -> Result<EncodedGraph, Fault> {
        check_known(self.0.minor(), request)?;
        let request = encode(&FrameCall::new(request, stride, on_device))?;
        let mut outputs = Outputs::default();
        self.0.frame(&request, &mut outputs)?;
        Ok(EncodedGraph {
            structure: outputs.take(channel::STRUCTURE),
            data: outputs.take(channel::DATA),
        })
    }

    /// Has a tracer fill a tile: `pixels` has four floats per pixel of the tile.
    ///
    /// # Errors
    /// Where the plugin fails, or `pixels` has another size than the tile.
    pub fn tile(
        &self,
        request: &FrameRequest,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let expected = 4 * tile.width as usize * tile.height as usize;
        if pixels.len() != expected {
            return Err(Fault::Error(format!(
                "a tile of {} x {} needs {expected} floats, {} given",
                tile.width,
                tile.height,
                pixels.len()
            )));
        }
        check_known(self.0.minor(), request)?;
        let request = encode(request)?;
        self.0.tile(TileCall { request: &request, scene, tile, pixels }, job)
    }

    /// Runs a tool over a cloud; it stages edits with `job`.
    ///
    /// # Errors
    /// Where the plugin fails; staged edits are then to be dropped.
    pub fn run(
        &mut self,
        values: &Values,
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        self.0.run(&encode(values)?, cloud, job)
    }

    /// Runs a tool that is handled over the surfels of a stroke; it stages edits with `job`. ABI 3.11.
    ///
    /// # Errors
    /// Where the plugin fails; staged edits are then to be dropped.
    pub fn run_stroke(
        &mut self,
        call: &StrokeCall,
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        self.0.run(&encode(call)?, cloud, job)
    }
}
