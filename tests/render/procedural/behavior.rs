//! How the renderer and the tool behave: what they bind, what they say, and that patterns stay where
//! they are.

use glam::{DQuat, DVec3, Vec3};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, CloudFacts, ObjectFrame, Projection, Scene, View};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_cloud::{Cloud, Rotation, Transform};
use surfelshop_render::{
    Backend, Engine, EngineOptions, GpuOptions, PassState, RenderError, RenderRequest, Rendered,
    RendererView,
};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::procedural::patterns::{ALL, Settings};
use surfelshop_tests::procedural::{Bench, Spot};
use surfelshop_tests::stage;

struct Lab {
    engine: Engine,
    renderer: RendererView,
    scene: Scene,
}

fn values(pairs: &[(&str, Value)]) -> Values {
    pairs.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

/// Facts of clouds that are shown together, as far as patterns ask for them.
fn facts(clouds: &[&Cloud]) -> CloudFacts {
    let each = || clouds.iter().map(|cloud| cloud.facts());
    CloudFacts {
        n_surfels: each().map(|facts| facts.n_surfels).sum(),
        bounds_min: each().map(|facts| facts.bounds_min).fold(DVec3::INFINITY, DVec3::min),
        bounds_max: each().map(|facts| facts.bounds_max).fold(DVec3::NEG_INFINITY, DVec3::max),
        columns: each().flat_map(|facts| facts.columns.clone()).collect(),
        objects: each().flat_map(|facts| facts.objects.clone()).collect(),
        colored: each().flat_map(|facts| facts.colored.clone()).collect(),
        ..CloudFacts::default()
    }
}

impl Lab {
    fn new() -> Self {
        let engine = stage::fresh_engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-procedural", "procedural");
        Self { engine, renderer, scene: Scene::default() }
    }

    fn frame(
        &mut self,
        clouds: &[&Cloud],
        view: View,
        values: &Values,
        probe: Option<&Probe>,
    ) -> Result<Rendered, RenderError> {
        let views: Vec<_> = clouds.iter().map(|cloud| cloud.view()).collect();
        let environment = probe.map(around);
        let request = RenderRequest {
            clouds: &views,
            facts: &facts(clouds),
            scene: &self.scene,
            view,
            values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: probe
                .zip(environment.as_ref())
                .map(|(probe, environment)| view_of(environment, probe)),
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        self.engine.render(&mut self.renderer, &request)
    }

    fn pixels(&mut self, clouds: &[&Cloud], view: View, values: &Values) -> Vec<[f32; 4]> {
        let rendered = self.frame(clouds, view, values, None).unwrap();
        rendered.image(&Output::Color).unwrap().data.as_chunks::<4>().0.to_vec()
    }
}

fn ran(frame: &Rendered, state: PassState) -> Vec<&str> {
    let passes = frame.passes.iter().filter(|pass| pass.state == state);
    passes.map(|pass| pass.name.as_str()).filter(|name| !name.starts_with("surfels:")).collect()
}

/// A sphere about the origin without colours.
fn sphere(n: usize, radius: f32) -> Cloud {
    Surfels { colors: Vec::new(), ..clouds::sphere(n, radius) }.cloud()
}

fn front() -> View {
    stage::view(DVec3::new(0.3, 0.4, 3.0), DVec3::ZERO, 64)
}

#[test]
fn what_a_frame_does_not_need_is_left_out() {
    let mut lab = Lab::new();
    let sphere = sphere(3000, 1.0);
    let probe = Probe::studio();
    let plain = lab.frame(&[&sphere], front(), &Values::new(), Some(&probe)).unwrap();
    assert_eq!(ran(&plain, PassState::Ran), ["procedural"]);
    assert_eq!(lab.engine.counters().environments, 0, "thesis lighting has no environment");
    let has = |frame: &Rendered, name: &str| frame.passes.iter().any(|pass| pass.name == name);
    assert!(!has(&plain, "surfels: object"), "one cloud needs no picture of clouds");
    let natural = values(&[("lighting", text("natural"))]);
    let lit = lab.frame(&[&sphere], front(), &natural, Some(&probe)).unwrap();
    assert!(ran(&lit, PassState::Ran).iter().any(|name| name.starts_with("prefilter")));
    let unlit = lab.frame(&[&sphere], front(), &natural, None).unwrap();
    assert_eq!(ran(&unlit, PassState::Ran), ["procedural"]);
}

#[test]
fn the_volume_is_filled_once() {
    let mut lab = Lab::new();
    let sphere = sphere(3000, 1.0);
    let volume = |size: i64, seed: i64, frequency: f64| {
        values(&[
            ("noise", text("volume")),
            ("volume-size", Value::Int(size)),
            ("seed", Value::Int(seed)),
            ("frequency", Value::Float(frequency)),
        ])
    };
    let mut frame = |size, seed, frequency| {
        let rendered =
            lab.frame(&[&sphere], front(), &volume(size, seed, frequency), None).unwrap();
        let count = |state| {
            let passes = ran(&rendered, state);
            passes.iter().filter(|name| name.starts_with("noise volume")).count()
        };
        (count(PassState::Ran), count(PassState::Reused))
    };
    assert_eq!(frame(32, 0, 4.0), (6, 0), "levels of 32 texels");
    assert_eq!(frame(32, 0, 9.0), (0, 6), "another frequency is the same volume");
    assert_eq!(frame(33, 0, 9.0), (0, 6), "sizes are powers of two");
    assert_eq!(frame(32, 1, 9.0), (6, 0), "another seed");
    assert_eq!(frame(64, 0, 9.0), (7, 0), "another size");
    assert_eq!(frame(32, 0, 4.0), (0, 6), "the first is still there");
}

/// Noise from a fine volume is the computed noise but for interpolation: with 16 texels a cell the
/// largest error of a linear interpolation, an eighth of the second derivative times the square of
/// a texel, is near 1 % of the noise's range. What repeats after 16 cells is not asked for here.
#[test]
fn the_volume_holds_the_same_noise() {
    let mut lab = Lab::new();
    let sphere = sphere(3000, 1.0);
    let settings = Settings { frequency: 4.0, octaves: 1, ..Settings::default() };
    let mut pictures = ["computed", "volume"].map(|noise| {
        let mut values = settings.values("simple-marble");
        values.insert("noise".to_owned(), text(noise));
        values.insert("volume-size".to_owned(), Value::Int(256));
        values.insert("lighting".to_owned(), text("none"));
        lab.pixels(&[&sphere], front(), &values)
    });
    let [a, b] = &mut pictures;
    let largest = a.iter().zip(b.iter()).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f32::max);
    assert!(largest < 0.05, "{largest}");
}

/// A scene moves, turns and scales a cloud, and the camera with it: nothing changes but rounding.
///
/// Invariant: patterns stay on a cloud that is moved, and each cloud of a scene has its own
#[test]
fn patterns_stay_on_a_cloud_that_is_moved() {
    let mut lab = Lab::new();
    // The directions of lights are the world's.
    lab.scene.lights.clear();
    let still = sphere(3000, 1.0);
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.4);
    let (scale, translation) = (3.0, DVec3::new(1e5, -2e4, 700.0));
    let transform = Transform { scale, translation, rotation: Rotation::Quaternion(turn) };
    let moved = still.transformed(&transform).unwrap();
    let object = moved.facts().objects[0];
    assert!((object.center - translation).length() < 0.1 && (object.size - 6.0).abs() < 0.1);
    let camera = front().camera;
    let place = |p: DVec3| turn * (p * scale) + translation;
    let view = View {
        camera: Camera {
            eye: place(camera.eye),
            target: place(camera.target),
            up: turn * camera.up,
            projection: Projection::Perspective { fov_y: 0.8 },
        },
        ..front()
    };
    for pattern in ALL {
        let values = values(&[("pattern", text(pattern)), ("lighting", text("none"))]);
        let a = lab.pixels(&[&still], front(), &values);
        let b = lab.pixels(&[&moved], view, &values);
        let differ = |(a, b): &(&[f32; 4], &[f32; 4])| (0..4).any(|c| (a[c] - b[c]).abs() > 0.02);
        let n = a.iter().zip(&b).filter(differ).count();
        // Pixels on edges of discs may fall to another one.
        let covered = a.iter().filter(|pixel| pixel[3] > 0.0).count();
        assert!(covered > 500 && n * 100 <= covered, "{pattern}: {n} of {covered}");
    }
}

