//! Pictures of both renderers against the plain one in f64.
//!
//! Where they may differ: coefficients of orders above 0 are stored with eleven bits (of fifteen of at most 0.4 each, 1e-4
//! in the mean of a splat and less of a pixel), and what is left out below 1e-4 of the light. Where rounding decides
//! whether a splat's 1/255 counts, a pixel is off by 0.004 at most: 3e-4 in the mean where that happens to 40 of 6,300.
//! That is 70 dB; 96 to 125 were measured.

use super::reference::{self, Kind, Pixel};
use super::stage::{self, Gaussians};
use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Projection, View};
use surfelshop_geometry::harmonics;
use surfelshop_render::Rendered;
use surfelshop_tests::stage::{each_way, engine, fresh_engine};

/// Decibels at least.
const LEAST: f64 = 70.0;

/// What the filters of the renderer `gaussians` are.
const FILTERS: [(&str, Kind); 3] = [
    ("classic", Kind::Space { low_pass: 0.3, keeps_sum: false }),
    ("mip", Kind::Space { low_pass: 0.1, keeps_sum: true }),
    ("none", Kind::Space { low_pass: 0.0, keeps_sum: false }),
];

/// Views of a ball of radius 1 about the origin.
pub(super) fn views() -> [(&'static str, View); 6] {
    let [perspective, wide] = [0.7, 1.4].map(|fov_y| Projection::Perspective { fov_y });
    let parallel = Projection::Orthographic { height: 2.2 };
    let view = |eye: [f64; 3], target: [f64; 3], projection: Projection| {
        let [eye, target] = [eye, target].map(DVec3::from_array);
        let camera = Camera { eye, target, up: DVec3::new(0.1, 1.0, 0.0), projection };
        View { camera, size_px: [90, 70], near: 0.02, far: 20.0 }
    };
    [
        ("far", view([1.3, 1.9, 5.6], [0.0; 3], perspective)),
        ("whole", view([-2.0, 0.7, 2.2], [0.0; 3], perspective)),
        ("close", view([0.5, 0.9, 0.8], [0.1, 0.2, 0.0], perspective)),
        ("inside", view([0.1, -0.05, 0.2], [0.6, 0.3, -0.4], wide)),
        ("grazing", view([1.02, 0.0, 1.5], [1.0, 0.05, 0.0], wide)),
        ("parallel", view([1.0, 1.5, 3.0], [0.0; 3], parallel)),
    ]
}

/// Holds pictures of a renderer with these settings against the plain one; the decibels of the worst.
fn agree(unit: &str, kind: Kind, order: usize, values: &Values, views: &[(&str, View)]) {
    let all = Gaussians::generated(2500);
    let cloud = all.cloud();
    let expected =
        |(_, view): &(&str, View)| reference::colors(&reference::draw(&all, view, kind, order));
    let expected: Vec<_> = views.iter().map(expected).collect();
    each_way(|| {
        let mut engine = engine();
        let mut renderer = stage::renderer(&engine, unit);
        for ((name, view), expected) in views.iter().zip(&expected) {
            let (clouds, outputs) = ([&cloud], [Output::Color]);
            let frame =
                stage::frame(&mut engine, &mut renderer, &clouds, *view, values, &outputs).unwrap();
            let found = stage::pixels(&frame, &Output::Color);
            let covered = expected.iter().filter(|pixel| pixel[3] > 0.1).count();
            assert!(10 * covered > expected.len(), "{name}: something is seen");
            let [color, coverage] = stage::decibels(&found, expected);
            let line =
                format!("{unit} {values:?} {name}: {color:.1} dB, coverage {coverage:.1} dB");
            stage::say(&line);
            assert!(color > LEAST && coverage > LEAST, "{line}");
        }
    });
}

/// The plain renderer's harmonics are the host's. Costs no time.
#[test]
fn harmonics_of_the_plain_renderer_are_those_of_the_host() {
    for direction in harmonics::directions(50) {
        let basis = harmonics::basis(direction);
        for l in 0..4i32 {
            for m in -l..=l {
                let own = reference::harmonic(l, m, direction);
                assert!((own - basis[(l * (l + 1) + m) as usize]).abs() < 1e-12, "{l} {m}");
            }
        }
    }
}

/// Costs 2 s.
#[test]
fn gaussians_in_space_look_as_the_formulas_say() {
    for (filter, kind) in FILTERS {
        let values = stage::values(&[("filter", stage::text(filter))]);
        agree("gaussians", kind, 3, &values, &views());
    }
}

/// Costs 1.5 s.
#[test]
fn gaussians_in_planes_look_as_the_formulas_say() {
    agree("gaussians-2d", Kind::Plane, 3, &Values::new(), &views());
}

/// Costs 2 s.
#[test]
fn fewer_orders_of_harmonics_are_drawn_where_that_is_said() {
    for order in 0..=3 {
        let values = stage::values(&[("order", Value::Int(order as i64))]);
        agree("gaussians", FILTERS[0].1, order, &values, &views()[1..2]);
        agree("gaussians-2d", Kind::Plane, order, &values, &views()[5..]);
    }
}

/// A cloud that has fewer orders than are drawn. Costs 0.3 s.
#[test]
fn orders_that_a_cloud_lacks_count_as_none() {
    let all = Gaussians::generated(600);
    let mut engine = engine();
    let mut renderer = stage::renderer(&engine, "gaussians");
    let (_, view) = views()[1];
    for left in 0..3 {
        let mut fewer = all.clone();
        fewer.harmonics[left + 1..].iter_mut().for_each(Vec::clear);
        let (cloud, outputs) = (fewer.cloud(), [Output::Color]);
        let none = Values::new();
        let frame =
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &outputs).unwrap();
        let expected = reference::colors(&reference::draw(&fewer, &view, FILTERS[0].1, 3));
        let [color, _] = stage::decibels(&stage::pixels(&frame, &Output::Color), &expected);
        assert!(color > LEAST, "{left}: {color:.1} dB");
    }
}

