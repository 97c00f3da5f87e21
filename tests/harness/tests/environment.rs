//! The renderer `environment` against sums over all texels in f64, and at its extremes.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "errors are part of the result")]

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Environment, Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::probe::{Mapping, Picture, Probe};
use surfelshop_engine::{Engine, PassState, RenderRequest, Rendered, RendererView};
use surfelshop_tests::natural_light::{NaturalLight, around, ggx_times_cosine, lone_sun, view_of};
use surfelshop_tests::{clouds, stage};

/// The renderer over a sphere of albedo 1, seen along -z without perspective.
struct Lab {
    engine: Engine,
    renderer: RendererView,
    cloud: Cloud,
    view: View,
    scene: Scene,
}

/// A pixel: unit normal and linear colour.
struct Pixel {
    normal: DVec3,
    color: [f64; 3],
}

const TO_EYE: DVec3 = DVec3::Z;

impl Lab {
    fn new() -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-environment", "environment");
        let mut sphere = clouds::sphere(20_000, 1.0);
        sphere.colors = vec![[255; 3]; sphere.positions.len()];
        let camera = Camera {
            eye: DVec3::new(0.0, 0.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Orthographic { height: 2.1 },
        };
        let view = View { camera, size_px: [40, 40], near: 0.1, far: 10.0 };
        Self { engine, renderer, cloud: sphere.cloud(), view, scene: Scene::default() }
    }

    fn rendered(&mut self, light: Option<(&Environment, &Probe)>, values: &Values) -> Rendered {
        self.rendered_of(light, values, 1)
    }

    /// Of one surfel of so many.
    fn rendered_of(
        &mut self,
        light: Option<(&Environment, &Probe)>,
        values: &Values,
        stride: u32,
    ) -> Rendered {
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &self.scene,
            view: self.view,
            values,
            outputs: &[Output::Color, Output::Normal],
            frame_index: 0,
            environment: light.map(|(environment, probe)| view_of(environment, probe)),
            stride,
        };
        self.engine.render(&mut self.renderer, &request).unwrap()
    }

    /// The covered pixels.
    fn pixels(&mut self, probe: &Probe, values: &Values) -> Vec<Pixel> {
        let environment = around(probe);
        pixels(&self.rendered(Some((&environment, probe)), values))
    }
}

fn pixels(rendered: &Rendered) -> Vec<Pixel> {
    let color = rendered.image(&Output::Color).unwrap();
    let normal = rendered.image(&Output::Normal).unwrap();
    let vector = |texel: &[f32]| [0, 1, 2].map(|k| f64::from(texel[k]));
    let pairs = color.data.chunks_exact(4).zip(normal.data.chunks_exact(4));
    pairs
        .filter(|(_, normal)| normal[3] > 0.0)
        .map(|(color, normal)| Pixel {
            normal: DVec3::from(vector(normal)).normalize_or(DVec3::Z),
            color: vector(color),
        })
        .collect()
}

