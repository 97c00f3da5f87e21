//! The safe calls a host makes into a loaded plugin.

use super::host_job::raw_job;
use super::plugin_side::{self, Description, Package};
use super::table::{Bytes, MAGIC, PluginTable, RawCloud, RawColumn, Sink, channel, status};
use crate::columns::CloudView;
use crate::frame::{FrameRequest, HostInfo, InMotion};
use crate::job::JobHost;
use crate::manifest::{ABI_MAJOR, ABI_MINOR};
use crate::object::ObjectFrame;
use crate::params::Values;
use crate::tool::{Tile, Traced};
use core::ffi::c_void;
use core::mem::offset_of;
use std::fmt;
use std::time::Duration;

/// Most bytes a plugin may write in one call, and of a graph's data or a computation's buffers.
pub const MAX_OUTPUT_BYTES: usize = 1 << 30;
/// Most bytes of the structure of a graph: hundreds of the longest shaders that are compiled.
pub const MAX_STRUCTURE_BYTES: usize = 16 << 20;
/// Most bytes of a unit's description.
const MAX_DESCRIPTION_BYTES: usize = 1 << 20;
/// Most bytes of a line that says what went wrong; what is longer is cut.
const MAX_ERROR_BYTES: usize = 4 << 10;

/// Most bytes of what goes through a channel.
fn most(of: u32) -> usize {
    match of {
        channel::STRUCTURE => MAX_STRUCTURE_BYTES,
        channel::DESCRIPTION => MAX_DESCRIPTION_BYTES,
        _ => MAX_OUTPUT_BYTES,
    }
}

/// How a call into a plugin failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The plugin said what went wrong.
    Error(String),
    /// The plugin's code panicked; says where.
    Panic(String),
    /// The plugin broke the boundary's rules.
    Misbehaved(String),
    /// The plugin was still at work when the host stopped waiting, after this time.
    TimedOut(Duration),
    /// The plugin was not asked; says why.
    NotAsked(String),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error(line) | Self::Panic(line) => f.write_str(line),
            Self::Misbehaved(line) => write!(f, "broke the plugin interface: {line}"),
            Self::TimedOut(limit) => write!(f, "did not answer within {} s", limit.as_secs_f64()),
            Self::NotAsked(line) => write!(f, "is not asked any more: {line}"),
        }
    }
}

impl std::error::Error for Fault {}

/// A plugin whose code is in memory.
#[derive(Clone, Copy)]
pub struct Plugin {
    table: &'static PluginTable,
}

/// A frame as a renderer wrote it: decoding is left to the host, which compares first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedGraph {
    /// Msgpack of [`Structure`](crate::graph::Structure).
    pub structure: Vec<u8>,
    /// Bytes of uniforms and uploads.
    pub data: Vec<u8>,
}

impl Plugin {
    /// A plugin registered in this program with [`static_plugin!`](crate::static_plugin!).
    #[must_use]
    pub fn of<P: Package>() -> Self {
        Self { table: const { &plugin_side::table::<P>() } }
    }

    /// A plugin from the address of its exported table.
    ///
    /// # Errors
    /// Where the table's magic, size or version is not this host's.
    ///
    /// # Safety
    /// `table` points to a [`PluginTable`] (or to something that starts with eight other bytes)
    /// that stays in memory, with the code it points to, until the process ends.
    pub unsafe fn from_table(table: *const PluginTable) -> Result<Self, Fault> {
        let misbehaved = |line: String| Err(Fault::Misbehaved(line));
        // SAFETY: at least eight bytes are readable, by the caller's promise.
        if unsafe { (*table).magic } != MAGIC {
            return misbehaved("the function table's magic bytes are wrong".to_owned());
        }
        // SAFETY: with the right magic, the fixed head of the table is readable.
        let (size, plugin) = unsafe { ((*table).size, ((*table).abi_major, (*table).abi_minor)) };
        if plugin.0 != ABI_MAJOR || plugin.1 > ABI_MINOR {
            return misbehaved(format!(
                "its function table speaks ABI {}.{}, this host {ABI_MAJOR}.{ABI_MINOR}",
                plugin.0, plugin.1
            ));
        }
        if (size as usize) < size_of::<PluginTable>() {
            return misbehaved(format!(
                "its function table has {size} bytes, expected {}",
                size_of::<PluginTable>()
            ));
        }
        let functions = [
            ("describe", offset_of!(PluginTable, describe)),
            ("create", offset_of!(PluginTable, create)),
            ("destroy", offset_of!(PluginTable, destroy)),
            ("frame", offset_of!(PluginTable, frame)),
            ("tile", offset_of!(PluginTable, tile)),
            ("run", offset_of!(PluginTable, run)),
        ];
        for (name, offset) in functions {
            // SAFETY: magic, version and size say that a whole table is there; a function is a pointer of
            // it, which other languages can leave null.
            let function = unsafe { table.byte_add(offset).cast::<*const c_void>().read() };
            if function.is_null() {
                return misbehaved(format!(
                    "its function table has no `{name}`; one that a plugin does without returns an error"
                ));
            }
        }
        // SAFETY: the whole table is there, with no function missing, and it stays.
        Ok(Self { table: unsafe { &*table } })
    }

