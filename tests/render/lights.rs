//! Lights with a place: what renderers make of them is what `Light` says, in f64, on both drivers,
//! also where they lie on the surface, far away and beyond all numbers.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{
    Backend, Engine, EngineOptions, GpuOptions, RenderRequest, Rendered, RendererView,
};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::{evaluated_light, stage, twin};

/// A renderer with what its lighting is called in the twin.
struct Unit {
    name: &'static str,
    values: Values,
    phong: twin::Phong,
}

fn units() -> [Unit; 3] {
    let values = |pairs: &[(&str, f64)]| {
        pairs.iter().map(|(id, value)| ((*id).to_owned(), Value::Float(*value))).collect()
    };
    let matte = twin::Phong { diffuse: 1.0, specular: 0.0, shininess: 1.0, ambient: 0.0 };
    [
        Unit {
            name: "flat",
            values: values(&[("ambient", 0.08)]),
            phong: twin::Phong { ambient: 0.08, ..matte },
        },
        Unit {
            name: "ewa-phong",
            values: values(&[("specular", 0.25), ("shininess", 64.0), ("ambient", 0.08)]),
            phong: twin::Phong { specular: 0.25, shininess: 64.0, ambient: 0.08, ..matte },
        },
        Unit { name: "environment", values: values(&[("ks", 0.0), ("kd", 1.0)]), phong: matte },
    ]
}

const OUTPUTS: [Output; 4] = [Output::Color, Output::Normal, Output::Albedo, Output::Depth];

fn engine(backend: Backend) -> Engine {
    let gpu = GpuOptions { backend: Some(backend), ..GpuOptions::default() };
    stage::engine_with(&gpu, &EngineOptions::default())
}

fn render(engine: &mut Engine, unit: &Unit, cloud: &Cloud, scene: &Scene, view: View) -> Rendered {
    let mut renderer = opened(engine, unit);
    render_again(engine, &mut renderer, unit, cloud, scene, view)
}

fn opened(engine: &mut Engine, unit: &Unit) -> RendererView {
    stage::built_renderer(engine, &format!("surfelshop-{}", unit.name), unit.name)
}

fn render_again(
    engine: &mut Engine,
    renderer: &mut RendererView,
    unit: &Unit,
    cloud: &Cloud,
    scene: &Scene,
    view: View,
) -> Rendered {
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene,
        view,
        values: &unit.values,
        outputs: &OUTPUTS,
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    engine.render(renderer, &request).unwrap()
}

fn color(frame: &Rendered) -> &[f32] {
    &frame.image(&Output::Color).unwrap().data
}

fn lit_by(lights: Vec<Light>) -> Scene {
    Scene { lights, ..Scene::default() }
}

fn point(position: DVec3, intensity: Vec3) -> Light {
    Light::Point { position, intensity }
}

/// One whose cone's edge runs across the unit sphere.
fn spot(softness: f32) -> Light {
    Light::Spot {
        position: DVec3::new(-1.0, 1.2, 1.5),
        target: DVec3::new(0.2, 0.1, 0.5),
        intensity: Vec3::new(0.3, 1.2, 0.9),
        angle: 0.4,
        softness,
    }
}

/// The light of [`spot`] a little narrower or wider: where they differ, rounding decides.
fn turned_by(scene: &Scene, radians: f64) -> Scene {
    let mut scene = scene.clone();
    for light in &mut scene.lights {
        if let Light::Spot { angle, .. } = light {
            *angle += radians;
        }
    }
    scene
}

/// Radiance may differ by this share and as much of 1: f32 has 6e-8, places come from a depth and a
/// direction of that precision at up to ten times the distance to the light, whose square falls twice
/// as fast, and an exponent of 64 makes up to five of it.
const LIGHTING: f64 = 1e-5;

