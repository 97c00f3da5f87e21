//! # LAS and LAZ: point clouds of airborne and terrestrial scanners, and COPC
//!
//! | parameter | type   | default | meaning                                                                |
//! |-----------|--------|---------|------------------------------------------------------------------------|
//! | `version` | choice | `auto`  | of files that are written: `1.4`, `1.2`; `auto`: the lowest that holds all values |
//! | `scale`   | float  | 0       | step of coordinates that are written; 0: the cloud's own, or one that suits |
//!
//! Reads LAS 1.0 to 1.5 with all point formats, 0 to 10, and LAZ of all versions. A COPC file is a LAZ file whose
//! chunks are the nodes of an octree; all its points are read, or node by node where the host asks. Writes LAS 1.4 and 1.2, and LAZ where the name of the
//! file ends in `.laz`.
//!
//! Columns: `position` (f64, in the file's coordinates), `intensity`, `return_number`, `n_returns`,
//! `classification`, `class_flags` (1 synthetic, 2 key point, 4 withheld, 8 overlap), `scan_flags` (1 direction of
//! the scan, 2 edge of a flight line), `scanner_channel`, `user_data`, `scan_angle` (degrees), `point_source`,
//! `gps_time`, `color` (16 bits, as stored), `nir`, and each field of extra bytes by its own name, with a `_` where
//! that is taken. Extra bytes with a scale or an offset, and whole numbers of 64 bits, become f64. `NormalX`,
//! `NormalY` and `NormalZ` are the column `normal`. Waveforms are left out.
//!
//! z points up. Where it does not in the cloud, or the cloud does not say, a record of `Surfelshop` with the number 1 notes
//! it in written files: `up=x`, `up=y` or `up=unknown`. Other programs pass over it.
//!
//! Written, a column goes into its field where all its values fit, as far as the first batch shows; later values
//! that do not fit are rounded or clamped, and counted in a line. A column that has no field, or whose values do not
//! fit, becomes extra bytes of its own type, one field a component, and comes back as it was. Colours of 8 bits are
//! spread to 16, and linear ones are sRGB-encoded.
//!
//! Damage: numbers of points and records are believed as far as the file reaches. Where a chunk of a LAZ file is
//! damaged, the points of the others are read, and a line says how many are missing. Without a table, chunks are
//! found one after the other. LAZ has no checksums: damage that decodes to points is not noticed.
//!
//! Limits: `GeoTIFF` keys say an EPSG code and a unit; systems that they
//! describe by other keys are unknown. Written files of EPSG codes have `GeoTIFF` keys in LAS 1.4, too, which asks for
//! WKT.
//!
//! Source: ASPRS, "LAS Specification 1.4 - R15", 2019; Isenburg, "`LASzip`: lossless compression of `LiDAR` data",
//! 2013; the crate `laz`; Hobu, "COPC Specification 1.0", 2021.
//!
//! ```text
//! surfelshop render tile.laz -r ewa-phong -o tile.png
//! ```

mod compressed;
mod decode;
mod extra;
mod header;
mod hierarchy;
mod layout;
mod notes;
mod numbers;
mod plain;
mod point_format;
mod points;
mod projection;
mod read;
mod records;
mod settings;
#[cfg(test)]
mod tests;
mod up_record;
mod write;

pub use settings::{Settings, Version};
use surfelshop_api::format::{CloudSink, CloudSource, FileSink, FileSource, FileTypes, Format};
use surfelshop_api::{HostInfo, Job, Result, UnitInfo, export_plugin};

/// The format.
pub struct Las;

impl Format for Las {
    const INFO: UnitInfo = UnitInfo::new(
        "las",
        "LAS and LAZ",
        "Reads and writes LAS and LAZ point clouds, and reads COPC.",
    );
    const FILES: FileTypes =
        FileTypes::new().ending("laz").ending("las").magic(0, b"LASF").written();
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
    id: "org.surfelshop.las",
    formats: [Las],
}
