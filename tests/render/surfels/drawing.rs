//! What is drawn is what rays meet.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::{Projection, Scene, SurfaceSettings, View, columns};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_tests::cast::{Agreement, cast};
use surfelshop_tests::{clouds, stage};

/// Vertices are snapped to 1/256 pixel, so pixels whose centre lies that close to a disc's edge
/// may fall either way; on these clouds they are fewer than one in a thousand.
const COVERAGE: f64 = 0.999;
/// Depth is interpolated in f32 over quads whose corners are snapped to 1/256 pixel; a steep disc
/// turns the snapping into depth. Measured below 1e-4 of the distance on all but few pixels.
const DEPTH_FRACTION: f64 = 1e-3;

fn check(cloud: &Cloud, view: View, what: &str) {
    let reference = cast(cloud, &view);
    // Rays meet discs as they are; the low-pass would widen them by a pixel.
    let mut scene = Scene::default();
    scene.surface.low_pass = 0.0;
    stage::each_way(|| {
        let mut engine = stage::engine();
        for (library, unit) in [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")]
        {
            let mut renderer = stage::built_renderer(&engine, library, unit);
            let outputs = [Output::Color, Output::Depth];
            let frame =
                stage::render(&mut engine, &mut renderer, cloud, &scene, view, &outputs).unwrap();
            let depth = frame.image(&Output::Depth).unwrap();
            let color = frame.image(&Output::Color).unwrap();
            assert!(color.data.iter().all(|v| v.is_finite()), "{what}, {unit}: not finite");
            for (c, d) in color.data.chunks_exact(4).zip(&depth.data) {
                assert_eq!(c[3] > 0.0, *d > 0.0, "{what}, {unit}: coverage of color and depth");
            }
            let agreement = Agreement::new(depth.data.iter().copied(), &reference, DEPTH_FRACTION);
            assert!(agreement.coverage() >= COVERAGE, "{what}, {unit}: {agreement:?}");
            assert!(agreement.both > 100, "{what}, {unit}: the view shows nothing");
            let wrong = agreement.depth_differs as f64 / agreement.both as f64;
            assert!(wrong <= 1.0 - COVERAGE, "{what}, {unit}: {agreement:?}");
        }
    });
}

#[test]
fn sphere_from_outside_covers_what_rays_meet() {
    let cloud = clouds::sphere(20_000, 1.0).cloud();
    check(&cloud, stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 256), "sphere");
}

#[test]
fn grazing_view_of_a_plane_covers_what_rays_meet() {
    let cloud = clouds::plane(100, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.05, 2.0), DVec3::ZERO, 256);
    check(&cloud, view, "grazing plane");
}

#[test]
fn camera_inside_a_sphere_covers_what_rays_meet() {
    let cloud = clouds::sphere(20_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 256);
    check(&cloud, view, "inside");
}

#[test]
fn camera_among_the_surfels_covers_what_rays_meet() {
    // The eye is nearer to some discs than their radius; they are clipped by the near plane.
    let cloud = clouds::sphere(2_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 0.999), DVec3::new(1.0, 0.2, 0.9), 256);
    check(&cloud, view, "among");
}

#[test]
fn parallel_projection_covers_what_rays_meet() {
    let cloud = clouds::sphere(20_000, 1.0).cloud();
    let mut view = stage::view(DVec3::new(1.0, 1.0, 3.0), DVec3::ZERO, 256);
    view.camera.projection = Projection::Orthographic { height: 2.5 };
    view.far = 10.0;
    check(&cloud, view, "orthographic");
}

/// Invariant: what is drawn is what rays meet, but for the filter in screen space
#[test]
fn the_sample_covers_what_rays_meet() {
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");
    let loaded = surfelshop_cloud::read(sample, &Default::default()).unwrap();
    for (what, view) in stage::hard_views(&loaded.cloud, 512) {
        check(&loaded.cloud, view, what);
    }
}

#[test]
fn equal_colours_blend_to_that_colour() {
    stage::each_way(|| {
        // Catches every mistake in weights and their division.
        let mut surfels = clouds::sphere(5_000, 1.0);
        surfels.colors.fill([186, 99, 30]);
        surfels.ao = vec![0.25; surfels.positions.len()];
        let cloud = surfels.cloud();
        let mut engine = stage::engine();
        let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 128);
        let outputs = [Output::Albedo, Output::Ao, Output::Normal];
        let frame =
            stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
                .unwrap();
        let expected = [186u8, 99, 30].map(|v| srgb_to_linear(f32::from(v) / 255.0));
        let mut covered = 0;
        for pixel in frame.image(&Output::Albedo).unwrap().data.chunks_exact(4) {
            if pixel[3] == 0.0 {
                continue;
            }
            covered += 1;
            for (value, expected) in pixel.iter().zip(expected) {
                // The surface holds colours in half precision.
                assert!((value - expected).abs() <= expected * 1e-3, "{pixel:?}");
            }
        }
        assert!(covered > 1_000);
        for pixel in frame.image(&Output::Ao).unwrap().data.chunks_exact(4) {
            // 16 bits.
            assert!(pixel[3] == 0.0 || (pixel[0] - 0.25).abs() < 2e-5, "{pixel:?}");
        }
        for pixel in frame.image(&Output::Normal).unwrap().data.chunks_exact(4) {
            let n = Vec3::from_slice(pixel);
            assert!(pixel[3] == 0.0 || (n.length() - 1.0).abs() < 1e-5, "{pixel:?}");
        }
    });
}

