//! Where a cloud lies, how large it is and in which order its points come makes no difference.

use glam::DVec3;
use std::slice;
use surfelshop_api::prelude::*;
use surfelshop_api::{Projection, Scene, View, static_plugin};
use surfelshop_cloud::{Cloud, WriteOptions};
use surfelshop_image::display_transform::{DisplayTransform, develop, to_8_bit};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::materials::Materials;
use surfelshop_tests::stage;
use surfelshop_tests::twin::Twin;

const UNITS: [(&str, &str); 2] =
    [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")];

/// The pictures by all renderers as 8-bit levels.
fn pictures(cloud: &Cloud, view: View) -> Vec<Vec<u8>> {
    let mut engine = stage::engine();
    UNITS
        .iter()
        .map(|(library, unit)| {
            let mut renderer = stage::built_renderer(&engine, library, unit);
            let (scene, outputs) = (Scene::default(), [Output::Color]);
            let frame =
                stage::render(&mut engine, &mut renderer, cloud, &scene, view, &outputs).unwrap();
            let color = frame.image(&Output::Color).unwrap();
            assert!(color.data.iter().all(|v| v.is_finite()));
            to_8_bit(&develop(color, &DisplayTransform::default()))
        })
        .collect()
}

/// A scene drawn by all renderers.
struct Drawn {
    cloud: Cloud,
    view: View,
    pictures: Vec<Vec<u8>>,
}

impl Drawn {
    fn new(cloud: Cloud, view: View) -> Self {
        let pictures = pictures(&cloud, view);
        Self { cloud, view, pictures }
    }
}

/// No value differs by more than one level, unless rounding decides on the pixel in both scenes:
/// computed in f64, the edge of a splat passes within a hundredth of a pixel of its centre, or two
/// depths agree to a hundredth of a radius. Coordinates that are moved or scaled are rounded anew,
/// and vertices are snapped to 1/256 pixel, so such pixels cannot be told from either scene; there
/// are fewer than one in a thousand.
#[track_caller]
fn alike(a: &Drawn, b: &Drawn, what: &str) {
    let scene = Scene::default();
    let twins = [a, b].map(|drawn| Twin::new(slice::from_ref(&drawn.cloud), &scene, &drawn.view));
    for (i, (_, unit)) in UNITS.iter().enumerate() {
        let (of_a, of_b) = (&a.pictures[i], &b.pictures[i]);
        assert!(of_a.iter().any(|v| *v > 0), "{what}, {unit}: the picture is empty");
        let mut differ = 0;
        for (at, (a, b)) in of_a.chunks(4).zip(of_b.chunks(4)).enumerate() {
            let levels = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
            if levels <= 1 {
                continue;
            }
            differ += 1;
            let (x, y) = (at as u32 % SIZE, at as u32 / SIZE);
            for twin in &twins {
                let pixel = twin.pixel(x, y);
                let sure = if *unit == "flat" { pixel.nearest_sure } else { pixel.sure };
                assert!(!sure, "{what}, {unit}: {levels} levels at {x} {y}: {pixel:?}");
            }
        }
        println!("{what}, {unit}: {differ} pixels of {} on an edge differ", of_a.len() / 4);
        assert!(differ * 4_000 <= of_a.len(), "{what}, {unit}: {differ} pixels");
    }
}

/// Side of the pictures, pixels.
const SIZE: u32 = 128;

fn view() -> View {
    stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, SIZE)
}

fn scaled_view(factor: f64) -> View {
    let mut view = view();
    view.camera.eye *= factor;
    view.near *= factor;
    view.far *= factor;
    view
}

fn scaled(surfels: &Surfels, factor: f32) -> Cloud {
    let mut surfels = surfels.clone();
    surfels.positions.iter_mut().for_each(|p| *p *= factor);
    surfels.radii.iter_mut().for_each(|r| *r *= factor);
    surfels.cloud()
}

