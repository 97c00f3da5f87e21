//! What a scene does not need is left out, and that changes no bit of a picture.

use glam::{DVec3, Vec3};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Light, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, RenderRequest, Rendered, RendererView, Restored,
    SurfelDrawing,
};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::materials::Materials;
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::stage;

const N: usize = 1500;
const OUTPUTS: [Output; 1] = [Output::Color];

surfelshop_api::static_plugin! { id: "org.surfelshop.test.leaving-out", renderers: [Materials] }

fn view() -> View {
    stage::view(DVec3::new(0.4, 0.7, 3.0), DVec3::ZERO, 64)
}

fn drawing(surfels: SurfelDrawing) -> Engine {
    stage::engine_with(
        &GpuOptions::default(),
        // As on a graphics card.
        &EngineOptions { surfels, constant_radii: Some(true), ..EngineOptions::default() },
    )
}

/// What is drawn.
struct AblationImage {
    cloud: Cloud,
    scene: Scene,
    values: Values,
    probe: Option<Probe>,
    outputs: Vec<Output>,
}

impl AblationImage {
    fn new(surfels: &Surfels) -> Self {
        Self {
            cloud: surfels.cloud(),
            scene: Scene::default(),
            values: Values::new(),
            probe: None,
            outputs: OUTPUTS.to_vec(),
        }
    }

    fn with(mut self, values: &[(&str, Value)]) -> Self {
        self.values = values.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect();
        self
    }

    fn lit_by(mut self, lights: Vec<Light>) -> Self {
        self.scene.lights = lights;
        self
    }

    fn under(mut self, probe: Probe) -> Self {
        self.probe = Some(probe);
        self
    }

