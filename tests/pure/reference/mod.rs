//! The path tracer against answers that are known, how fast it gets there, and that it gets to the same
//! on any number of threads.

mod lights;

use glam::{DVec3, Vec3};
use std::sync::Arc;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{
    Camera, Environment, FrameRequest, Light, Projection, Scene, SurfaceSettings, UnitKind, View,
};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_image::TracedPicture;
use surfelshop_runtime::plugins::{LoadedUnit, Timeouts};
use surfelshop_runtime::trace::{TraceOrder, samples_of, trace};
use surfelshop_tests::clouds::Surfels;
use surfelshop_tests::natural_light::around;
use surfelshop_tests::stage;

struct Lab {
    unit: LoadedUnit,
    threads: usize,
    scene: Scene,
    probe: Option<Probe>,
}

impl Lab {
    fn new() -> Self {
        let unit = stage::built_unit("surfelshop-reference", UnitKind::Tracer, "reference");
        let surface = SurfaceSettings { two_sided: false, ..SurfaceSettings::default() };
        let scene = Scene { lights: Vec::new(), surface, ..Scene::default() };
        Self { unit, threads: 0, scene, probe: None }
    }

    /// In even light of radiance 1 from everywhere.
    fn in_even_light() -> Self {
        Self { probe: Some(Probe::constant([1.0; 3])), ..Self::new() }
    }

    fn picture(&self, surfels: &Surfels, view: View, values: &[(&str, Value)]) -> TracedPicture {
        let values: Values = values.iter().map(|(id, v)| ((*id).to_owned(), v.clone())).collect();
        let cloud = surfels.cloud();
        let environment: Option<Environment> = self.probe.as_ref().map(around);
        let texels: Arc<[[f32; 3]]> = match &self.probe {
            Some(probe) => {
                let environment = around(probe);
                Arc::from(surfelshop_tests::natural_light::view_of(&environment, probe).texels)
            }
            None => Arc::default(),
        };
        let order = TraceOrder {
            request: FrameRequest {
                view,
                scene: self.scene.clone(),
                cloud: cloud.facts().clone(),
                frame_index: 0,
                values: values.clone(),
                environment,
            },
            clouds: vec![cloud],
            texels,
            samples: samples_of(&self.unit, &values),
            threads: self.threads,
        };
        trace(&self.unit, order, &Timeouts::default(), |_| true).unwrap()
    }
}

/// Mean and standard error of the green channel over the pixels that `counts` by its place.
fn mean(picture: &TracedPicture, counts: impl Fn([u32; 2]) -> bool) -> (f64, f64) {
    let width = picture.color.width;
    let (mut sum, mut variance, mut n) = (0.0, 0.0, 0.0);
    let pixels = picture.color.data.as_chunks::<4>().0.iter();
    for (i, (color, own)) in pixels.zip(picture.variance.data.as_chunks::<4>().0).enumerate() {
        let at = [i as u32 % width, i as u32 / width];
        if color[3] > 0.0 && counts(at) {
            sum += f64::from(color[1]);
            variance += f64::from(own[1]);
            n += 1.0;
        }
    }
    assert!(n > 0.0);
    (sum / n, variance.sqrt() / n)
}

/// Three standard errors, and what discs are off from the surface they stand for.
#[track_caller]
fn is_near((found, error): (f64, f64), expected: f64, of_discs: f64) {
    let most = 3.0 * error + of_discs;
    assert!((found - expected).abs() <= most, "{found} for {expected}, {most} allowed");
}

fn parallel(eye: DVec3, target: DVec3, height: f64, size: u32) -> View {
    let projection = Projection::Orthographic { height };
    let up =
        if (eye - target).x.abs() + (eye - target).z.abs() > 0.0 { DVec3::Y } else { DVec3::X };
    let camera = Camera { eye, target, up, projection };
    View { camera, size_px: [size; 2], near: 1e-3, far: 100.0 }
}

/// Points evenly over the unit sphere.
fn spiral(n: usize) -> impl Iterator<Item = Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..n).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), golden * i as f64);
        DVec3::new(r * angle.cos(), r * angle.sin(), z).as_vec3()
    })
}

/// sRGB code whose linear value is an albedo, about; and that value.
fn code(albedo: f64) -> ([u8; 3], f64) {
    let code = (surfelshop_api::params::linear_to_srgb(albedo as f32) * 255.0).round();
    let linear = surfelshop_api::params::srgb_to_linear(code / 255.0);
    ([code as u8; 3], f64::from(linear))
}

fn int(value: i64) -> Value {
    Value::Int(value)
}

