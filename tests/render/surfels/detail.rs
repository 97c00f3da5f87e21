//! Merged surfels: fewer are drawn, and the picture stays what it was within bounds.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::Image;
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, RenderRequest, Rendered, RendererView, SurfelDrawing,
};
use surfelshop_tests::{clouds, stage};

const PHONG: (&str, &str) = ("surfelshop_ewa_phong", "ewa-phong");
const FLAT: (&str, &str) = ("surfelshop_flat", "flat");

const OUTPUTS: [Output; 3] = [Output::Color, Output::Normal, Output::Albedo];

struct Lab {
    scene: Scene,
    engine: Engine,
    renderer: RendererView,
}

/// Every way to draw.
const WAYS: [SurfelDrawing; 3] =
    [SurfelDrawing::Quads, SurfelDrawing::Compute, SurfelDrawing::Processor];

impl Lab {
    fn new(unit: (&str, &str), surfels: SurfelDrawing) -> Self {
        Self::with(unit, &EngineOptions { surfels, ..EngineOptions::default() })
    }

    fn with(unit: (&str, &str), options: &EngineOptions) -> Self {
        let engine = stage::engine_with(&GpuOptions::default(), options);
        let renderer = stage::built_renderer(&engine, unit.0, unit.1);
        Self { scene: Scene::default(), engine, renderer }
    }

    fn rendered(&mut self, cloud: &Cloud, view: View, detail_px: f32) -> Rendered {
        let request = RenderRequest {
            clouds: &[cloud.view()],
            facts: cloud.facts(),
            scene: &self.scene,
            view,
            values: &Values::new(),
            outputs: &OUTPUTS,
            frame_index: 0,
            environment: None,
            stride: 1,
            detail_px,
            parts: None,
            eye_dome: None,
        };
        self.engine.forget_surfaces();
        self.engine.render(&mut self.renderer, &request).unwrap()
    }

    /// The pictures, and how many surfels were drawn for them.
    fn pictures(&mut self, cloud: &Cloud, view: View, detail_px: f32) -> (Vec<Image>, usize) {
        let images = self.rendered(cloud, view, detail_px).images;
        let drawn = self.engine.counters().drawn_surfels;
        (images.into_iter().map(|(_, image)| image).collect(), drawn)
    }
}

fn view(size: u32) -> View {
    stage::view(DVec3::new(0.6, 0.8, 2.6), DVec3::ZERO, size)
}

/// How a picture differs from another.
struct Difference {
    /// Share of the covered pixels that only one of them covers.
    coverage: f64,
    /// Share of the pixels covered by both that differ by more than two levels of 8 bits.
    above_two_levels: f64,
    /// Mean difference of those, signed and not, in levels.
    bias: f64,
    mean: f64,
}

fn difference(a: &Image, b: &Image) -> Difference {
    let (mut either, mut both, mut above, mut bias, mut sum) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in a.data.chunks_exact(4).zip(b.data.chunks_exact(4)) {
        let (has_a, has_b) = (a[3] > 0.0, b[3] > 0.0);
        either += f64::from(has_a || has_b);
        if has_a && has_b {
            both += 1.0;
            let levels = [0, 1, 2].map(|i| f64::from(b[i] - a[i]) * 255.0);
            above += f64::from(levels.iter().any(|level| level.abs() > 2.0));
            bias += levels.iter().sum::<f64>() / 3.0;
            sum += levels.iter().map(|level| level.abs()).sum::<f64>() / 3.0;
        }
    }
    Difference {
        coverage: 1.0 - both / either,
        above_two_levels: above / both,
        bias: bias / both,
        mean: sum / both,
    }
}

/// The bounds that the README states, on a body with waves: of what is blended anyway, means stay.
///
/// Invariant: merged surfels change the picture within bounds, and happen only where they are
/// asked for and taken
#[test]
fn merged_surfels_change_the_picture_within_bounds() {
    let cloud = clouds::wavy_sphere(1_000_000);
    for way in WAYS {
        within_bounds(&cloud, &mut Lab::new(PHONG, way));
    }
}

fn within_bounds(cloud: &Cloud, lab: &mut Lab) {
    let (full, all) = lab.pictures(cloud, view(80), 0.0);
    for (detail_px, coverage, mean) in [(0.75, 0.002, 0.5), (1.0, 0.005, 1.0), (1.5, 0.01, 2.0)] {
        let (merged, drawn) = lab.pictures(cloud, view(80), detail_px);
        for (i, output) in OUTPUTS.iter().enumerate() {
            let found = difference(&full[i], &merged[i]);
            println!(
                "{detail_px} px, {output:?}: {drawn} of {all} surfels, coverage {:.4}, mean {:.3}, \
                 bias {:.3} levels, above two levels {:.4}",
                found.coverage, found.mean, found.bias, found.above_two_levels
            );
            assert!(found.coverage < coverage, "{detail_px} {output:?}: {}", found.coverage);
            assert!(found.mean < mean, "{detail_px} {output:?}: {}", found.mean);
            assert!(found.bias.abs() < 0.5, "{detail_px} {output:?}: {}", found.bias);
        }
        assert!(2 * drawn < all, "{detail_px}: {drawn} of {all}");
    }
}

