//! How splats are lit: as by other renderers where they do the same, and from a map.

use crate::splats::stage::{Way, choice, mode};
use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{Engine, RenderRequest, RendererView};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::{stage, twin};

fn ahead(size: u32) -> View {
    stage::view(DVec3::new(0.5, 0.8, 3.0), DVec3::ZERO, size)
}

/// Colours of a picture, in the light of a probe where there is one.
fn colors(
    engine: &mut Engine,
    renderer: &mut RendererView,
    cloud: &Cloud,
    scene: &Scene,
    view: View,
    values: &Values,
    probe: Option<&Probe>,
) -> Vec<f32> {
    let environment = probe.map(around);
    let environment = environment.as_ref().zip(probe).map(|(around, probe)| view_of(around, probe));
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene,
        view,
        values,
        outputs: &[Output::Color],
        frame_index: 0,
        environment,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    let rendered = engine.render(renderer, &request).unwrap();
    rendered.image(&Output::Color).unwrap().data.clone()
}

#[test]
fn splats_of_one_normal_are_lit_as_by_the_other_renderers() {
    let cloud = clouds::sphere(600, 1.0).cloud();
    let [mut way, ..] = Way::all();
    let studio = Probe::studio();
    let averaged = |lighting: &str| -> Values {
        [choice("mode", "averaged"), choice("lighting", lighting)].into()
    };
    for (library, unit, lighting, probe) in [
        ("surfelshop-ewa-phong", "ewa-phong", "exact", None),
        ("surfelshop-environment", "environment", "natural", Some(&studio)),
        ("surfelshop-environment", "environment", "natural", None),
    ] {
        let mut other = stage::built_renderer(&way.engine, library, unit);
        let (scene, view) = (Scene::default(), ahead(96));
        let engine = &mut way.engine;
        let values = averaged(lighting);
        let own = colors(engine, &mut way.renderer, &cloud, &scene, view, &values, probe);
        let none = Values::new();
        let expected = colors(engine, &mut other, &cloud, &scene, view, &none, probe);
        let apart = own.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // What a surface reflects at a right angle is a constant here and computed there, in f32.
        assert!(apart <= 1e-6, "{unit}: {apart}");
        assert!(own.iter().any(|value| *value > 0.1), "there is something to see");
    }
}

/// Lit by the twin: the normals of fields, blended, and the baseline's lighting.
#[test]
fn light_on_fields_is_that_of_the_twin() {
    let cloud = clouds::sphere(60, 1.0).elliptical(0.6).varying().cloud();
    let (scene, view) = (Scene::default(), ahead(64));
    let phong = twin::Phong { diffuse: 1.0, specular: 0.25, shininess: 64.0, ambient: 0.08 };
    let truth = twin::Twin::new(std::slice::from_ref(&cloud), &scene, &view).with_fields(true);
    for mut way in Way::all() {
        let drawn = way.draw(&cloud, &scene, view, &mode("phong"), &[Output::Color]);
        let color = drawn.image(&Output::Color).unwrap();
        let (mut worst, mut compared) = (0.0f64, 0);
        for i in 0..64 * 64 {
            let (x, y) = (i % 64, i / 64);
            let pixel = truth.pixel(x, y);
            if !pixel.sure || pixel.depth <= 0.0 {
                continue;
            }
            let position = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let expected = twin::shade(&pixel, &scene, &view, position, &phong);
            let found = Vec3::from_slice(color.pixel(x, y)).as_dvec3();
            worst = worst.max((found - expected).abs().max_element());
            compared += 1;
        }
        // As for the baseline: half precision of albedos, and 6e-5 rad of normals times a slope of 5.
        assert!(compared > 1000 && worst < 2e-3, "{}: {worst} in {compared}", way.name);
    }
}

/// One side of a ball, seen in parallel projection under a light far away: a map of light leaves out
/// nothing but what lies between its texels.
#[test]
fn a_finer_map_of_light_is_nearer_to_what_it_stands_for() {
    let cloud = clouds::sphere(3000, 1.0).cloud();
    let towards = DVec3::new(-0.4, 0.55, 0.75);
    let light = Light::Directional { towards, radiance: Vec3::ONE, follows_camera: false };
    let scene = Scene { lights: vec![light], ..Scene::default() };
    let mut view = ahead(96);
    view.camera.projection = Projection::Orthographic { height: 2.4 };
    view.far = 10.0;
    let [mut way, ..] = Way::all();
    let mut drawn = |values: Values| {
        let drawn = way.draw(&cloud, &scene, view, &values, &[Output::Color]);
        drawn.image(&Output::Color).unwrap().data.clone()
    };
    let exact = drawn(Values::new());
    let sizes = [16, 32, 64, 128, 256];
    let errors = sizes.map(|size| {
        let size = ("map-size".to_owned(), Value::Int(size));
        let mapped = drawn([choice("lighting", "map"), size].into());
        let squares = mapped.iter().zip(&exact).map(|(a, b)| f64::from(a - b).powi(2));
        (squares.sum::<f64>() / exact.len() as f64).sqrt()
    });
    println!("root mean square of radiance by texels along the map: {sizes:?} {errors:?}");
    // Linear between texels: a quarter of the error for half the distance, less at the shadow's edge, where
    // light has a kink, and for half-precision texels. The highlight is eight degrees wide.
    assert!(errors.windows(2).all(|pair| pair[1] < 0.5 * pair[0]), "{errors:?}");
    assert!(errors[3] < 1e-3, "the default shows no difference: {errors:?}");
}

#[test]
fn splats_far_apart_and_none_at_all_are_drawn() {
    let none = Surfels::default();
    let mut one = Surfels::default();
    one.push(Vec3::ZERO, Vec3::Z, 0.5);
    for mut way in Way::all() {
        for values in ["phong", "averaged", "blended", "flat"] {
            for lighting in ["exact", "map", "natural"] {
                let values: Values = [choice("mode", values), choice("lighting", lighting)].into();
                for (surfels, covered) in [(&none, false), (&one, true)] {
                    let cloud = surfels.cloud();
                    let outputs = [Output::Color];
                    let drawn = way.draw(&cloud, &Scene::default(), ahead(32), &values, &outputs);
                    let color = &drawn.image(&Output::Color).unwrap().data;
                    assert!(color.iter().all(|value| value.is_finite()));
                    assert_eq!(color.iter().any(|value| *value > 0.0), covered, "{values:?}");
                }
            }
        }
    }
}