    fn draw(&self, engine: &mut Engine, renderer: &mut RendererView) -> (Rendered, Vec<Restored>) {
        let environment = self.probe.as_ref().map(around);
        let given = self.probe.as_ref().zip(environment.as_ref());
        let clouds = [self.cloud.view()];
        let request = RenderRequest {
            clouds: &clouds,
            facts: self.cloud.facts(),
            scene: &self.scene,
            view: view(),
            environment: given.map(|(probe, environment)| view_of(environment, probe)),
            values: &self.values,
            outputs: &self.outputs,
            frame_index: 0,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        let rendered = engine.render(renderer, &request).unwrap();
        (rendered, engine.left_out(renderer, &request))
    }
}

fn bits(rendered: &Rendered) -> Vec<u32> {
    let image = rendered.image(&Output::Color).unwrap();
    image.data.iter().map(|value| value.to_bits()).collect()
}

/// How far pictures with a feature and without it lie apart at most on graphics cards, whose compilers
/// contract and reorder sums as they like, as a share of the brightest value.
/// Source: sums of at most 64 terms, each of them rounded by half a unit in the last place.
const ROUNDING: f32 = 32.0 * f32::EPSILON;

/// Whether two pictures are the same but for rounding; not where a value is NaN.
fn differ_by_rounding(one: &Rendered, other: &Rendered) -> bool {
    let [one, other] = [one, other].map(|rendered| &rendered.image(&Output::Color).unwrap().data);
    let bound = ROUNDING * one.iter().fold(0.0f32, |most, v| most.max(v.abs()));
    one.iter().zip(other).all(|(a, b)| (a - b).abs() <= bound)
}

fn bare() -> Surfels {
    Surfels { colors: Vec::new(), ..clouds::sphere(N, 1.0) }
}

fn full() -> Surfels {
    let mut surfels = clouds::sphere(N, 1.0);
    surfels.ao = (0..N).map(|i| (i % 7) as f32 / 8.0).collect();
    surfels.materials = (0..N).map(|i| (i % 3) as u32).collect();
    for (i, radius) in surfels.radii.iter_mut().enumerate() {
        *radius *= 1.0 + (i % 5) as f32 / 10.0;
    }
    surfels
}

fn number(value: f64) -> Value {
    Value::Float(value)
}

/// Each built-in renderer over clouds that lack everything and nothing, with parameters that need little:
/// whatever is left out is put back, one after the other, and nothing changes.
///
/// Invariant: what is left out changes no bit of a picture where it is put back, on graphics cards nothing but
/// rounding, for every built-in renderer and way to draw
#[test]
fn what_is_left_out_changes_no_bit_where_it_is_kept() {
    let zero = |ids: &[&'static str]| -> Vec<(&'static str, Value)> {
        ids.iter().map(|id| (*id, number(0.0))).collect()
    };
    let text = |value: &str| Value::Text(value.to_owned());
    let thesis = [zero(&["specular", "own-color"]), vec![("lighting", text("thesis"))]].concat();
    let phong = [zero(&["specular", "ao-strength"]), vec![("lighting", text("phong"))]].concat();
    let lamp = Light::Directional {
        towards: DVec3::new(1.0, 1.0, 1.0),
        radiance: Vec3::ONE,
        follows_camera: false,
    };
    let mut lit = AblationImage::new(&full()).under(Probe::sky());
    lit.scene.lights.push(lamp);
    let cases: Vec<(&str, &str, AblationImage)> = vec![
        ("surfelshop_flat", "flat", AblationImage::new(&bare())),
        ("surfelshop_flat", "flat", AblationImage::new(&full()).with(&zero(&["ao-strength"]))),
        (
            "surfelshop_ewa_phong",
            "ewa-phong",
            AblationImage::new(&bare()).with(&zero(&["specular"])),
        ),
        ("surfelshop_ewa_phong", "ewa-phong", AblationImage::new(&full())),
        (
            "surfelshop_environment",
            "environment",
            AblationImage::new(&bare()).under(Probe::studio()),
        ),
        ("surfelshop_environment", "environment", AblationImage::new(&full()).under(Probe::sky())),
        ("surfelshop_environment", "environment", lit),
        ("surfelshop_environment", "environment", AblationImage::new(&bare())),
        ("surfelshop_procedural", "procedural", AblationImage::new(&full()).with(&thesis)),
        ("surfelshop_procedural", "procedural", AblationImage::new(&full()).with(&phong)),
    ];
    let mut seen = BTreeSet::new();
    for surfels in [SurfelDrawing::Quads, SurfelDrawing::Compute, SurfelDrawing::Processor] {
        for (library, unit, shot) in &cases {
            let mut engine = drawing(surfels);
            let mut renderer = stage::built_renderer(&engine, library, unit);
            let (without, left_out) = shot.draw(&mut engine, &mut renderer);
            assert!(bits(&without).iter().any(|bits| *bits != 0), "{unit} draws something");
            for kept in left_out {
                engine.keep(vec![kept.clone()]);
                let (with, still) = shot.draw(&mut engine, &mut renderer);
                let same = match engine.gpu().is_software() {
                    true => bits(&without) == bits(&with),
                    false => differ_by_rounding(&without, &with),
                };
                assert!(same, "{unit}, {surfels:?}: {kept}");
                // A column of our own is not the cloud's, so that it is lacking all the same.
                let is_column = matches!(kept, Restored::Column(_) | Restored::Output(_));
                assert!(is_column || !still.contains(&kept), "{unit}: {kept} was not kept");
                seen.insert(kept.to_string());
            }
            engine.keep(Vec::new());
            let (again, _) = shot.draw(&mut engine, &mut renderer);
            assert!(bits(&without) == bits(&again), "{unit}: as before");
        }
    }
    let expected = [
        "a radius for each surfel",
        "column ao",
        "column color",
        "column material",
        "feature procedural::shown::OWN_COLOR",
        "feature shading::natural::HAS_BAND_4",
        "feature shading::natural::HAS_LIGHTS",
        "feature shading::natural::HAS_SUN",
        "feature surfelshop::occlusion::COUNTS",
        "feature surfelshop::phong::HIGHLIGHTS",
        "output albedo",
        "output ao",
        "output depth",
        "output normal",
    ];
    assert_eq!(seen.iter().map(String::as_str).collect::<Vec<_>>(), expected);
}

/// A probe that gives no light changes nothing of what lights show, and as a background covers what is
/// empty with black.
#[test]
fn a_black_probe_is_no_probe() {
    let mut without = AblationImage::new(&full());
    without.scene.lights = vec![Light::Directional {
        towards: DVec3::new(0.3, 1.0, 0.6),
        radiance: Vec3::ONE,
        follows_camera: false,
    }];
    let black = || Probe::constant([0.0; 3]);
    let matte = [("ks", number(0.0))];
    let mut engine = drawing(SurfelDrawing::Processor);
    let mut draw = |shot: &AblationImage| {
        let mut renderer = stage::built_renderer(&engine, "surfelshop_environment", "environment");
        let (rendered, _) = shot.draw(&mut engine, &mut renderer);
        (rendered.image(&Output::Color).unwrap().clone(), rendered.graph_bytes)
    };
    let shot = |more: &[(&str, Value)]| {
        let shot = AblationImage { scene: without.scene.clone(), ..AblationImage::new(&full()) };
        shot.with(&[&matte[..], more].concat())
    };
    let (plain, _) = draw(&shot(&[]));
    let (dark, _) = draw(&shot(&[]).under(black()));
    assert!(plain == dark, "light from nowhere is no light");
    let behind = [("background", Value::Text("sharp".to_owned()))];
    let (backed, _) = draw(&shot(&behind).under(black()));
    for (expected, found) in plain.data.chunks(4).zip(backed.data.chunks(4)) {
        assert_eq!(expected[..3], found[..3], "black behind is nothing behind");
        assert_eq!(found[3], 1.0, "and it covers");
    }
}

/// Estimated normals and radii, given as columns, are the same picture.
#[test]
fn normals_that_are_given_are_those_that_were_estimated() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bare.ply");
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {N}\nproperty float x\nproperty float y\n\
         property float z\nend_header\n"
    );
    for p in &clouds::sphere(N, 1.0).positions {
        text.push_str(&format!("{} {} {}\n", p[0], p[1], p[2]));
    }
    std::fs::write(&file, text).unwrap();
    let estimated = surfelshop_cloud::read(&file, &Default::default()).unwrap();
    assert_eq!(estimated.summary.normals.estimated, N as u64);
    let given = folder.path().join("given.ply");
    surfelshop_cloud::write(&given, &estimated.cloud, &Default::default()).unwrap();
    let given = surfelshop_cloud::read(&given, &Default::default()).unwrap();
    assert_eq!(given.summary.normals.estimated, 0);
    let mut engine = drawing(SurfelDrawing::Quads);
    let mut draw = |cloud: &Cloud| {
        let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let shot = AblationImage { cloud: cloud.clone(), ..AblationImage::new(&bare()) };
        bits(&shot.draw(&mut engine, &mut renderer).0)
    };
    assert!(draw(&estimated.cloud) == draw(&given.cloud), "the same picture");
}