    /// What a unit says of itself, by its position in the manifest.
    ///
    /// # Errors
    /// Where the plugin fails or writes something that is no description.
    pub fn describe(&self, unit: u32) -> Result<Description, Fault> {
        let mut outputs = Outputs::default();
        // SAFETY: the table's functions may be called with a sink that lives for the call.
        let status = unsafe { (self.table.describe)(unit, outputs.sink()) };
        outputs.check(status)?;
        let misbehaved = |what: &dyn fmt::Display| {
            Fault::Misbehaved(format!("its description is no good: {what}"))
        };
        let written = outputs.channel(channel::DESCRIPTION);
        if written.is_empty() {
            return Err(Fault::Misbehaved("it wrote no description".to_owned()));
        }
        let description: Description =
            rmp_serde::from_slice(written).map_err(|error| misbehaved(&error))?;
        description.check().map_err(|line| misbehaved(&line))?;
        Ok(description)
    }

    /// Makes an instance of a unit, by its position in the manifest.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn create(&self, unit: u32, host: &HostInfo) -> Result<Instance, Fault> {
        let host = encode(host)?;
        let mut outputs = Outputs::default();
        let mut instance = std::ptr::null_mut();
        // SAFETY: bytes, place and sink live for the call.
        let status =
            unsafe { (self.table.create)(unit, borrow(&host), &raw mut instance, outputs.sink()) };
        outputs.check(status)?;
        if instance.is_null() {
            return Err(Fault::Misbehaved("it made no instance and gave no reason".to_owned()));
        }
        Ok(Instance { table: self.table, pointer: instance })
    }
}

/// An instance of a unit inside a plugin; dropping it ends it there.
pub struct Instance {
    table: &'static PluginTable,
    pointer: *mut c_void,
}

// SAFETY: units are `Send`, so an instance may be used from another thread than it was made on.
unsafe impl Send for Instance {}
// SAFETY: the only call on a shared instance is `tile`, and tracers are `Sync`.
unsafe impl Sync for Instance {}

impl Instance {
    /// Has a renderer describe a frame.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn frame(&mut self, request: &FrameRequest) -> Result<EncodedGraph, Fault> {
        self.frame_in_motion(request, 1)
    }

    /// Has a renderer describe a frame in which one surfel of `stride` is drawn
    /// ([`Graph::stride`](crate::Graph::stride)); 0 is taken as 1. ABI 3.6.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn frame_in_motion(
        &mut self,
        request: &FrameRequest,
        stride: u32,
    ) -> Result<EncodedGraph, Fault> {
        check_known(self.table.abi_minor, request)?;
        let request = encode(&Asked { request, moves: InMotion { stride } })?;
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and used by this call alone; bytes and sink live for it.
        let status = unsafe { (self.table.frame)(self.pointer, borrow(&request), outputs.sink()) };
        outputs.check(status)?;
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
        check_known(self.table.abi_minor, request)?;
        let request = encode(request)?;
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
            (self.table.tile)(
                self.pointer,
                borrow(&request),
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
        let values = encode(values)?;
        let columns = raw_columns(cloud);
        let cloud = raw_cloud(cloud, &columns);
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (self.table.run)(
                self.pointer,
                borrow(&values),
                &raw const cloud,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        let mut outputs = Outputs::default();
        // SAFETY: the pointer came from `create` and is not used after this. A failure to end is
        // contained by the plugin's shim and has no consequence here.
        unsafe { (self.table.destroy)(self.pointer, outputs.sink()) };
    }
}

/// A request for a frame as it is written: one map of all fields.
#[derive(serde::Serialize)]
struct Asked<'a> {
    #[serde(flatten)]
    request: &'a FrameRequest,
    #[serde(flatten)]
    moves: InMotion,
}

/// Whether a plugin of an older minor version can read a request.
fn check_known(minor: u16, request: &FrameRequest) -> Result<(), Fault> {
    let placed = request.scene.lights.iter().filter(|light| light.position().is_some()).count();
    if minor >= 1 || placed == 0 {
        return Ok(());
    }
    Err(Fault::Error(format!(
        "it speaks ABI {ABI_MAJOR}.{minor}, which knows no point lights and spots, of which the \
         scene has {placed}; build it again, or leave them out"
    )))
}

fn encode(value: &impl serde::Serialize) -> Result<Vec<u8>, Fault> {
    rmp_serde::to_vec_named(value)
        .map_err(|error| Fault::Error(format!("the request could not be encoded: {error}")))
}

pub(super) fn borrow(bytes: &[u8]) -> Bytes {
    Bytes { ptr: bytes.as_ptr(), len: bytes.len() }
}

