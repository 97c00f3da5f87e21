//! Columns that differ in some surfels from one that is on the device: these surfels alone are sent.

use crate::surfels::columns::Columns;
use crate::surfels::columns::changed::{few, places_of};
use surfelshop_cloud::changed_rows;

/// What a column on the device is found by: its generation, the order it is in, and what it is drawn as.
pub(crate) type ColumnKey = (u64, u32, &'static str);

/// Surfels between two that differ that are sent along: a write of their own costs more.
const GAP: u32 = 16;

/// A column on the device, and the surfels in which another one differs from it.
pub(crate) struct Predecessor {
    key: ColumnKey,
    rows: Vec<u32>,
}

/// A column as it is written: the order of its surfels, the bytes of each, and its chunks.
pub(crate) struct PatchSource<'a> {
    pub(crate) order: &'a [u32],
    pub(crate) encode: &'a dyn Fn(usize, &mut Vec<u8>),
    pub(crate) stride: usize,
    pub(crate) chunks: &'a [(u32, u32)],
    pub(crate) largest: f32,
}

impl Columns {
    /// The column on the device that a column which is not there differs least from; none where there is no such, or
    /// it was drawn in this frame or later.
    pub(crate) fn predecessor(
        &self,
        wanted: ColumnKey,
        n_surfels: usize,
        frame: u64,
    ) -> Option<Predecessor> {
        let (generation, order, variable) = wanted;
        if self.uploaded.contains_key(&wanted) {
            return None;
        }
        let known = self.uploaded.iter().filter(|((_, own_order, own_variable), column)| {
            *own_order == order
                && *own_variable == variable
                && column.n_surfels == n_surfels
                && column.last_used < frame
        });
        let with_rows = known.filter_map(|(key, _)| {
            Some(Predecessor { key: *key, rows: changed_rows(key.0, generation)? })
        });
        let least = with_rows.min_by_key(|known| known.rows.len())?;
        few(least.rows.len(), n_surfels).then_some(least)
    }

    /// Makes another column of one on the device. The other is gone then.
    pub(crate) fn patch(&mut self, of: Predecessor, wanted: ColumnKey, source: &PatchSource<'_>) {
        let Some(mut column) = self.uploaded.remove(&of.key) else { return };
        let places = places_of(&of.rows, source.order);
        let mut bytes = Vec::new();
        for (buffer, &(first, len)) in column.buffers.iter().zip(source.chunks) {
            let own = places.partition_point(|place| *place < first)
                ..places.partition_point(|place| *place < first + len);
            for run in places[own].chunk_by(|a, b| b - a <= GAP) {
                let [Some(start), Some(last)] = [run.first(), run.last()] else { continue };
                bytes.clear();
                for place in *start..=*last {
                    (source.encode)(source.order[place as usize] as usize, &mut bytes);
                }
                let offset = u64::from(start - first) * source.stride as u64;
                self.queue.write_buffer(buffer, offset, &bytes);
                self.sent_bytes += bytes.len() as u64;
            }
        }
        (column.largest, column.last_used) = (source.largest, self.frame);
        self.patches += 1;
        self.uploaded.insert(wanted, column);
    }
}