/// Where pixels hold more than four surfels, what is drawn grows with the pixels, not the surfels.
#[test]
fn beyond_four_surfels_a_pixel_no_more_are_drawn() {
    let mut lab = Lab::new(PHONG, SurfelDrawing::Processor);
    let side = 64;
    let mut counts = Vec::new();
    for doubling in 0..7 {
        let cloud = clouds::wavy_sphere((4 * side * side) << doubling);
        counts.push(lab.pictures(&cloud, view(side as u32), 1.5).1);
    }
    println!("surfels drawn, from 4 a pixel on, twice as many each time: {counts:?}");
    let growth = (counts[6] as f64 / counts[0] as f64).powf(1.0 / 6.0);
    assert!(growth < 1.2, "{growth} for each doubling");
}

#[test]
fn nothing_is_merged_where_that_is_not_asked_for_nor_taken() {
    let cloud = clouds::wavy_sphere(200_000);
    for way in WAYS {
        let (asked, all) = Lab::new(PHONG, way).pictures(&cloud, view(64), 1.0);
        let (full, whole) = Lab::new(PHONG, way).pictures(&cloud, view(64), 0.0);
        assert!(all < whole && asked != full, "{way:?}");
        // It shows the nearest surfels themselves and takes no others.
        let mut flat = Lab::new(FLAT, way);
        assert_eq!(flat.pictures(&cloud, view(64), 1.0), flat.pictures(&cloud, view(64), 0.0));
        // Far less than any surfel.
        let mut lab = Lab::new(PHONG, way);
        assert_eq!(lab.pictures(&cloud, view(64), 1e-6).0, full, "{way:?}");
    }
}

/// What the device draws is cut into chunks, which blocks know nothing of.
#[test]
fn chunks_make_no_difference_to_merged_surfels() {
    let cloud = clouds::wavy_sphere(30_000);
    let drawn = |surfels, chunk_surfels| {
        let options = EngineOptions { surfels, chunk_surfels, ..EngineOptions::default() };
        let mut lab = Lab::with(PHONG, &options);
        let pictures = lab.pictures(&cloud, view(64), 2.0);
        (pictures, lab.engine.counters().chunks)
    };
    for way in [SurfelDrawing::Quads, SurfelDrawing::Compute] {
        let (whole, one) = drawn(way, 1 << 20);
        let (chunked, many) = drawn(way, 1000);
        assert!(one == 1 && many > 30, "{way:?}: {one} and {many} chunks");
        assert!(whole == chunked, "{way:?}");
    }
}

/// The scene's factor on radii brings surfels no nearer to each other.
#[test]
fn small_radii_merge_no_sooner() {
    let cloud = clouds::wavy_sphere(20_000);
    let mut lab = Lab::new(PHONG, SurfelDrawing::Processor);
    lab.scene.surface.radius_scale = 0.1;
    // Neighbours are about seven pixels apart.
    let (full, all) = lab.pictures(&cloud, view(256), 0.0);
    assert_eq!(lab.pictures(&cloud, view(256), 1.0), (full, all));
    // From afar neighbours are half a pixel apart, and merged ones cover what these cover.
    let (full, _) = lab.pictures(&cloud, view(18), 0.0);
    let (coarse, merged) = lab.pictures(&cloud, view(18), 20.0);
    assert!(2 * merged < all, "{merged} of {all}");
    let found = difference(&full[0], &coarse[0]);
    assert!(found.coverage < 0.02 && found.mean < 3.0, "{} {}", found.coverage, found.mean);
    // A detail far above the distance of neighbours leaves no holes.
    let (full, _) = lab.pictures(&cloud, view(64), 0.0);
    let (coarse, _) = lab.pictures(&cloud, view(64), 3.0);
    let found = difference(&full[0], &coarse[0]);
    assert!(found.coverage < 0.02, "{}", found.coverage);
}

#[test]
fn materials_stay_apart_and_ellipses_as_they_are() {
    let mut lab = Lab::new(PHONG, SurfelDrawing::Processor);
    let drawn = |lab: &mut Lab, cloud: &Cloud| {
        [0.0, 2.0].map(|detail_px| lab.pictures(cloud, view(48), detail_px).1)
    };
    let sphere = clouds::sphere(60_000, 1.0);
    let [all, merged] = drawn(&mut lab, &sphere.cloud());
    assert!(3 * merged < all, "{merged} of {all}");
    let ellipses = clouds::sphere(60_000, 1.0).elliptical(0.5).cloud();
    let [all, merged] = drawn(&mut lab, &ellipses);
    assert_eq!(all, merged);
    // Each surfel of another material than its neighbours in any order.
    let mut columns = sphere.cloud().columns().to_vec();
    columns.push(Column::new("material", 1, Buffer::U32((0..60_000).collect())));
    let [all, merged] = drawn(&mut lab, &Cloud::new(DVec3::ZERO, columns).unwrap());
    assert_eq!(all, merged);
}
