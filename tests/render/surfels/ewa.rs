//! The screen-space filter: equal to its twin in f64, without holes, within a pixel of the discs,
//! and worth having.

use glam::{DVec3, Vec3};
use std::slice;
use surfelshop_api::graph::Output;
use surfelshop_api::{Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_tests::cast::{beyond_reach, cast, depth_inside_px};
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

/// Radiance may differ by this: albedo passes through half precision (5e-4 of its value), normals
/// through 2 x 16 bits (6e-5 rad, times a highlight's slope of up to 5 for exponent 64), and the
/// rest is f32 rounding, unless the rasteriser snaps vertices (1/256 pixel), which moves weights
/// by up to 8 r dr = 0.2 % of a splat ten pixels wide.
const RADIANCE: f64 = 2e-3;
/// Depth may differ by this fraction for f32, and by what a splat's depth changes within the
/// 1/256 pixel that its corners are snapped to.
const DEPTH: f64 = 1e-5;
const SNAPPED_PX: f64 = 1.0 / 256.0;

/// Compares with the twin all pixels in which rounding decides nothing, at least `sure` of the
/// covered ones.
#[track_caller]
fn equals_twin(cloud: &Cloud, scene: &Scene, view: View, sure: f64) {
    let color = render(cloud, scene, view, PHONG, Output::Color);
    let depth = render(cloud, scene, view, PHONG, Output::Depth);
    let truth = twin::Twin::new(slice::from_ref(cloud), scene, &view);
    let phong = twin::Phong { diffuse: 1.0, specular: 0.25, shininess: 64.0, ambient: 0.08 };
    let (mut compared, mut left_out) = (0, 0);
    let (mut worst, mut worst_depth) = (0.0f64, 0.0f64);
    for i in 0..view.size_px[0] * view.size_px[1] {
        let (x, y) = (i % view.size_px[0], i / view.size_px[0]);
        let pixel = truth.pixel(x, y);
        if !pixel.sure {
            left_out += 1;
            continue;
        }
        let found = color.pixel(x, y);
        assert_eq!(found[3] > 0.0, pixel.depth > 0.0, "coverage at {x} {y}: {pixel:?}");
        if pixel.depth > 0.0 {
            let position = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let expected = twin::shade(&pixel, scene, &view, position, &phong);
            let difference = (Vec3::from_slice(found).as_dvec3() - expected).abs().max_element();
            assert!(expected.is_finite() && difference.is_finite(), "{pixel:?} {found:?}");
            worst = worst.max(difference);
            let allowed = DEPTH * pixel.depth + SNAPPED_PX * pixel.slope;
            let off = (f64::from(depth.pixel(x, y)[0]) - pixel.depth).abs();
            worst_depth = worst_depth.max(off / allowed);
            compared += 1;
        }
    }
    println!(
        "{compared} pixels compared, {left_out} left out; radiance differs by {worst:.5}, \
         depth by {worst_depth:.3} of what is allowed"
    );
    assert!(compared > 200, "the view shows too little: {compared}");
    let enough = f64::from(compared) >= sure * f64::from(compared + left_out);
    assert!(enough, "{left_out} pixels left out, {compared} compared");
    assert!(worst < RADIANCE, "largest difference {worst}");
    assert!(worst_depth < 1.0, "depth differs by {worst_depth} of what is allowed");
}

fn colored_sphere(n: usize) -> Cloud {
    clouds::sphere(n, 1.0).cloud()
}

#[test]
fn large_splats_equal_the_twin() {
    stage::each_way(|| {
        let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
        equals_twin(&colored_sphere(300), &Scene::default(), view, 0.9);
    });
}

/// Invariant: filtered coverage, depth and light equal those of an f64 twin
#[test]
fn pixel_sized_splats_equal_the_twin() {
    stage::each_way(|| {
        let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 48);
        equals_twin(&colored_sphere(4_000), &Scene::default(), view, 0.7);
    });
}

#[test]
fn parallel_projection_equals_the_twin() {
    stage::each_way(|| {
        let mut view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 64);
        view.camera.projection = Projection::Orthographic { height: 2.5 };
        view.far = 10.0;
        equals_twin(&colored_sphere(2_000), &Scene::default(), view, 0.7);
    });
}

