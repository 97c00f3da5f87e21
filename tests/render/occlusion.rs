//! `ao-strength` and `ao-affects`, which three renderers have alike.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Environment, Light, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{RenderRequest, RendererView};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::{clouds, stage};

/// Accessibility everywhere.
const OPEN: f32 = 0.25;

/// What of the light `ao-affects` takes in, in its order.
const AFFECTS: [&str; 4] = ["ambient", "diffuse", "reflections", "all"];

/// A renderer over a sphere.
struct Lab {
    engine: stage::PooledEngine,
    renderer: RendererView,
    view: View,
    /// Whether a light shines.
    lit: bool,
    probe: Option<(Environment, Probe)>,
}

impl Lab {
    fn new(library: &str, unit: &str, probe: Option<Probe>) -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, library, unit);
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 48);
        let probe = probe.map(|probe| (around(&probe), probe));
        Self { engine, renderer, view, lit: true, probe }
    }

    /// Linear colour of all pixels.
    fn picture(&mut self, cloud: &Cloud, values: &[(&str, Value)]) -> Vec<f32> {
        let values: Values = values.iter().map(|(id, v)| ((*id).to_owned(), v.clone())).collect();
        let towards = DVec3::new(0.5, 0.5, 0.7).normalize_or(DVec3::Z);
        let light = Light::Directional { towards, radiance: Vec3::ONE, follows_camera: false };
        let lights = if self.lit { vec![light] } else { vec![] };
        let request = RenderRequest {
            clouds: &[cloud.view()],
            facts: cloud.facts(),
            scene: &Scene { lights, ..Scene::default() },
            view: self.view,
            values: &values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: self.probe.as_ref().map(|(around, probe)| view_of(around, probe)),
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        let rendered = self.engine.render(&mut self.renderer, &request).unwrap();
        rendered.image(&Output::Color).unwrap().data.clone()
    }

    /// The picture of a part of the light: what the scene's light adds, or what is there without.
    fn part(&mut self, cloud: &Cloud, values: &[(&str, Value)], of_lights: bool) -> Vec<f32> {
        self.lit = false;
        let without = self.picture(cloud, values);
        self.lit = true;
        match of_lights {
            false => without,
            true => {
                let with = self.picture(cloud, values);
                with.iter().zip(&without).map(|(with, without)| with - without).collect()
            }
        }
    }
}

fn sphere(ao: bool) -> Cloud {
    let mut surfels = clouds::sphere(3_000, 1.0);
    if ao {
        surfels.ao = vec![OPEN; surfels.positions.len()];
    }
    surfels.cloud()
}

fn occlusion(strength: f64, affects: &str) -> [(&'static str, Value); 2] {
    let affects = Value::Text(affects.to_owned());
    [("ao-strength", Value::Float(strength)), ("ao-affects", affects)]
}

fn number(id: &'static str, value: f64) -> (&'static str, Value) {
    (id, Value::Float(value))
}

/// Holds that two pictures are one but for rounding: sums of a few numbers of 24 bits, and
/// accessibility of 16.
fn same(found: &[f32], expected: &[f32], what: &str) {
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().any(|value| *value > 0.01));
    for (place, (found, expected)) in found.iter().zip(expected).enumerate() {
        let far = (found - expected).abs();
        // Alpha comes with colour, and differences of pictures have none.
        assert!(
            place % 4 == 3 || far < 1e-4 * expected.abs().max(0.1),
            "{what}: {found} {expected}"
        );
    }
}