/// How far numbers are apart, of the second, where pixels count; sorted.
fn apart(found: &[f32], expected: &[Pixel], number: impl Fn(&Pixel) -> Option<f64>) -> Vec<f64> {
    let of = |(found, expected): (&f32, &Pixel)| {
        number(expected).map(|number| (f64::from(*found) / number - 1.0).abs())
    };
    let mut apart: Vec<f64> = found.iter().zip(expected).filter_map(of).collect();
    assert!(10 * apart.len() > found.len(), "of {} pixels {} count", found.len(), apart.len());
    apart.sort_by(f64::total_cmp);
    apart
}

/// A share of a sorted list.
pub(super) fn at(list: &[f64], share: f64) -> f64 {
    list[((list.len() - 1) as f64 * share) as usize]
}

/// Depths are right to rounding, which a plane seen from its side enlarges; where it decides which of the plane and the
/// widened centre is met, or whether a splat counts, a few pixels have the depth of the other one. Costs 2.5 s.
#[test]
fn depths_and_normals_of_planes_are_those_that_rays_meet() {
    let all = Gaussians::generated(2500);
    let cloud = all.cloud();
    let expected = views().map(|(_, view)| reference::draw(&all, &view, Kind::Plane, 3));
    each_way(|| {
        let mut engine = engine();
        let mut renderer = stage::renderer(&engine, "gaussians-2d");
        for ((name, view), expected) in views().iter().zip(&expected) {
            let (none, outputs) = (Values::new(), stage::outputs());
            let frame = stage::frame(&mut engine, &mut renderer, &[&cloud], *view, &none, &outputs);
            depths_and_normals_agree(name, &frame.unwrap(), expected);
        }
    });
}