/// The inside of half a sphere, open to -z. Its outermost discs end at the rim, about.
fn bowl(n: usize, albedo: f64) -> (Surfels, f64) {
    let (code, albedo) = code(albedo);
    let mut surfels = Surfels::default();
    let radius = 1.6 * (4.0 * std::f32::consts::PI / n as f32).sqrt();
    for place in spiral(n).filter(|place| place.z > 0.75 * radius) {
        surfels.push(place, -place, radius);
    }
    surfels.colors = vec![code; surfels.positions.len()];
    (surfels, albedo)
}

/// A convex body of albedo rho in even light radiates rho, whatever the number of reflections.
#[test]
fn a_sphere_in_even_light_radiates_its_albedo() {
    let (code, albedo) = code(0.7);
    let mut sphere = surfelshop_tests::clouds::sphere(20_000, 1.0);
    sphere.colors = vec![code; sphere.positions.len()];
    let lab = Lab::in_even_light();
    let view = parallel(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 2.2, 48);
    for model in ["lambert", "phong", "ggx"] {
        let values = [
            ("samples", int(64)),
            ("model", Value::Text(model.to_owned())),
            ("ks", Value::Float(0.0)),
        ];
        is_near(mean(&lab.picture(&sphere, view, &values), |_| true), albedo, 0.004);
    }
}

/// Every point of a bowl that is half a sphere sees the bowl with half its sky, whatever the point, so
/// that in even light it radiates (rho / 2) sum (rho / 2)^k over as many reflections: rho / (2 - rho)
/// after all of them. The rim is as ragged as its discs are large, 0.014, which moves the share of the
/// sky by half of that.
///
/// Invariant: the reference gives the answers that are known of bowls, spheres, squares and
/// shadows, errs as the root of its samples, and is the same on any number of threads
#[test]
fn a_bowl_gains_with_each_reflection_what_the_series_says() {
    let lab = Lab::in_even_light();
    let view = parallel(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, 1.2, 32);
    let (surfels, albedo) = bowl(160_000, 0.8);
    for bounces in [0, 1, 2, 5] {
        let values = [("samples", int(128)), ("bounces", int(bounces))];
        let half = 0.5 * albedo;
        let expected: f64 = (0..=bounces as i32).map(|k| half * half.powi(k)).sum();
        is_near(mean(&lab.picture(&surfels, view, &values), |_| true), expected, 0.007);
    }
    // Nothing is lost or won where nothing is absorbed.
    let (white, albedo) = bowl(160_000, 1.0);
    let values = [("samples", int(128)), ("bounces", int(64))];
    is_near(mean(&lab.picture(&white, view, &values), |_| true), albedo / (2.0 - albedo), 0.014);
}

