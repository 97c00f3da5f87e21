//! Curves of the drawings of Phong splatting: fits of normals, projection, and planes.

use super::Computed;
use super::camera::Splat;
use super::curves::{Line, chart, sampled};
use super::splats::{cap, fitted_slope};
use glam::DVec3;

/// A figure's curves, by name.
pub(super) fn curves(name: &str) -> anyhow::Result<Computed> {
    match name {
        "normal-fit" => fits(),
        "projective" => projective(),
        _ => planes(),
    }
}

/// The largest angle between a cap's normals and a field, degrees, over its disc along an axis.
fn largest_angle(steepest: f64, field: impl Fn(f64) -> DVec3) -> f64 {
    let at = |u: f64| cap([u, 0.0], steepest).angle_between(field(u)).to_degrees();
    sampled(-1.0, 1.0, at).iter().map(|point| point.1).fold(0.0, f64::max)
}

fn fits() -> anyhow::Result<Computed> {
    let linear = |degrees: f64| {
        let steepest = degrees.to_radians();
        let slope = fitted_slope(steepest, 75f64.to_radians());
        largest_angle(steepest, |u| DVec3::new(slope * u, 0.0, 1.0))
    };
    let constant = |degrees: f64| largest_angle(degrees.to_radians(), |_| DVec3::Z);
    let lines = [
        Line { name: "one normal", points: sampled(1.0, 70.0, constant) },
        Line { name: "linear field", points: sampled(1.0, 70.0, linear) },
    ];
    let mut all = Computed::default();
    let plot = chart(
        "largest error of a splat's normals",
        "normals at the rim, degrees",
        "degrees",
        &lines,
    )?;
    all.drawing("a cap of a ball", plot);
    all.number("error of one normal where the rim leans by 30 degrees", constant(30.0), "degrees");
    all.number("error of a linear field there", linear(30.0), "degrees");
    Ok(all)
}

/// How far the affine image of a splat's rim is from the image of it, over the affine one's extent.
fn affine_error(tilt: f64, ratio: f64) -> f64 {
    let (sin, cos) = tilt.sin_cos();
    let splat = Splat {
        center: DVec3::new(0.0, 0.0, -1.0),
        axes: [DVec3::X * ratio, DVec3::new(0.0, cos, sin) * ratio],
    };
    let image = |p: DVec3| p.truncate() / -p.z;
    let h = 1e-6;
    let slopes = splat.axes.map(|axis| (image(splat.center + axis * h) - image(splat.center)) / h);
    let mut worst: f64 = 0.0;
    for k in 0..360 {
        let (v, u) = f64::from(k).to_radians().sin_cos();
        let exact = image(splat.center + splat.axes[0] * u + splat.axes[1] * v);
        let affine = image(splat.center) + slopes[0] * u + slopes[1] * v;
        worst = worst.max(exact.distance(affine));
    }
    worst / ratio
}

fn projective() -> anyhow::Result<Computed> {
    let along =
        |ratio: f64| sampled(0.0, 89.0, move |degrees| affine_error(degrees.to_radians(), ratio));
    let lines = [
        Line { name: "radius 0.02 of the distance", points: along(0.02) },
        Line { name: "radius 0.1", points: along(0.1) },
        Line { name: "radius 0.3", points: along(0.3) },
    ];
    let mut all = Computed::default();
    let plot =
        chart("what an affine projection misses", "tilt, degrees", "radii of the splat", &lines)?;
    all.drawing("a splat before the eye", plot);
    all.number("at 60 degrees, radius 0.1", affine_error(60f64.to_radians(), 0.1), "radii");
    Ok(all)
}

/// Largest distances of samples of z = x^2 + k y^2 from the tangent plane and from the plane of least squares.
fn distances(k: f64) -> [f64; 2] {
    let n = 60;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
    let heights: Vec<f64> = (0..n * n)
        .map(|i| [at(i % n), at(i / n)])
        .filter(|[x, y]| x * x + y * y <= 1.0)
        .map(|[x, y]| 0.1 * (x * x + k * y * y))
        .collect();
    // Of samples that lie evenly around the middle the plane of least squares is level.
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    [0.0, mean].map(|plane| heights.iter().map(|h| (h - plane).abs()).fold(0.0, f64::max))
}

fn planes() -> anyhow::Result<Computed> {
    let ratio = |k: f64| {
        let [tangent, fitted] = distances(k);
        fitted / tangent
    };
    let lines = [Line { name: "fitted over tangent", points: sampled(-1.0, 1.0, ratio) }];
    let mut all = Computed::default();
    let plot = chart(
        "distance of a fitted plane over that of the tangent plane",
        "curvature of the other direction",
        "",
        &lines,
    )?;
    all.drawing("a bend, from a saddle to a bowl", plot);
    all.number(
        "a bowl: error of the plane of least squares over the tangent plane's",
        ratio(1.0),
        "",
    );
    all.number("a fold", ratio(0.0), "");
    all.number("a saddle", ratio(-1.0), "");
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_of_least_squares_is_half_as_far_from_a_bowl() {
        let [tangent, fitted] = distances(1.0);
        assert!((fitted / tangent - 0.5).abs() < 0.02, "{fitted} {tangent}");
    }

    #[test]
    fn an_affine_projection_is_right_head_on_and_of_small_splats() {
        assert!(affine_error(0.0, 0.1) < 1e-4);
        assert!(affine_error(1.0, 0.001) < 2e-3 && affine_error(1.0, 0.3) > 0.1);
    }
}
