//! A cloud as it is drawn: which of its columns, in which chunks.

use glam::DVec3;
use std::sync::Arc;
use surfelshop_api::columns;
use surfelshop_raster::Geometry;

/// One column's buffers, chunk by chunk.
pub(crate) type ChunkBuffers = Arc<Vec<wgpu::Buffer>>;

/// A cloud ready to be drawn.
pub(crate) struct DrawnCloud<'a> {
    pub(crate) origin: DVec3,
    /// Number of the object that it belongs to.
    pub(crate) object: u32,
    pub(crate) n_surfels: u32,
    /// Places on the device: those of the surfels, and behind them those of merged ones.
    pub(crate) n_places: u32,
    /// Places before those of surfels that are cut; all places where none is.
    pub(crate) n_whole: u32,
    pub(crate) chunk_len: u32,
    /// Buffers by shader variable.
    pub(crate) columns: Vec<(&'static str, ChunkBuffers)>,
    /// Preprocessor names that say which columns exist.
    pub(crate) defines: Vec<&'static str>,
    /// Generations of the columns, for cache keys.
    pub(crate) generations: Vec<u64>,
    /// Largest radius, scene units.
    pub(crate) max_radius: f32,
    /// The radius of all surfels where they have one: the device is not given a column then.
    pub(crate) equal_radius: Option<f32>,
    /// The largest radius of its round splats in perspective, in shares of their distance from the eye and times the
    /// scene's factor on radii; infinity where they are as large as they are. Merged ones are not bounded.
    pub(crate) round_reach: f32,
    /// Its columns in memory, where the CPU draws it.
    pub(crate) on_host: Option<Arc<surfelshop_raster::Columns>>,
    /// What parts of these are made of when they are drawn.
    pub(crate) geometry: Option<Geometry<'a>>,
    /// What its places are chosen by, where the device draws merged surfels.
    pub(crate) merged: Option<Arc<surfelshop_raster::Columns>>,
}

impl DrawnCloud<'_> {
    /// Number of chunks, as the device holds them.
    pub(crate) fn n_chunks(&self) -> usize {
        self.columns.first().map_or(0, |(_, buffers)| buffers.len())
    }

    /// First place and number of places of each chunk: of whole surfels, or of those that are cut.
    pub(crate) fn chunks(&self) -> Vec<(u32, u32)> {
        let parts = [0..self.n_whole, self.n_whole..self.n_places];
        let len = self.chunk_len;
        let chunks = parts.into_iter().flat_map(|part| {
            let firsts = part.clone().step_by(len as usize);
            firsts.map(move |first| (first, len.min(part.end - first)))
        });
        chunks.collect()
    }

    /// Whether its surfels have normal fields, and they are read.
    pub(crate) fn has_fields(&self) -> bool {
        self.columns.iter().any(|(name, _)| *name == columns::NORMAL_FIELD)
    }
}
