//! # `potree`: octrees of Potree 2
//!
//! Reads `metadata.json`, with `hierarchy.bin` and `octree.bin` beside it, as `PotreeConverter` 2 writes them: points
//! as they are (`DEFAULT`) and compressed (`BROTLI`). The folder's name will do, too. All points are read, or node by
//! node where the host asks: so they are drawn in place without being held as a whole, up to two million nodes.
//!
//! | attribute | column |
//! |-----------|--------|
//! | `position` | `position`, f64, in the file's coordinates |
//! | `rgb` | `color`, as stored |
//! | `intensity`, `classification` | the same |
//! | `return number`, `number of returns`, `point source id`, `gps-time` | `return_number`, `n_returns`, `point_source`, `gps_time` |
//! | `classification flags`, `user data` | `class_flags`, `user_data` |
//! | `scan angle`, `scan angle rank` | `scan_angle`, degrees |
//! | `normal`, or `NormalX`, `NormalY` and `NormalZ` | `normal` |
//! | any other | its own name, with a `_` where that is taken |
//!
//! Attributes with a scale or an offset, and whole numbers of 64 bits, become f64. z points up.
//!
//! The points of an inner node are not those of the nodes beneath: all of them together are the cloud. Compressed
//! coordinates are one step larger in the file than they were, by a mistake of its writers, and are set right.
//!
//! Not read: Potree 1 (`cloud.js`), whose points are in a file for each node; attributes of unknown types.
//!
//! Source: `PotreeConverter` 2.1; Schütz, Ohrhallinger and Wimmer, "Fast Out-of-Core Octree Generation for Massive
//! Point Clouds", 2020.
//!
//! ```text
//! surfelshop render town/metadata.json -r ewa-phong -o town.png
//! ```

mod attributes;
mod decode;
mod hierarchy;
mod metadata;
mod read;
#[cfg(test)]
mod tests;

use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, FileSource, FileTypes};
use surfelshop_api::prelude::{HostInfo, Job, Result, UnitInfo, export_plugin};

/// The format.
struct Potree;

impl Format for Potree {
    const INFO: UnitInfo = UnitInfo::new(
        "potree",
        "Potree",
        "Reads the octrees of Potree 2 (metadata.json with hierarchy.bin and octree.bin).",
    );
    const FILES: FileTypes =
        FileTypes::new().ending("metadata.json").beside(hierarchy::NAME).beside(read::OCTREE);
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        _params: &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        read::read(file, clouds, job)
    }
}

export_plugin! {
    id: "org.surfelshop.potree",
    formats: [Potree],
}
