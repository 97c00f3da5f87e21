//! Triangles of lists, strips and fans.

use crate::accessor::whole_numbers;
use crate::buffers::Buffers;
use crate::mesh::Topology;
use gltf::json::mesh::Mode;
use surfelshop_api::format::BATCH;
use surfelshop_api::prelude::{Error, Job, Result};

/// Makes triangles of indices that come one after the other.
struct Assembly {
    mode: Mode,
    mirrors: bool,
    /// Added to each index.
    base: u32,
    /// Number of points.
    count: u32,
    n_taken: u64,
    first: u32,
    /// The last two indices.
    last: [u32; 2],
    out: Vec<[u32; 3]>,
    /// Triangles with a corner that is no point.
    n_wrong: u64,
}

impl Assembly {
    fn take(&mut self, index: u32) {
        let (place, [a, b]) = (self.n_taken, self.last);
        self.n_taken += 1;
        match self.mode {
            Mode::TriangleStrip if place >= 2 => {
                // Every other triangle of a strip is turned the other way round.
                let turns = place % 2 == 1;
                // Those without area only lead the strip elsewhere.
                if a != b && b != index && a != index {
                    self.push(if turns { [a, index, b] } else { [a, b, index] });
                }
            }
            Mode::TriangleFan if place >= 2 => self.push([b, index, self.first]),
            Mode::Triangles if place % 3 == 2 => self.push([a, b, index]),
            _ => {}
        }
        if place == 0 {
            self.first = index;
        }
        self.last = [b, index];
    }

    fn push(&mut self, [a, b, c]: [u32; 3]) {
        if a.max(b).max(c) >= self.count {
            self.n_wrong += 1;
            return;
        }
        // All points together are fewer than 2^32.
        let moved = [a, b, c].map(|index| self.base + index);
        let [a, b, c] = moved;
        self.out.push(if self.mirrors { [a, c, b] } else { moved });
    }
}

/// Where the triangles of a mesh go.
pub(crate) struct Placed<'a> {
    pub topology: &'a Topology,
    pub mirrors: bool,
    /// The number of the mesh's first point, and how many it has.
    pub base: u32,
    pub count: u32,
}

impl Placed<'_> {
    /// Hands the triangles over, in batches; returns how many have a corner that is no point.
    ///
    /// # Errors
    /// Where indices are none, memory runs out, the system refuses, the user asked to stop, or `take` fails.
    pub(crate) fn each(
        &self,
        buffers: &Buffers,
        job: &Job<'_>,
        mut take: impl FnMut(&[[u32; 3]]) -> Result<()>,
    ) -> Result<u64> {
        let Self { topology, mirrors, base, count } = *self;
        let mode = topology.mode;
        let (n_taken, first, last, out, n_wrong) = (0, 0, [0; 2], Vec::new(), 0);
        let mut made = Assembly { mode, mirrors, base, count, n_taken, first, last, out, n_wrong };
        let reader = topology.indices.as_ref().map(|indices| {
            let is_list = indices.shape.components == 1 && !indices.shape.normalized;
            let wrong = || Error::new("expected indices of one number each, found others");
            is_list.then(|| indices.reader(buffers)).ok_or_else(wrong)?
        });
        let reader = reader.transpose()?;
        let n = topology.indices.as_ref().map_or(count, |indices| indices.count);
        let mut start = 0;
        while start < n {
            job.check()?;
            // At most a batch.
            let len = (n - start).min(BATCH as u32);
            made.out.try_reserve(len as usize)?;
            match &reader {
                None => (start..start + len).for_each(|index| made.take(index)),
                Some(reader) => {
                    let bytes = reader.elements(start, len as usize)?;
                    let indices = whole_numbers(&bytes, reader.shape().kind)?;
                    indices.into_iter().for_each(|index| made.take(index));
                }
            }
            if !made.out.is_empty() {
                take(&made.out)?;
            }
            made.out.clear();
            start += len;
        }
        Ok(made.n_wrong)
    }
}
