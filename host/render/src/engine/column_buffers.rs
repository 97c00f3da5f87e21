//! Columns of clouds as buffers, for graphs that ask for them.

use crate::engine::output_request::OutputRequest;
use crate::engine::{Engine, RenderRequest};
use crate::graph::{BufferPart, Node, Plan, RenderError};
use crate::surfels::Ordered;
use std::collections::HashMap;
use surfelshop_api::graph::{COLUMNS_HEADER_WORDS, MAX_PAYLOADS};

/// Bytes of what the device stores of a splat besides its columns.
const BYTES_OF_A_SPLAT: u64 = 48 + 16 * MAX_PAYLOADS as u64;

impl Engine {
    /// The buffers of a graph that are filled with columns, where passes that run read them: their parts, by their
    /// positions.
    ///
    /// # Errors
    /// Where a buffer is of clouds that are not there, or has room for another number of surfels.
    pub(super) fn column_buffers(
        &mut self,
        asked: &OutputRequest,
        plan: &Plan,
        request: &RenderRequest<'_>,
    ) -> Result<HashMap<usize, Vec<BufferPart>>, RenderError> {
        self.given.next_frame();
        let clouds = request.data();
        let buffers = plan.structure.buffers.iter().enumerate();
        let wanted: Vec<_> = buffers
            .filter_map(|(i, buffer)| Some((i, buffer, buffer.columns.as_ref()?)))
            .filter(|(i, ..)| asked.touches(plan, Node::Buffer(*i)))
            .collect();
        // All parts of a frame have equally many: a pass of splats reads several buffers.
        let widest = wanted.iter().map(|(.., of)| 4 * u64::from(of.stride_words())).max();
        let Some(widest) = widest else { return Ok(HashMap::new()) };
        let limits = self.gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let room = most.saturating_sub(4 * u64::from(COLUMNS_HEADER_WORDS));
        let part_len = (room / widest.max(BYTES_OF_A_SPLAT)).min(u64::from(u32::MAX));
        let part_len = (part_len as u32).min(self.part_len);
        let ordered = Ordered::new(clouds);
        let mut given = HashMap::new();
        for (i, buffer, of) in wanted {
            let refuse =
                |what: String| Err(RenderError::Graph(format!("buffer `{}` {what}", buffer.label)));
            let is_there = |object: &u32| (*object as usize) < clouds.len();
            if !(of.objects.is_sorted_by(|a, b| a < b) && of.objects.iter().all(is_there)) {
                let n = clouds.len();
                return refuse(format!(
                    "is of the clouds {:?}; there are {n}, ascending",
                    of.objects
                ));
            }
            let n_of = |object: &u32| clouds[*object as usize].len as u64;
            let n_surfels: u64 = of.objects.iter().map(n_of).sum();
            if buffer.size != of.bytes(n_surfels) {
                let (found, expected) = (buffer.size, of.bytes(n_surfels));
                return refuse(format!(
                    "has {found} bytes; the columns of its {n_surfels} surfels take {expected}"
                ));
            }
            given.insert(i, self.given.buffer(&self.gpu, &ordered, of, part_len)?);
        }
        Ok(given)
    }
}
