//! # SFL: the surfel files of `Pointshop3D`
//!
//! Reads every surfel set of a file as a cloud, in its full resolution, and writes clouds as surfel sets.
//!
//! | column | of | |
//! |---|---|---|
//! | `position` | `f32`, or `f64` where a transform was applied | |
//! | `normal` | three `f32` | floats, codes of 16 or 32 bits, or u x v of the tangents |
//! | `radius` | `f32` | stored, or the longer tangent, or from the sampling density |
//! | `tangent_u`, `tangent_v` | three `f32` | half axes of ellipses |
//! | `color` | three or four `u8` | diffuse colour; luminance and YUV become RGB |
//! | `specular`, `ambient` | three `u8` | the other colours, without opacity |
//! | `ambient_coefficient`, `diffuse_coefficient`, `specular_coefficient` | `f32`, 0 to 1 | in steps of 1/255 |
//! | `shininess`, `flags`, `texture`, `weight`, `sampling_density`, `isovalue`, `origin_cell`, `camera_depth`, `camera_id`, `camera_xy`, `camera_angles` | as stored | |
//!
//! A set stands where its transform and the file's axes put it: rigid transforms become the cloud's pose, others are
//! applied to the surfels. y is up then, or x or z where that is so in a file whose other axes follow from it: its
//! coordinates stay. The camera of the scene, markers, feature relations and coarser resolutions are not
//! read.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `normals` | choice | `cub32` | written normals: codes of 32 bits, as `Pointshop3D` has them, or `float` |
//!
//! Written files are of surfel format 1: big-endian, colours as RGBA. Positions are 32-bit floats; where that would round them
//! because they lie far from zero, they are stored around an origin, which goes into the set's transform.
//! Columns that surfels have no property for are left out, with a line for each.
//!
//! Limits: files are smaller than 4 GiB, and hold at most 1023 sets. The format does not say what the bytes of U and V
//! of YUV colours stand for: they are read as differences around 128. It does not say either what its default units are
//! units of: where a file states them, they are taken for metres.
//!
//! Source: the format's facts were taken from files of the original library, with which this reader and writer share no code.

mod big_endian;
mod gff;
mod read;
mod settings;
mod surfel;
#[cfg(test)]
mod tests;
mod write;

use settings::Settings;
use surfelshop_api::format::{CloudSink, CloudSource, FileSink, FileSource, FileTypes};
use surfelshop_api::{Format, HostInfo, Job, Result, UnitInfo, export_plugin};

/// `Pointshop3D`'s surfel files.
pub struct Sfl;

impl Format for Sfl {
    const INFO: UnitInfo = UnitInfo::new(
        "sfl",
        "SFL (Pointshop3D)",
        "Reads and writes surfel sets of Pointshop3D, with ellipses, materials and flags.",
    );
    const FILES: FileTypes = FileTypes::new().ending("sfl").magic(8, b"SFLF").written().several();
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        _params: &Settings,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        read::read(file, clouds, job)
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        params: &Settings,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        write::write(clouds, params, file, job)
    }
}

export_plugin! {
    id: "org.surfelshop.sfl",
    formats: [Sfl],
}
