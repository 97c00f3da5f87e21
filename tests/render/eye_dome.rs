//! Eye-dome lighting: for every renderer what its colour and its distances make, frame by frame.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::{EyeDome, Image, PictureMean};
use surfelshop_render::{RenderRequest, Rendered};
use surfelshop_session::antialias::shift_px;
use surfelshop_session::options::{DeviceArguments, PluginFiles, SurfelChoice};
use surfelshop_session::session::RenderSession;
use surfelshop_tests::{clouds, stage};

const HOW: EyeDome = EyeDome { strength: 1.0, radius: 1.4 };

fn color(rendered: &Rendered) -> &Image {
    rendered.image(&Output::Color).unwrap()
}

/// Views of a ball, in both projections.
fn views() -> [View; 2] {
    let perspective = stage::view(DVec3::new(1.0, 2.0, 4.0), DVec3::ZERO, 64);
    let mut parallel = perspective;
    parallel.camera.projection = Projection::Orthographic { height: 2.6 };
    [perspective, View { near: 0.1, far: 20.0, ..parallel }]
}

fn request<'a>(
    cloud: &'a Cloud,
    clouds: &'a [surfelshop_api::CloudView<'a>],
    scene: &'a Scene,
    values: &'a Values,
    view: View,
) -> RenderRequest<'a> {
    RenderRequest {
        clouds,
        facts: cloud.facts(),
        scene,
        view,
        values,
        outputs: &[Output::Color],
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: Some(HOW),
    }
}

/// Invariant: eye-dome lighting darkens the colour of every renderer by the distances of the same frame, and changes
/// nothing where it is off
#[test]
fn every_renderer_is_darkened_by_its_own_distances() {
    let cloud = clouds::wavy_sphere(3000);
    let (scene, values) = (Scene::default(), Values::new());
    let plain = [cloud.view()];
    for surfels in [SurfelChoice::Cpu, SurfelChoice::Quads] {
        let device = DeviceArguments { surfels, ..DeviceArguments::default() };
        let mut session = RenderSession::open_with(&device, &PluginFiles::default(), None).unwrap();
        for (package, id) in [
            ("surfelshop_flat", "flat"),
            ("surfelshop_ewa_phong", "ewa-phong"),
            ("surfelshop_environment", "environment"),
        ] {
            let mut renderer = stage::built_renderer(&session.engine, package, id);
            for view in views() {
                let darkened = request(&cloud, &plain, &scene, &values, view);
                let off = RenderRequest { eye_dome: None, ..darkened };
                let both = [Output::Depth, Output::Color];
                let off = session.engine.render(&mut renderer, &off).unwrap();
                let asked = RenderRequest { outputs: &both, ..darkened };
                let on = session.engine.render(&mut renderer, &asked).unwrap();
                let alone = session.engine.render(&mut renderer, &darkened).unwrap();
                let names = |rendered: &Rendered| {
                    rendered.images.iter().map(|(output, _)| output.name()).collect::<Vec<_>>()
                };
                assert_eq!(
                    (names(&on), names(&alone)),
                    (vec!["depth".into(), "color".into()], vec!["color".into()])
                );
                assert!(color(&on) == color(&alone), "{id}: depths that nobody asked for");
                let mut expected = color(&off).clone();
                HOW.darken(&mut expected, on.image(&Output::Depth).unwrap(), &view);
                assert!(*color(&on) == expected, "{id}: not of its own distances");
                let n_darker = color(&on).data.iter().zip(&color(&off).data);
                assert!(n_darker.filter(|(on, off)| on < off).count() > 300, "{id}");
                let again = RenderRequest { eye_dome: None, ..darkened };
                let again = session.engine.render(&mut renderer, &again).unwrap();
                assert!(color(&again) == color(&off), "{id}: off is not off");
            }
        }
    }
}

#[test]
fn each_of_the_frames_of_a_mean_is_darkened_by_itself() {
    let cloud = clouds::wavy_sphere(3000);
    let (scene, values) = (Scene::default(), Values::new());
    let plain = [cloud.view()];
    let device = DeviceArguments { surfels: SurfelChoice::Cpu, ..DeviceArguments::default() };
    let mut session = RenderSession::open_with(&device, &PluginFiles::default(), None).unwrap();
    let mut renderer = stage::built_renderer(&session.engine, "surfelshop_ewa_phong", "ewa-phong");
    let darkened = request(&cloud, &plain, &scene, &values, views()[0]);
    let settled = session.settle_view_antialiased(&mut renderer, &darkened, 4).unwrap();
    let mut mean: Option<PictureMean> = None;
    for index in 0..4 {
        let frame = session.frame_view(&mut renderer, &darkened, shift_px(index, 4)).unwrap();
        match &mut mean {
            Some(mean) => mean.add(color(&frame.rendered)).unwrap(),
            none => *none = Some(PictureMean::of(color(&frame.rendered))),
        }
    }
    assert!(*color(&settled.rendered) == mean.unwrap().mean());
}
