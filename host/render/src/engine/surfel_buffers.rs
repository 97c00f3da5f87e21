//! The scene's surfels as data, for graphs that ask for them.

use crate::engine::output_request::OutputRequest;
use crate::engine::{Engine, RenderRequest};
use crate::graph::{Node, Plan, RenderError};
use crate::surfels::SURFEL_BYTES;
use std::collections::HashMap;
use surfelshop_api::Graph;

impl Engine {
    /// The buffers of a graph that are filled with surfels, where passes that run read them; by their
    /// positions.
    ///
    /// # Errors
    /// Where a buffer has room for another number of surfels, or a cloud cannot be drawn.
    pub(super) fn surfel_buffers(
        &mut self,
        asked: &OutputRequest,
        plan: &Plan,
        request: &RenderRequest<'_>,
    ) -> Result<HashMap<usize, wgpu::Buffer>, RenderError> {
        self.samples.next_frame();
        let scale = request.scene.surface.radius_scale;
        let n_surfels = request.data().iter().map(|cloud| cloud.len as u64).sum();
        let mut given = HashMap::new();
        for (i, buffer) in plan.structure.buffers.iter().enumerate() {
            if let Some(at_most) = buffer.surfels
                && asked.touches(plan, Node::Buffer(i))
            {
                // Said before it is made: of a size that nobody declared it may be beyond measure.
                let n_given = u64::from(Graph::surfels_given(n_surfels, at_most)).max(1);
                if buffer.size != n_given * SURFEL_BYTES {
                    return Err(RenderError::Graph(format!(
                        "buffer `{}` has {} bytes; {at_most} at most of the scene's surfels take {}",
                        buffer.label,
                        buffer.size,
                        n_given * SURFEL_BYTES
                    )));
                }
                let made = self.samples.buffer(&self.gpu, request.data(), scale, at_most)?;
                given.insert(i, made);
            }
        }
        Ok(given)
    }
}