/// A part of the light: the settings that leave no other, whether it is of lights, and from which
/// choice on it is darkened.
type Part = (Vec<(&'static str, Value)>, bool, usize);

/// Holds that each part of the light is darkened as told.
fn parts_are_darkened(lab: &mut Lab, parts: &[Part]) {
    let (open, closed) = (sphere(false), sphere(true));
    for (settings, of_lights, from) in parts {
        let bright = lab.part(&open, settings, *of_lights);
        for (place, affects) in AFFECTS.iter().enumerate() {
            for strength in [0.0, 0.5, 1.0] {
                let asked = [&settings[..], &occlusion(strength, affects)].concat();
                let found = lab.part(&closed, &asked, *of_lights);
                let left = if place >= *from { 1.0 - strength * 0.75 } else { 1.0 } as f32;
                let expected: Vec<f32> = bright.iter().map(|value| value * left).collect();
                same(&found, &expected, &format!("{settings:?} {affects} {strength}"));
            }
        }
    }
}

#[test]
fn flat_darkens_what_it_is_told_to() {
    let mut lab = Lab::new("surfelshop_flat", "flat", None);
    let parts = [(vec![number("ambient", 0.5)], false, 0), (vec![number("ambient", 0.0)], true, 1)];
    parts_are_darkened(&mut lab, &parts);
}

#[test]
fn blended_splats_darken_what_they_are_told_to() {
    let mut lab = Lab::new("surfelshop_ewa_phong", "ewa-phong", None);
    let only = |ambient, diffuse, specular| {
        let [ambient, diffuse] = [number("ambient", ambient), number("diffuse", diffuse)];
        vec![ambient, diffuse, number("specular", specular), number("shininess", 8.0)]
    };
    let parts = [
        (only(0.5, 0.0, 0.0), false, 0),
        (only(0.0, 1.0, 0.0), true, 1),
        (only(0.0, 0.0, 1.0), true, 3),
    ];
    parts_are_darkened(&mut lab, &parts);
}

#[test]
fn natural_light_darkens_what_it_is_told_to() {
    for model in ["ggx", "thesis"] {
        let mut lab = Lab::new("surfelshop_environment", "environment", Some(Probe::sky()));
        let model = ("model", Value::Text(model.to_owned()));
        let matte = vec![number("ks", 0.0), model.clone()];
        let shiny = vec![number("kd", 0.0), number("roughness", 0.5), model];
        let parts = [(matte.clone(), false, 0), (matte, true, 1), (shiny.clone(), true, 3)];
        parts_are_darkened(&mut lab, &parts);
        // How open the mirrored direction is differs from how open all are: less is taken.
        let (open, closed) = (sphere(false), sphere(true));
        let mut mirrored = |strength, affects| {
            let asked = [&shiny[..], &occlusion(strength, affects)].concat();
            lab.part(&closed, &asked, false)
        };
        let (none, half, all) =
            (mirrored(0.0, "all"), mirrored(0.5, "reflections"), mirrored(1.0, "reflections"));
        let before = mirrored(1.0, "diffuse");
        let bright = lab.part(&open, &shiny, false);
        same(&none, &bright, "no strength");
        same(&before, &bright, "matte parts only");
        let mean: Vec<f32> = none.iter().zip(&all).map(|(a, b)| f32::midpoint(*a, *b)).collect();
        same(&half, &mean, "half of the strength");
        let sum = |picture: &[f32]| picture.iter().map(|value| f64::from(*value)).sum::<f64>();
        assert!(sum(&all) < 0.9 * sum(&bright) && sum(&all) > 0.25 * sum(&bright));
    }
    // Without an environment the scene's lights alone shine, and are darkened alike.
    let mut lab = Lab::new("surfelshop_environment", "environment", None);
    parts_are_darkened(&mut lab, &[(vec![], true, 1)]);
}

#[test]
fn without_accessibility_the_parameters_change_nothing() {
    let open = sphere(false);
    for (library, unit) in [
        ("surfelshop_flat", "flat"),
        ("surfelshop_ewa_phong", "ewa-phong"),
        ("surfelshop_environment", "environment"),
    ] {
        let probe = (unit == "environment").then(Probe::studio);
        let mut lab = Lab::new(library, unit, probe);
        let plain = lab.picture(&open, &[]);
        let before = lab.engine.counters();
        for affects in AFFECTS {
            for strength in [0.0, 1.0] {
                assert!(lab.picture(&open, &occlusion(strength, affects)) == plain, "{unit}");
            }
        }
        let after = lab.engine.counters();
        assert_eq!((after.compiled, after.plans), (before.compiled, before.plans), "{unit}");
        assert_eq!(after.uploads, before.uploads, "{unit}: no column is bound for it");
    }
}