/// Two clouds have two boxes: each looks as it does alone.
#[test]
fn each_cloud_of_a_scene_has_its_own_box() {
    let mut lab = Lab::new();
    let left = sphere(3000, 0.5);
    let shift = |x: f64, cloud: &Cloud| {
        let translation = DVec3::new(x, 0.0, 0.0);
        cloud.transformed(&Transform { translation, ..Transform::default() }).unwrap()
    };
    // One with colours, one without.
    let right = shift(0.6, &clouds::sphere(2000, 0.3).cloud());
    let left = shift(-0.5, &left);
    let values = values(&[("pattern", text("checker")), ("lighting", text("none"))]);
    let alone = [&left, &right].map(|cloud| lab.pixels(&[cloud], front(), &values));
    let both = lab.pixels(&[&left, &right], front(), &values);
    let covered = |pixel: &[f32; 4]| pixel[3] > 0.0;
    let mut seen = [0, 0];
    for (i, pixel) in both.iter().enumerate() {
        for (which, alone) in alone.iter().enumerate() {
            if covered(&alone[i]) {
                assert_eq!(*pixel, alone[i]);
                seen[which] += 1;
            }
        }
    }
    assert!(seen.iter().all(|n| *n > 50), "{seen:?}");
}

/// The checker's answer is known: cubes of the box's eighths, light where the sum of their numbers is
/// even.
#[test]
fn the_checker_is_a_checker() {
    let mut bench = Bench::new(&GpuOptions::default());
    let object = ObjectFrame { center: DVec3::splat(4.0), size: 8.0, ..ObjectFrame::default() };
    let mut spots = Vec::new();
    for i in 0..512 {
        let cell = Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32);
        let offset = cell + Vec3::new(0.3, 0.5, 0.8);
        spots.push(Spot { offset, normal: Vec3::Z, radius: 1e-3, albedo: Vec3::ONE });
    }
    let settings = Settings { frequency: 8.0, ..Settings::default() };
    let colors = bench.colors(&spots, DVec3::ZERO, object, &settings.values("checker")).unwrap();
    for (spot, color) in spots.iter().zip(colors) {
        let even = spot.offset.floor().element_sum() as i32 % 2 == 0;
        let expected = if even { 0.8 } else { 0.05 };
        assert!((color - expected).abs().max_element() < 1e-5, "{spot:?}: {color}");
    }
}

