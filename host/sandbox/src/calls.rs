//! The calls that a host makes into a module: requests go into its memory, and answers come out of it.

use crate::arena::Mark;
use crate::clouds::len_of;
use crate::function::HostFunction;
use crate::host::Host;
use crate::instance::{Instance, Pace};
use crate::layout::Written;
use crate::stop::Stop;
use surfelshop_api::{CloudView, Tile, Traced};
use wasmi::Val;

/// A tile that a tracer fills.
#[derive(Debug)]
pub struct TileCall<'a> {
    /// The request, msgpack.
    pub request: &'a [u8],
    /// Clouds and light.
    pub scene: &'a Traced<'a>,
    /// Which part of the picture, and which sample.
    pub tile: Tile,
    /// Four floats for each pixel of the tile.
    pub pixels: &'a mut [f32],
}

/// What a call of a format lends besides the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lent<'a> {
    /// A file of this name that is read, and a sink of clouds.
    Read(&'a str),
    /// A file of this name that is written, and a source of clouds.
    Written(&'a str),
}

/// Clouds that stay in a module's memory from tile to tile.
#[derive(Default)]
pub(crate) struct HeldClouds {
    /// What they are told by; nothing where none are there.
    key: Option<Vec<CloudKey>>,
    address: u32,
    above: Option<Mark>,
}

/// What a cloud in memory is known by: each column's name, generation and length, and where its triangles are.
#[derive(PartialEq)]
struct CloudKey {
    columns: Vec<(String, u64, usize)>,
    faces: (usize, usize),
    place: [u64; 11],
}

fn key(cloud: &CloudView<'_>) -> CloudKey {
    let column =
        |c: &surfelshop_api::ColumnView<'_>| (c.name.to_owned(), c.generation, c.values.len());
    let object = &cloud.object;
    let ([x, y, z], [cx, cy, cz]) = (cloud.origin.to_array(), object.center.to_array());
    let [qx, qy, qz, qw] = object.rotation.to_array();
    CloudKey {
        columns: cloud.columns.iter().map(column).collect(),
        faces: (cloud.faces.as_ptr().addr(), cloud.faces.len()),
        place: [x, y, z, cx, cy, cz, object.size, qx, qy, qz, qw].map(f64::to_bits),
    }
}

fn words<const N: usize>(words: [u32; N]) -> [Val; N] {
    words.map(|word| Val::I32(word as i32))
}

impl Instance {
    /// Lets go of what the last call was lent.
    fn clear(&mut self) {
        self.arena.release(&Mark::of_nothing());
        self.batch = None;
        self.lent = HeldClouds::default();
    }

    fn structure(&mut self, words: impl IntoIterator<Item = u32>) -> Result<u32, Stop> {
        self.lend(&Written::default().u32s(words).bytes())
    }

    fn functions_at<const N: usize>(
        &mut self,
        first: impl IntoIterator<Item = u32>,
        functions: [HostFunction; N],
    ) -> Result<u32, Stop> {
        let places = functions.map(|function| self.place_of(function));
        self.structure(first.into_iter().chain(places))
    }

    fn sink(&mut self) -> Result<u32, Stop> {
        self.functions_at([0], [HostFunction::Write])
    }

    fn job(&mut self) -> Result<u32, Stop> {
        use HostFunction::{Cancelled, Compute, Parallel, Progress, Stage};
        self.functions_at([0], [Progress, Cancelled, Stage, Parallel, Compute])
    }

    /// Bytes, and the structure that names them.
    fn message(&mut self, bytes: &[u8]) -> Result<u32, Stop> {
        let at = self.lend(bytes)?;
        self.structure([at, bytes.len() as u32])
    }

    fn finish(
        &mut self,
        (function, arguments): (u32, &[Val]),
        mut pace: Pace,
        host: &mut dyn Host,
    ) -> Result<i32, Stop> {
        self.start(&mut pace, host)?;
        let [status] = self.call((function, arguments), &mut pace, host, 0)?;
        Ok(status)
    }

    /// Has a unit describe itself; returns the status.
    ///
    /// # Errors
    /// Where the call does not return.
    pub fn describe(&mut self, unit: u32, host: &mut dyn Host) -> Result<i32, Stop> {
        self.clear();
        let sink = self.sink()?;
        let pace = self.steps();
        self.finish((self.functions.describe, &words([unit, sink])), pace, host)
    }

    /// Makes the instance that the other calls work on; returns the status, and whether one was made.
    ///
    /// # Errors
    /// Where the call does not return.
    pub fn create(
        &mut self,
        unit: u32,
        info: &[u8],
        host: &mut dyn Host,
    ) -> Result<(i32, bool), Stop> {
        self.clear();
        let (info, out, sink) = (self.message(info)?, self.structure([0])?, self.sink()?);
        let pace = self.steps();
        let arguments = words([unit, info, out, sink]);
        let status = self.finish((self.functions.create, &arguments), pace, host)?;
        self.unit = self.pair(out)?.0;
        Ok((status, self.unit != 0))
    }

    /// Has a renderer describe a frame; returns the status.
    ///
    /// # Errors
    /// Where the call does not return.
    pub fn frame(&mut self, request: &[u8], host: &mut dyn Host) -> Result<i32, Stop> {
        self.clear();
        let (request, sink) = (self.message(request)?, self.sink()?);
        let pace = self.steps();
        self.finish((self.functions.frame, &words([self.unit, request, sink])), pace, host)
    }

    /// Runs a tool over a cloud, which is copied in; returns the status.
    ///
    /// # Errors
    /// Where the call does not return, or the cloud is too large for the module's memory.
    pub fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        host: &mut dyn Host,
    ) -> Result<i32, Stop> {
        self.clear();
        let request = self.message(request)?;
        let room = self.room(len_of(cloud))?;
        let cloud = self.put_cloud(cloud, room)?;
        let (cloud, job, sink) = (self.lend(&cloud)?, self.job()?, self.sink()?);
        let arguments = words([self.unit, request, cloud, job, sink]);
        self.finish((self.functions.run, &arguments), Pace::Job(None), host)
    }

    /// Has a tracer fill a tile; returns the status. Clouds stay in the module's memory for the next tile.
    ///
    /// # Errors
    /// Where the call does not return, or the clouds are too large for the module's memory.
    pub fn tile(&mut self, call: TileCall<'_>, host: &mut dyn Host) -> Result<i32, Stop> {
        let TileCall { request, scene, tile, pixels } = call;
        let clouds = self.hold_clouds(scene.clouds)?;
        let texels = self.lend(bytemuck::cast_slice(scene.texels))?;
        let at = self.lend(bytemuck::cast_slice(pixels))?;
        let Tile { x, y, width, height, sample } = tile;
        let tile = self.structure([x, y, width, height, sample])?;
        let (request, job, sink) = (self.message(request)?, self.job()?, self.sink()?);
        let (n_clouds, n_texels) = (scene.clouds.len() as u32, scene.texels.len() as u32);
        let first = [self.unit, request, clouds, n_clouds, texels, n_texels, tile, at];
        let arguments = [&words(first)[..], &words([pixels.len() as u32, job, sink])[..]].concat();
        let status = self.finish((self.functions.tile, &arguments), Pace::Job(None), host)?;
        let filled = self.slice(at, size_of_val(pixels) as u32)?;
        for (pixel, bits) in pixels.iter_mut().zip(filled.as_chunks().0) {
            *pixel = f32::from_le_bytes(*bits);
        }
        Ok(status)
    }

    /// The address of clouds in memory: of those of the last tile where they are the same.
    fn hold_clouds(&mut self, clouds: &[CloudView<'_>]) -> Result<u32, Stop> {
        let wanted: Vec<CloudKey> = clouds.iter().map(key).collect();
        if let (Some(held), Some(mark)) = (&self.lent.key, &self.lent.above)
            && *held == wanted
        {
            self.arena.release(mark);
            return Ok(self.lent.address);
        }
        self.clear();
        let mut structures = Vec::new();
        for cloud in clouds {
            let at = self.room(len_of(cloud))?;
            structures.extend(self.put_cloud(cloud, at)?);
        }
        let address = self.lend(&structures)?;
        self.lent = HeldClouds { key: Some(wanted), address, above: Some(self.arena.mark()) };
        Ok(address)
    }

    /// Has a format read or write a file; returns the status.
    ///
    /// # Errors
    /// Where the call does not return, or the module has no functions of formats.
    pub fn file(
        &mut self,
        request: &[u8],
        lent: Lent<'_>,
        host: &mut dyn Host,
    ) -> Result<i32, Stop> {
        use HostFunction::{
            Batch, Begin, Faces, Length, NextBatch, NextCloud, ReadAt, Warn, WriteAt,
        };
        self.clear();
        let Some([read, write]) = self.functions.files else {
            return Err(Stop::misbehaved("it has no functions of formats"));
        };
        let request = self.message(request)?;
        let (Lent::Read(name) | Lent::Written(name)) = lent;
        let at = self.lend(name.as_bytes())?;
        let file = self.functions_at([0, at, name.len() as u32], [Length, ReadAt, WriteAt])?;
        let (job, sink) = (self.job()?, self.sink()?);
        let (function, arguments) = match lent {
            Lent::Read(_) => {
                let clouds = self.functions_at([0], [Begin, Batch, Faces, Warn])?;
                (read, words([self.unit, request, file, clouds, job, sink]))
            }
            Lent::Written(_) => {
                let clouds = self.functions_at([0], [NextCloud, NextBatch])?;
                (write, words([self.unit, request, clouds, file, job, sink]))
            }
        };
        self.finish((function, &arguments), Pace::Job(None), host)
    }
}