/// A unit square sees one opposite, one unit away, with 0.1998 of its sky.
///
/// Source: Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", C-11, in closed form.
#[test]
fn opposite_squares_have_their_form_factor() {
    let mut surfels = Surfels::default();
    let n = 80;
    let at = |i: usize| (i as f32 + 0.5) / n as f32 - 0.5;
    let radius = 0.75 / n as f32;
    for i in 0..n * n {
        let (x, y) = (at(i % n), at(i / n));
        surfels.push(Vec3::new(x, y, 0.0), Vec3::Z, radius);
        surfels.push(Vec3::new(x, y, 1.0), -Vec3::Z, radius);
    }
    let lab = Lab::new();
    // From between the squares.
    let view = parallel(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, 1.0, 64);
    let values = [("samples", int(128)), ("mode", Value::Text("ambient-occlusion".to_owned()))];
    let (open, error) = mean(&lab.picture(&surfels, view, &values), |_| true);
    let x: f64 = 1.0;
    let form = 2.0 / (std::f64::consts::PI * x * x)
        * (((1.0 + x * x).powi(2) / (1.0 + 2.0 * x * x)).sqrt().ln()
            + 2.0 * x * (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan()
            - 2.0 * x * x.atan());
    assert!((form - 0.1998).abs() < 1e-4, "{form}");
    // Discs reach a radius, 0.0094, over the edge of the upper square, the form factor's derivative by
    // its half width is below 0.5.
    is_near((1.0 - open, error), form, 0.005);
}

/// Light falls on a plane at its cosine, and not where a square stands in its way.
#[test]
fn a_light_on_a_plane_casts_a_sharp_shadow() {
    let (code, albedo) = code(0.6);
    let mut surfels = Surfels::default();
    let grid = |n: i32| (0..n * n).map(move |i| (i % n, i / n));
    for (x, y) in grid(80) {
        let place = Vec3::new(x as f32 - 39.5, 0.0, y as f32 - 39.5) / 20.0;
        surfels.push(place, Vec3::Y, 0.06);
    }
    for (x, y) in grid(20) {
        let place = Vec3::new((x as f32 - 9.5) / 20.0, 1.0, (y as f32 - 9.5) / 20.0);
        surfels.push(place, Vec3::Y, 0.06);
        surfels.push(place, -Vec3::Y, 0.06);
    }
    surfels.colors = vec![code; surfels.positions.len()];
    let mut lab = Lab::new();
    let towards = DVec3::new(1.0, 1.0, 0.0);
    let light = Light::Directional { towards, radiance: Vec3::splat(2.0), follows_camera: false };
    lab.scene.lights = vec![light];
    // Between the plane and the square, which lies at 1.
    let view = parallel(DVec3::new(0.0, 0.9, 0.0), DVec3::ZERO, 3.6, 72);
    let picture = lab.picture(&surfels, view, &[("samples", int(16)), ("bounces", int(0))]);
    // The square spans -0.5 to 0.5 and its shadow lies one unit towards -x: where is told by what is dark.
    let dark = |at: [u32; 2]| {
        let i = (at[1] * 72 + at[0]) as usize;
        picture.color.data[4 * i + 1] < 0.01
    };
    let n_dark = (0..72 * 72).filter(|i| dark([i % 72, i / 72])).count();
    // A unit square of 1.04 (with its discs' edges) is 400 to 460 pixels of 0.05 squared.
    assert!((380..480).contains(&n_dark), "{n_dark}");
    // Its middle is the square's, one unit from there; discs' edges move it by less than a pixel.
    let middle = view.camera.view_from_world() * (DVec3::NEG_X - view.camera.eye);
    let expected = [36.0 + 20.0 * middle.x, 36.0 - 20.0 * middle.y];
    let places = (0..72 * 72).map(|i| [i % 72, i / 72]).filter(|at| dark(*at));
    let sums = places.fold([0.0; 2], |sum, [x, y]| [sum[0] + f64::from(x), sum[1] + f64::from(y)]);
    for (sum, expected) in sums.into_iter().zip(expected) {
        let found = sum / f64::from(n_dark as u32) + 0.5;
        assert!((found - expected).abs() < 1.0, "{found} {expected}");
    }
    let lit = |at: [u32; 2]| {
        let i = (at[1] * 72 + at[0]) as usize;
        picture.color.data[4 * i + 1] > 0.8 * 2.0 * albedo as f32 * 0.7
    };
    is_near(mean(&picture, lit), 2.0 * albedo * 0.5f64.sqrt(), 0.002);
}

/// Errors fall with the root of the number of paths: fitted over powers of four, no shallower than
/// -0.45. The truth has 64 times as many as the last, so that its own error bends the line by less than
/// a hundredth. Of 64 pixels with three channels the slope is known to 0.016.
#[test]
fn errors_fall_with_the_root_of_the_paths() {
    let lab = Lab { probe: Some(Probe::studio()), ..Lab::new() };
    let (surfels, _) = bowl(4000, 0.8);
    let view = parallel(DVec3::new(0.5, 0.5, -3.0), DVec3::ZERO, 1.2, 8);
    let picture = |samples: i64, seed: i64| {
        lab.picture(&surfels, view, &[("samples", int(samples)), ("seed", int(seed))])
    };
    let truth = picture(16_384, 1);
    let error = |samples: i64| {
        let found = picture(samples, 2);
        let pairs = found.color.data.iter().zip(&truth.color.data);
        let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
        let measured = (squares / (3.0 * 64.0)).sqrt();
        // What the picture says of itself is what is measured.
        let told = found.standard_error();
        assert!((0.7..1.4).contains(&(told / measured)), "{samples}: {told} told, {measured}");
        measured
    };
    let points: Vec<(f64, f64)> =
        [4, 16, 64, 256].iter().map(|&n| ((n as f64).ln(), error(n).ln())).collect();
    let n = points.len() as f64;
    let center = |k: fn(&(f64, f64)) -> f64| points.iter().map(k).sum::<f64>() / n;
    let (x, y) = (center(|p| p.0), center(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    assert!(slope < -0.45, "{slope}");
}

#[test]
fn pictures_are_the_same_on_any_number_of_threads() {
    let (surfels, _) = bowl(2000, 0.8);
    let view = parallel(DVec3::new(0.5, 0.5, -3.0), DVec3::ZERO, 2.4, 80);
    let mut lab = Lab { probe: Some(Probe::sky()), ..Lab::new() };
    let mut picture = |threads: usize, seed: i64| {
        lab.threads = threads;
        lab.picture(&surfels, view, &[("samples", int(5)), ("seed", int(seed))])
    };
    let one = picture(1, 0);
    for threads in [2, 5] {
        let other = picture(threads, 0);
        assert_eq!(one.color, other.color);
        assert_eq!(one.variance, other.variance);
        assert_eq!(one.halves, other.halves);
    }
    assert_ne!(picture(1, 1).color, one.color);
}