/// Invariant: place and size of a cloud do not show, but for single pixels on discs' edges
#[test]
fn clouds_far_from_the_origin_look_as_at_the_origin() {
    stage::each_way(|| {
        // A ball of two centimetres whose surfels are a millimetre apart; f32 resolves half a metre
        // where it is moved to.
        let factor = 0.02;
        let mut surfels = clouds::sphere(5_000, factor);
        let view = scaled_view(f64::from(factor));
        let here = Drawn::new(surfels.cloud(), view);
        let far = DVec3::new(5e6, -4e6, 3e6);
        surfels.origin = far;
        let mut moved = view;
        moved.camera.eye += far;
        moved.camera.target += far;
        alike(&here, &Drawn::new(surfels.cloud(), moved), "moved");
        // The same through a file, which holds the sum of origin and offset.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("far.ply");
        surfelshop_cloud::write(&path, &surfels.cloud(), &WriteOptions::default()).unwrap();
        let read = surfelshop_cloud::read(&path, &Default::default()).unwrap().cloud;
        alike(&here, &Drawn::new(read, moved), "read");
    });
}

#[test]
fn clouds_of_any_size_look_alike() {
    stage::each_way(|| {
        let surfels = clouds::sphere(5_000, 1.0);
        let normal = Drawn::new(surfels.cloud(), view());
        for factor in [1e-6, 1e6, 1e-20, 1e20, 1e-30, 1e30] {
            let other = Drawn::new(scaled(&surfels, factor), scaled_view(f64::from(factor)));
            alike(&normal, &other, &format!("{factor:e}"));
        }
    });
}

#[test]
fn clouds_of_any_size_look_alike_in_parallel_projection() {
    stage::each_way(|| {
        let surfels = clouds::sphere(5_000, 1.0);
        let at = |factor: f64| {
            let mut view = scaled_view(factor);
            view.camera.projection = Projection::Orthographic { height: 2.5 * factor };
            view.far = 10.0 * factor;
            Drawn::new(scaled(&surfels, factor as f32), view)
        };
        let normal = at(1.0);
        for factor in [1e-6, 1e6, 1e-30, 1e30] {
            alike(&normal, &at(factor), &format!("{factor:e}"));
        }
    });
}

#[test]
fn depth_is_in_scene_units_at_any_size() {
    stage::each_way(|| {
        let surfels = clouds::sphere(5_000, 1.0);
        for factor in [1.0, 1e-6, 1e20] {
            let mut engine = stage::engine();
            let mut renderer = stage::built_renderer(&engine, UNITS[1].0, UNITS[1].1);
            let cloud = scaled(&surfels, factor);
            let view = scaled_view(f64::from(factor));
            let outputs = [Output::Depth];
            let scene = Scene::default();
            let frame =
                stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
            let found = frame.image(&Output::Depth).unwrap().pixel(64, 64)[0];
            // The eye is sqrt(10.25) from the centre; the discs lie within 0.3 % of the sphere.
            let expected = (10.25f32.sqrt() - 1.0) * factor;
            assert!((found / expected - 1.0).abs() < 3e-3, "{found:e} for {expected:e}");
        }
    });
}

#[test]
fn far_surfaces_are_told_apart_with_a_near_plane_close_by() {
    stage::each_way(|| {
        // Two discs a hundredth apart at distance 1000, near plane at 0.01: reversed depth in floats
        // resolves 9e-5 there.
        let mut surfels = Surfels::default();
        surfels.push(glam::Vec3::new(0.0, 0.0, -1000.0), glam::Vec3::Z, 300.0);
        surfels.push(glam::Vec3::new(0.0, 0.0, -1000.01), glam::Vec3::Z, 300.0);
        surfels.colors = vec![[255, 0, 0], [0, 0, 255]];
        let mut view = stage::view(DVec3::ZERO, DVec3::NEG_Z, 64);
        view.near = 0.01;
        for order in [[0, 1], [1, 0]] {
            let mut ordered = surfels.clone();
            ordered.positions = order.map(|i| surfels.positions[i]).to_vec();
            ordered.colors = order.map(|i| surfels.colors[i]).to_vec();
            let flat = &pictures(&ordered.cloud(), view)[0];
            let center = 4 * (32 * 64 + 32);
            assert!(flat[center] > 100 && flat[center + 2] < 10, "the nearer disc is red");
        }
    });
}

