//! Extremes, the shader's variants and what is left out.

use crate::environment::light::{TO_EYE, all_reflected, matte, sun, text, values};
use glam::DVec3;
use surfelshop_api::Light;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{PassState, Rendered};
use surfelshop_tests::natural_light::{Lab, around, pixels};
use surfelshop_tests::{clouds, stage};

#[test]
fn dim_light_keeps_its_digits() {
    let mut lab = Lab::new(20_000, 40);
    let bright = Probe::studio();
    let mut picture = bright.picture.clone();
    // A power of two: nothing is lost on the way.
    let scale = 2f32.powi(-30);
    picture.rgb.iter_mut().flatten().for_each(|value| *value *= scale);
    let dim = Probe::from_picture("dim", picture, None).unwrap();
    let reference = lab.pixels(&bright, &all_reflected(0.2)).unwrap();
    for (dim, bright) in lab.pixels(&dim, &all_reflected(0.2)).unwrap().iter().zip(&reference) {
        let found = dim.color[1] / f64::from(scale);
        assert!((found - bright.color[1]).abs() < 2e-3 * bright.color[1] + 1e-6, "{found}");
    }
}

#[test]
fn extremes_stay_finite_and_bounded() {
    let mut lab = Lab::new(20_000, 40);
    let mut picture = Probe::sky().picture;
    let n = picture.rgb.len();
    picture.rgb[n / 3] = [f32::INFINITY; 3];
    picture.rgb[n / 2] = [f32::NAN; 3];
    picture.rgb[n / 4] = [1e5; 3];
    picture.rgb[n / 5] = [-1.0, 0.0, 0.0];
    let hard = Probe::from_picture("hard", picture, None).unwrap();
    assert_eq!((hard.repairs.n_not_finite, hard.repairs.n_negative), (2, 1));
    let mut largest = 0.0f64;
    for probe in [&hard, &sun(), &Probe::constant([0.0; 3]), &Probe::constant([1e5; 3])] {
        for (model, spread) in [("ggx", "roughness"), ("thesis", "c")] {
            for amount in [0.0, 1e-6, 0.05, 0.5, 1.0] {
                for ior in [0.2, 0.999_999, 1.0, 1.000_001, 1.5, 4.0] {
                    let values = values(&[
                        ("model", text(model)),
                        (spread, Value::Float(amount)),
                        ("ior", Value::Float(ior)),
                        ("background", text("sharp")),
                    ]);
                    let environment = around(probe);
                    let rendered = lab.frame(Some((&environment, probe)), &values, 1).unwrap();
                    let color = rendered.image(&Output::Color).unwrap();
                    // Diffuse and specular each give at most the brightest light back; the sun's
                    // own radiance stands in the facts.
                    let most = 2.0 * probe.facts.max_radiance * 1.01 + 1e-6;
                    for value in color.data.chunks_exact(4).flat_map(|p| &p[..3]) {
                        assert!(value.is_finite() && *value >= 0.0, "{model} {amount} {ior}");
                        assert!(f64::from(*value) <= most, "{value} of {most}: {model} {amount}");
                        largest = largest.max(f64::from(*value));
                    }
                }
            }
        }
    }
    assert!(largest > 1.0, "there was light");
}

#[test]
fn light_on_each_surfel_is_near_that_on_each_pixel() {
    let mut lab = Lab::new(20_000, 40);
    for probe in [Probe::constant([1.0, 0.5, 0.25]), Probe::studio(), Probe::sky()] {
        for model in ["ggx", "thesis"] {
            // A dull surface: highlights of the sun change within a surfel.
            let mut asked = values(&[
                ("model", text(model)),
                ("antialias", Value::Bool(false)),
                ("roughness", Value::Float(1.0)),
                ("c", Value::Float(1.0)),
            ]);
            let by_pixel = lab.pixels(&probe, &asked).unwrap();
            asked.insert("shading".to_owned(), text("surfel"));
            let by_surfel = lab.pixels(&probe, &asked).unwrap();
            assert_eq!(by_pixel.len(), by_surfel.len());
            let mean = by_pixel.iter().map(|p| p.color[1]).sum::<f64>() / by_pixel.len() as f64;
            // A surfel of this sphere spans 0.02 rad, over which smooth light hardly changes; at
            // the silhouette surfels are seen edge on and blend over more of it.
            let inner = by_pixel.iter().zip(&by_surfel).filter(|(p, _)| p.normal.z > 0.3);
            for (pixel, surfel) in inner {
                let difference = (pixel.color[1] - surfel.color[1]).abs();
                assert!(difference < 0.03 * mean, "{} {model}: {difference}", probe.name);
            }
        }
    }
    // Of a subset that is drawn larger, each surfel still has its own light.
    let probe = Probe::constant([1.0, 0.5, 0.25]);
    let environment = around(&probe);
    let mut asked = matte();
    asked.insert("shading".to_owned(), text("surfel"));
    let subset = pixels(&lab.frame(Some((&environment, &probe)), &asked, 8).unwrap(), TO_EYE);
    assert!(subset.len() > 900);
    for pixel in subset {
        assert!((pixel.color[1] - 0.5).abs() < 1e-3, "{:?}", pixel.color);
    }
    // Background, lights and accessibility work alike.
    let environment = around(&Probe::sky());
    let asked = values(&[("shading", text("surfel")), ("background", text("sharp"))]);
    let probe = Probe::sky();
    let rendered = lab.frame(Some((&environment, &probe)), &asked, 1).unwrap();
    let color = rendered.image(&Output::Color).unwrap();
    assert!(color.data.chunks_exact(4).all(|p| p[3] == 1.0 && p[0] > 0.0));
}