#[test]
fn the_cloud_s_own_colours_and_their_share_count() {
    let mut bench = Bench::new(&GpuOptions::default());
    let albedo = Vec3::new(0.2, 0.5, 1.0);
    let spots = [Spot { offset: Vec3::ZERO, normal: Vec3::Z, radius: 0.01, albedo }];
    let mut color = |share: f64| {
        let mut values = Settings::default().values("granite");
        values.insert("own-color".to_owned(), Value::Float(share));
        bench.colors(&spots, DVec3::ZERO, ObjectFrame::default(), &values).unwrap()[0]
    };
    let (own, half, none) = (color(1.0), color(0.5), color(0.0));
    assert!((own - none * albedo.as_dvec3()).length() < 1e-6);
    assert!((half - 0.5 * (own + none)).length() < 1e-6);
}

fn own(folder: &Path, wgsl: &str) -> Values {
    let path = folder.join("mine.wgsl");
    std::fs::write(&path, wgsl).unwrap();
    values(&[("file", text(&path.display().to_string())), ("lighting", text("none"))])
}

#[test]
fn a_pattern_of_one_s_own_is_shown_and_its_changes_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let sphere = sphere(3000, 1.0);
    let pattern = |color: &str| {
        format!(
            "#import surfelshop::noise::Place\n#import procedural::pattern::Look\n\
             fn look(at: Place, albedo: vec3<f32>) -> Look {{\n\
             return Look({color}, 0.0, 1.0, 0.0);\n}}\n"
        )
    };
    let mut middle = |color: &str| {
        let values = own(folder.path(), &pattern(color));
        lab.pixels(&[&sphere], front(), &values)[32 * 64 + 32]
    };
    assert_eq!(middle("vec3(0.25, 0.5, 1.0)"), [0.25, 0.5, 1.0, 1.0]);
    assert_eq!(middle("albedo"), [1.0; 4], "clouds without colours are white");
    assert_eq!(middle("vec3(0.0)"), [0.0, 0.0, 0.0, 1.0]);
}