fn values(list: &[(&str, Value)]) -> Values {
    list.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

fn text(value: &str) -> Value {
    Value::Text(value.to_owned())
}

/// Mirror-like reflection of everything, in full.
fn all_reflected(roughness: f64) -> Values {
    let number = Value::Float;
    values(&[
        ("kd", number(0.0)),
        ("metallic", number(1.0)),
        ("roughness", number(roughness)),
        // So few pixels show so large a sphere that each shows many normals.
        ("antialias", Value::Bool(false)),
    ])
}

fn matte() -> Values {
    values(&[("ks", Value::Float(0.0))])
}

fn sun() -> Probe {
    Probe::from_picture("lone sun", lone_sun(1e5), None).unwrap()
}

/// The four kinds of light that need no file.
fn probes() -> [Probe; 4] {
    [Probe::constant([1.0; 3]), Probe::studio(), Probe::sky(), sun()]
}

/// Mean and largest absolute error over all channels, as shares of the mean reference.
fn errors(pixels: &[Pixel], reference: impl Fn(&Pixel) -> [f64; 3]) -> [f64; 2] {
    let (mut sum, mut largest, mut scale) = (0.0, 0.0f64, 0.0);
    for pixel in pixels {
        for (found, expected) in pixel.color.iter().zip(reference(pixel)) {
            sum += (found - expected).abs();
            largest = largest.max((found - expected).abs());
            scale += expected;
        }
    }
    let mean = scale / (3 * pixels.len()) as f64;
    [sum / (3 * pixels.len()) as f64 / mean, largest / mean]
}

#[test]
fn a_white_surface_in_even_light_is_as_bright_as_the_light() {
    let mut lab = Lab::new();
    let even = Probe::constant([1.0; 3]);
    for pixel in lab.pixels(&even, &matte()) {
        assert!(pixel.color.iter().all(|c| (c - 1.0).abs() < 1e-3), "{:?}", pixel.color);
    }
    for step in 0..=10 {
        let roughness = f64::from(step) / 10.0;
        for pixel in lab.pixels(&even, &all_reflected(roughness)) {
            let c = pixel.color;
            assert!(c.iter().all(|c| (c - 1.0).abs() < 0.02), "roughness {roughness}: {c:?}");
        }
        // Body and surface together, too, give back what arrives.
        let both = values(&[("roughness", Value::Float(roughness))]);
        for pixel in lab.pixels(&even, &both) {
            assert!((pixel.color[1] - 1.0).abs() < 0.02, "{:?}", pixel.color);
        }
    }
}

/// What even light of radiance 1 becomes when GGX reflects it once: the sum over a fine grid.
fn reflected_once(normal: DVec3, roughness: f64) -> f64 {
    let n = 1200;
    let (u, v) = normal.any_orthonormal_pair();
    let step = |i: usize| (i as f64 + 0.5) / n as f64;
    let row = |i: usize| {
        let cosine = step(i);
        let sine = (1.0 - cosine * cosine).sqrt();
        let value = |j: usize| {
            let (s, c) = (std::f64::consts::TAU * step(j)).sin_cos();
            let towards = cosine * normal + sine * (c * u + s * v);
            ggx_times_cosine(normal, TO_EYE, towards, roughness, 1.0)
        };
        (0..n).map(value).sum::<f64>()
    };
    (0..n).map(row).sum::<f64>() * std::f64::consts::TAU / (n * n) as f64
}

#[test]
fn light_reflected_once_is_the_integral() {
    let mut lab = Lab::new();
    let even = Probe::constant([1.0; 3]);
    for roughness in [0.3, 0.5, 0.8, 1.0] {
        let mut once = all_reflected(roughness);
        once.insert("multiple-scattering".to_owned(), Value::Bool(false));
        let pixels = lab.pixels(&even, &once);
        for cosine in [0.15, 0.3, 0.6, 0.99] {
            let far = |p: &&Pixel| (p.normal.dot(TO_EYE) - cosine).abs();
            let pixel = pixels.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            let (found, expected) = (pixel.color[0], reflected_once(pixel.normal, roughness));
            println!("roughness {roughness}, cosine {cosine}: {found:.4} for {expected:.4}");
            assert!((found - expected).abs() < 0.01 * expected, "{found} for {expected}");
        }
    }
}

#[test]
fn matte_surfaces_agree_with_the_sum_over_all_texels() {
    let mut lab = Lab::new();
    for (probe, most) in [
        // Soft boxes against a dim room are far from what nine numbers can say: twenty-five
        // leave a fifth of this (`higher_orders_are_no_worse`).
        (Probe::studio(), 0.05),
        (Probe::sky(), 0.01),
        (sun(), 0.002),
        (Probe::constant([0.3, 0.5, 2.0]), 1e-3),
    ] {
        let truth = NaturalLight::of(&probe);
        let pixels = lab.pixels(&probe, &matte());
        let [mean, largest] = errors(&pixels, |pixel| truth.white_diffuse(pixel.normal));
        println!("{}: mean error {mean:.5}, largest {largest:.5}", probe.name);
        assert!(mean < most, "{}: {mean}", probe.name);
    }
}

#[test]
fn higher_orders_are_no_worse() {
    let mut lab = Lab::new();
    let probe = Probe::studio();
    let truth = NaturalLight::of(&probe);
    let mut error = |order: i64| {
        let mut matte = matte();
        matte.insert("sh-order".to_owned(), Value::Int(order));
        matte.insert("window".to_owned(), Value::Bool(false));
        errors(&lab.pixels(&probe, &matte), |pixel| truth.white_diffuse(pixel.normal))[0]
    };
    let by_order: Vec<f64> = (1..=5).map(&mut error).collect();
    println!("{by_order:?}");
    assert!(by_order[1] < 0.5 * by_order[0] && by_order[3] < by_order[1], "{by_order:?}");
    // Odd orders above 1 have no part in matte light.
    assert!((by_order[2] - by_order[1]).abs() < 1e-6 && (by_order[4] - by_order[3]).abs() < 1e-6);
}

#[test]
fn nothing_gets_darker_than_black() {
    let mut lab = Lab::new();
    for probe in &probes() {
        for model in ["ggx", "thesis"] {
            let pixels = lab.pixels(probe, &values(&[("model", text(model))]));
            let least = pixels.iter().flat_map(|p| p.color).fold(f64::INFINITY, f64::min);
            assert!(least >= 0.0, "{} by {model}: {least}", probe.name);
        }
    }
    // Also where the sun stays among the harmonics: the window alone prevents it.
    let mut with_window = matte();
    with_window.insert("sun".to_owned(), Value::Bool(false));
    let least =
        |pixels: &[Pixel]| pixels.iter().flat_map(|p| p.color).fold(f64::INFINITY, f64::min);
    assert!(least(&lab.pixels(&sun(), &with_window)) >= -1e-4);
    with_window.insert("window".to_owned(), Value::Bool(false));
    assert!(least(&lab.pixels(&sun(), &with_window)) < -0.1, "the window has nothing to do");
}

/// Six colours, one around each axis: x red, -x cyan, y green, -y magenta, z blue, -z yellow.
fn color_of(direction: DVec3) -> [f32; 3] {
    let largest = direction.abs().max_element();
    let axis = (0..3).find(|&k| direction[k].abs() == largest).unwrap();
    let towards = direction[axis] > 0.0;
    let mut color = [if towards { 0.0 } else { 1.0 }; 3];
    color[axis] = if towards { 1.0 } else { 0.0 };
    color
}

/// The six colours as a picture of a mapping.
fn six_colors(mapping: Mapping) -> Picture {
    let (width, height) = match mapping {
        Mapping::LatLong => (512, 256),
        Mapping::VerticalCross => (384, 512),
        Mapping::HorizontalCross => (512, 384),
        _ => (512, 512),
    };
    let texel = |i: u32| {
        let at = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n);
        let direction = mapping.direction(at(i % width, width), at(i / width, height));
        direction.map_or([0.0; 3], color_of)
    };
    Picture { width, height, rgb: (0..width * height).map(texel).collect() }
}

