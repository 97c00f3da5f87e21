//! Colours that are darkened by the distances of the same frame.

use crate::engine::{Engine, RenderRequest, Rendered, RendererView};
use crate::graph::RenderError;
use glam::Vec2;
use surfelshop_api::graph::Output;
use surfelshop_image::{EyeDome, Image};

impl Engine {
    /// A frame whose colour is darkened by its distances, which are asked for besides where nobody does. They are those
    /// of the whole scene.
    pub(super) fn attempt_darkened(
        &mut self,
        how: EyeDome,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, RenderError> {
        let mut outputs = request.outputs.to_vec();
        if !outputs.contains(&Output::Depth) {
            outputs.push(Output::Depth);
        }
        let whole_depths = std::mem::replace(&mut self.whole_depths, true);
        let asked = RenderRequest { outputs: &outputs, ..*request };
        let rendered = self.attempt(renderer, &asked, shift_px);
        self.whole_depths = whole_depths;
        let mut rendered = rendered?;
        let distances = image_of(&mut rendered, &Output::Depth).map(std::mem::take);
        if let Some(distances) = distances {
            if let Some(color) = image_of(&mut rendered, &Output::Color) {
                how.darken(color, &distances, &request.view);
            }
            if let Some(place) = image_of(&mut rendered, &Output::Depth) {
                *place = distances;
            }
        }
        rendered.images.truncate(request.outputs.len());
        self.gpu.stages.end("eye-dome lighting");
        Ok(rendered)
    }
}

fn image_of<'a>(rendered: &'a mut Rendered, wanted: &Output) -> Option<&'a mut Image> {
    let found = rendered.images.iter_mut().find(|(output, _)| output == wanted);
    found.map(|(_, image)| image)
}