/// Compares what renderers make of the surface that they say they have; the number of pixels.
#[track_caller]
fn equals_lighting(frame: &Rendered, unit: &Unit, scene: &Scene, view: View) -> u32 {
    let [color, normal, albedo, depth] = OUTPUTS.map(|output| frame.image(&output).unwrap());
    let [narrower, wider] = [-1e-4, 1e-4].map(|radians| turned_by(scene, radians));
    let (mut compared, mut left_out, mut worst) = (0, 0, 0.0f64);
    for i in 0..view.size_px[0] * view.size_px[1] {
        let (x, y) = (i % view.size_px[0], i / view.size_px[0]);
        if color.pixel(x, y)[3] == 0.0 {
            continue;
        }
        let vector = |texel: &[f32]| Vec3::from_slice(texel).as_dvec3();
        let pixel = twin::Pixel {
            depth: f64::from(depth.pixel(x, y)[0]),
            normal: vector(normal.pixel(x, y)).normalize_or_zero(),
            albedo: vector(albedo.pixel(x, y)),
            ..twin::Pixel::default()
        };
        let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let expected = |scene: &Scene| twin::shade(&pixel, scene, &view, center, &unit.phong);
        let truth = expected(scene);
        let apart = (expected(&narrower) - expected(&wider)).abs().max_element();
        // Edges that are smooth do not change as much over so small an angle.
        if apart > 0.01 {
            left_out += 1;
            continue;
        }
        let off = (vector(color.pixel(x, y)) - truth).abs() / (truth + 1.0);
        assert!(off.is_finite(), "{}: {:?} for {truth}", unit.name, color.pixel(x, y));
        worst = worst.max(off.max_element());
        compared += 1;
    }
    println!("{}: {compared} pixels, {left_out} left out, off by {worst:.1e}", unit.name);
    assert!(worst < LIGHTING, "{}: off by {worst}", unit.name);
    assert!(50 * left_out <= compared, "{}: {left_out} left out", unit.name);
    compared
}