#[test]
fn colours_of_every_type_become_the_same_albedo() {
    stage::each_way(|| {
        // 16 x 16 discs that do not touch, one for each code; red, green and blue differ.
        let n = 16;
        let mut surfels = clouds::plane(n, 1.0);
        surfels.radii.fill(0.05);
        let codes: Vec<u8> = (0..=255u8).flat_map(|i| [i, 255 - i, i.wrapping_mul(77)]).collect();
        let linear: Vec<f32> =
            codes.iter().map(|code| srgb_to_linear(f32::from(*code) / 255.0)).collect();
        let wide: Vec<u16> = codes.iter().map(|code| u16::from(*code) * 257).collect();
        let opaque: Vec<u8> = codes.chunks(3).flat_map(|c| [c[0], c[1], c[2], 9]).collect();
        let mut view = stage::view(DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, 256);
        view.camera.up = DVec3::NEG_Z;
        view.camera.projection = Projection::Orthographic { height: 2.0 };
        view.far = 10.0;
        let plain = surfels.cloud();
        let mut engine = stage::engine();
        for (library, unit) in [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")]
        {
            let mut renderer = stage::built_renderer(&engine, library, unit);
            for (ty, components, values) in [
                ("u8", 3, Buffer::U8(codes.clone())),
                ("u8", 4, Buffer::U8(opaque.clone())),
                ("u16", 3, Buffer::U16(wide.clone())),
                ("f32", 3, Buffer::F32(linear.clone())),
            ] {
                let column = Column::new(columns::COLOR, components, values);
                let what = format!("{unit}, {components} x {ty}");
                let cloud = plain.with_columns(vec![column]).unwrap();
                let (scene, outputs) = (Scene::default(), [Output::Albedo]);
                let frame =
                    stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs)
                        .unwrap();
                let albedo = frame.image(&Output::Albedo).unwrap();
                for (i, expected) in linear.chunks(3).enumerate() {
                    let found = albedo.pixel((i % n * 16 + 8) as u32, (i / n * 16 + 8) as u32);
                    for (found, expected) in found.iter().zip(expected) {
                        // Half precision once on the way to the device and once in the surface.
                        let error = (found - expected).abs();
                        assert!(
                            error <= expected * 1e-3,
                            "{what}, code {i}: {found} for {expected}"
                        );
                    }
                }
            }
        }
    });
}

#[test]
fn blended_normals_of_a_sphere_are_its_own() {
    stage::each_way(|| {
        let cloud = clouds::sphere(20_000, 1.0).cloud();
        let mut engine = stage::engine();
        let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 256);
        let outputs = [Output::Normal, Output::Depth];
        let frame =
            stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
                .unwrap();
        let surface = SurfaceSettings { two_sided: false, ..SurfaceSettings::default() };
        let scene = Scene { surface, ..Scene::default() };
        let fronts =
            stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
        let world_from_view = view.camera.view_from_world().transpose();
        let normals = frame.image(&Output::Normal).unwrap();
        let depths = frame.image(&Output::Depth).unwrap();
        let is_front = fronts.image(&Output::Depth).unwrap();
        let mut n_past_rim = 0;
        for y in 0..256 {
            for x in 0..256 {
                let depth = f64::from(depths.pixel(x, y)[0]);
                if depth == 0.0 {
                    continue;
                }
                // What sticks out past the rim has the normal of the rim, which is farther in.
                if is_front.pixel(x, y)[0] == 0.0 {
                    n_past_rim += 1;
                    continue;
                }
                let (_, ray) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let point = view.camera.eye + world_from_view * (ray * (depth / -ray.z));
                let truth = point.normalize_or_zero().as_vec3();
                let found = Vec3::from_slice(normals.pixel(x, y));
                // A mean of normals within a radius of 1.5 spacings, 0.038 rad; where the surface is
                // seen at a slant the depth tolerance of one radius lets in as much again.
                let bound = if truth.z > 0.7 { 0.038 } else { 0.076 };
                let angle = found.cross(truth).length();
                assert!(angle < bound, "at {x} {y}: {found} for {truth}");
            }
        }
        // Of an outline of some 500 pixels.
        assert!(n_past_rim < 250, "{n_past_rim}");
    });
}
