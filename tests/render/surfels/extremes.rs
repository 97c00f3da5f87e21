//! Extreme cases of drawing and lighting, each against an oracle.
//!
//! What else could break is tested where it lives: reading and repairing in `host/cloud`,
//! neighbourhoods in `host/sdk/geometry`, sizes and places in `scale.rs`, thin and sub-pixel splats in
//! `ewa.rs`, near planes in `drawing.rs`, empty and equal clouds in `degenerate.rs`.

use glam::{DVec3, Vec3};
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values, srgb_to_linear};
use surfelshop_render::{Backend, EngineOptions, GpuOptions, RenderRequest};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::{stage, twin};

#[test]
fn thousands_of_surfels_at_one_place_keep_their_colour() {
    stage::each_way(|| {
        // Half-precision sums would stall at 2,048, 32-bit fixed point overflow at 4,096.
        let mut surfels = Surfels::default();
        for _ in 0..20_000 {
            surfels.push(Vec3::ZERO, Vec3::Z, 0.5);
            surfels.colors.push([240, 120, 30]);
        }
        let expected = [240u8, 120, 30].map(|v| srgb_to_linear(f32::from(v) / 255.0));
        let cloud = surfels.cloud();
        for backend in [Backend::Primary, Backend::Gl] {
            let gpu = GpuOptions { backend: Some(backend), ..GpuOptions::default() };
            let mut engine = stage::engine_with(&gpu, &EngineOptions::default());
            let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
            let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
            let (scene, outputs) = (Scene::default(), [Output::Albedo]);
            let frame =
                stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
            let found = frame.image(&Output::Albedo).unwrap().pixel(16, 16);
            for (found, expected) in found.iter().zip(expected) {
                // Half precision twice, and f32 sums of 20,000 terms: n 2^-24.
                assert!(
                    (found / expected - 1.0).abs() < 3e-3,
                    "{backend:?}: {found} for {expected}"
                );
            }
        }
    });
}

#[test]
fn the_sharpest_highlight_is_smooth_and_right() {
    stage::each_way(|| {
        // The lobe of exponent 1024 is two degrees wide; half precision would give it five steps.
        let cloud = clouds::sphere(20_000, 1.0).cloud();
        let scene = Scene::default();
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 48);
        let mut values = Values::new();
        for (id, value) in
            [("shininess", 1024.0), ("specular", 1.0), ("diffuse", 0.0), ("ambient", 0.0)]
        {
            values.insert(id.to_owned(), Value::Float(value));
        }
        let mut engine = stage::engine();
        let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let outputs = [Output::Color, Output::Normal];
        let request = RenderRequest {
            clouds: &[cloud.view()],
            facts: cloud.facts(),
            scene: &scene,
            view,
            values: &values,
            outputs: &outputs,
            frame_index: 0,
            environment: None,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        let frame = engine.render(&mut renderer, &request).unwrap();
        let color = frame.image(&Output::Color).unwrap();
        let normals = frame.image(&Output::Normal).unwrap();
        let phong = twin::Phong { diffuse: 0.0, specular: 1.0, shininess: 1024.0, ambient: 0.0 };
        let mut brightest = 0.0f32;
        for y in 0..48 {
            for x in 0..48 {
                let found = color.pixel(x, y);
                assert!(found.iter().all(|v| v.is_finite()));
                if found[3] == 0.0 {
                    continue;
                }
                brightest = brightest.max(found[0]);
                // The same normal in f64: only the lighting is compared.
                let normal = Vec3::from_slice(normals.pixel(x, y)).as_dvec3().normalize_or_zero();
                let pixel = twin::Pixel { depth: 1.0, normal, ..twin::Pixel::default() };
                let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let expected = twin::shade(&pixel, &scene, &view, center, &phong).x;
                // Slope of cos^1024 is at most 20 per radian; the angle is good to 1e-6 rad in f32.
                let difference = (f64::from(found[0]) - expected).abs();
                assert!(difference < 2e-4, "at {x} {y}: {} for {expected}", found[0]);
            }
        }
        assert!(brightest > 0.2, "the highlight is in view: {brightest}");
    });
}
