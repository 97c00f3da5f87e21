//! Surfels drawn by compute or by the CPU are those that are drawn as quads.

mod backs;

use glam::{DVec3, Vec3};
use surfelshop_api::columns;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{CloudFacts, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_render::{
    Atomics, Backend, Engine, EngineOptions, GpuOptions, RenderRequest, Rendered, RendererView,
    SurfelDrawing,
};
use surfelshop_tests::agreement::{Drawn, DrawnView, differences};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::stage;

/// An engine that draws in one way, with the renderers whose pictures are compared.
struct Way {
    name: &'static str,
    engine: Engine,
    flat: RendererView,
    ewa: RendererView,
}

impl Way {
    fn new(name: &'static str, surfels: SurfelDrawing, options: EngineOptions) -> Self {
        Self::on(name, &GpuOptions::default(), EngineOptions { surfels, ..options })
    }

    fn on(name: &'static str, gpu: &GpuOptions, options: EngineOptions) -> Self {
        let engine = stage::engine_with(gpu, &options);
        let flat = stage::built_renderer(&engine, "surfelshop-flat", "flat");
        let ewa = stage::built_renderer(&engine, "surfelshop-ewa-phong", "ewa-phong");
        Self { name, engine, flat, ewa }
    }

    fn quads() -> Self {
        Self::new("quads", SurfelDrawing::Quads, EngineOptions::default())
    }

    /// All other ways; the narrow one is for devices without 64-bit atomics.
    fn others() -> [Self; 3] {
        let narrow = EngineOptions { only_32_bit_atomics: true, ..EngineOptions::default() };
        [
            Self::new("compute", SurfelDrawing::Compute, EngineOptions::default()),
            Self::new("compute with 32 bits", SurfelDrawing::Compute, narrow),
            Self::new("processor", SurfelDrawing::Processor, EngineOptions::default()),
        ]
    }

    /// Pictures of the nearest surfels and of blended ones.
    fn shots(&mut self, case: &Case) -> [DrawnView; 2] {
        let outputs = [Output::Color, Output::Depth, Output::Normal];
        let flat = render(&mut self.engine, &mut self.flat, case, &outputs);
        let ewa = render(&mut self.engine, &mut self.ewa, case, &outputs[..2]);
        let image = |rendered: &Rendered, output| rendered.image(output).cloned().unwrap();
        let shot = |rendered: &Rendered| DrawnView {
            color: image(rendered, &Output::Color),
            depth: image(rendered, &Output::Depth),
            normal: image(&flat, &Output::Normal),
        };
        [shot(&flat), shot(&ewa)]
    }
}

/// What is drawn.
struct Case {
    name: String,
    clouds: Vec<Cloud>,
    scene: Scene,
    view: View,
    detail_px: f32,
}

impl Case {
    fn new(name: impl Into<String>, surfels: &Surfels, view: View) -> Self {
        let clouds = vec![surfels.cloud()];
        Self { name: name.into(), clouds, scene: Scene::default(), view, detail_px: 0.0 }
    }

    fn facts(&self) -> CloudFacts {
        let each = || self.clouds.iter().map(Cloud::facts);
        let mut columns: Vec<String> = each().flat_map(|facts| facts.columns.clone()).collect();
        columns.sort();
        columns.dedup();
        CloudFacts {
            n_surfels: each().map(|facts| facts.n_surfels).sum(),
            bounds_min: each().map(|facts| facts.bounds_min).fold(DVec3::INFINITY, DVec3::min),
            bounds_max: each().map(|facts| facts.bounds_max).fold(DVec3::NEG_INFINITY, DVec3::max),
            columns,
            ..CloudFacts::default()
        }
    }
}

fn render(
    engine: &mut Engine,
    renderer: &mut RendererView,
    case: &Case,
    outputs: &[Output],
) -> Rendered {
    render_with(engine, renderer, case, outputs, &Values::new())
}

fn render_with(
    engine: &mut Engine,
    renderer: &mut RendererView,
    case: &Case,
    outputs: &[Output],
    values: &Values,
) -> Rendered {
    let clouds: Vec<_> = case.clouds.iter().map(Cloud::view).collect();
    let request = RenderRequest {
        clouds: &clouds,
        facts: &case.facts(),
        scene: &case.scene,
        view: case.view,
        values,
        outputs,
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: case.detail_px,
        parts: None,
        eye_dome: None,
    };
    engine.render(renderer, &request).unwrap()
}

/// Pixels that may differ, as a share of those covered. Each of them is one in which rounding decides.
const MASKED: f64 = 0.005;

/// Holds all ways against quads.
fn check(cases: &[Case]) {
    let mut quads = Way::quads();
    let expected: Vec<_> = cases.iter().map(|case| quads.shots(case)).collect();
    let mut wrong = Vec::new();
    for mut way in Way::others() {
        for (case, expected) in cases.iter().zip(&expected) {
            let found = way.shots(case);
            for (kind, (a, b)) in ["nearest", "blended"].iter().zip(expected.iter().zip(&found)) {
                let drawn = Drawn {
                    clouds: &case.clouds,
                    scene: &case.scene,
                    view: &case.view,
                    blended: *kind == "blended",
                };
                let found = differences(&drawn, a, b);
                let told = format!("{}, {}, {kind}: {found:?}", way.name, case.name);
                println!("{told}");
                // The twin knows no merged surfels.
                let is_known = case.detail_px == 0.0;
                if found.share() > MASKED || is_known && !found.unexplained.is_empty() {
                    wrong.push(told);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn ahead(distance: f64) -> View {
    stage::view(DVec3::new(0.2, 0.3, distance), DVec3::ZERO, 256)
}

/// Invariant: quads, compute and processor draw the same; the pixels that differ, half a percent
/// at most, are those of which an f64 twin says that rounding decides: an edge within 1/256
/// pixel of their centre, or a depth as near to the limit of blending
#[test]
fn hard_views_agree() {
    let sphere = clouds::sphere(3000, 1.0);
    let mut cases = Vec::new();
    for (name, view) in stage::hard_views(&sphere.cloud(), 256) {
        cases.push(Case::new(name, &sphere, view));
        let mut parallel = view;
        parallel.camera.projection = Projection::Orthographic { height: 2.2 };
        cases.push(Case::new(format!("{name}, parallel"), &sphere, parallel));
    }
    // The eye is nearer to some discs than their radius: they reach behind the near plane.
    let among = stage::view(DVec3::new(0.0, 0.0, 0.999), DVec3::new(1.0, 0.2, 0.9), 256);
    cases.push(Case::new("among", &sphere, among));
    check(&cases);
}

#[test]
fn discs_of_all_sizes_agree() {
    let mut cases = Vec::new();
    for (n, distance) in [(50, 3.0), (200, 1.6), (1000, 3.0), (60_000, 3.0), (60_000, 40.0)] {
        let sphere = clouds::sphere(n, 1.0);
        cases.push(Case::new(format!("{n} at {distance}"), &sphere, ahead(distance)));
    }
    // Small and large ones in one picture, through each other.
    let mut mixed = clouds::sphere(5000, 1.0);
    let large = clouds::sphere(20, 1.02);
    mixed.positions.extend(large.positions);
    mixed.normals.extend(large.normals);
    mixed.radii.extend(large.radii.iter().map(|radius| 0.3 * radius));
    mixed.colors.extend(large.colors);
    cases.push(Case::new("mixed", &mixed, ahead(3.0)));
    check(&cases);
}

#[test]
fn all_columns_agree() {
    let mut full = clouds::sphere(4000, 1.0);
    full.ao = (0..full.positions.len()).map(|i| (i % 7) as f32 / 6.0).collect();
    full.materials = (0..full.positions.len()).map(|i| (i % 3) as u32).collect();
    let bare = Surfels { colors: Vec::new(), ..clouds::sphere(4000, 1.0) };
    let shade = Surfels { ao: full.ao.clone(), ..bare.clone() };
    let grazing = stage::view(DVec3::new(0.0, 0.05, 1.6), DVec3::ZERO, 256);
    let mut moved = clouds::sphere(2000, 0.6);
    moved.origin = DVec3::new(0.5, 0.4, 0.3);
    let mut two = Case::new("two clouds", &full, ahead(3.0));
    two.clouds.push(moved.cloud());
    check(&[
        Case::new("colours, accessibility, materials", &full, ahead(3.0)),
        Case::new("no colours", &bare, ahead(3.0)),
        Case::new("accessibility alone", &shade, ahead(3.0)),
        Case::new("ellipses", &clouds::sphere(3000, 1.0).elliptical(0.1), ahead(3.0)),
        Case::new("grazing ellipses", &clouds::sphere(3000, 1.0).elliptical(0.1), grazing),
        Case::new("grazing plane", &clouds::plane(40, 1.0), grazing),
        two,
    ]);
}

#[test]
fn all_settings_agree() {
    let sphere = clouds::sphere(3000, 1.0);
    let inside = stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 256);
    let mut cases = Vec::new();
    for (name, two_sided, depth_tolerance, low_pass, view) in [
        ("one-sided", false, 1.0, 1.0, ahead(3.0)),
        ("one-sided, inside", false, 1.0, 1.0, inside),
        ("no tolerance", true, 0.0, 1.0, ahead(3.0)),
        ("no low-pass", true, 1.0, 0.0, ahead(3.0)),
        ("neither", true, 0.0, 0.0, ahead(3.0)),
        ("no low-pass, far", true, 1.0, 0.0, ahead(30.0)),
        ("wide low-pass", true, 4.0, 4.0, ahead(3.0)),
    ] {
        let mut case = Case::new(name, &sphere, view);
        case.scene.surface.two_sided = two_sided;
        case.scene.surface.depth_tolerance = depth_tolerance;
        case.scene.surface.low_pass = low_pass;
        cases.push(case);
    }
    check(&cases);
}

/// Invariant: round splats face the eye in all ways to draw, whatever their normals and the sides that are drawn
#[test]
fn round_splats_agree() {
    let mut some = clouds::sphere(3000, 1.0);
    some.round = (0..3000).map(|i| u8::from(i % 3 == 0) * 7).collect();
    let mut all = clouds::sphere(400, 1.0);
    all.round = vec![1; 400];
    all.radii.fill(0.04);
    // Half of them are turned away, and would not be drawn as discs.
    all.normals.iter_mut().for_each(|normal| *normal = Vec3::X);
    let mut parallel = ahead(3.0);
    parallel.camera.projection = Projection::Orthographic { height: 2.2 };
    let inside = stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 256);
    let mut several = all.clone();
    (0..400).for_each(|i| several.radii[i] *= 0.5 + (i % 5) as f32);
    let mut unbounded = all.clone();
    unbounded.round = vec![columns::ROUND_UNBOUNDED; 400];
    let mut several_unbounded = several.clone();
    several_unbounded.round.clone_from(&unbounded.round);
    let mut larger = Case::new("all, twice as large, inside", &several, inside);
    larger.scene.surface.radius_scale = 2.0;
    let mut one_sided = Case::new("all, one-sided", &all, ahead(3.0));
    one_sided.scene.surface.two_sided = false;
    check(&[
        Case::new("some", &some, ahead(3.0)),
        Case::new("some, parallel", &some, parallel),
        Case::new("some, inside", &some, inside),
        Case::new("all", &all, ahead(3.0)),
        Case::new("all, inside", &all, inside),
        Case::new("all, of several radii, inside", &several, inside),
        Case::new("all, as large as they are, inside", &unbounded, inside),
        Case::new("several of them, as large as they are, inside", &several_unbounded, inside),
        one_sided,
        larger,
    ]);
}

#[test]
fn equal_discs_agree() {
    // Of discs at one place the first is the nearest, and all of them are added up.
    let mut surfels = Surfels::default();
    for i in 0..300u32 {
        surfels.push(Vec3::ZERO, Vec3::Z, 0.05);
        surfels.push(Vec3::X * 0.8, Vec3::Z, 0.7);
        surfels.colors.extend([[(i % 256) as u8, 40, 200]; 2]);
    }
    check(&[Case::new("equal discs", &surfels, ahead(3.0))]);
}

/// All ways merge the same surfels.
///
/// Invariant: all ways to draw merge the same surfels, in chunks of any size
#[test]
fn merged_surfels_agree() {
    let fine = clouds::wavy_sphere(60_000);
    let mut full = clouds::sphere(40_000, 1.0);
    full.ao = (0..full.positions.len()).map(|i| (i % 7) as f32 / 6.0).collect();
    full.materials = (0..full.positions.len()).map(|i| (i / 8000) as u32).collect();
    let mut round = clouds::sphere(20_000, 1.0);
    round.round = (0..20_000).map(|i| u8::from(i / 1000 % 2 == 0)).collect();
    // Larger than what bounds those that stand for one.
    let mut all_round = clouds::sphere(20_000, 1.0);
    all_round.round = vec![1; 20_000];
    let near = stage::view(DVec3::new(0.2, 0.3, 1.5), DVec3::ZERO, 64);
    let grazing = stage::view(DVec3::new(0.0, 0.05, 1.6), DVec3::ZERO, 64);
    let far = stage::view(DVec3::new(0.2, 0.3, 3.0), DVec3::ZERO, 48);
    let case = |name: &str, cloud: Cloud, view, detail_px| {
        let clouds = vec![cloud];
        Case { name: name.to_owned(), clouds, scene: Scene::default(), view, detail_px }
    };
    let mut two = case("two clouds", full.cloud(), far, 2.0);
    two.clouds.push(fine.clone());
    check(&[
        case("colours", fine, far, 1.0),
        case("all columns", full.cloud(), far, 4.0),
        case("grazing", full.cloud(), grazing, 1.5),
        case("round splats", round.cloud(), far, 4.0),
        case("round splats from near", all_round.cloud(), near, 8.0),
        case("ellipses", clouds::sphere(20_000, 1.0).elliptical(0.3).cloud(), far, 4.0),
        two,
    ]);
}

#[test]
fn nothing_and_next_to_nothing_are_drawn() {
    let mut single = Surfels::default();
    single.push(Vec3::ZERO, Vec3::Z, 0.01);
    check(&[
        Case::new("nothing", &Surfels::default(), ahead(3.0)),
        Case::new("a single one", &single, ahead(3.0)),
    ]);
}

#[test]
fn dots_far_below_a_pixel_agree() {
    // They hardly overlap, so that each is most of its pixels' sums.
    let mut sparse = clouds::sphere(3000, 1.0);
    sparse.radii.fill(0.001);
    check(&[Case::new("sparse", &sparse, ahead(3.0))]);
}

fn names(rendered: &Rendered) -> Vec<&str> {
    rendered.passes.iter().map(|pass| pass.name.as_str()).collect()
}

#[test]
fn passes_say_which_way_was_taken() {
    let case = Case::new("sphere", &clouds::sphere(3000, 1.0), ahead(3.0));
    let [mut wide, mut narrow, _] = Way::others();
    let rendered = render(&mut wide.engine, &mut wide.ewa, &case, &[Output::Color]);
    if wide.engine.gpu().atomics != Atomics::Only32 {
        assert!(names(&rendered).contains(&"surfels: compute visibility"), "{rendered:?}");
    }
    assert!(names(&rendered).contains(&"surfels: compute accumulate"));
    let rendered = render(&mut narrow.engine, &mut narrow.ewa, &case, &[Output::Color]);
    for step in ["distances", "numbers"] {
        let name = format!("surfels: compute visibility, {step}");
        assert!(names(&rendered).contains(&name.as_str()), "{name}: {:?}", names(&rendered));
    }
}

#[test]
fn compute_gives_the_same_bits_again() {
    // Integers add up to the same in any order, and large discs are drawn in theirs.
    let mut mixed = clouds::sphere(20_000, 1.0);
    for i in (0..mixed.radii.len()).step_by(50) {
        mixed.radii[i] *= 12.0;
    }
    let case = Case::new("mixed", &mixed, ahead(2.0));
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    let options = EngineOptions { surfels: SurfelDrawing::Compute, ..EngineOptions::default() };
    let [vulkan, ..] = Way::others();
    for mut way in [vulkan, Way::on("OpenGL", &gpu, options)] {
        let mut first: Vec<u32> = Vec::new();
        // Also where another renderer has found the nearest surfels of the view before.
        for (i, after_another) in [false, true].into_iter().cycle().take(24).enumerate() {
            way.engine.forget_surfaces();
            if after_another {
                render(&mut way.engine, &mut way.flat, &case, &[Output::Color]);
            }
            let rendered = render(&mut way.engine, &mut way.ewa, &case, &[Output::Color]);
            let bits = rendered.images[0].1.data.iter().map(|value| value.to_bits()).collect();
            if i == 0 {
                first = bits;
            } else {
                assert!(bits == first, "{}: frame {i} is another", way.name);
            }
        }
    }
}

#[test]
fn surfels_shaded_one_by_one_are_drawn_as_quads() {
    let case = Case::new("sphere", &clouds::sphere(3000, 1.0), ahead(3.0));
    let values: Values = [("shading".to_owned(), Value::Text("surfel".to_owned()))].into();
    let pictures: Vec<Image> =
        [Way::quads().engine, Way::others().into_iter().next().unwrap().engine]
            .into_iter()
            .map(|mut engine| {
                let mut renderer =
                    stage::built_renderer(&engine, "surfelshop-environment", "environment");
                let outputs = [Output::Color];
                let mut rendered =
                    render_with(&mut engine, &mut renderer, &case, &outputs, &values);
                assert!(names(&rendered).contains(&"surfels: records"), "{:?}", names(&rendered));
                rendered.images.remove(0).1
            })
            .collect();
    assert!(pictures[0].data == pictures[1].data);
}

/// What is drawn, moved and read back is only what holds surfels, in textures that held other frames.
#[test]
fn a_frame_shows_nothing_of_those_before_it() {
    let sphere = clouds::sphere(500, 0.4);
    let aside = |x: f64, y: f64| stage::view(DVec3::new(x, y, 3.0), DVec3::new(x, y, 0.0), 200);
    let away = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 9.0), 200);
    let smaller = stage::view(DVec3::new(0.5, 0.0, 3.0), DVec3::new(0.5, 0.0, 0.0), 72);
    let views =
        [aside(0.9, 0.8), aside(-0.9, 0.3), away, aside(0.0, -0.9), smaller, aside(0.9, 0.0)];
    let new = || Way::new("processor", SurfelDrawing::Processor, EngineOptions::default());
    let mut used = new();
    let mut covered = Vec::new();
    // Twice: what the first turn leaves is used again in the second.
    for view in views.iter().chain(&views) {
        let case = Case::new("moved", &sphere, *view);
        used.engine.forget_surfaces();
        let (found, fresh) = (used.shots(&case), new().shots(&case));
        for (found, fresh) in found.iter().zip(&fresh) {
            assert!(found.color.data == fresh.color.data, "color");
            assert!(found.depth.data == fresh.depth.data, "depth");
            assert!(found.normal.data == fresh.normal.data, "normal");
        }
        covered.push(found[1].color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count());
    }
    assert!(covered[2] == 0 && covered[0] > 500 && covered[3] > 500, "{covered:?}");
}

#[test]
fn opengl_computes_what_vulkan_computes() {
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    let options = EngineOptions { surfels: SurfelDrawing::Compute, ..EngineOptions::default() };
    let mut opengl = Way::on("OpenGL", &gpu, options);
    let [mut vulkan, ..] = Way::others();
    let sphere = clouds::sphere(5000, 1.0);
    let grazing = stage::view(DVec3::new(0.0, 0.05, 1.6), DVec3::ZERO, 256);
    let mut cases = vec![
        Case::new("front", &sphere, ahead(3.0)),
        Case::new("large", &clouds::sphere(200, 1.0), ahead(1.6)),
        Case::new("inside", &sphere, stage::view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, 256)),
        Case::new("grazing", &clouds::sphere(2000, 1.0).elliptical(0.1), grazing),
    ];
    let mut parallel = ahead(3.0);
    parallel.camera.projection = Projection::Orthographic { height: 2.2 };
    // Parallel depth is spread evenly up to `far`, so the range decides its resolution.
    parallel.far = 10.0;
    cases.push(Case::new("parallel", &sphere, parallel));
    for case in &cases {
        let both = vulkan.shots(case).into_iter().zip(opengl.shots(case));
        for (kind, (a, b)) in ["nearest", "blended"].iter().zip(both) {
            let levels = |shot: &DrawnView| -> Vec<u8> {
                use surfelshop_image::display_transform::{DisplayTransform, develop, to_8_bit};
                to_8_bit(&develop(&shot.color, &DisplayTransform::default()))
            };
            let (a, b) = (levels(&a), levels(&b));
            let pairs = a.chunks_exact(4).zip(b.chunks_exact(4));
            let differs =
                |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2);
            let covered = a.chunks_exact(4).filter(|pixel| pixel[3] > 0).count();
            let n = pairs.filter(differs).count();
            assert!(n * 100 < covered, "{} {kind}: {n} of {covered} pixels differ", case.name);
        }
    }
}