#[test]
fn grazing_splats_equal_the_twin() {
    stage::each_way(|| {
        let view = stage::view(DVec3::new(0.0, 0.1, 1.6), DVec3::ZERO, 64);
        equals_twin(&clouds::plane(24, 1.0).cloud(), &Scene::default(), view, 0.5);
    });
}

#[test]
fn elliptical_splats_equal_the_twin() {
    stage::each_way(|| {
        let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
        for share in [0.6, 0.1, 0.01] {
            let cloud = clouds::sphere(400, 1.0).elliptical(share).cloud();
            equals_twin(&cloud, &Scene::default(), view, 0.7);
        }
    });
}

#[test]
fn lights_with_a_place_equal_the_twin() {
    stage::each_way(|| {
        let position = DVec3::new(0.9, 1.1, 1.2);
        let spot = Light::Spot {
            position: DVec3::new(-1.5, 1.2, 1.8),
            target: DVec3::new(0.2, 0.1, 0.5),
            intensity: Vec3::new(1.0, 3.0, 2.0),
            angle: 0.4,
            softness: 0.6,
        };
        let lights = vec![Light::Point { position, intensity: Vec3::new(0.4, 0.3, 0.5) }, spot];
        let scene = Scene { lights, ..Scene::default() };
        let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
        equals_twin(&colored_sphere(300), &scene, view, 0.9);
        let mut parallel = view;
        parallel.camera.projection = Projection::Orthographic { height: 2.5 };
        parallel.far = 10.0;
        equals_twin(&colored_sphere(2_000), &scene, parallel, 0.7);
    });
}

/// One disc nearly as large as its distance, which is 1, the eye so far above its plane.
fn disc_below_the_eye(radius: f32, height: f64) -> (Cloud, View) {
    let mut surfels = Surfels::default();
    surfels.push(Vec3::NEG_Z, Vec3::Y, radius);
    surfels.colors.push([250, 180, 90]);
    let eye = DVec3::Y * height;
    // Tilted, so that the horizon passes pixel centres at all distances.
    let mut view = stage::view(eye, eye + DVec3::new(0.03, 0.02, -1.0), 128);
    view.camera.up = DVec3::new(0.1, 1.0, 0.0);
    (surfels.cloud(), view)
}

/// Heights above the plane of [`disc_below_the_eye`]: from a line on the screen to a surface.
const HEIGHTS: [f64; 9] = [1e-5, 1e-3, 0.005, 0.01, 0.02, 0.03, 0.06, 0.1, 0.3];

#[test]
fn discs_as_large_as_their_distance_equal_the_twin() {
    stage::each_way(|| {
        for height in HEIGHTS {
            for low_pass in [1.0, 4.0] {
                let (cloud, view) = disc_below_the_eye(0.85, height);
                let mut scene = Scene::default();
                scene.surface.low_pass = low_pass;
                equals_twin(&cloud, &scene, view, 0.9);
            }
        }
    });
}

/// A widened splat may reach this many pixels further than its disc: the low-pass, the 1/256 pixel
/// that vertices are snapped to, and f32.
fn reach_px(low_pass: f32) -> f64 {
    f64::from(low_pass) + 0.01
}

/// No pixel whose ray meets a disc stays empty, and no covered pixel's centre is further than the
/// low-pass from a disc.
#[track_caller]
fn stays_within(low_pass: f32, cloud: &Cloud, view: View, what: &str) {
    let met = cast(cloud, &view);
    let mut scene = Scene::default();
    scene.surface.low_pass = low_pass;
    stage::each_way(|| {
        for unit in [FLAT, PHONG] {
            let color = render(cloud, &scene, view, unit, Output::Color);
            assert!(color.data.iter().all(|v| v.is_finite()), "{what}");
            let mut beside = Vec::new();
            let mut covered = 0;
            for (i, depth) in met.depth.iter().enumerate() {
                let (x, y) = (i as u32 % view.size_px[0], i as u32 / view.size_px[0]);
                let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let drawn = color.data[4 * i + 3] > 0.0;
                covered += usize::from(drawn);
                if !drawn && depth.is_finite() {
                    // On the rim itself f32 and snapping decide.
                    let lost = depth_inside_px(cloud, &view, center);
                    assert!(lost < 0.01, "{what}, {}: hole at {x} {y}, {lost} px inside", unit.1);
                }
                if drawn && !depth.is_finite() {
                    beside.push(center);
                }
            }
            let stray = beyond_reach(cloud, &view, &beside, reach_px(low_pass));
            assert!(stray.is_empty(), "{what}, {}: beyond {low_pass} px: {stray:?}", unit.1);
            assert!(covered > 0, "{what}: nothing is drawn");
        }
    });
}

