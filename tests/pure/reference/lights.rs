//! Lights with a place in the path tracer: how light falls with the distance, and where shadows lie.

use crate::reference::{Lab, code, int, is_near, mean, parallel};
use glam::{DVec3, Vec3};
use surfelshop_api::params::Value;
use surfelshop_api::{Light, View};
use surfelshop_image::TracedPicture;
use surfelshop_tests::clouds::Surfels;

/// Half the side of the plane at y = 0, and of the square above it.
const PLANE: f32 = 2.0;
const SQUARE: f32 = 0.5;
/// Half the picture's side, scene units, and its side in pixels.
const SEEN: f64 = 1.8;
const SIZE: u32 = 72;
/// Radius of the discs.
const DISC: f32 = 0.06;

/// A plane at y = 0, with its albedo.
fn plane() -> (Surfels, f64) {
    let (code, albedo) = code(0.6);
    let mut surfels = Surfels::default();
    add_square(&mut surfels, PLANE, 0.0, Vec3::Y);
    surfels.colors = vec![code; surfels.positions.len()];
    (surfels, albedo)
}

/// The same below a square of two sides.
fn plane_below(height: f32) -> (Surfels, f64) {
    let (mut surfels, albedo) = plane();
    for normal in [Vec3::Y, -Vec3::Y] {
        add_square(&mut surfels, SQUARE, height, normal);
    }
    surfels.colors.resize(surfels.positions.len(), surfels.colors[0]);
    (surfels, albedo)
}

/// Discs 0.05 apart that end where the square does.
fn add_square(surfels: &mut Surfels, half: f32, height: f32, normal: Vec3) {
    let n = (half * 40.0) as i32;
    for i in 0..n * n {
        let at = |k: i32| (k as f32 + 0.5) / 20.0 - half;
        surfels.push(Vec3::new(at(i % n), height, at(i / n)), normal, DISC);
    }
}

/// From above, below the square.
fn view() -> View {
    parallel(DVec3::new(0.0, 0.9, 0.0), DVec3::ZERO, 2.0 * SEEN, SIZE)
}

/// The place on the plane that a position of the picture shows.
fn place([x, y]: [f64; 2]) -> DVec3 {
    let view = view();
    let (start, _) = view.ray(x, y);
    let place = view.camera.eye + view.camera.view_from_world().transpose() * start;
    DVec3::new(place.x, 0.0, place.z)
}

fn center(at: [u32; 2]) -> DVec3 {
    place(at.map(|k| f64::from(k) + 0.5))
}

/// What a white plane at y = 0 radiates under a light of intensity 1.
fn on_the_plane(light: DVec3, place: DVec3) -> f64 {
    (light.y / light.distance(place)) / light.distance_squared(place)
}

fn traced(lab: &Lab, surfels: &Surfels, samples: i64, filter: bool) -> TracedPicture {
    let values = [("samples", int(samples)), ("bounces", int(0)), ("filter", Value::Bool(filter))];
    lab.picture(surfels, view(), &values)
}

fn green(picture: &TracedPicture, [x, y]: [u32; 2]) -> f64 {
    f64::from(picture.color.pixel(x, y)[1])
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE * SIZE).map(|i| [i % SIZE, i / SIZE])
}

fn under(position: DVec3, intensity: f32) -> Lab {
    let mut lab = Lab::new();
    lab.scene.lights = vec![Light::Point { position, intensity: Vec3::splat(intensity) }];
    lab
}

/// Over pixels whose distance to the light differs by a factor of six, ring by ring.
///
/// Invariant: in the tracer light falls with the square of the distance within three standard
/// errors, and shadows lie where straight lines end
#[test]
fn light_of_a_point_falls_with_the_square_of_the_distance() {
    let (surfels, albedo) = plane();
    let light = DVec3::new(0.1, 0.4, -0.2);
    let lab = under(light, 0.5);
    // So many that three standard errors of a ring are below a thousandth of its light.
    let picture = traced(&lab, &surfels, 1024, true);
    // The mean over a pixel, as paths go all over it: 8 x 8 places leave less than a thousandth of
    // what it differs from the middle.
    let expected = |at: [u32; 2]| {
        let step = |k: u32, i: u32| f64::from(k) + (f64::from(i) + 0.5) / 8.0;
        let places = (0..64).map(|i| place([step(at[0], i % 8), step(at[1], i / 8)]));
        albedo * 0.5 * places.map(|place| on_the_plane(light, place)).sum::<f64>() / 64.0
    };
    for ring in 0..8 {
        let within = |at: [u32; 2]| {
            let distance = center(at).distance(light.with_y(0.0));
            (f64::from(ring) * 0.25..f64::from(ring + 1) * 0.25).contains(&distance)
        };
        let n = pixels().filter(|at| within(*at)).count() as f64;
        let truth = pixels().filter(|at| within(*at)).map(expected).sum::<f64>() / n;
        let (found, error) = mean(&picture, within);
        assert!(3.0 * error < 1e-3 * truth || ring < 2, "ring {ring}: {error} of {truth}");
        // Discs of a plane are no approximation; f32 is.
        is_near((found, error), truth, 1e-5 * truth);
    }
    // Through the middles of pixels there is no chance.
    let sharp = traced(&lab, &surfels, 1, false);
    for at in pixels() {
        let truth = albedo * 0.5 * on_the_plane(light, center(at));
        let off = (green(&sharp, at) / truth - 1.0).abs();
        // Places are f32 of a few units, and 0.4 away.
        assert!(off < 1e-5, "{at:?}: {off}");
    }
}

