//! Clouds of Gaussians and of surfels in one scene.

use super::stage::{self, Gaussians};
use glam::{DVec3, Quat, Vec3};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_cloud::{Cloud, Transform};
use surfelshop_render::RenderError;
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::stage::{each_way, engine, view};

const SIZE: u32 = 64;

/// A wall of red surfels at z = 0.
fn wall() -> Cloud {
    let mut surfels = Surfels::default();
    for i in 0..40 * 40 {
        let [x, y] = [i % 40, i / 40].map(|k| 0.1 * (k as f32 - 19.5));
        surfels.push(Vec3::new(x, y, 0.0), Vec3::Z, 0.1);
        surfels.colors.push([200, 40, 30]);
    }
    surfels.cloud()
}

/// Gaussians of one place each on a slope that goes through the wall at x = 0.
fn slope() -> Gaussians {
    let mut all = Gaussians::default();
    for i in 0..60 * 60 {
        let [x, y] = [i % 60, i / 60].map(|k| 0.04 * (k as f32 - 29.5));
        all.push(Vec3::new(x, y, x), [0.03; 3], Quat::IDENTITY, 0.9, [-1.0, 0.2, 1.5]);
    }
    all
}

fn front() -> View {
    view(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, SIZE)
}

/// Colours of clouds, encoded as Gaussians' are, and coverage.
fn colors(unit: &str, clouds: &[&Cloud]) -> Vec<[f64; 4]> {
    let mut engine = engine();
    let mut renderer = stage::renderer(&engine, unit);
    let (none, outputs) = (Values::new(), [Output::Color]);
    let frame = stage::frame(&mut engine, &mut renderer, clouds, front(), &none, &outputs).unwrap();
    stage::all_finite(&frame, unit);
    let encoded = |[r, g, b, a]: [f32; 4]| {
        let [r, g, b] = [r, g, b].map(|c| stage::encoded(f64::from(c)));
        [r, g, b, f64::from(a)]
    };
    stage::pixels(&frame, &Output::Color).into_iter().map(encoded).collect()
}

/// How far a picture is from another in a column of pixels.
fn apart(a: &[[f64; 4]], b: &[[f64; 4]], column: usize) -> f64 {
    let of = |row: usize| {
        let at = row * SIZE as usize + column;
        (0..4).map(|k| (a[at][k] - b[at][k]).abs()).fold(0.0, f64::max)
    };
    (0..SIZE as usize).map(of).fold(0.0, f64::max)
}

/// One over the other in the space of their colours.
fn over(front: &[[f64; 4]], back: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let of = |(front, back): (&[f64; 4], &[f64; 4])| {
        std::array::from_fn(|k| front[k] + (1.0 - front[3]) * back[k])
    };
    front.iter().zip(back).map(of).collect()
}

/// Costs 1.5 s.
#[test]
fn surfaces_hide_gaussians_behind_them_and_are_hidden_by_those_before_them() {
    each_way(|| {
        let (wall, slope) = (wall(), slope().cloud());
        let behind = Transform { translation: DVec3::new(0.0, 0.0, -5.0), ..Transform::default() };
        let hidden = slope.transformed(&behind).unwrap();
        for unit in stage::UNITS {
            let surface = colors(unit, &[&wall, &hidden]);
            let alone = colors(unit, &[&slope]);
            for clouds in [[&wall, &slope], [&slope, &wall]] {
                let both = colors(unit, &clouds);
                let expected = over(&alone, &surface);
                // The slope is at the wall's depth in the middle; a Gaussian is seen 3 standard deviations off.
                for column in (0..28).chain(38..SIZE as usize) {
                    let (expected, what) = match column < 32 {
                        true => (&surface, "the surface"),
                        false => (&expected, "Gaussians over the surface"),
                    };
                    let apart = apart(&both, expected, column);
                    assert!(apart < 1e-3, "{unit}: column {column} is {apart} off {what}");
                }
            }
            let seen = alone[32 * SIZE as usize + 45];
            assert!(seen[3] > 0.9, "{unit}: the slope is dense: {seen:?}");
        }
    });
}

/// A large Gaussian in a plane that cuts the wall: each pixel has a depth of its own. Costs 0.6 s.
#[test]
fn planes_are_cut_by_surfaces_pixel_by_pixel() {
    each_way(|| {
        let wall = wall();
        let mut all = Gaussians::default();
        let turn = Quat::from_rotation_y(-0.9);
        all.push(Vec3::ZERO, [0.8, 0.8, 0.01], turn, 0.9, [-1.0, 0.2, 1.5]);
        let disc = all.cloud();
        let behind = Transform { translation: DVec3::new(0.0, 0.0, -5.0), ..Transform::default() };
        let surface = colors("gaussians-2d", &[&wall, &disc.transformed(&behind).unwrap()]);
        let alone = colors("gaussians-2d", &[&disc]);
        let both = colors("gaussians-2d", &[&disc, &wall]);
        let expected = over(&alone, &surface);
        let differs = |column: usize| apart(&both, &surface, column) > 0.05;
        let sides: Vec<bool> = (16..48).map(differs).collect();
        // Where the plane goes through the wall, at the edge between two pixels, rounding may decide.
        let first = sides.iter().position(|differs| *differs).unwrap();
        assert!((15..=17).contains(&first) && sides[first..].iter().all(|d| *d), "{sides:?}");
        for column in 34..48 {
            let apart = apart(&both, &expected, column);
            assert!(apart < 1e-3, "column {column}: {apart}");
        }
        for column in 0..30 {
            assert!(apart(&both, &surface, column) < 1e-3, "column {column}");
        }
    });
}

/// Costs 0.2 s.
#[test]
fn surfels_alone_are_refused_by_what_they_lack() {
    let mut engine = engine();
    let surfels = clouds::sphere(500, 1.0).cloud();
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        let (none, outputs) = (Values::new(), [Output::Color]);
        let refused =
            stage::frame(&mut engine, &mut renderer, &[&surfels], front(), &none, &outputs);
        let error = refused.err().unwrap();
        assert!(matches!(error, RenderError::Needs(_)), "{error:?}");
        let line = error.to_string();
        for word in ["splat_scale", "splat_rotation", "another renderer"] {
            assert!(line.contains(word) && !line.contains('\n'), "{line}");
        }
        let good = Gaussians::generated(10).cloud();
        stage::frame(&mut engine, &mut renderer, &[&good], front(), &none, &outputs).unwrap();
    }
}
