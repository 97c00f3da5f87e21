//! The calls on an instance of a unit, by bytes: the same wherever its code runs.

use super::fault::Fault;
use super::instance::Instance;
use super::outputs::Outputs;
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::job::JobHost;
use surfelshop_api::{CloudView, Tile, Traced};

/// A tile that a tracer fills.
pub(crate) struct TileCall<'a> {
    /// The request, msgpack.
    pub(crate) request: &'a [u8],
    /// Clouds and light.
    pub(crate) scene: &'a Traced<'a>,
    /// Which part of the picture, and which sample.
    pub(crate) tile: Tile,
    /// Four floats for each pixel of the tile.
    pub(crate) pixels: &'a mut [f32],
}

/// A file that is lent to a format, with its name.
pub(crate) type NamedFile<'a> = (&'a str, &'a dyn FileHost);

/// An instance of a unit; requests are msgpack.
pub(crate) trait Calls: Send + Sync {
    /// The minor version of the interface that its package speaks.
    fn minor(&self) -> u16;

    /// Has a renderer describe a frame.
    fn frame(&mut self, request: &[u8], outputs: &mut Outputs) -> Result<(), Fault>;

    /// Has a tracer fill a tile.
    fn tile(&self, call: TileCall<'_>, job: &dyn JobHost) -> Result<(), Fault>;

    /// Has a tool run over a cloud.
    fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault>;

    /// Has a format read a file.
    fn read(
        &mut self,
        request: &[u8],
        file: NamedFile<'_>,
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault>;

    /// Has a format write a file.
    fn write(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        file: NamedFile<'_>,
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault>;
}

/// The code of a package that does not run in this program's own memory, for as long as the program does.
pub(crate) trait Apart: Send + Sync {
    /// Has a unit describe itself.
    fn describe(&self, unit: u32, outputs: &mut Outputs) -> Result<(), Fault>;

    /// Makes an instance of a unit; `info` is what it is made from, msgpack.
    fn create(&'static self, unit: u32, info: Vec<u8>) -> Result<Instance, Fault>;

    /// Whether it is confined to what nobody needs to trust.
    fn is_sandboxed(&self) -> bool;
}