/// Invariant: points and spots shine in every renderer as the twin says, on Vulkan and OpenGL,
/// and stay finite on the surface and beyond all numbers
#[test]
fn points_and_spots_shine_as_the_twin_says_on_both_drivers() {
    let cloud = clouds::sphere(5_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
    let mut parallel = view;
    parallel.camera.projection = Projection::Orthographic { height: 2.5 };
    parallel.far = 10.0;
    let near = point(DVec3::new(0.6, 0.7, 0.9), Vec3::new(0.1, 0.05, 0.15));
    let sun = Light::Directional {
        towards: DVec3::new(-0.4, 0.1, 0.5),
        radiance: Vec3::new(0.4, 0.5, 0.2),
        follows_camera: true,
    };
    let scenes = [
        lit_by(vec![near]),
        lit_by(vec![spot(0.0)]),
        lit_by(vec![spot(0.6)]),
        lit_by(vec![sun, spot(1.0), near]),
    ];
    for backend in [Backend::Primary, Backend::Gl] {
        let mut engine = engine(backend);
        for unit in &units() {
            for (scene, view) in
                scenes.iter().flat_map(|scene| [view, parallel].map(|view| (scene, view)))
            {
                let frame = render(&mut engine, unit, &cloud, scene, view);
                let dark = render(&mut engine, unit, &cloud, &lit_by(Vec::new()), view);
                assert!(equals_lighting(&frame, unit, scene, view) > 2_000);
                let lit = color(&frame).iter().zip(color(&dark)).filter(|(a, b)| *a > *b).count();
                assert!(lit > 500, "{}: the light is in view: {lit}", unit.name);
            }
        }
    }
}

/// Invariant: shaders are made for what a scene has of lights; lights that come and go change pictures as if the renderer
/// had never seen others
///
/// 0.5 s.
#[test]
fn lights_that_come_and_go_are_seen_by_an_open_renderer() {
    let cloud = clouds::sphere(2_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 64);
    let near = point(DVec3::new(0.6, 0.7, 0.9), Vec3::new(0.1, 0.05, 0.15));
    let sun = |x: f64| Light::Directional {
        towards: DVec3::new(x, 0.1, 0.5),
        radiance: Vec3::new(0.4, 0.5, 0.2),
        follows_camera: false,
    };
    let mut engine = stage::engine();
    let unit = &units()[1];
    let mut open = opened(&mut engine, unit);
    let one = lit_by(vec![sun(-0.4)]);
    let scenes =
        [one.clone(), lit_by(vec![sun(-0.4), sun(0.4)]), lit_by(vec![near]), lit_by(vec![]), one];
    for scene in &scenes {
        let frame = render_again(&mut engine, &mut open, unit, &cloud, scene, view);
        assert!(equals_lighting(&frame, unit, scene, view) > 1_000);
        let fresh = render(&mut engine, unit, &cloud, scene, view);
        assert!(color(&frame) == color(&fresh), "{} lights", scene.lights.len());
    }
}

/// Whatever a renderer makes of light: at each place it is that of the directional light that arrives
/// there.
#[test]
fn highlights_of_every_model_are_those_of_what_arrives() {
    let text = |pairs: &[(&str, &str)]| -> Values {
        pairs
            .iter()
            .map(|(id, value)| ((*id).to_owned(), Value::Text((*value).to_owned())))
            .collect()
    };
    let unit = |name, values| Unit { name, values, ..units()[0] };
    let models = [
        unit("environment", text(&[("model", "ggx")])),
        unit("environment", text(&[("model", "thesis")])),
        unit("procedural", text(&[("lighting", "thesis")])),
        unit("procedural", text(&[("lighting", "natural")])),
        unit("procedural", text(&[("lighting", "phong")])),
    ];
    let cloud = clouds::sphere(5_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 48);
    let mut engine = stage::engine();
    for unit in &models {
        for light in [point(DVec3::new(0.6, 0.7, 0.9), Vec3::new(0.1, 0.05, 0.15)), spot(1.0)] {
            let scene = lit_by(vec![light]);
            let frame = render(&mut engine, unit, &cloud, &scene, view);
            let depth = frame.image(&Output::Depth).unwrap();
            let mut n_lit = 0;
            for at in (0..48 * 48).step_by(37).map(|i| [i % 48, i / 48]) {
                let [x, y] = at;
                if depth.pixel(x, y)[0] == 0.0 {
                    continue;
                }
                let center = at.map(|k| f64::from(k) + 0.5);
                let place = twin::place(&view, center, f64::from(depth.pixel(x, y)[0]));
                let (towards, radiance) = evaluated_light::arriving(&light, &view, place);
                let radiance = radiance.as_vec3();
                let sun = Light::Directional { towards, radiance, follows_camera: false };
                let expected = render(&mut engine, unit, &cloud, &lit_by(vec![sun]), view);
                let [found, truth] = [&frame, &expected].map(|frame| {
                    Vec3::from_slice(frame.image(&Output::Color).unwrap().pixel(x, y))
                });
                let off = ((found - truth).abs() / (truth + 1.0)).max_element();
                assert!(f64::from(off) < LIGHTING, "{}: {found} for {truth}", unit.name);
                n_lit += i32::from(truth.max_element() > 0.05);
            }
            assert!(n_lit >= 3, "{}: the light is in view: {n_lit}", unit.name);
        }
    }
}

/// With lighting for each surfel: places are those of surfels, not of pixels.
#[test]
fn surfels_are_lit_where_they_are() {
    let cloud = clouds::sphere(40_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
    let scene = lit_by(vec![point(DVec3::new(0.6, 0.7, 0.9), Vec3::splat(0.1)), spot(1.0)]);
    let mut engine = stage::engine();
    let [.., mut unit] = units();
    let by_pixel = render(&mut engine, &unit, &cloud, &scene, view);
    unit.values.insert("shading".to_owned(), Value::Text("surfel".to_owned()));
    let by_surfel = render(&mut engine, &unit, &cloud, &scene, view);
    let pairs = color(&by_pixel).iter().zip(color(&by_surfel));
    let off = pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
    let sum = color(&by_pixel).iter().map(|a| f64::from(*a)).sum::<f64>();
    println!("{:.4} of the radiance differ", off / sum);
    // The nearest surfel's centre lies up to a pixel away, where light differs by a hundredth; in the
    // middle of the scene instead it would be dark or several times as bright.
    assert!(off < 0.02 * sum, "{off} of {sum}");
}

/// A plane with a light in it, seen from above.
fn on_a_plane(position: DVec3, intensity: f32) -> (Cloud, Scene, View) {
    let scene = lit_by(vec![point(position, Vec3::splat(intensity))]);
    let view = stage::view(DVec3::new(0.2, 2.0, 1.0), DVec3::ZERO, 64);
    (clouds::plane(40, 1.0).cloud(), scene, view)
}

#[test]
fn a_light_on_the_surface_is_no_brighter_than_at_its_radius() {
    for backend in [Backend::Primary, Backend::Gl] {
        let mut engine = engine(backend);
        for unit in &units() {
            for height in [0.0, 1e-9, 1e-5, 1e-3] {
                let position = DVec3::new(0.1, height, 0.05);
                let (cloud, scene, view) = on_a_plane(position, 0.01);
                let frame = render(&mut engine, unit, &cloud, &scene, view);
                // Two units wide: its radius is a ten-thousandth of that.
                let brightest = 0.01 / 2e-4f32.powi(2) * 1.25 + 0.08;
                let data = color(&frame);
                let finite = data.iter().all(|c| c.is_finite() && *c >= 0.0 && *c <= brightest);
                assert!(finite, "{}, {height}", unit.name);
            }
            // A tenth of the plane's size above it everything is ordinary.
            let (cloud, scene, view) = on_a_plane(DVec3::new(0.1, 0.2, 0.05), 0.05);
            let frame = render(&mut engine, unit, &cloud, &scene, view);
            equals_lighting(&frame, unit, &scene, view);
        }
    }
}

#[test]
fn whatever_a_light_says_pictures_are_finite_and_what_gives_no_light_is_dark() {
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 24);
    let at = DVec3::new(0.0, 0.5, 2.0);
    let of = |position, target, intensity, angle, softness| Light::Spot {
        position,
        target,
        intensity: Vec3::splat(intensity),
        angle,
        softness,
    };
    let dark = [
        of(at, DVec3::ZERO, 1.0, 0.0, 0.0),
        of(at, DVec3::ZERO, 1.0, 0.0, 1.0),
        of(at, DVec3::ZERO, 1.0, -1.0, 0.5),
        of(at, DVec3::ZERO, 1.0, f64::NAN, 0.5),
        of(at, DVec3::ZERO, 0.0, 1.0, 0.5),
        of(at, DVec3::ZERO, f32::NAN, 1.0, 0.5),
        of(at, DVec3::ZERO, -1.0, 1.0, 0.5),
        of(DVec3::splat(f64::NAN), DVec3::ZERO, 1.0, 1.0, 0.5),
        point(DVec3::splat(f64::NAN), Vec3::ONE),
        point(DVec3::new(f64::INFINITY, 0.0, 0.0), Vec3::ONE),
        // Beyond what f64 squares.
        point(DVec3::new(0.0, 0.0, 1e300), Vec3::splat(f32::MAX)),
        // The surface turns its back to it.
        point(DVec3::ZERO, Vec3::ONE),
    ];
    let bright = [
        of(at, at, 1.0, 1.0, f32::NAN),
        of(at, DVec3::ZERO, f32::MAX, 1.0, 0.5),
        of(at, DVec3::splat(f64::NAN), f32::INFINITY, 9.0, 3.0),
        point(at, Vec3::splat(f32::INFINITY)),
        point(DVec3::new(0.0, 0.0, 1e11), Vec3::splat(1e22)),
    ];
    for backend in [Backend::Primary, Backend::Gl] {
        let mut engine = engine(backend);
        for unit in &units() {
            let none = render(&mut engine, unit, &cloud, &lit_by(Vec::new()), view);
            for light in dark {
                let frame = render(&mut engine, unit, &cloud, &lit_by(vec![light]), view);
                assert_eq!(color(&frame), color(&none), "{}: {light:?}", unit.name);
            }
            for light in bright {
                let frame = render(&mut engine, unit, &cloud, &lit_by(vec![light]), view);
                let finite = color(&frame).iter().all(|c| c.is_finite());
                let lit = color(&frame).iter().zip(color(&none)).any(|(a, b)| *a > *b + 0.1);
                assert!(finite && lit, "{}: {light:?}", unit.name);
            }
        }
    }
}

/// One that is so far away that rays are parallel is a directional light.
#[test]
fn a_far_point_is_a_directional_light() {
    let cloud = clouds::sphere(2_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 48);
    let towards = DVec3::new(2.0, 6.0, 3.0) / 7.0;
    let radiance = Vec3::new(1.0, 0.5, 0.25);
    let sun = Light::Directional { towards, radiance, follows_camera: false };
    let mut engine = stage::engine();
    for unit in &units() {
        let expected = render(&mut engine, unit, &cloud, &lit_by(vec![sun]), view);
        for distance in [1e6, 1e9, 1e11] {
            let lamp = point(towards * distance, radiance * (distance * distance) as f32);
            let found = render(&mut engine, unit, &cloud, &lit_by(vec![lamp]), view);
            let pairs = color(&found).iter().zip(color(&expected));
            let off = pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
            // Over two units light differs by 4e-6 where it comes from a million, and the
            // highlight's slope of 5 is that of 2e-6 rad.
            assert!(off < 3e-5, "{}: {off} from {distance:e}", unit.name);
        }
    }
}

fn moved(light: &Light, move_by: impl Fn(DVec3) -> DVec3, brighter: f32) -> Light {
    match *light {
        Light::Point { position, intensity } => {
            Light::Point { position: move_by(position), intensity: intensity * brighter }
        }
        Light::Spot { position, target, intensity, angle, softness } => Light::Spot {
            position: move_by(position),
            target: move_by(target),
            intensity: intensity * brighter,
            angle,
            softness,
        },
        directional @ Light::Directional { .. } => directional,
    }
}

/// Pixels of two pictures of one thing that differ by more than a few levels of 255.
#[track_caller]
fn alike(a: &Rendered, b: &Rendered, what: &str) {
    let differ = color(a).chunks(4).zip(color(b).chunks(4)).filter(|(a, b)| {
        assert!(b.iter().all(|c| c.is_finite()), "{what}");
        a.iter().zip(b.iter()).any(|(a, b)| (a - b).abs() > 0.01)
    });
    // At the edges of discs f32 decides which one is seen.
    let differ = differ.count();
    assert!(500 * differ <= color(a).len() / 4, "{what}: {differ} pixels");
}

#[test]
fn lights_stay_with_clouds_far_from_the_origin_and_of_any_size() {
    let surfels = clouds::sphere(2_000, 1.0);
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 64);
    let lights = [point(DVec3::new(0.6, 0.7, 0.9), Vec3::splat(0.1)), spot(0.6)];
    for unit in &units()[..2] {
        let mut engine = stage::engine();
        let here = render(&mut engine, unit, &surfels.cloud(), &lit_by(lights.to_vec()), view);
        let far = DVec3::new(5e6, -4e6, 3e6);
        let there = Surfels { origin: far, ..surfels.clone() };
        let mut far_view = view;
        far_view.camera.eye += far;
        far_view.camera.target += far;
        let far_lights = lights.map(|light| moved(&light, |place| place + far, 1.0));
        let found =
            render(&mut engine, unit, &there.cloud(), &lit_by(far_lights.to_vec()), far_view);
        alike(&here, &found, &format!("{}, moved", unit.name));
        for factor in [1e-15, 1e-6, 1e6, 1e15] {
            let mut scaled = surfels.clone();
            scaled.positions.iter_mut().for_each(|place| *place *= factor as f32);
            scaled.radii.iter_mut().for_each(|radius| *radius *= factor as f32);
            let mut view = view;
            view.camera.eye *= factor;
            view.near *= factor;
            view.far *= factor;
            let brighter = (factor * factor) as f32;
            let lights = lights.map(|light| moved(&light, |place| place * factor, brighter));
            let found = render(&mut engine, unit, &scaled.cloud(), &lit_by(lights.to_vec()), view);
            alike(&here, &found, &format!("{}, {factor:e}", unit.name));
        }
    }
}

#[test]
fn as_many_lights_as_there_may_be_add_up() {
    let cloud = clouds::sphere(2_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 48);
    let lights: Vec<Light> = (0..Scene::MAX_LIGHTS + 1)
        .map(|i| {
            let around = glam::DVec2::from_angle(i as f64);
            let position = DVec3::new(1.5 * around.x, 1.5 * around.y, 1.0 + 0.2 * i as f64);
            match i % 2 {
                0 => point(position, Vec3::new(0.1, 0.2, 0.05 * i as f32)),
                _ => moved(&spot(0.5), |place| place + 0.1 * position, 1.0),
            }
        })
        .collect();
    let mut engine = stage::engine();
    for unit in &units() {
        let most = lit_by(lights[..Scene::MAX_LIGHTS].to_vec());
        let frame = render(&mut engine, unit, &cloud, &most, view);
        assert!(equals_lighting(&frame, unit, &most, view) > 500);
        // One more is left out.
        let more = render(&mut engine, unit, &cloud, &lit_by(lights.clone()), view);
        assert_eq!(color(&more), color(&frame), "{}", unit.name);
    }
}