/// Invariant: what is wrong with a pattern is one line that names its file, and the next frame
/// is good
#[test]
fn what_is_wrong_with_a_pattern_is_said_in_one_line_and_the_next_frame_is_good() {
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let sphere = sphere(3000, 1.0);
    let head = "#import surfelshop::noise::Place\n#import procedural::pattern::Look\n";
    let body = |body: &str| {
        format!("{head}fn look(at: Place, albedo: vec3<f32>) -> Look {{\n{body}\n}}\n")
    };
    let good = body("return Look(albedo, 0.0, 1.0, 0.0);");
    for (wgsl, words) in [
        (String::new(), "expected `fn look(at: Place, albedo: vec3<f32>) -> Look`, found no such"),
        ("fn look(a: f32) -> f32 { return a; }".to_owned(), "found `fn look(a: f32) -> f32`"),
        (body("return Look(albido, 0.0, 1.0, 0.0);"), "mine.wgsl, line 4: no definition in scope"),
        (body("return Look(albedo, 0.0, 1.0, 0.0)"), "mine.wgsl, line 5: expected `;`"),
        (body("return Look(albedo, 0.0);"), "mine.wgsl"),
        (
            format!("var<uniform> mine: f32;\n{}", body("return Look(vec3(mine), 0.0, 1.0, 0.0);")),
            "mine.wgsl: `procedural::chosen::mine` (a uniform of 4 bytes) is not bound",
        ),
        (
            format!(
                "var<workgroup> ours: f32;\n{}",
                body("return Look(vec3(ours), 0.0, 1.0, 0.0);")
            ),
            "only compute passes have",
        ),
        (
            body(
                "var q: array<f32, 200000>; q[i32(albedo.x)] = 1.0; return Look(vec3(q[3]), 0.0, 1.0, 0.0);",
            ),
            "at most 65536 are compiled",
        ),
        (
            format!(
                "var<private> q: array<f32, 100000000>;\n{}",
                body("q[3] = 1.0; return Look(vec3(q[3]), 0.0, 1.0, 0.0);")
            ),
            "at most 65536 are compiled",
        ),
        (format!("#import surfelshop::nois::Place\n{good}"), "line 1: there is no module"),
        (format!("struct A {{ a1: f32 }}\n{good}"), "cannot end in a digit, as `a1` does"),
        (body("var x = 0.0; loop { x += 1.0; } return Look(vec3(x), 0.0, 1.0, 0.0);"), ""),
        ("\u{0}".repeat(300_000), "expected a file of at most 131072 bytes, found 300000 bytes"),
    ] {
        let values = own(folder.path(), &wgsl);
        match lab.frame(&[&sphere], front(), &values, None) {
            // A loop without an end is ended by the host.
            Ok(_) => assert!(wgsl.contains("loop"), "{wgsl}"),
            Err(error) => {
                let line = error.to_string();
                assert!(line.contains(words) && !line.contains('\n'), "{line}");
            }
        }
        lab.frame(&[&sphere], front(), &own(folder.path(), &good), None).unwrap();
    }
    // Words of other languages are no mistake.
    let umlauts =
        body("/* Grüne Adern */ let größe = 0.5; return Look(vec3(größe), 0.0, 1.0, 0.0);");
    let umlauts = format!("\u{feff}// Größe\n{}", umlauts.replace("fn look(", "fn  look ("));
    lab.frame(&[&sphere], front(), &own(folder.path(), &umlauts), None).unwrap();
    for (path, words) in [
        (folder.path().join("none.wgsl"), "none.wgsl: No such file"),
        (folder.path().to_owned(), "131072 bytes, found a folder"),
    ] {
        let values = values(&[("file", text(&path.display().to_string()))]);
        let line = lab.frame(&[&sphere], front(), &values, None).unwrap_err().to_string();
        assert!(line.contains(words) && !line.contains('\n'), "{line}");
    }
    std::fs::write(folder.path().join("mine.wgsl"), [0xff, 0xfe]).unwrap();
    let path = folder.path().join("mine.wgsl").display().to_string();
    let values = values(&[("file", text(&path))]);
    let line = lab.frame(&[&sphere], front(), &values, None).unwrap_err().to_string();
    assert!(line.contains("it is not UTF-8 text"), "{line}");
}

