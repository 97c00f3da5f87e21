//! Surfels alone: a view's surface buffer without a renderer that looks through it, to be timed.

use crate::engine::prepared_view::{DrawnAs, PreparedView};
use crate::engine::{Engine, RenderRequest};
use crate::graph::{PassReport, Recorder, RenderError, checked};
use crate::surfels::{DrawnCloud, SurfaceParts};
use glam::Vec2;
use surfelshop_api::graph::SurfaceMode;

impl Engine {
    /// Makes the blended surface buffer of a view, as a frame does first, waits until it is there
    /// and reads nothing back. Outputs, values and environment of the request have no part in it.
    /// Where the surface is kept from an earlier frame its passes are reported as reused.
    ///
    /// # Errors
    /// Where a cloud cannot be drawn, or the device fails.
    pub fn draw_surfels(
        &mut self,
        request: &RenderRequest<'_>,
    ) -> Result<Vec<PassReport>, RenderError> {
        let passes = self.attempt_surfels(request);
        passes.map_err(|error| self.cause(error))
    }

    fn attempt_surfels(
        &mut self,
        request: &RenderRequest<'_>,
    ) -> Result<Vec<PassReport>, RenderError> {
        self.check_size(request.view.size_px)?;
        let on_host = self.surfels.on_host(&self.gpu);
        let mut scene = request.scene.clone();
        let merged = request.detail_px > 0.0 || on_host;
        let request = &request.drawn(merged, &mut scene);
        let computes = self.surfels.computes(&self.gpu, request.view.size_px);
        let clouds = self.drawn_clouds(request, None, on_host, &[])?;
        let device = self.gpu.device.clone();
        let made = checked(&device, || self.make_surface(request, &clouds, computes));
        let made = made.map_err(RenderError::Device).and_then(|made| made);
        if made.is_err() {
            self.surfaces.forget();
        }
        made
    }

    fn make_surface(
        &mut self,
        request: &RenderRequest<'_>,
        clouds: &[DrawnCloud<'_>],
        computes: bool,
    ) -> Result<Vec<PassReport>, RenderError> {
        let mut parts = SurfaceParts::default();
        parts.add(SurfaceMode::Blended);
        let drawn_as = DrawnAs { computes, tints_backs: false, bounds_round: true };
        let prepared = PreparedView::new(&self.gpu, request, clouds, drawn_as, Vec2::ZERO)?;
        let input = prepared.input(request, clouds);
        let mut recorder = Recorder::new(&self.gpu);
        self.surfaces
            .ensure(parts, &input, &mut recorder, &mut self.pipelines)
            .map_err(RenderError::Host)?;
        let passes = recorder.submit().map_err(RenderError::Device)?;
        // A device that is lost while it is waited for is found lost by `checked`.
        drop(self.gpu.device.poll(wgpu::PollType::wait_indefinitely()));
        Ok(passes)
    }
}