#[test]
fn every_mapping_shows_each_axis_in_its_color() {
    let mut lab = Lab::new();
    for mapping in Mapping::ALL {
        let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
        let near_axis = |direction: DVec3| direction.abs().max_element() > 0.9;
        let mut seen = [0; 6];
        for pixel in lab.pixels(&probe, &all_reflected(0.0)) {
            let mirrored = 2.0 * pixel.normal.dot(TO_EYE) * pixel.normal - TO_EYE;
            if !near_axis(mirrored) || pixel.normal.z < 0.2 {
                continue;
            }
            let expected = color_of(mirrored);
            for (found, expected) in pixel.color.iter().zip(expected) {
                assert!(
                    (found - f64::from(expected)).abs() < 0.02,
                    "{}: towards {mirrored} is {:?}, not {expected:?}",
                    mapping.name(),
                    pixel.color
                );
            }
            let axis = (0..3).find(|&k| mirrored[k].abs() > 0.9).unwrap();
            seen[2 * axis + usize::from(mirrored[axis] < 0.0)] += 1;
        }
        // Straight behind the sphere nothing can be seen in it.
        assert!(seen[..5].iter().all(|n| *n > 0), "{}: {seen:?}", mapping.name());
    }
}

#[test]
fn backgrounds_show_the_environment_where_nothing_else_is() {
    let mut lab = Lab::new();
    let mapping = Mapping::LatLong;
    let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
    let environment = around(&probe);
    for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
        let up = if axis.y.abs() > 0.5 { DVec3::Z } else { DVec3::Y };
        lab.view.camera = Camera {
            eye: 5.0 * axis,
            target: 10.0 * axis,
            up,
            projection: Projection::Perspective { fov_y: 0.3 },
        };
        for how in ["sharp", "blurred"] {
            let values = values(&[("background", text(how))]);
            let rendered = lab.rendered(Some((&environment, &probe)), &values);
            let color = rendered.image(&Output::Color).unwrap();
            for pixel in color.data.chunks_exact(4) {
                let expected = color_of(axis);
                let close = pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02);
                assert!(close && pixel[3] == 1.0, "{how} towards {axis}: {pixel:?}");
            }
        }
    }
}

