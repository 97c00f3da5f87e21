//! Normal fields and lines that cut, drawn in every way, against the twin in f64.

use crate::splats::stage::{Way, mode};
use glam::{DVec3, Vec3};
use std::slice;
use surfelshop_api::graph::Output;
use surfelshop_api::{Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::{stage, twin};

/// Normals may differ by this, radians: they pass through 2 x 16 bits (6e-5 rad), and the rasteriser
/// snaps vertices (1/256 pixel), which moves points over splats, and weights, by a few times as much at
/// most.
const NORMAL: f64 = 3e-4;
/// Depth may differ by this fraction for f32, and by what a splat's depth changes within the 1/256 pixel
/// that its corners are snapped to.
const DEPTH: f64 = 1e-5;
const SNAPPED_PX: f64 = 1.0 / 256.0;

struct Case {
    name: &'static str,
    cloud: Cloud,
    scene: Scene,
    view: View,
    /// Share of the pixels in which rounding decides nothing, at least.
    sure: f64,
    /// Covered pixels at least.
    covered: u32,
}

impl Case {
    fn new(name: &'static str, surfels: &Surfels, view: View) -> Self {
        let (cloud, scene) = (surfels.cloud(), Scene::default());
        Self { name, cloud, scene, view, sure: 0.6, covered: 200 }
    }
}

/// Holds one way against the twin: coverage, depth and normals.
fn equals_twin(way: &mut Way, case: &Case, fields: bool) {
    let Case { cloud, scene, view, .. } = case;
    let outputs = [Output::Color, Output::Depth, Output::Normal];
    let values = mode(if fields { "phong" } else { "averaged" });
    let drawn = way.draw(cloud, scene, *view, &values, &outputs);
    let image = |output| drawn.image(output).unwrap();
    let (color, depth, normal) =
        (image(&Output::Color), image(&Output::Depth), image(&Output::Normal));
    assert!(color.data.iter().all(|value| value.is_finite()), "{}: {}", way.name, case.name);
    let truth = twin::Twin::new(slice::from_ref(cloud), scene, view).with_fields(fields);
    let (mut compared, mut left_out, mut empty) = (0, 0, 0);
    let (mut worst, mut worst_depth) = (0.0f64, 0.0f64);
    for i in 0..view.size_px[0] * view.size_px[1] {
        let (x, y) = (i % view.size_px[0], i / view.size_px[0]);
        let pixel = truth.pixel(x, y);
        let told = || format!("{}: {}, at {x} {y}: {pixel:?}", way.name, case.name);
        if !pixel.sure {
            left_out += 1;
            continue;
        }
        assert_eq!(color.pixel(x, y)[3] > 0.0, pixel.depth > 0.0, "{}", told());
        if pixel.depth == 0.0 {
            empty += 1;
            continue;
        }
        let found = Vec3::from_slice(normal.pixel(x, y)).as_dvec3();
        worst = worst.max(found.angle_between(pixel.normal));
        assert!(worst < NORMAL, "{worst}: {found:?} {}", told());
        let allowed = DEPTH * pixel.depth + SNAPPED_PX * pixel.slope;
        let off = (f64::from(depth.pixel(x, y)[0]) - pixel.depth).abs();
        worst_depth = worst_depth.max(off / allowed);
        compared += 1;
    }
    println!(
        "{}, {}, fields {fields}: {compared} compared, {left_out} left out, {empty} empty; normals \
         differ by {worst:.5}, depth by {worst_depth:.3} of what is allowed",
        way.name, case.name
    );
    assert!(compared >= case.covered, "{}: {compared} pixels are covered", case.name);
    let share = f64::from(compared + empty) / f64::from(compared + empty + left_out);
    assert!(share >= case.sure, "{}: {left_out} pixels are left out", case.name);
    assert!(worst_depth < 1.0, "{}: {worst_depth}", case.name);
}

fn ahead(distance: f64, size: u32) -> View {
    stage::view(DVec3::new(0.2, 0.3, 1.0).normalize_or(DVec3::Z) * distance, DVec3::ZERO, size)
}

/// A few splats with fields, cut in every way.
fn splats(n: usize, share: f32) -> Surfels {
    clouds::sphere(n, 1.0).elliptical(share).varying()
}

/// One large splat in the plane y = 0, cut by the line x = 0.
fn halved() -> Surfels {
    let mut surfels = Surfels::default();
    surfels.push(Vec3::ZERO, Vec3::Y, 1.0);
    surfels.tangents = vec![[Vec3::X, 0.7 * Vec3::Z]];
    surfels.fields = vec![[0.1, -0.1, 0.8, 0.5]];
    surfels.clips = vec![[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]];
    surfels
}

fn cases() -> Vec<Case> {
    let whole = |surfels: Surfels| Surfels { clips: Vec::new(), ..surfels };
    let mut cases = vec![
        Case::new("large", &splats(60, 0.6), ahead(3.0, 64)),
        Case::new("whole", &whole(splats(60, 0.6)), ahead(3.0, 64)),
        Case::new("pixel-sized", &splats(4000, 0.6), ahead(3.0, 48)),
        Case::new("below a pixel", &splats(4000, 0.6), ahead(9.0, 48)),
        Case::new("narrow", &splats(400, 0.05), ahead(3.0, 64)),
        // Near the eye, and some of it behind the near plane.
        Case::new("near plane", &halved(), {
            let view = stage::view(DVec3::new(0.1, 0.05, 0.1), DVec3::new(0.5, 0.0, 0.05), 64);
            View { near: 0.05, ..view }
        }),
        Case::new("grazing", &halved(), stage::view(DVec3::new(0.4, 0.05, 2.0), DVec3::ZERO, 64)),
        // Not quite: the twin's own equations hold for a splat of some width.
        Case::new("edge-on", &halved(), stage::view(DVec3::new(0.3, 1e-4, 2.0), DVec3::ZERO, 64)),
        Case::new(
            "from below",
            &halved(),
            stage::view(DVec3::new(0.3, -1.0, 1.0), DVec3::ZERO, 64),
        ),
        Case::new("behind the eye", &halved(), {
            stage::view(DVec3::new(0.0, 0.5, -3.0), DVec3::new(0.0, 0.5, -9.0), 64)
        }),
    ];
    let mut parallel = Case::new("parallel", &splats(400, 0.6), ahead(3.0, 64));
    parallel.view.camera.projection = Projection::Orthographic { height: 2.5 };
    parallel.view.far = 10.0;
    let mut scaled = Case::new("scaled", &splats(400, 0.6), ahead(3.0, 64));
    scaled.scene.surface.radius_scale = 0.7;
    let mut sharp = Case::new("no low-pass", &splats(400, 0.6), ahead(3.0, 64));
    sharp.scene.surface.low_pass = 0.0;
    let mut swapped = splats(60, 0.6);
    swapped.tangents.iter_mut().for_each(|axes| axes.swap(0, 1));
    let swapped = Case::new("swapped tangents", &swapped, ahead(3.0, 64));
    cases.extend([parallel, scaled, sharp, swapped]);
    for case in &mut cases {
        case.covered = match case.name {
            "below a pixel" => 40,
            "edge-on" => 20,
            "grazing" => 60,
            "behind the eye" => 0,
            _ => 200,
        };
        case.sure = match case.name {
            // Thousands of edges lie in every pixel.
            "pixel-sized" | "below a pixel" | "narrow" | "parallel" => 0.3,
            _ => 0.6,
        };
    }
    cases
}

/// Invariant: normals that vary over splats, and lines that cut them, are those of an f64 twin
/// in every way to draw: grazing, edge-on, across the near plane, behind the eye, below a pixel
#[test]
fn every_way_to_draw_equals_the_twin() {
    let cases = cases();
    for mut way in Way::all() {
        for case in &cases {
            for fields in [true, false] {
                equals_twin(&mut way, case, fields);
            }
        }
    }
}

#[test]
fn splats_in_a_plane_with_the_eye_are_a_line() {
    for mut way in Way::all() {
        for fields in ["phong", "averaged"] {
            let view = stage::view(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 96);
            let outputs = [Output::Color, Output::Depth, Output::Normal];
            let drawn =
                way.draw(&halved().cloud(), &Scene::default(), view, &mode(fields), &outputs);
            let values = drawn.images.iter().flat_map(|(_, image)| &image.data);
            assert!(values.into_iter().all(|value| value.is_finite()), "{}", way.name);
            let color = drawn.image(&Output::Color).unwrap();
            let covered: Vec<[u32; 2]> = (0..96 * 96)
                .map(|i| [i % 96, i / 96])
                .filter(|[x, y]| color.pixel(*x, *y)[3] > 0.0)
                .collect();
            let n_rows = covered.iter().map(|[_, y]| *y).collect::<std::collections::BTreeSet<_>>();
            assert!(n_rows.len() <= 3 && covered.len() > 10, "{}: {covered:?}", way.name);
            // What x = 0 cuts off is not there, but for half a pixel.
            assert!(covered.iter().all(|[x, _]| *x >= 47), "{}: {covered:?}", way.name);
        }
    }
}

#[test]
fn fields_and_cuts_are_seen() {
    let view = ahead(3.0, 96);
    let with = splats(60, 0.6);
    let outputs = [Output::Normal, Output::Depth];
    for mut way in Way::all() {
        let mut normals = |surfels: &Surfels, values: &str| {
            let drawn =
                way.draw(&surfels.cloud(), &Scene::default(), view, &mode(values), &outputs);
            drawn.image(&Output::Normal).unwrap().data.clone()
        };
        let whole = Surfels { clips: Vec::new(), ..with.clone() };
        let plain = Surfels { fields: Vec::new(), ..whole.clone() };
        let (varying, constant) = (normals(&whole, "phong"), normals(&whole, "averaged"));
        assert_ne!(varying, constant, "fields change normals");
        assert_eq!(constant, normals(&plain, "averaged"), "others do not see them");
        assert_eq!(constant, normals(&plain, "phong"), "without fields both are the same");
        let cut = normals(&with, "phong");
        let covered = |normals: &[f32]| normals.chunks(4).filter(|pixel| pixel[3] > 0.0).count();
        assert!(covered(&cut) < covered(&varying), "what is cut off is gone");
    }
}

/// Surfels that nothing cuts are drawn as if there were no such column, and so are fields of zeros as
/// the normals of the splats' planes.
///
/// Invariant: what is not cut is drawn as if there were no lines, by the same passes to the same
/// bits
#[test]
fn what_is_not_there_costs_nothing() {
    let view = ahead(3.0, 96);
    let surfels = Surfels { clips: Vec::new(), fields: Vec::new(), ..splats(400, 0.6) };
    let uncut = Surfels { clips: vec![[0.0; 7]; 400], ..surfels.clone() };
    let outputs = [Output::Color, Output::Depth, Output::Normal];
    for mut way in Way::all() {
        let mut drawn = |surfels: &Surfels, values: &str| {
            let drawn =
                way.draw(&surfels.cloud(), &Scene::default(), view, &mode(values), &outputs);
            let passes: Vec<String> = drawn.passes.iter().map(|pass| pass.name.clone()).collect();
            let images: Vec<Vec<f32>> =
                drawn.images.iter().map(|(_, image)| image.data.clone()).collect();
            (images, passes)
        };
        let plain = drawn(&surfels, "averaged");
        assert_eq!(plain, drawn(&uncut, "averaged"), "no line cuts anything");
        assert_eq!(plain, drawn(&surfels, "phong"), "there are no fields");
        // Chunks of whole splats are drawn by the same shaders whether others are cut or not.
        let mut one_cut = uncut.clone();
        let towards = Vec3::new(0.2, 0.3, 1.0);
        let ahead = |a: &usize, b: &usize| {
            let at = |i: &usize| surfels.normals[*i].dot(towards);
            at(a).total_cmp(&at(b))
        };
        one_cut.clips[(0..400).max_by(ahead).unwrap()] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        let halved = drawn(&one_cut, "averaged");
        let colors = |images: &[Vec<f32>]| -> Vec<[f32; 4]> { images[0].as_chunks().0.to_vec() };
        let (before, after) = (colors(&plain.0), colors(&halved.0));
        let n_changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
        // One of 400 splats of 0.6 radii covers about a thirtieth of the ball: a tenth is far more.
        assert!((1..before.len() / 10).contains(&n_changed), "{}: {n_changed}", way.name);
        assert_eq!(plain.1, halved.1, "{}", way.name);
    }
}

/// Numbers that are none cut nothing, and stand for no field.
#[test]
fn numbers_that_are_none_are_passed_over() {
    let view = ahead(3.0, 96);
    let surfels = Surfels { clips: Vec::new(), fields: Vec::new(), ..splats(60, 0.6) };
    let mut odd = surfels.clone();
    odd.clips = vec![[f32::NAN, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]; 60];
    odd.clips[3] = [1.0, 0.0, f32::INFINITY, 0.0, 0.0, 1.0, 1.0];
    odd.clips[4] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, f32::NAN];
    odd.fields = vec![[f32::NAN; 4]; 60];
    let zeros = Surfels { fields: vec![[0.0; 4]; 60], ..surfels };
    let outputs = [Output::Color, Output::Depth];
    for mut way in Way::all() {
        let mut drawn = |surfels: &Surfels| {
            let drawn =
                way.draw(&surfels.cloud(), &Scene::default(), view, &mode("phong"), &outputs);
            drawn.images.iter().map(|(_, image)| image.data.clone()).collect::<Vec<_>>()
        };
        assert_eq!(drawn(&odd), drawn(&zeros), "{}", way.name);
    }
}