/// Invariant: that filter leaves no hole and widens nothing by more than its radius
#[test]
fn filtered_splats_leave_no_hole_and_stay_within_the_low_pass() {
    let sphere = colored_sphere(5_000);
    let front = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
    let mut parallel = front;
    parallel.camera.projection = Projection::Orthographic { height: 2.5 };
    parallel.far = 10.0;
    let far = stage::view(DVec3::new(0.0, 2.0, 60.0), DVec3::ZERO, 96);
    let inside = stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 96);
    let among = stage::view(DVec3::new(0.0, 0.0, 0.999), DVec3::new(1.0, 0.2, 0.9), 96);
    let grazing = stage::view(DVec3::new(0.0, 0.03, 2.0), DVec3::ZERO, 96);
    // Through the middle of a row: between two, a low-pass of half a pixel just reaches them.
    let edge_on = stage::view(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 97);
    let plane = clouds::plane(60, 1.0).cloud();
    let few = colored_sphere(2_000);
    for low_pass in [0.5, 1.0, 4.0] {
        stays_within(low_pass, &sphere, front, "sphere");
        stays_within(low_pass, &sphere, parallel, "sphere in parallel projection");
        stays_within(low_pass, &sphere, far, "far sphere of sub-pixel splats");
        stays_within(low_pass, &sphere, inside, "inside");
        stays_within(low_pass, &few, among, "among the surfels");
        stays_within(low_pass, &plane, grazing, "grazing plane");
        stays_within(low_pass, &plane, edge_on, "plane seen edge-on");
        for share in [0.3, 0.01, 0.0] {
            let ellipses = clouds::sphere(3_000, 1.0).elliptical(share).cloud();
            stays_within(low_pass, &ellipses, front, &format!("ellipses of share {share}"));
        }
    }
}

#[test]
fn discs_as_large_as_their_distance_have_no_hole_and_stay_within_the_low_pass() {
    for height in HEIGHTS.into_iter().chain([0.0]) {
        let (disc, view) = disc_below_the_eye(0.85, height);
        for low_pass in [0.5, 1.0, 4.0] {
            stays_within(low_pass, &disc, view, &format!("{height} above a large disc"));
        }
    }
}

