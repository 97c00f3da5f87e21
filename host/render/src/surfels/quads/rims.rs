//! Rims of a packed surface, as `rims.rs` of `host/raster` says what they are.

use super::{Drawing, Step, set};
use crate::graph::{Attachment, DrawKind, Pipelines, Recorder};
use crate::surfels::surface::{Surface, packed_texture};

const NAME: &str = "surfels: rims";

impl Drawing<'_> {
    /// A packed surface whose pixels that only stick out past a rim look as the front does beside them; the same where no
    /// backs are drawn.
    ///
    /// # Errors
    /// Where a pipeline cannot be made or bound.
    pub(crate) fn with_smooth_rims(
        &self,
        packed: wgpu::TextureView,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<wgpu::TextureView, String> {
        if !self.input.settings.two_sided {
            return Ok(packed);
        }
        let made = packed_texture(recorder.gpu, self.input.size);
        let (from, to) = (packed.texture(), made.texture());
        let whole = surface.size();
        recorder.encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), whole);
        let more = [
            ("nearest", wgpu::BindingResource::TextureView(surface.winners()?)),
            ("packed", wgpu::BindingResource::TextureView(&packed)),
        ];
        let step = Step {
            name: NAME,
            entries: ["cover_screen", "rim_fragment"],
            formats: &[wgpu::TextureFormat::Rgba32Uint],
            kind: DrawKind::Fullscreen,
        };
        let draws = self.prepare(&step, recorder.gpu, pipelines, &more)?;
        let target = [Attachment { view: &made, clear: false, slice: None }];
        recorder.render(NAME, &target, None, |pass| {
            for (pipeline, group, _) in &draws {
                set(pass, pipeline, group);
                pass.draw(0..3, 0..1);
            }
        });
        Ok(made)
    }
}
