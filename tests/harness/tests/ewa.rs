//! The screen-space filter: equal to its twin in f64, without holes, within a pixel of the discs,
//! and worth having.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "the tables are what the tests measure")]

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::{Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_engine::Image;
use surfelshop_tests::cast::cast;
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::{stage, twin};

fn render(cloud: &Cloud, scene: &Scene, view: View, unit: (&str, &str), output: Output) -> Image {
    let mut engine = stage::engine();
    let mut renderer = stage::built_renderer(&engine, unit.0, unit.1);
    let outputs = [output.clone()];
    let frame = stage::render(&mut engine, &mut renderer, cloud, scene, view, &outputs).unwrap();
    frame.image(&output).unwrap().clone()
}

const PHONG: (&str, &str) = ("surfelshop_ewa_phong", "ewa-phong");
const FLAT: (&str, &str) = ("surfelshop_flat", "flat");

/// Pixels whose decision (inside or outside a disc, in front of or behind the depth limit) hangs
/// on less than this fraction of a radius are left out: vertices are snapped to 1/256 pixel and
/// the discs here are a few pixels wide.
const MARGIN: f64 = 0.01;
/// Radiance may differ by this: albedo passes through half precision (5e-4 of its value), normals
/// through 2 x 16 bits (6e-5 rad, times a highlight's slope of up to 5 for exponent 64), and the
/// rest is f32 rounding, unless the rasteriser snaps vertices (1/256 pixel), which moves weights
/// by up to 8 r dr = 0.2 % of a splat ten pixels wide.
const RADIANCE: f64 = 2e-3;

fn equals_twin(cloud: &Cloud, scene: &Scene, view: View) {
    let color = render(cloud, scene, view, PHONG, Output::Color);
    let truth = twin::surface(cloud, scene, &view);
    let phong = twin::Phong { diffuse: 1.0, specular: 0.25, shininess: 64.0, ambient: 0.08 };
    let (mut compared, mut left_out, mut worst) = (0, 0, 0.0f64);
    for (i, pixel) in truth.iter().enumerate() {
        if pixel.margin < MARGIN {
            left_out += 1;
            continue;
        }
        let (x, y) = (i as u32 % view.size_px[0], i as u32 / view.size_px[0]);
        let found = color.pixel(x, y);
        assert_eq!(
            found[3] > 0.0,
            pixel.depth > 0.0,
            "coverage at {x} {y}, margin {}",
            pixel.margin
        );
        if pixel.depth > 0.0 {
            let position = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let expected = twin::shade(pixel, scene, &view, position, &phong);
            let difference = (Vec3::from_slice(found).as_dvec3() - expected).abs().max_element();
            worst = worst.max(difference);
            compared += 1;
        }
    }
    println!("{compared} pixels compared, {left_out} left out, largest difference {worst:.5}");
    assert!(compared > 200, "the view shows too little: {compared}");
    assert!(left_out * 2 < truth.len(), "{left_out} pixels left out");
    assert!(worst < RADIANCE, "largest difference {worst}");
}

fn colored_sphere(n: usize) -> Cloud {
    clouds::sphere(n, 1.0).cloud()
}

#[test]
fn large_splats_equal_the_twin() {
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
    equals_twin(&colored_sphere(300), &Scene::default(), view);
}

#[test]
fn pixel_sized_splats_equal_the_twin() {
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 48);
    equals_twin(&colored_sphere(4_000), &Scene::default(), view);
}

#[test]
fn parallel_projection_equals_the_twin() {
    let mut view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 64);
    view.camera.projection = Projection::Orthographic { height: 2.5 };
    view.far = 10.0;
    equals_twin(&colored_sphere(2_000), &Scene::default(), view);
}

#[test]
fn grazing_splats_equal_the_twin() {
    let view = stage::view(DVec3::new(0.0, 0.1, 1.6), DVec3::ZERO, 64);
    equals_twin(&clouds::plane(24, 1.0).cloud(), &Scene::default(), view);
}

/// Pixels covered by discs, each pixel tested at `n * n` places.
fn cast_finely(cloud: &Cloud, view: &View, n: u32) -> Vec<bool> {
    let [w, h] = view.size_px;
    let fine = View { size_px: [w * n, h * n], ..*view };
    let met = cast(cloud, &fine);
    let mut covered = vec![false; (w * h) as usize];
    for (i, depth) in met.depth.iter().enumerate() {
        let (x, y) = (i as u32 % (w * n) / n, i as u32 / (w * n) / n);
        covered[(y * w + x) as usize] |= depth.is_finite();
    }
    covered
}