fn raw_columns(cloud: &CloudView<'_>) -> Vec<RawColumn> {
    cloud
        .columns
        .iter()
        .map(|column| RawColumn {
            name: borrow(column.name.as_bytes()),
            element: column.values.element() as u32,
            components: column.components,
            generation: column.generation,
            values: column.values.as_ptr(),
            len: column.values.len(),
        })
        .collect()
}

fn raw_object(object: &ObjectFrame) -> [f64; 8] {
    let ([x, y, z], [qx, qy, qz, qw]) = (object.center.to_array(), object.rotation.to_array());
    [x, y, z, object.size, qx, qy, qz, qw]
}

fn raw_cloud(cloud: &CloudView<'_>, columns: &[RawColumn]) -> RawCloud {
    RawCloud {
        origin: cloud.origin.to_array(),
        len: cloud.len,
        columns: columns.as_ptr(),
        n_columns: columns.len(),
        faces: cloud.faces.as_ptr(),
        n_faces: cloud.faces.len(),
        object: raw_object(&cloud.object),
    }
}

/// # Safety
/// The bytes are alive and unchanged for `'a`.
pub(super) unsafe fn lent<'a>(bytes: Bytes) -> &'a [u8] {
    if bytes.len == 0 || bytes.ptr.is_null() {
        return &[];
    }
    // SAFETY: by the caller's promise.
    unsafe { std::slice::from_raw_parts(bytes.ptr, bytes.len) }
}

/// What a plugin wrote during one call.
#[derive(Default)]
struct Outputs {
    channels: Vec<(u32, Vec<u8>)>,
    total: usize,
    /// What was too much: so many bytes, where so many are taken.
    too_much: Option<(usize, usize)>,
}

impl Outputs {
    fn sink(&mut self) -> Sink {
        unsafe extern "C" fn write(context: *mut c_void, channel: u32, bytes: Bytes) {
            // SAFETY: the context is the `Outputs` whose sink this is, alive for the call and
            // used by one thread at a time; the plugin lends the bytes for the call.
            let (outputs, bytes) = unsafe { (&mut *context.cast::<Outputs>(), lent(bytes)) };
            let bytes = match channel {
                channel::ERROR => &bytes[..bytes.len().min(MAX_ERROR_BYTES)],
                _ => bytes,
            };
            outputs.total = outputs.total.saturating_add(bytes.len());
            for (found, most) in [(bytes.len(), most(channel)), (outputs.total, MAX_OUTPUT_BYTES)] {
                if found > most {
                    outputs.too_much.get_or_insert((found, most));
                    return;
                }
            }
            outputs.channels.retain(|(other, _)| *other != channel);
            outputs.channels.push((channel, bytes.to_vec()));
        }
        Sink { context: std::ptr::from_mut(self).cast(), write }
    }

    fn channel(&self, channel: u32) -> &[u8] {
        self.channels.iter().find(|(id, _)| *id == channel).map_or(&[], |(_, bytes)| bytes)
    }

    fn take(&mut self, channel: u32) -> Vec<u8> {
        let found = self.channels.iter_mut().find(|(id, _)| *id == channel);
        found.map(|(_, bytes)| std::mem::take(bytes)).unwrap_or_default()
    }

    fn check(&self, status: i32) -> Result<(), Fault> {
        let line = || {
            let text = String::from_utf8_lossy(self.channel(channel::ERROR));
            let one_line = text.split_whitespace().collect::<Vec<_>>().join(" ");
            if one_line.is_empty() { "it gave no reason".to_owned() } else { one_line }
        };
        match status {
            status::OK => match self.too_much {
                None => Ok(()),
                Some((found, most)) => Err(Fault::Misbehaved(format!(
                    "it wrote {found} bytes where at most {most} are taken"
                ))),
            },
            status::ERROR => Err(Fault::Error(line())),
            status::PANIC => Err(Fault::Panic(line())),
            other => Err(Fault::Misbehaved(format!("it returned the unknown status {other}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Light, Projection, Scene, View};
    use glam::{DVec3, Vec3};

    #[test]
    fn a_plugin_older_than_lights_with_a_place_is_told_so() {
        let projection = Projection::Orthographic { height: 1.0 };
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        let mut request = FrameRequest {
            view: View { camera, size_px: [1; 2], near: 0.1, far: 9.0 },
            scene: Scene::default(),
            cloud: Default::default(),
            frame_index: 0,
            values: Values::new(),
            environment: None,
        };
        assert_eq!(check_known(0, &request), Ok(()));
        request.scene.lights.push(Light::Point { position: DVec3::X, intensity: Vec3::ONE });
        assert_eq!(check_known(ABI_MINOR, &request), Ok(()));
        let line = check_known(0, &request).unwrap_err().to_string();
        let expected = "it speaks ABI 3.0, which knows no point lights and spots, of which the \
                        scene has 1; build it again, or leave them out";
        assert!(line.contains(expected), "{line}");
    }
}