#[test]
fn parallel_views_see_the_same_background_at_any_scale() {
    let mut lab = Lab::new();
    let probe = Probe::sky();
    let environment = around(&probe);
    // Past the sphere, so that nothing else is seen.
    lab.view.camera.eye = DVec3::new(10.0, 0.0, 4.0);
    lab.view.camera.target = DVec3::new(10.0, 0.5, 0.0);
    let mut corner = |height: f64| {
        lab.view.camera.projection = Projection::Orthographic { height };
        let asked = values(&[("background", text("sharp"))]);
        let rendered = lab.rendered(Some((&environment, &probe)), &asked);
        rendered.image(&Output::Color).unwrap().pixel(0, 0).to_vec()
    };
    let usual = corner(2.5);
    assert!(usual[0] > 0.0);
    for height in [0.0025, 12.0] {
        assert_eq!(corner(height), usual, "{height}");
    }
}

#[test]
fn dim_light_keeps_its_digits() {
    let mut lab = Lab::new();
    let bright = Probe::studio();
    let mut picture = bright.picture.clone();
    // A power of two: nothing is lost on the way.
    let scale = 2f32.powi(-30);
    picture.rgb.iter_mut().flatten().for_each(|value| *value *= scale);
    let dim = Probe::from_picture("dim", picture, None).unwrap();
    let reference = lab.pixels(&bright, &all_reflected(0.2));
    for (dim, bright) in lab.pixels(&dim, &all_reflected(0.2)).iter().zip(&reference) {
        let found = dim.color[1] / f64::from(scale);
        assert!((found - bright.color[1]).abs() < 2e-3 * bright.color[1] + 1e-6, "{found}");
    }
}

#[test]
fn turning_the_light_is_turning_the_world() {
    let mut lab = Lab::new();
    let mapping = Mapping::Octahedral;
    let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
    let mut environment = around(&probe);
    // A quarter about y: what came from x comes from -z.
    environment.probe_from_world = glam::DMat3::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    environment.gain = 2.0;
    let seen = pixels(&lab.rendered(Some((&environment, &probe)), &all_reflected(0.0)));
    let in_front = seen.iter().max_by(|a, b| a.normal.z.total_cmp(&b.normal.z)).unwrap();
    // The mirrored direction is z; x of the probe lies at -z now, so -x lies at z.
    let expected = color_of(DVec3::NEG_X).map(|c| 2.0 * f64::from(c));
    for (found, expected) in in_front.color.iter().zip(expected) {
        assert!((found - expected).abs() < 0.05, "{:?}", in_front.color);
    }
}