/// On a plane inverse distance changes evenly over the screen: at each pixel it is that of the plane
/// at most the low-pass away.
///
/// Invariant: depth is that of the surface, at most the filter's radius away
#[test]
fn filtered_depth_is_that_of_the_surface_within_the_low_pass() {
    stage::each_way(|| {
        for (n, height, low_pass) in [60, 6]
            .into_iter()
            .flat_map(|n| [0.003, 0.03, 0.3, 2.0].map(|height| (n, height)))
            .flat_map(|(n, height)| [1.0, 4.0].map(|low_pass| (n, height, low_pass)))
        {
            let cloud = clouds::plane(n, 1.0).cloud();
            let view = stage::view(DVec3::new(0.1, height, 1.8), DVec3::new(0.0, 0.0, 0.1), 96);
            let mut scene = Scene::default();
            scene.surface.low_pass = low_pass;
            let depth = render(&cloud, &scene, view, FLAT, Output::Depth);
            let up = view.camera.view_from_world() * DVec3::Y;
            let inverse = |x: f64, y: f64| {
                let (_, direction) = view.ray(x, y);
                up.dot(direction / -direction.z) / -height
            };
            let middle = inverse(48.0, 48.0);
            let per_px = (inverse(49.0, 48.0) - middle).hypot(inverse(48.0, 49.0) - middle);
            let mut covered = 0;
            for (x, y) in (0..96).flat_map(|y| (0..96).map(move |x| (x, y))) {
                let found = f64::from(depth.pixel(x, y)[0]);
                if found > 0.0 {
                    let expected = inverse(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let off_px = (1.0 / found - expected).abs() / per_px;
                    // Snapping, and f32 of a position next to the eye's.
                    let allowed = f64::from(low_pass) + 0.01 + 1e-6 / (found * per_px);
                    assert!(off_px < allowed, "{n} {height} {low_pass}: {off_px} px at {x} {y}");
                    covered += 1;
                }
            }
            assert!(covered > 50, "{n} {height}: {covered} pixels");
        }
    });
}

#[test]
fn a_disc_that_nearly_reaches_the_eye_is_drawn_however_edge_on() {
    stage::each_way(|| {
        // Its cosine to the view ray at the centre is below 1e-4, and near the eye it is many pixels
        // thick.
        for radius in [0.98, 0.99, 0.999] {
            for height in [1e-5, 9e-5, 1.1e-4] {
                let (disc, mut view) = disc_below_the_eye(radius, height);
                for low_pass in [0.0, 1.0] {
                    stays_within(low_pass, &disc, view, &format!("{height} above radius {radius}"));
                }
                view.near = 0.01;
                let met = cast(&disc, &view).depth.iter().filter(|depth| depth.is_finite()).count();
                let color = render(&disc, &Scene::default(), view, PHONG, Output::Color);
                let drawn = color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count();
                // As it is, a hundred-thousandth thick: f32 decides on a few pixels at its ends.
                let enough = 10 * drawn >= 9 * met;
                assert!(enough, "{drawn} of {met} pixels with the disc across the near plane");
            }
        }
    });
}

#[test]
fn a_splat_below_a_pixel_of_a_small_picture_is_drawn() {
    stage::each_way(|| {
        for normal in [Vec3::Y, Vec3::new(0.0, 1.0, 0.1), Vec3::new(0.0, 1.0, 0.3)] {
            for (size, low_pass) in [(8, 4.0), (8, 1.0), (16, 4.0)] {
                let mut surfels = Surfels::default();
                surfels.push(Vec3::NEG_Z, normal.normalize_or(Vec3::Y), 0.01);
                let mut view = stage::view(DVec3::ZERO, DVec3::NEG_Z, size);
                view.camera.projection = Projection::Perspective { fov_y: 1.6 };
                let mut scene = Scene::default();
                scene.surface.low_pass = low_pass;
                let color = render(&surfels.cloud(), &scene, view, FLAT, Output::Color);
                let drawn = color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count();
                assert!(drawn >= 4, "{normal} in {size} pixels, low-pass {low_pass}: {drawn}");
            }
        }
    });
}

#[test]
fn edge_on_and_sub_pixel_discs_are_drawn() {
    stage::each_way(|| {
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
        // However small its weight, a surfel has its own colour.
        for radius in [1e-4, 1e-9, 1e-30] {
            let mut point = Surfels::default();
            point.push(Vec3::ZERO, Vec3::Z, radius);
            point.colors.push([255, 0, 255]);
            let albedo = render(&point.cloud(), &Scene::default(), view, PHONG, Output::Albedo);
            let covered: Vec<_> = albedo.data.chunks_exact(4).filter(|p| p[3] > 0.0).collect();
            assert!(!covered.is_empty(), "radius {radius:e}");
            assert!(covered.iter().all(|p| **p == [1.0, 0.0, 1.0, 1.0]), "{radius:e}: {covered:?}");
        }
        // A line 15 pixels long and up to two wide; a point of up to four pixels.
        assert!((12..40).contains(&covered(0..32)), "{}", covered(0..32));
        assert!((1..=4).contains(&covered(32..64)), "{}", covered(32..64));
    });
}

#[test]
fn minified_colours_are_averaged_instead_of_picked() {
    stage::each_way(|| {
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
    });
}
