//! An instance of a unit inside a plugin, and the calls on it.

use super::clouds::{raw_cloud, raw_columns};
use super::fault::Fault;
use super::job::raw_job;
use super::outputs::Outputs;
use super::plugin::Tables;
use super::request::{FrameCall, check_known, encode};
use super::sandboxed::Sandboxed;
use core::ffi::c_void;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::abi::format_table::FormatTable;
use surfelshop_api::abi::table::{Bytes, RawCloud, RawColumn, channel};
use surfelshop_api::frame::OnDevice;
use surfelshop_api::job::JobHost;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudView, FrameRequest, StrokeCall, Tile, Traced};
use surfelshop_sandbox::TileCall;

/// An instance of a unit inside a plugin; dropping it ends it there.
pub struct Instance(Held);

enum Held {
    Native(Native),
    Sandboxed(Sandboxed),
}

/// An instance inside a library.
pub(super) struct Native {
    tables: Tables,
    pointer: *mut c_void,
}

// SAFETY: units are `Send`, so an instance may be used from another thread than it was made on.
unsafe impl Send for Native {}
// SAFETY: the only call on a shared instance is `tile`, and tracers are `Sync`.
unsafe impl Sync for Native {}

impl Native {
    /// The instance, for a call that uses it alone.
    pub(super) fn pointer(&mut self) -> *mut c_void {
        self.pointer
    }

    /// The functions of its package's formats.
    pub(super) fn formats(&self) -> Result<&'static FormatTable, Fault> {
        let lacks = || Fault::Misbehaved("it has no functions of formats".to_owned());
        self.tables.formats.ok_or_else(lacks)
    }
}

impl Instance {
    /// One that `create` of these tables made.
    pub(super) fn native(tables: Tables, pointer: *mut c_void) -> Self {
        Self(Held::Native(Native { tables, pointer }))
    }

    /// One in a sandbox.
    pub(super) fn sandboxed(sandboxed: Sandboxed) -> Self {
        Self(Held::Sandboxed(sandboxed))
    }

    /// Where it is.
    pub(super) fn held(&mut self) -> Result<&mut Native, &mut Sandboxed> {
        match &mut self.0 {
            Held::Native(native) => Ok(native),
            Held::Sandboxed(sandboxed) => Err(sandboxed),
        }
    }

    /// The minor version of the interface that its package speaks.
    fn minor(&self) -> u16 {
        match &self.0 {
            Held::Native(native) => native.tables.plugin.abi_minor,
            Held::Sandboxed(sandboxed) => sandboxed.minor(),
        }
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
        check_known(self.minor(), request)?;
        let request = encode(&FrameCall::new(request, stride, on_device))?;
        let mut outputs = Outputs::default();
        match &mut self.0 {
            Held::Native(Native { tables, pointer }) => {
                // SAFETY: the instance is alive and used by this call alone; bytes and sink live for it.
                let status =
                    unsafe { (tables.plugin.frame)(*pointer, Bytes::of(&request), outputs.sink()) };
                outputs.check(status)?;
            }
            Held::Sandboxed(sandboxed) => sandboxed.frame(&request, &mut outputs)?,
        }
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
        check_known(self.minor(), request)?;
        let request = encode(request)?;
        let Native { tables, pointer } = match &self.0 {
            Held::Native(native) => native,
            Held::Sandboxed(sandboxed) => {
                return sandboxed.tile(TileCall { request: &request, scene, tile, pixels }, job);
            }
        };
        let columns: Vec<Vec<RawColumn>> = scene.clouds.iter().map(raw_columns).collect();
        let raw: Vec<RawCloud> = scene
            .clouds
            .iter()
            .zip(&columns)
            .map(|(cloud, columns)| raw_cloud(cloud, columns))
            .collect();
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and shared only by `tile` calls; everything lent lives
        // for the call, and the pixels are lent to it alone.
        let status = unsafe {
            (tables.plugin.tile)(
                *pointer,
                Bytes::of(&request),
                raw.as_ptr(),
                raw.len(),
                scene.texels.as_ptr(),
                scene.texels.len(),
                &raw const tile,
                pixels.as_mut_ptr(),
                pixels.len(),
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
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
        self.run_with(&encode(values)?, cloud, job)
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
        self.run_with(&encode(call)?, cloud, job)
    }

    fn run_with(
        &mut self,
        call: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let Native { tables, pointer } = match &mut self.0 {
            Held::Native(native) => native,
            Held::Sandboxed(sandboxed) => return sandboxed.run(call, cloud, job),
        };
        let columns = raw_columns(cloud);
        let cloud = raw_cloud(cloud, &columns);
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (tables.plugin.run)(
                *pointer,
                Bytes::of(call),
                &raw const cloud,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }
}

impl Drop for Native {
    fn drop(&mut self) {
        let mut outputs = Outputs::default();
        // SAFETY: the pointer came from `create` and is not used after this. A failure to end is
        // contained by the plugin's shim and has no consequence here.
        unsafe { (self.tables.plugin.destroy)(self.pointer, outputs.sink()) };
    }
}