/// Accessibility darkens what `ao-affects` says, alike under every lighting.
#[test]
fn accessibility_darkens_patterns() {
    let mut lab = Lab::new();
    let open = sphere(3000, 1.0);
    let ao = surfelshop_cloud::Column::new(
        "ao",
        1,
        surfelshop_cloud::Buffer::F32(vec![0.25; open.len()]),
    );
    let closed = open.with_columns(vec![ao]).unwrap();
    let probe = Probe::studio();
    let mean = |frame: &Rendered| -> f32 {
        frame.image(&Output::Color).unwrap().data.as_chunks::<4>().0.iter().map(|p| p[1]).sum()
    };
    for lighting in ["thesis", "phong", "natural"] {
        let values = values(&[
            ("lighting", text(lighting)),
            ("specular", Value::Float(0.0)),
            ("ambient", Value::Float(0.0)),
        ]);
        let [a, b] = [&open, &closed]
            .map(|cloud| mean(&lab.frame(&[cloud], front(), &values, Some(&probe)).unwrap()));
        assert!((b / a - 0.25).abs() < 0.01, "{lighting}: {b} of {a}");
    }
    let values = values(&[("lighting", text("thesis")), ("ao-strength", Value::Float(0.0))]);
    let [a, b] =
        [&open, &closed].map(|cloud| mean(&lab.frame(&[cloud], front(), &values, None).unwrap()));
    assert_eq!(a, b);
}

/// What the manual offers as a pattern to begin with is one.
#[test]
fn the_pattern_of_the_readme_works() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host/manual/use/patterns.md");
    let readme = std::fs::read_to_string(readme).unwrap();
    let blocks = readme.split("```wgsl\n").skip(1).filter_map(|rest| rest.split("```").next());
    let patterns: Vec<&str> = blocks.filter(|block| block.contains("fn look(")).collect();
    let [pattern] = patterns[..] else { panic!("{} patterns", patterns.len()) };
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let pixels = lab.pixels(&[&sphere(3000, 1.0)], front(), &own(folder.path(), pattern));
    let reds: Vec<f32> = pixels.iter().filter(|p| p[3] > 0.0).map(|p| p[0]).collect();
    let (least, most) = reds.iter().fold((1.0f32, 0.0f32), |(a, b), &r| (a.min(r), b.max(r)));
    assert!(least < 0.4 && most > 0.5, "{least} to {most}");
}

/// Through OpenGL a volume would stay empty but for its first slice; that is said instead.
#[test]
fn volumes_are_refused_where_they_cannot_be_filled() {
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    let engine = stage::engine_with(&gpu, &EngineOptions::default());
    let renderer = stage::built_renderer(&engine, "surfelshop-procedural", "procedural");
    let mut lab = Lab { engine, renderer, scene: Scene::default() };
    let cloud = sphere(3000, 1.0);
    let volume = values(&[("noise", text("volume")), ("volume-size", Value::Int(16))]);
    let line = lab.frame(&[&cloud], front(), &volume, None).unwrap_err().to_string();
    assert!(line.contains("stores into a volume, which OpenGL cannot do here"), "{line}");
    lab.frame(&[&cloud], front(), &Values::new(), None).unwrap();
}