#[test]
fn extremes_stay_finite_and_bounded() {
    let mut lab = Lab::new();
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
                    let rendered = lab.rendered(Some((&environment, probe)), &values);
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
fn rough_surfaces_agree_with_the_sum_where_the_split_is_exact() {
    let mut errors_found = Vec::new();
    // Seen along the normal, the map is filtered by the very lobe: what remains is its texels, the
    // levels between two of them, and sampling, a hundredth each.
    let mut lab = Lab::new();
    for (probe, most) in [(Probe::studio(), 0.03), (Probe::sky(), 0.03)] {
        let truth = NaturalLight::of(&probe);
        for roughness in [0.4, 0.6, 0.8, 1.0] {
            let mut once = all_reflected(roughness);
            once.insert("multiple-scattering".to_owned(), Value::Bool(false));
            let pixels = lab.pixels(&probe, &once);
            let ahead: Vec<Pixel> =
                pixels.into_iter().filter(|pixel| pixel.normal.z > 0.998).collect();
            let expected = |p: &Pixel| truth.ggx(p.normal, TO_EYE, roughness, 1.0);
            let [mean, _] = errors(&ahead, expected);
            println!("{} at roughness {roughness}: {mean:.4}", probe.name);
            errors_found.push((mean, most, probe.name.clone()));
        }
    }
    for (mean, most, name) in errors_found {
        assert!(mean < most, "{name}: {mean}");
    }
}

#[test]
fn light_on_each_surfel_is_near_that_on_each_pixel() {
    let mut lab = Lab::new();
    for probe in [Probe::constant([1.0, 0.5, 0.25]), Probe::studio(), Probe::sky()] {
        for model in ["ggx", "thesis"] {
            // A dull surface: highlights of the sun change within a surfel.
            let mut asked = values(&[
                ("model", text(model)),
                ("antialias", Value::Bool(false)),
                ("roughness", Value::Float(1.0)),
                ("c", Value::Float(1.0)),
            ]);
            let by_pixel = lab.pixels(&probe, &asked);
            asked.insert("shading".to_owned(), text("surfel"));
            let by_surfel = lab.pixels(&probe, &asked);
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
    let subset = pixels(&lab.rendered_of(Some((&environment, &probe)), &asked, 8));
    assert!(subset.len() > 900);
    for pixel in subset {
        assert!((pixel.color[1] - 0.5).abs() < 1e-3, "{:?}", pixel.color);
    }
    // Background, lights and accessibility work alike.
    let environment = around(&Probe::sky());
    let asked = values(&[("shading", text("surfel")), ("background", text("sharp"))]);
    let probe = Probe::sky();
    let rendered = lab.rendered(Some((&environment, &probe)), &asked);
    let color = rendered.image(&Output::Color).unwrap();
    assert!(color.data.chunks_exact(4).all(|p| p[3] == 1.0 && p[0] > 0.0));
}

#[test]
fn every_variant_of_the_shader_draws() {
    let mut lab = Lab::new();
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
                        let rendered = lab.rendered(Some((&environment, &probe)), &values);
                        let bright =
                            pixels(&rendered).iter().map(|p| p.color[1]).fold(0.0, f64::max);
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

#[test]
fn what_a_scene_does_not_need_is_left_out() {
    let mut lab = Lab::new();
    let probe = Probe::studio();
    let environment = around(&probe);
    let light = Some((&environment, &probe));
    let none = lab.rendered(None, &Values::new());
    assert_eq!(ran(&none, PassState::Ran), ["environment"]);
    assert_eq!(lab.engine.counters().environments, 0, "no map is uploaded");
    let matte_only = lab.rendered(light, &matte());
    assert_eq!(ran(&matte_only, PassState::Ran), ["environment"], "no specular passes");
    assert_eq!(lab.engine.counters().environments, 1);
    let first = lab.rendered(light, &Values::new());
    let n_filters = ran(&first, PassState::Ran).len() - 1;
    assert!(n_filters > 3, "{:?}", first.passes);
    // Prefiltered once: neither another roughness nor a turn of the light needs it again.
    let mut turned = environment.clone();
    turned.probe_from_world = glam::DMat3::from_rotation_y(1.0);
    let rough = values(&[("roughness", Value::Float(0.9))]);
    let second = lab.rendered(Some((&turned, &probe)), &rough);
    assert_eq!(ran(&second, PassState::Ran), ["environment"]);
    assert_eq!(ran(&second, PassState::Reused).len(), n_filters);
    assert_eq!(lab.engine.counters().environments, 1);
}

#[test]
fn lights_of_the_scene_are_added_but_for_those_that_follow_the_camera() {
    let mut lab = Lab::new();
    let dark = Probe::constant([0.0; 3]);
    let towards = DVec3::new(0.6, 0.0, 0.8);
    let radiance = glam::Vec3::new(1.0, 2.0, 3.0);
    let brightest = |lab: &mut Lab| {
        let pixels = lab.pixels(&dark, &matte());
        pixels.iter().map(|p| p.color[1]).fold(0.0, f64::max)
    };
    lab.scene.lights = vec![Light::Directional { towards, radiance, follows_camera: true }];
    assert_eq!(brightest(&mut lab), 0.0);
    lab.scene.lights.push(Light::Directional { towards, radiance, follows_camera: false });
    for pixel in lab.pixels(&dark, &matte()) {
        let expected = 2.0 * pixel.normal.dot(towards).max(0.0);
        assert!((pixel.color[1] - expected).abs() < 2e-3, "{} for {expected}", pixel.color[1]);
    }
    // A highlight where the light is mirrored, in either model.
    for model in ["ggx", "thesis"] {
        let shiny = values(&[("model", text(model)), ("kd", Value::Float(0.0))]);
        let pixels = lab.pixels(&dark, &shiny);
        let half = (towards + TO_EYE).normalize_or(DVec3::Z);
        let best = pixels.iter().max_by(|a, b| a.color[1].total_cmp(&b.color[1])).unwrap();
        assert!(best.color[1] > 0.02 && best.normal.dot(half) > 0.98, "{model}");
        assert!(pixels.iter().flat_map(|p| p.color).all(|c| c.is_finite() && c >= 0.0));
    }
    // Without an environment all of them shine.
    let all = pixels(&lab.rendered(None, &matte()));
    assert!(all.iter().map(|p| p.color[1]).fold(0.0, f64::max) > 3.9);
}
