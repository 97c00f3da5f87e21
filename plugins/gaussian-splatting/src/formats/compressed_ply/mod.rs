//! # `compressed-ply`: the packed PLY files of `SuperSplat` and `PlayCanvas`
//!
//! A binary PLY file, least significant byte first, with these elements:
//!
//! | element  | properties                                                                            |
//! |----------|---------------------------------------------------------------------------------------|
//! | `chunk`  | bounds of every 256 Gaussians, float: `min_x` to `max_z`, those of the logarithms of sizes |
//! |          | `min_scale_x` to `max_scale_z`, and in newer files those of colours `min_r` to `max_b`     |
//! | `vertex` | `packed_position`, `packed_rotation`, `packed_scale` and `packed_color`; uint             |
//! | `sh`     | `f_rest_0` to `f_rest_8`, 23 or 44, red first; uchar; may be missing                      |
//!
//! Positions and sizes are 11, 10 and 11 bits between the bounds, rotations w, x, y, z without the largest, which two
//! bits name, and three times 10 bits; colours and opacity have 8 bits. Other elements and properties are stepped over.
//! Files do not say which axis points up.
//!
//! What is written has Gaussians along a Z-curve, so that those of a chunk lie close together: the finer are its steps.
//! Spherical harmonics are held within -4 and 4 in steps of 1/32, logarithms of sizes within -20 and 20.
//!
//! Source: playcanvas/splat-transform, `decompress-ply.ts` and `compressed-chunk.ts`.

mod header;
mod points;
mod write;

use super::batch::{Batch, in_batches, resize};
use header::Header;
use points::{CHUNK, Chunk, Vertex};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes,
};
use surfelshop_api::prelude::{HostInfo, Job, LimitInfo, Result, UnitInfo};

/// Why points come back a little beside.
const COARSE: &str =
    "positions have 10 and 11 bits between the bounds of 256 neighbours in such files";

/// The format.
pub(crate) struct CompressedPly;

impl surfelshop_api::Format for CompressedPly {
    const INFO: UnitInfo = UnitInfo::new(
        "compressed-ply",
        "Compressed PLY",
        "Reads and writes packed Gaussian splats of SuperSplat and PlayCanvas (.compressed.ply).",
    );
    // They begin as any PLY file does.
    const FILES: FileTypes = FileTypes::new().ending("compressed.ply").written();
    type Params = ();
    const LIMITS: &'static [LimitInfo] =
        &[LimitInfo::new("round-trip", COARSE), LimitInfo::new("moved", COARSE)];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        (): &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let header = Header::read(file)?;
        let mut batch = Batch::new(clouds, header.degree());
        let cloud = CloudHeader {
            format: format!("compressed PLY, spherical harmonics of degree {}", header.degree()),
            rows: Some(header.vertex.rows),
            columns: batch.header(),
            comments: header.comments.clone(),
            ..CloudHeader::default()
        };
        if !clouds.begin(&cloud)? {
            return Ok(());
        }
        let harmonics = header.harmonics.as_ref().filter(|_| batch.has_rest());
        let mut bytes: [Vec<u8>; 3] = Default::default();
        // Batches are whole chunks.
        in_batches(header.vertex.rows, 0.0..1.0, job, |first, n| {
            let [chunks, vertices, rest] = &mut bytes;
            let rows = |element: &header::Element, first: u64, n: usize, bytes: &mut Vec<u8>| {
                resize(bytes, n * element.stride)?;
                file.read_exact_at(element.start + first * element.stride as u64, bytes)
            };
            rows(&header.chunk, first / CHUNK as u64, n.div_ceil(CHUNK), chunks)?;
            rows(&header.vertex, first, n, vertices)?;
            if let Some(harmonics) = harmonics {
                rows(harmonics, first, n, rest)?;
            }
            let chunks =
                chunks.chunks_exact(header.chunk.stride).map(|row| Chunk::of(&header, row));
            let chunks: Vec<Chunk> = chunks.collect();
            for (i, row) in vertices.chunks_exact(header.vertex.stride).enumerate() {
                let mut found = Vertex::of(&header, row).gaussian(&chunks[i / CHUNK]);
                if let Some(harmonics) = harmonics {
                    let row = &rest[i * harmonics.stride..][..harmonics.stride];
                    points::add_harmonics(&header, row, &mut found);
                }
                batch.push(&found);
            }
            batch.hand_over(clouds)
        })?;
        batch.finish(clouds);
        Ok(())
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        (): &(),
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        write::write(clouds, file, job)
    }
}