/// A permutation that leaves nothing where it was.
fn shuffled(surfels: &Surfels) -> Surfels {
    let n = surfels.positions.len();
    // 7919 is prime and does not divide n, so multiples of it visit every index once.
    assert_ne!(n % 7919, 0);
    let order: Vec<usize> = (0..n).map(|i| (i * 7919 + 13) % n).collect();
    let mut out = surfels.clone();
    for (to, &from) in order.iter().enumerate() {
        out.positions[to] = surfels.positions[from];
        out.normals[to] = surfels.normals[from];
        out.radii[to] = surfels.radii[from];
        out.colors[to] = surfels.colors[from];
        out.ao[to] = surfels.ao[from];
        out.materials[to] = surfels.materials[from];
    }
    out
}

static_plugin! { id: "org.surfelshop.test.scale", renderers: [Materials] }

/// The bits of everything there is to see of a cloud, by renderer and output.
fn outputs(cloud: &Cloud) -> Vec<(String, Vec<u32>)> {
    let mut engine = stage::engine();
    let all = [Output::Color, Output::Depth, Output::Normal, Output::Albedo, Output::Ao];
    let mut seen = Vec::new();
    let built = UNITS.map(|(library, unit)| (stage::built_renderer(&engine, library, unit), unit));
    let materials = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    for (mut renderer, unit) in built.into_iter().chain([(materials, "materials")]) {
        let scene = Scene::default();
        let frame = stage::render(&mut engine, &mut renderer, cloud, &scene, view(), &all).unwrap();
        for (output, image) in &frame.images {
            let bits = image.data.iter().map(|value| value.to_bits()).collect();
            seen.push((format!("{unit}, {}", output.name()), bits));
        }
    }
    seen
}

/// Invariant: the order of a cloud's points shows in no output
#[test]
fn the_order_of_points_does_not_show() {
    stage::each_way(|| {
        let mut sphere = clouds::sphere(5_000, 1.0);
        // Discs of different colours in one plane, and several at one place: depths tie everywhere.
        let mut plane = clouds::plane(60, 1.0);
        plane.colors =
            (0..3_600u32).map(|i| [(i * 37 % 256) as u8, (i * 91 % 256) as u8, 200]).collect();
        for i in 0..300 {
            let at = plane.positions[i];
            plane.push(at, glam::Vec3::Y, 0.05);
            plane.colors.push([(i % 256) as u8, 255, 0]);
        }
        // Discs at one place that differ in accessibility alone, and in their material alone.
        let mut twins = clouds::plane(30, 1.0);
        for _ in 0..2 {
            let again = twins.clone();
            twins.positions.extend(again.positions);
            twins.normals.extend(again.normals);
            twins.radii.extend(again.radii);
        }
        twins.colors = vec![[90, 120, 150]; 3_600];
        twins.ao = (0..3_600).map(|i| [0.125, 0.5, 0.625, 0.875][i / 900]).collect();
        let mut materials = twins.clone();
        materials.ao = vec![0.5; 3_600];
        materials.materials = (0..3_600).map(|i| 7 - 2 * (i / 900)).collect();
        for surfels in [&mut sphere, &mut plane, &mut twins] {
            let n = surfels.positions.len();
            surfels.materials = (0..n as u32).map(|i| i % 5).collect();
        }
        for surfels in [&mut sphere, &mut plane] {
            let n = surfels.positions.len();
            surfels.ao = (0..n).map(|i| (i % 7) as f32 / 8.0).collect();
        }
        for (surfels, what) in
            [(sphere, "sphere"), (plane, "plane"), (twins, "twins"), (materials, "materials")]
        {
            let ordered = outputs(&surfels.cloud());
            let other = outputs(&shuffled(&surfels).cloud());
            for ((name, a), (_, b)) in ordered.iter().zip(&other) {
                let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
                assert_eq!(differ, 0, "{what}, {name}: of {} values", a.len());
                assert!(
                    a.iter().any(|bits| f32::from_bits(*bits) > 0.0),
                    "{what}, {name} is empty"
                );
            }
        }
    });
}