/// A square one unit above the plane, a light three above it: the shadow is half again as large as
/// the square, and moved away from the light by half of how far that is off the middle.
#[test]
fn a_point_casts_its_shadow_where_straight_lines_end() {
    let (surfels, albedo) = plane_below(1.0);
    let light = DVec3::new(1.0, 3.0, -0.4);
    let picture = traced(&under(light, 5.0), &surfels, 1, false);
    let (mut n_dark, mut n_lit) = (0, 0);
    for at in pixels() {
        let place = center(at);
        // Where the line to the light passes the square's height, from the square's middle.
        let passed = place + (light - place) / 3.0;
        let out = passed.x.abs().max(passed.z.abs()) - f64::from(SQUARE);
        // Discs end up to their radius outside of the square, and within it nowhere.
        if out > f64::from(DISC) {
            let truth = albedo * 5.0 * on_the_plane(light, place);
            assert!((green(&picture, at) / truth - 1.0).abs() < 1e-5, "{at:?}");
            n_lit += 1;
        } else if out < 0.0 {
            assert_eq!(green(&picture, at), 0.0, "{at:?}");
            n_dark += 1;
        }
    }
    // 1.5 squared in pixels of 0.05 squared is 900, of which the picture's edge cuts off none.
    assert!((850..950).contains(&n_dark) && n_lit > 3500, "{n_dark} {n_lit}");
}

#[test]
fn what_lies_beyond_a_point_casts_no_shadow() {
    let (surfels, albedo) = plane_below(1.0);
    // Below the square, and nearly in its plane.
    for light in [DVec3::new(0.1, 0.5, 0.0), DVec3::new(0.0, 0.99, 0.1)] {
        let picture = traced(&under(light, 1.0), &surfels, 1, false);
        for at in pixels() {
            let truth = albedo * on_the_plane(light, center(at));
            assert!((green(&picture, at) / truth - 1.0).abs() < 1e-5, "{light} {at:?}");
        }
    }
    // Just above it the square hides it: the same test, and it can fail.
    let picture = traced(&under(DVec3::new(0.0, 1.01, 0.1), 1.0), &surfels, 1, false);
    assert_eq!(green(&picture, [SIZE / 2; 2]), 0.0);
}

/// A spot straight down: a disc of light of radius `height tan(angle)`, with what `Light` says of soft
/// edges within.
#[test]
fn a_spot_lights_its_cone() {
    let (surfels, albedo) = plane();
    let (position, angle) = (DVec3::new(0.2, 1.5, 0.1), 0.6f64);
    for softness in [0.0, 0.5, 1.0] {
        let mut lab = Lab::new();
        let (target, intensity) = (position.with_y(0.0), Vec3::splat(2.0));
        let light = Light::Spot { position, target, intensity, angle, softness };
        lab.scene.lights = vec![light];
        let picture = traced(&lab, &surfels, 1, false);
        let (mut n_lit, mut n_between) = (0, 0);
        for at in pixels() {
            let place = center(at);
            let from_axis = (place.distance(target) / position.y).atan();
            if (from_axis - angle).abs() < 1e-5 {
                continue;
            }
            let full = angle * (1.0 - f64::from(softness));
            let t = (from_axis.cos() - angle.cos()) / (full.cos() - angle.cos()).max(1e-300);
            let t = t.clamp(0.0, 1.0);
            let share = t * t * (3.0 - 2.0 * t);
            let truth = albedo * 2.0 * on_the_plane(position, place) * share;
            let off = (green(&picture, at) - truth).abs();
            assert!(off < 1e-5, "softness {softness}, {at:?}: {off} off {truth}");
            n_lit += i32::from(share > 0.0);
            n_between += i32::from(share > 0.05 && share < 0.95);
        }
        // pi (1.5 tan 0.6)^2 / 0.05^2 is 1323 pixels.
        assert!((1280..1360).contains(&n_lit), "{n_lit}");
        assert_eq!(n_between > 200, softness > 0.0, "{n_between}");
    }
}

#[test]
fn lights_on_the_surface_and_beyond_all_numbers_leave_pictures_finite() {
    let (surfels, _) = plane();
    let places = [0.0, 1e-7, 1e30, f64::INFINITY, f64::NAN];
    for y in places {
        let picture = traced(&under(DVec3::new(0.025, y, 0.025), f32::MAX), &surfels, 4, true);
        let data = &picture.color.data;
        assert!(data.iter().all(|value| value.is_finite() && *value >= 0.0), "{y}");
    }
}
