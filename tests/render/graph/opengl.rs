//! Without Vulkan: OpenGL draws the same picture, adding up in fixed point.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::{Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::display_transform::{DisplayTransform, develop, to_8_bit};
use surfelshop_render::{Backend, Engine, EngineOptions, GpuOptions};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::stage;

fn engine(backend: Backend) -> Engine {
    let gpu = GpuOptions { backend: Some(backend), ..GpuOptions::default() };
    stage::engine_with(&gpu, &EngineOptions::default())
}

fn levels(engine: &mut Engine, unit: (&str, &str), cloud: &Cloud, view: View) -> Vec<u8> {
    let mut renderer = stage::built_renderer(engine, unit.0, unit.1);
    let outputs = [Output::Color];
    let frame = stage::render(engine, &mut renderer, cloud, &Scene::default(), view, &outputs);
    let frame = frame.unwrap();
    to_8_bit(&develop(frame.image(&Output::Color).unwrap(), &DisplayTransform::default()))
}

fn compare(view: View) {
    compare_cloud(&clouds::sphere(5_000, 1.0).cloud(), view);
}

fn compare_cloud(cloud: &Cloud, view: View) {
    let (mut vulkan, mut opengl) = (engine(Backend::Primary), engine(Backend::Gl));
    assert!(!opengl.gpu().blends_f32, "this test is about the fixed-point path");
    for unit in [
        ("surfelshop_flat", "flat"),
        ("surfelshop_ewa_phong", "ewa-phong"),
        ("surfelshop_phong_splatting", "phong-splatting"),
        ("surfelshop_global_illumination", "global-illumination"),
    ] {
        let a = levels(&mut vulkan, unit, cloud, view);
        let b = levels(&mut opengl, unit, cloud, view);
        assert!(a.iter().any(|v| *v > 0));
        let differ = a
            .chunks(4)
            .zip(b.chunks(4))
            .filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 2));
        // Pixels on the edge of a disc may fall to another surfel.
        let covered = a.chunks(4).filter(|pixel| pixel[3] > 0).count();
        let differ = differ.count();
        assert!(differ * 100 <= covered, "{}: {differ} of {covered} pixels differ", unit.1);
    }
}

/// Invariant: OpenGL draws what Vulkan draws
#[test]
fn opengl_draws_what_vulkan_draws() {
    compare(stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 128));
}

/// Normals that vary over splats, and lines that cut them.
#[test]
fn opengl_draws_splats_as_vulkan_draws_them() {
    let splats = clouds::sphere(300, 1.0).elliptical(0.6).varying();
    compare_cloud(&splats.cloud(), stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 128));
}

#[test]
fn opengl_draws_what_vulkan_draws_in_parallel_projection() {
    let mut view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 128);
    view.camera.projection = Projection::Orthographic { height: 2.5 };
    // Parallel depth is spread evenly up to `far`, so the range decides its resolution.
    view.far = 10.0;
    compare(view);
}

#[test]
fn opengl_draws_what_vulkan_draws_from_inside() {
    compare(stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 128));
}

#[test]
fn opengl_draws_what_vulkan_draws_of_thin_and_near_discs() {
    // Triple products of rays and discs lose most where a disc is long in depth and thin.
    let grazing = stage::view(DVec3::new(0.0, 0.05, 1.6), DVec3::ZERO, 128);
    compare_cloud(&clouds::plane(24, 1.0).cloud(), grazing);
    compare_cloud(&clouds::sphere(2_000, 1.0).elliptical(0.1).cloud(), grazing);
    let mut disc = Surfels::default();
    disc.push(Vec3::NEG_Z, Vec3::Y, 0.85);
    for height in [0.001, 0.01, 0.03, 0.1] {
        let eye = DVec3::Y * height;
        compare_cloud(&disc.cloud(), stage::view(eye, eye + DVec3::new(0.03, 0.02, -1.0), 128));
    }
}

#[test]
fn opengl_weighs_small_surfels_as_vulkan_does() {
    // Over blue discs of several pixels lie red ones of a fifth of a pixel: by area they count for
    // a twentieth.
    let mut surfels = clouds::plane(40, 1.0);
    surfels.colors = vec![[0, 0, 255]; surfels.positions.len()];
    for i in 0..surfels.positions.len() {
        let at = surfels.positions[i];
        surfels.push(at, Vec3::Y, 0.004);
        surfels.colors.push([255, 0, 0]);
    }
    let (cloud, view) = (surfels.cloud(), stage::view(DVec3::new(0.0, 3.0, 0.1), DVec3::ZERO, 128));
    // `flat` would show which of two discs at one depth is taken.
    let phong = ("surfelshop_ewa_phong", "ewa-phong");
    let a = levels(&mut engine(Backend::Primary), phong, &cloud, view);
    let b = levels(&mut engine(Backend::Gl), phong, &cloud, view);
    let inner = |levels: &[u8]| levels[4 * (64 * 128 + 64)..4 * (64 * 128 + 65)].to_vec();
    assert!(inner(&a)[2] > 3 * inner(&a)[0] && inner(&a)[0] > 5, "{:?}", inner(&a));
    let differ = a.iter().zip(&b).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differ * 100 <= a.len(), "{differ} of {} values differ", a.len());
}

#[test]
fn opengl_draws_pictures_whose_sums_do_not_fit_one_binding() {
    // 32 bytes a pixel: these are 160 MB, above WebGPU's binding of 128 MiB.
    let mut view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 128);
    view.size_px = [2_500, 2_000];
    let mut opengl = engine(Backend::Gl);
    let cloud = clouds::sphere(5_000, 1.0).cloud();
    let picture = levels(&mut opengl, ("surfelshop_ewa_phong", "ewa-phong"), &cloud, view);
    // The sphere's rows below the first band are there as well.
    let row = |y: usize| &picture[4 * 2_500 * y..4 * 2_500 * (y + 1)];
    for y in [400, 1_000, 1_600] {
        assert!(row(y).chunks(4).any(|pixel| pixel[3] > 0), "row {y} is empty");
    }
}