#[test]
fn every_variant_of_the_shader_draws() {
    let mut lab = Lab::new(20_000, 40);
    // A light of its own, an environment with a sun, and a surface that knows its accessibility.
    let mut sphere = clouds::sphere(2_000, 1.0);
    sphere.ao = vec![0.5; sphere.positions.len()];
    let open = std::mem::replace(&mut lab.cloud, sphere.cloud());
    let light =
        Light::Directional { towards: DVec3::X, radiance: glam::Vec3::ONE, follows_camera: false };
    let probe = Probe::sky();
    let environment = around(&probe);
    let mut n_variants = 0;
    for cloud in [open, lab.cloud.clone()] {
        lab.cloud = cloud;
        for lights in [vec![], vec![light]] {
            lab.scene.lights = lights;
            for model in ["ggx", "thesis"] {
                for background in ["none", "sharp", "blurred"] {
                    for (kd, ks, order) in
                        [(1.0, 1.0, 2), (1.0, 1.0, 4), (0.0, 1.0, 2), (1.0, 0.0, 4)]
                    {
                        let values = values(&[
                            ("model", text(model)),
                            ("background", text(background)),
                            ("kd", Value::Float(kd)),
                            ("ks", Value::Float(ks)),
                            ("sh-order", Value::Int(order)),
                            ("multiple-scattering", Value::Bool(order == 2)),
                        ]);
                        let rendered = lab.frame(Some((&environment, &probe)), &values, 1).unwrap();
                        let bright = pixels(&rendered, TO_EYE)
                            .iter()
                            .map(|p| p.color[1])
                            .fold(0.0, f64::max);
                        assert!(bright > 0.01, "{model} {background} {kd} {ks} {order}");
                        n_variants += 1;
                    }
                }
            }
        }
    }
    assert_eq!(n_variants, 96);
}

fn ran(rendered: &Rendered, state: PassState) -> Vec<String> {
    let passes = rendered.passes.iter().filter(|pass| pass.state == state);
    let own =
        passes.filter(|pass| !pass.name.starts_with("surfels") && !pass.name.starts_with("host"));
    own.map(|pass| pass.name.clone()).collect()
}

/// Invariant: a frame does without what its scene does not need
#[test]
fn what_a_scene_does_not_need_is_left_out() {
    let mut lab = Lab::new(20_000, 40);
    lab.engine = stage::new_engine();
    let probe = Probe::studio();
    let environment = around(&probe);
    let light = Some((&environment, &probe));
    let none = lab.frame(None, &Values::new(), 1).unwrap();
    assert_eq!(ran(&none, PassState::Ran), ["environment"]);
    assert_eq!(lab.engine.counters().environments, 0, "no map is uploaded");
    let matte_only = lab.frame(light, &matte(), 1).unwrap();
    assert_eq!(ran(&matte_only, PassState::Ran), ["environment"], "no specular passes");
    assert_eq!(lab.engine.counters().environments, 1);
    let first = lab.frame(light, &Values::new(), 1).unwrap();
    let n_filters = ran(&first, PassState::Ran).len() - 1;
    assert!(n_filters > 3, "{:?}", first.passes);
    // Prefiltered once: neither another roughness nor a turn of the light needs it again.
    let mut turned = environment.clone();
    turned.probe_from_world = glam::DMat3::from_rotation_y(1.0);
    let rough = values(&[("roughness", Value::Float(0.9))]);
    let second = lab.frame(Some((&turned, &probe)), &rough, 1).unwrap();
    assert_eq!(ran(&second, PassState::Ran), ["environment"]);
    assert_eq!(ran(&second, PassState::Reused).len(), n_filters);
    assert_eq!(lab.engine.counters().environments, 1);
}

#[test]
fn lights_of_the_scene_are_added_but_for_those_that_follow_the_camera() {
    let mut lab = Lab::new(20_000, 40);
    let dark = Probe::constant([0.0; 3]);
    let towards = DVec3::new(0.6, 0.0, 0.8);
    let radiance = glam::Vec3::new(1.0, 2.0, 3.0);
    let brightest = |lab: &mut Lab| {
        let pixels = lab.pixels(&dark, &matte()).unwrap();
        pixels.iter().map(|p| p.color[1]).fold(0.0, f64::max)
    };
    lab.scene.lights = vec![Light::Directional { towards, radiance, follows_camera: true }];
    assert_eq!(brightest(&mut lab), 0.0);
    lab.scene.lights.push(Light::Directional { towards, radiance, follows_camera: false });
    for pixel in lab.pixels(&dark, &matte()).unwrap() {
        let expected = 2.0 * pixel.normal.dot(towards).max(0.0);
        assert!((pixel.color[1] - expected).abs() < 2e-3, "{} for {expected}", pixel.color[1]);
    }
    // A highlight where the light is mirrored, in either model.
    for model in ["ggx", "thesis"] {
        let shiny = values(&[("model", text(model)), ("kd", Value::Float(0.0))]);
        let pixels = lab.pixels(&dark, &shiny).unwrap();
        let half = (towards + TO_EYE).normalize_or(DVec3::Z);
        let best = pixels.iter().max_by(|a, b| a.color[1].total_cmp(&b.color[1])).unwrap();
        assert!(best.color[1] > 0.02 && best.normal.dot(half) > 0.98, "{model}");
        assert!(pixels.iter().flat_map(|p| p.color).all(|c| c.is_finite() && c >= 0.0));
    }
    // Without an environment all of them shine.
    let all = pixels(&lab.frame(None, &matte(), 1).unwrap(), TO_EYE);
    assert!(all.iter().map(|p| p.color[1]).fold(0.0, f64::max) > 3.9);
}