/// Columns are there as long as something that is drawn reads them.
///
/// Invariant: columns are where surfels are drawn as long as something reads them
#[test]
fn columns_come_with_what_reads_them_and_go_with_it() {
    for surfels in [SurfelDrawing::Quads, SurfelDrawing::Processor] {
        let mut engine = drawing(surfels);
        let mut phong = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let mut materials = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
        let cloud = full().cloud();
        let shot = || AblationImage { cloud: cloud.clone(), ..AblationImage::new(&full()) };
        let mut bytes_each = |renderer: &mut RendererView, shot: &AblationImage| {
            shot.draw(&mut engine, renderer);
            let counters = engine.counters();
            let bytes = counters.column_bytes + counters.host_column_bytes;
            // Groups of sixteen and blocks are the CPU's own.
            (bytes / N as u64, counters.uploads)
        };
        let depth = AblationImage { outputs: vec![Output::Depth], ..shot() };
        let (least, uploads) = bytes_each(&mut phong, &depth);
        assert!((28..30).contains(&least), "{least}: positions, normals and radii alone");
        let without_ao = shot().with(&[("ao-strength", number(0.0))]);
        let (colored, _) = bytes_each(&mut phong, &without_ao);
        assert_eq!(colored, least + 4, "colours besides");
        let (all, _) = bytes_each(&mut phong, &shot());
        assert_eq!(all, least + 8, "accessibility besides");
        let (_, before) = bytes_each(&mut phong, &shot());
        let (_, after) = bytes_each(&mut phong, &shot());
        assert_eq!(before, after, "and nothing is brought twice");
        let (marked, _) = bytes_each(&mut materials, &shot());
        assert_eq!(marked, all + 4, "materials besides; what others read stays");
        // Nothing but depth for a while.
        let last = (0..70).map(|_| bytes_each(&mut phong, &depth)).last().unwrap();
        if surfels == SurfelDrawing::Quads {
            assert!(last.0 <= least + 4, "{last:?}: colours and accessibility went");
            assert_eq!(last.1, uploads + 3, "and nothing was brought anew");
        } else {
            assert_eq!(last.0, least, "colours, accessibility and materials went");
        }
    }
}

/// While the shader for what a scene has is compiled, one that has more draws the same picture.
#[test]
fn a_shader_with_more_stands_in_while_its_own_is_compiled() {
    // Lights of which the shader has code for all there is: the first that is made is then the one that
    // stands in for all, and nothing else is made beside.
    let image = || {
        let lamp =
            |x| Light::Point { position: DVec3::new(x, 2.0, 2.0), intensity: Vec3::splat(4.0) };
        AblationImage::new(&full()).lit_by(vec![lamp(-2.0), lamp(2.0)])
    };
    let mut engine = drawing(SurfelDrawing::Processor);
    engine.compile_beside(true);
    let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
    let shining = image();
    shining.draw(&mut engine, &mut renderer);
    let first = engine.counters().compiled.pipelines;
    let matte = image().with(&[("specular", number(0.0))]);
    let (stood_in, _) = matte.draw(&mut engine, &mut renderer);
    let started = Instant::now();
    while engine.counters().compiled.pipelines == first {
        assert!(started.elapsed() < Duration::from_secs(120), "its own never comes");
        std::thread::sleep(Duration::from_millis(10));
        // What has come is taken in when the pass is drawn.
        matte.draw(&mut engine, &mut renderer);
    }
    let (own, _) = matte.draw(&mut engine, &mut renderer);
    assert_eq!(engine.counters().compiled.pipelines, first + 1, "one is compiled, once");
    assert!(bits(&stood_in) == bits(&own), "the same picture");
    // The other way round what has everything is made as soon as there is anything.
    let mut engine = drawing(SurfelDrawing::Processor);
    engine.compile_beside(true);
    let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
    matte.draw(&mut engine, &mut renderer);
    let before = engine.counters().compiled.pipelines;
    let (shown, _) = shining.draw(&mut engine, &mut renderer);
    assert_eq!(engine.counters().compiled.pipelines, before + 1, "once, by whoever began");
    let without_ao = image().with(&[("ao-strength", number(0.0))]);
    without_ao.draw(&mut engine, &mut renderer);
    let stood_in = engine.counters().compiled.pipelines;
    assert!(stood_in <= before + 2, "{stood_in}: it waits for nothing");
    assert!(bits(&shown) != bits(&own), "highlights show");
}
