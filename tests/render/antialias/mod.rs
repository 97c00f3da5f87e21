//! Antialiased pictures: frames that are seen at other places of each pixel, and their mean.

mod coverage;
mod places;
mod renderers;

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{EnvironmentView, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{RenderRequest, RendererView};
use surfelshop_session::options::{DeviceArguments, PluginFiles, SurfelChoice};
use surfelshop_session::session::RenderSession;
use surfelshop_tests::stage;

/// A session that draws surfels in this way.
fn session(surfels: SurfelChoice) -> RenderSession {
    let device = DeviceArguments { surfels, ..DeviceArguments::default() };
    RenderSession::open_with(&device, &PluginFiles::default(), None).unwrap()
}

/// A scene whose surfels are as large as they are.
fn sharp() -> Scene {
    let mut scene = Scene::default();
    scene.surface.low_pass = 0.0;
    scene
}

/// A parallel view from the front, so many scene units high.
fn parallel(height: f64, size: u32) -> View {
    let mut view = stage::view(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, size);
    view.camera.projection = Projection::Orthographic { height };
    View { near: 0.1, far: 20.0, ..view }
}

/// What is drawn, and by what.
struct Subject {
    renderer: RendererView,
    cloud: Cloud,
    scene: Scene,
    values: Values,
}

impl Subject {
    /// Does something with the request for outputs of a view.
    fn request<T>(
        &mut self,
        view: View,
        environment: Option<EnvironmentView<'_>>,
        outputs: &[Output],
        work: impl FnOnce(&mut RendererView, &RenderRequest<'_>) -> T,
    ) -> T {
        let clouds = [self.cloud.view()];
        let request = RenderRequest {
            clouds: &clouds,
            facts: self.cloud.facts(),
            scene: &self.scene,
            view,
            values: &self.values,
            outputs,
            frame_index: 0,
            environment,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        work(&mut self.renderer, &request)
    }
}

fn flat(session: &RenderSession, cloud: Cloud) -> Subject {
    let renderer = stage::built_renderer(&session.engine, "surfelshop_flat", "flat");
    Subject { renderer, cloud, scene: sharp(), values: Values::new() }
}