fn depths_and_normals_agree(name: &str, frame: &Rendered, expected: &[Pixel]) {
    let firsts = |output: &Output| stage::firsts(frame.image(output).unwrap());
    let (median, mean) = (firsts(&Output::Depth), firsts(&stage::expected_depth()));
    // A splat that rounding leaves out changes the light that is let through by 1/255.
    let is_sure = |pixel: &Pixel| pixel.median > 0.0 && pixel.to_half > 0.005;
    let median = apart(&median, expected, |p| is_sure(p).then_some(p.median));
    let mean = apart(&mean, expected, |p| (p.color[3] > 0.05).then_some(p.expected));
    let normals = stage::pixels(frame, &Output::Normal);
    let angle = |(found, expected): (&[f32; 4], &Pixel)| {
        let found = Vec3::from_slice(&found[..3]).as_dvec3();
        (expected.color[3] > 0.05).then_some((found - expected.normal).length())
    };
    let mut normals: Vec<f64> = normals.iter().zip(expected).filter_map(angle).collect();
    normals.sort_by(f64::total_cmp);
    let of = |list: &[f64]| [0.5, 0.99, 1.0].map(|share| format!("{:.1e}", at(list, share)));
    let line = format!(
        "{name}: median depth {:?}, expected {:?}, normals {:?}",
        of(&median),
        of(&mean),
        of(&normals)
    );
    stage::say(&line);
    // Ten times what was measured, or more.
    assert!(at(&median, 0.5) < 1e-6 && at(&mean, 0.5) < 3e-6, "{line}");
    assert!(at(&median, 0.99) < 1e-5 && at(&mean, 0.99) < 3e-4, "{line}");
    assert!(at(&normals, 0.5) < 2e-5 && at(&normals, 0.99) < 1e-3, "{line}");
}

/// Pixels with nothing, or too little, in them have the depth 0. Costs 0.2 s.
#[test]
fn nothing_has_no_depth_and_no_normal() {
    let mut all = Gaussians::default();
    all.push(Vec3::ZERO, [0.2; 3], glam::Quat::IDENTITY, 0.4, [0.0; 3]);
    let cloud = all.cloud();
    let mut engine = fresh_engine();
    let (_, view) = views()[1];
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        let (none, outputs) = (Values::new(), stage::outputs());
        let frame =
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &outputs).unwrap();
        let at = |output: &Output, x: u32, y: u32| frame.image(output).unwrap().pixel(x, y)[0];
        assert_eq!(at(&Output::Depth, 45, 35), 0.0, "{unit}: less than half is kept off");
        let distance = at(&stage::expected_depth(), 45, 35);
        // Its centre lies at distance |(-2, 0.7, 2.2)|; a plane that is met beside it is as near as a tenth.
        assert!((distance - 3.054).abs() < 0.1, "{unit}: {distance}");
        assert_eq!(at(&stage::expected_depth(), 0, 0), 0.0, "{unit}");
        let corner = frame.image(&Output::Normal).unwrap().pixel(0, 0);
        assert_eq!(corner, [0.0; 4], "{unit}");
    }
}

/// Settings that stand for other columns. Costs 0.3 s.
#[test]
fn settings_do_what_other_columns_would() {
    let all = Gaussians::generated(800);
    let mut halved = all.clone();
    halved.scales.iter_mut().flatten().for_each(|scale| *scale *= 0.5);
    let mut clear = all.clone();
    clear.opacities.iter_mut().filter(|opacity| **opacity < 0.4).for_each(|opacity| *opacity = 0.0);
    let (_, view) = views()[1];
    let mut engine = engine();
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        let mut draw = |all: &Gaussians, pairs: &[(&str, Value)]| {
            let (values, outputs) = (stage::values(pairs), stage::outputs());
            let cloud = all.cloud();
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &values, &outputs).unwrap()
        };
        let size = draw(&all, &[("size", Value::Float(0.5))]);
        stage::equal_bits(&size, &draw(&halved, &[]), "size");
        let opaque = draw(&all, &[("least-opacity", Value::Float(0.4))]);
        stage::equal_bits(&opaque, &draw(&clear, &[]), "least-opacity");
        let encoded = stage::pixels(&draw(&all, &[]), &Output::Color);
        let linear = draw(&all, &[("space", stage::text("linear"))]);
        for (encoded, linear) in encoded.iter().zip(stage::pixels(&linear, &Output::Color)) {
            for channel in 0..3 {
                let expected = stage::encoded(f64::from(encoded[channel]));
                assert!((f64::from(linear[channel]) - expected).abs() < 1e-5);
            }
        }
    }
}
