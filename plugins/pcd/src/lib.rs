//! # `pcd`: point clouds of the Point Cloud Library
//!
//! | parameter   | type   | default   | meaning                                                          |
//! |-------------|--------|-----------|------------------------------------------------------------------|
//! | `encoding`  | choice | `binary`  | how points are written: `binary`, `ascii` or `binary-compressed`  |
//! | `viewpoint` | choice | `scanner` | what VIEWPOINT says when a file is read: `scanner` or `pose`       |
//!
//! Reads versions .5 to .7 in all three encodings. Fields become columns of their own names, types and
//! counts, but for these, whose case does not matter:
//!
//! | fields                                      | column                                                |
//! |---------------------------------------------|-------------------------------------------------------|
//! | `x` `y` `z`                                 | `position`, f32 where all three are, else f64          |
//! | `normal_x` `normal_y` `normal_z`; `nx` `ny` `nz` | `normal`, f32 or f64                               |
//! | `rgb`, `rgba` of 4 bytes                    | `color` of 3 or 4 bytes, unpacked                      |
//! | `red` `green` `blue`, of 8 or 16 bits        | `color`                                               |
//! | `intensity`, `classification`               | the same                                              |
//! | `returnnumber`, `numberofreturns`           | `return_number`, `n_returns`                           |
//! | `gpstime`, `pointsourceid`, `scananglerank` | `gps_time` (f64), `point_source`, `scan_angle` (f32)    |
//! | `_`                                         | padding, left out                                      |
//!
//! Whole numbers of 8 bytes become f64. Organised clouds keep every point of their grid, those without a
//! place (NaN) too.
//!
//! VIEWPOINT is where the sensor stood in the coordinates of the points: PCL's estimates of normals take it so,
//! and points are left where they are. PCL's viewer and its tool `transform_from_viewpoint` move the points by it
//! instead; for files that were meant so there is `viewpoint=pose`. Programs that know no viewpoint write the
//! default, zero. It is therefore believed only of organised clouds, which a sensor took.
//!
//! Written are all columns in their own types; positions in 4 bytes where that loses nothing, else in 8; colours
//! as PCL packs them into 4 bytes; no triangles. `binary` and `ascii` stream, `binary-compressed` holds what it has
//! compressed until its size is known. Compressed files of up to 256 MiB are decompressed whole, larger ones field by
//! field beside each other, in two passes and as many times 100 kB as there are fields.
//!
//! Source: PCL, "The PCD (Point Cloud Data) file format"; LZF, by Marc Lehmann.

mod ascii;
mod decode;
mod encode;
mod fields;
mod header;
mod header_text;
mod layout;
mod lzf;
mod names;
mod packed;
mod read;
mod store;
#[cfg(test)]
mod tests;
mod text;
mod write;

use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, CloudSource, FileSink, FileSource, FileTypes};
use surfelshop_api::prelude::{
    Error, HostInfo, Job, Result, UnitInfo, choices, export_plugin, params,
};

choices! {
    /// How points are stored.
    pub enum Encoding {
        /// As they lie in memory.
        Binary = "binary",
        /// As text.
        Ascii = "ascii",
        /// Field by field, compressed.
        BinaryCompressed = "binary-compressed",
    }
}

choices! {
    /// What VIEWPOINT says.
    pub enum ViewpointMeaning {
        /// Where the sensor stood, in the coordinates of the points.
        Scanner = "scanner",
        /// How points are moved from the sensor's coordinates into common ones.
        Pose = "pose",
    }
}

params! {
    /// Settings of `pcd`.
    pub struct Settings {
        /// How points are written: as they lie in memory (binary), as text (ascii), or compressed.
        encoding: Encoding { default: Encoding::Binary },
        /// What VIEWPOINT says when a file is read: where the sensor stood among the points
        /// (scanner), or how they are moved from its coordinates (pose).
        viewpoint: ViewpointMeaning { default: ViewpointMeaning::Scanner },
    }
}

/// The format.
struct Pcd;

impl Format for Pcd {
    const INFO: UnitInfo = UnitInfo::new(
        "pcd",
        "PCD",
        "Reads and writes point clouds of the Point Cloud Library (.pcd).",
    );
    const FILES: FileTypes = FileTypes::new()
        .ending("pcd")
        .magic(0, b"# .PCD")
        .magic(0, b"VERSION .7")
        .magic(0, b"VERSION 0.7")
        .written()
        .grid();
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        params: &Settings,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        read::read(file, params.viewpoint, clouds, job)
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        params: &Settings,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        let mut lines = Vec::new();
        write::write(clouds, params.encoding, file, job, &mut lines)?;
        match clouds.next_cloud()? {
            None => Ok(lines),
            Some(_) => Err(Error::new("expected one cloud, found several: a PCD file holds one")),
        }
    }
}

export_plugin! {
    id: "org.surfelshop.pcd",
    formats: [Pcd],
}
