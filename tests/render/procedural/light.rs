//! Lighting is that of the other renderers and of the thesis; patterns are laid as parameters say.

use glam::{DQuat, DVec3, Vec3};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Light, ObjectFrame, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{GpuOptions, RenderRequest, Rendered, RendererView};
use surfelshop_tests::evaluated_light::arriving;
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::procedural::noise::Place;
use surfelshop_tests::procedural::patterns::Settings;
use surfelshop_tests::procedural::{Bench, places};
use surfelshop_tests::{clouds, stage, twin};

fn values(pairs: &[(&str, Value)]) -> Values {
    pairs.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

fn float(number: f64) -> Value {
    Value::Float(number)
}

/// A sphere with colours, seen without perspective, under lights of every kind.
struct Lab {
    engine: stage::PooledEngine,
    cloud: Cloud,
    scene: Scene,
    view: View,
}

impl Lab {
    fn new() -> Self {
        let light = |towards: DVec3, radiance: Vec3| Light::Directional {
            towards,
            radiance,
            follows_camera: false,
        };
        // The cone's edge runs across the sphere.
        let spot = Light::Spot {
            position: DVec3::new(-1.0, 1.2, 1.5),
            target: DVec3::new(0.2, 0.1, 0.5),
            intensity: Vec3::new(0.3, 1.2, 0.9),
            angle: 0.4,
            softness: 0.3,
        };
        let (position, intensity) = (DVec3::new(0.9, -0.8, 1.1), Vec3::new(0.4, 0.2, 0.3));
        let lights = vec![
            light(DVec3::new(0.4, 0.5, 0.8), Vec3::new(0.5, 0.4, 0.3)),
            light(DVec3::new(-0.9, 0.1, 0.2), Vec3::new(0.2, 0.3, 0.9)),
            Light::Point { position, intensity },
            spot,
        ];
        let camera = Camera {
            eye: DVec3::new(0.0, 0.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Orthographic { height: 2.1 },
        };
        Self {
            engine: stage::engine(),
            cloud: clouds::sphere(20_000, 1.0).cloud(),
            scene: Scene { lights, ..Scene::default() },
            view: View { camera, size_px: [96; 2], near: 0.1, far: 10.0 },
        }
    }

    fn frame(
        &mut self,
        renderer: &mut RendererView,
        values: &Values,
        probe: Option<&Probe>,
    ) -> Rendered {
        let environment = probe.map(around);
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &self.scene,
            view: self.view,
            values,
            outputs: &[Output::Color, Output::Normal, Output::Albedo, Output::Depth],
            frame_index: 0,
            environment: probe.zip(environment.as_ref()).map(|(p, e)| view_of(e, p)),
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        self.engine.render(renderer, &request).unwrap()
    }

    fn renderer(&self, unit: &str) -> RendererView {
        stage::built_renderer(&self.engine, &format!("surfelshop-{unit}"), unit)
    }
}

/// A pattern of one material in the cloud's own colours.
fn material(folder: &Path, [specular, roughness, metallic]: [f64; 3]) -> Value {
    let path = folder.join(format!("{specular}-{roughness}-{metallic}.wgsl"));
    let wgsl = format!(
        "#import surfelshop::noise::Place\n#import procedural::pattern::Look\n\
         fn look(at: Place, albedo: vec3<f32>) -> Look {{\n\
         return Look(albedo, {specular:?}, {roughness:?}, {metallic:?});\n}}\n"
    );
    std::fs::write(&path, wgsl).unwrap();
    text(&path.display().to_string())
}

/// Largest difference of two frames, and the largest value of the first.
fn apart(a: &Rendered, b: &Rendered) -> (f32, f32) {
    let [a, b] = [a, b].map(|frame| &frame.image(&Output::Color).unwrap().data);
    let largest = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    (largest, a.iter().copied().fold(0.0, f32::max))
}

/// The roughness whose highlight has an exponent: exponent = 2 / roughness^4 - 2.
fn roughness_of(exponent: f64) -> f64 {
    (2.0 / (exponent + 2.0)).powf(0.25)
}

/// The same material gives the same picture as `ewa-phong`'s own, but for the exponent's rounding on its
/// way through the roughness.
///
/// Invariant: `phong` and `natural` lighting of patterns are those of `ewa-phong` and
/// `environment`, `thesis` that of the thesis
#[test]
fn phong_lighting_is_that_of_ewa_phong() {
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let (mut own, mut other) = (lab.renderer("procedural"), lab.renderer("ewa-phong"));
    let pattern = material(folder.path(), [0.6, roughness_of(38.0), 0.0]);
    let ours = values(&[("file", pattern), ("lighting", text("phong")), ("ambient", float(0.21))]);
    let theirs =
        values(&[("specular", float(0.3)), ("shininess", float(38.0)), ("ambient", float(0.21))]);
    let (ours, theirs) = (lab.frame(&mut own, &ours, None), lab.frame(&mut other, &theirs, None));
    let (largest, brightest) = apart(&ours, &theirs);
    assert!(largest < 1e-4 && brightest > 0.8, "{largest}, up to {brightest}");
}

/// The same material gives the same picture as `environment`'s own.
#[test]
fn natural_lighting_is_that_of_environment() {
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let (mut own, mut other) = (lab.renderer("procedural"), lab.renderer("environment"));
    let probe = Probe::studio();
    for [specular, roughness, metallic] in [[0.6, 0.4, 0.0], [0.2, 0.25, 1.0], [1.0, 0.5, 0.5]] {
        let pattern = material(folder.path(), [specular, roughness, metallic]);
        let ours = values(&[("file", pattern), ("lighting", text("natural"))]);
        let ks = specular + (1.0 - specular) * metallic;
        let theirs = values(&[
            ("ks", float(ks)),
            ("roughness", float(roughness)),
            ("metallic", float(metallic)),
        ]);
        for probe in [Some(&probe), None] {
            let ours = lab.frame(&mut own, &ours, probe);
            let theirs = lab.frame(&mut other, &theirs, probe);
            let (largest, brightest) = apart(&ours, &theirs);
            assert!(largest < 1e-5 && brightest > 0.1, "{specular}: {largest}, up to {brightest}");
        }
    }
}

/// The thesis's light: 0.5 n.l + 0.5, and Ks (r.l)^m / 2 with the eye's mirror image r. The normals of
/// the picture are packed to 2^-14, which an exponent of 38 makes 38 x 0.6 x 2^-14 of.
#[test]
fn thesis_lighting_is_that_of_the_thesis() {
    let folder = tempfile::tempdir().unwrap();
    let mut lab = Lab::new();
    let mut own = lab.renderer("procedural");
    for metallic in [0.0, 1.0] {
        let pattern = material(folder.path(), [0.8, roughness_of(38.0), metallic]);
        let frame = lab.frame(&mut own, &values(&[("file", pattern)]), None);
        let [color, normal, albedo] = [Output::Color, Output::Normal, Output::Albedo]
            .map(|output| frame.image(&output).unwrap().data.as_chunks::<4>().0);
        let depth = frame.image(&Output::Depth).unwrap();
        let vector = |texel: &[f32; 4]| Vec3::from_slice(texel).as_dvec3();
        let (mut n, mut behind) = (0, 0);
        for (i, ((color, normal), albedo)) in color.iter().zip(normal).zip(albedo).enumerate() {
            if normal[3] <= 0.0 {
                continue;
            }
            let (x, y) = (i as u32 % depth.width, i as u32 / depth.width);
            let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let place = twin::place(&lab.view, center, f64::from(depth.pixel(x, y)[0]));
            let (normal, albedo) = (vector(normal).normalize_or(DVec3::Z), vector(albedo));
            let mut expected = DVec3::ZERO;
            for light in &lab.scene.lights {
                let (towards, radiance) = arriving(light, &lab.view, place);
                let cosine = normal.dot(towards);
                let mirrored = 2.0 * normal.z * normal - DVec3::Z;
                let shine =
                    if cosine > 0.0 { mirrored.dot(towards).max(0.0).powi(38) } else { 0.0 };
                let tint = DVec3::ONE.lerp(albedo, metallic);
                let matte = albedo * (0.5 * cosine + 0.5);
                expected += radiance * (matte + tint * (0.4 * shine));
                behind += i32::from(cosine < 0.0);
            }
            let difference = (vector(color) - expected).abs().max_element();
            assert!(difference < 0.004, "{color:?} for {expected}");
            n += 1;
        }
        assert!(n > 4000 && behind > 1000, "{n} {behind}");
    }
}

/// Where a pattern lies after scale and turns: a point of the box is where it was before them.
#[test]
fn scale_and_turns_lay_the_pattern() {
    let mut bench = Bench::new(&GpuOptions::default());
    let settings = Settings { frequency: 5.0, octaves: 4, ..Settings::default() };
    let (scale, degrees) = (0.45, [20.0, -35.0, 110.0]);
    let mut values = settings.values("veined-marble");
    values.insert("scale".to_owned(), float(scale));
    for (axis, angle) in ["x", "y", "z"].into_iter().zip(degrees) {
        values.insert(format!("rotation-{axis}"), float(angle));
    }
    let [x, y, z] = degrees.map(f64::to_radians);
    let turn = DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
    let object =
        ObjectFrame { center: DVec3::new(0.2, 0.1, -0.3), size: 1.7, ..Default::default() };
    let spots = places::spots(500, 1.5, 1e-3, 8);
    let colors = bench.colors(&spots, DVec3::ZERO, object, &values).unwrap();
    for (spot, color) in spots.iter().zip(colors) {
        let at = spot.place(DVec3::ZERO, &object, true);
        let to_pattern = |v: DVec3| turn.inverse() * v / scale;
        let at = Place {
            position: to_pattern(at.position - 0.5) + 0.5,
            across: to_pattern(at.across),
            along: to_pattern(at.along),
            ..at
        };
        let expected = settings.look("veined-marble", &at, spot.albedo.as_dvec3()).albedo;
        // Veins are as steep as 30 per unit, places as good as 1e-6.
        assert!((color - expected).abs().max_element() < 1e-4, "{color} for {expected}");
    }
}

/// Without its own colours a coloured cloud is a white one.
#[test]
fn own_colours_count_as_much_as_they_are_asked_to() {
    let mut lab = Lab::new();
    let mut own = lab.renderer("procedural");
    let of = |share: f64| {
        values(&[
            ("lighting", text("none")),
            ("pattern", text("granite")),
            ("own-color", float(share)),
        ])
    };
    let [none, half, all] = [0.0, 0.5, 1.0].map(|share| lab.frame(&mut own, &of(share), None));
    lab.cloud = lab.cloud.without_column("color");
    let white = lab.frame(&mut own, &of(1.0), None);
    assert!(apart(&none, &white).0 < 1e-6);
    assert!(apart(&all, &white).0 > 0.1);
    let [none, half, all] = [&none, &half, &all].map(|f| &f.image(&Output::Color).unwrap().data);
    for ((none, half), all) in none.iter().zip(half).zip(all) {
        assert!((0.5 * (none + all) - half).abs() < 1e-5);
    }
}