/// No pixel whose ray meets a disc stays empty, and no covered pixel's centre is further than a
/// pixel from a disc.
fn stays_within_a_pixel(cloud: &Cloud, view: View, what: &str) {
    let met = cast(cloud, &view);
    let near = cast_finely(cloud, &view, 8);
    let [w, h] = view.size_px.map(i64::from);
    for unit in [FLAT, PHONG] {
        let color = render(cloud, &Scene::default(), view, unit, Output::Color);
        assert!(color.data.iter().all(|v| v.is_finite()), "{what}");
        let mut covered = 0;
        for (i, depth) in met.depth.iter().enumerate() {
            let (x, y) = (i as i64 % w, i as i64 / w);
            let drawn = color.data[4 * i + 3] > 0.0;
            covered += usize::from(drawn);
            assert!(drawn || !depth.is_finite(), "{what}, {}: hole at {x} {y}", unit.1);
            // A disc within a pixel of the centre touches the pixel or one of its neighbours.
            let beside = (-1..=1).any(|dy| {
                (-1..=1).any(|dx| {
                    let (x, y) = (x + dx, y + dy);
                    (0..w).contains(&x) && (0..h).contains(&y) && near[(y * w + x) as usize]
                })
            });
            assert!(!drawn || beside, "{what}, {}: stray pixel at {x} {y}", unit.1);
        }
        assert!(covered > 0, "{what}: nothing is drawn");
    }
}

#[test]
fn filtered_splats_leave_no_hole_and_stay_within_a_pixel() {
    let sphere = colored_sphere(5_000);
    let front = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
    stays_within_a_pixel(&sphere, front, "sphere");
    let far = stage::view(DVec3::new(0.0, 2.0, 60.0), DVec3::ZERO, 96);
    stays_within_a_pixel(&sphere, far, "far sphere of sub-pixel splats");
    let plane = clouds::plane(60, 1.0).cloud();
    let grazing = stage::view(DVec3::new(0.0, 0.03, 2.0), DVec3::ZERO, 96);
    stays_within_a_pixel(&plane, grazing, "grazing plane");
    let inside = stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 96);
    stays_within_a_pixel(&sphere, inside, "inside");
}

#[test]
fn edge_on_and_sub_pixel_discs_are_drawn() {
    let mut surfels = Surfels::default();
    surfels.push(Vec3::new(-0.5, 0.0, 0.0), Vec3::Y, 0.3);
    surfels.push(Vec3::new(0.5, 0.0, 0.0), Vec3::Z, 1e-4);
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
    let color = render(&surfels.cloud(), &Scene::default(), view, PHONG, Output::Color);
    let covered = |columns: std::ops::Range<u32>| {
        columns
            .flat_map(|x| (0..64).map(move |y| (x, y)))
            .filter(|&(x, y)| color.pixel(x, y)[3] > 0.0)
            .count()
    };
    // A line 15 pixels long and up to two wide; a point of up to four pixels.
    assert!((12..40).contains(&covered(0..32)), "{}", covered(0..32));
    assert!((1..=4).contains(&covered(32..64)), "{}", covered(32..64));
}

#[test]
fn minified_colours_are_averaged_instead_of_picked() {
    let mut surfels = clouds::plane(400, 1.0);
    // Stripes and dots finer than a pixel of the far view.
    surfels.colors = (0..400 * 400u32)
        .map(|i| {
            let (x, z) = (i % 400, i / 400);
            let bit = (x ^ z) & 1 == 0;
            [if bit { 255 } else { 0 }, (x * 7 % 256) as u8, if z % 5 == 0 { 255 } else { 30 }]
        })
        .collect();
    let cloud = surfels.cloud();
    println!("| distance | unfiltered | filtered | ratio |\n|---|---|---|---|");
    for distance in [2.0, 3.0, 4.0] {
        let eye = DVec3::new(0.0, 0.7, 1.0) * distance;
        let view = stage::view(eye, DVec3::ZERO, 64);
        // 64 samples a pixel of the unfiltered discs, averaged.
        let fine = View { size_px: [512, 512], ..view };
        let mut plain = Scene::default();
        plain.surface.low_pass = 0.0;
        let samples = render(&cloud, &plain, fine, PHONG, Output::Albedo);
        let error = |scene: &Scene| {
            let image = render(&cloud, scene, view, PHONG, Output::Albedo);
            let (mut sum, mut n) = (0.0, 0);
            for y in 0..64 {
                for x in 0..64 {
                    let (mut mean, mut covered) = (DVec3::ZERO, 0);
                    for i in 0..64 {
                        let sample = samples.pixel(8 * x + i % 8, 8 * y + i / 8);
                        mean += Vec3::from_slice(sample).as_dvec3();
                        covered += u32::from(sample[3] > 0.0);
                    }
                    // Pixels at the plane's border are about coverage, not colour.
                    if covered == 64 {
                        let found = Vec3::from_slice(image.pixel(x, y)).as_dvec3();
                        sum += (found - mean / 64.0).length_squared();
                        n += 1;
                    }
                }
            }
            assert!(n > 50, "the plane is in view: {n}");
            (sum / f64::from(n)).sqrt()
        };
        let (unfiltered, filtered) = (error(&plain), error(&Scene::default()));
        let ratio = filtered / unfiltered;
        println!("| {distance} | {unfiltered:.4} | {filtered:.4} | {ratio:.3} |");
        assert!(ratio <= 0.25, "at distance {distance}: {filtered} of {unfiltered}");
    }
}
