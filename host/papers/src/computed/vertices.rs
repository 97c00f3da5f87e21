//! Mirrored rays computed at vertices or at pixels, with erratum T15 of the thesis.
//!
//! A ball of surfels in the light of a probe. Fragments see what their vertices have, blended by Gaussians.

use super::mapping::Map;
use super::sky::Sky;
use super::specular::{BLUR, SHARE};
use super::surface::Surface;
use super::{Bench, Computed};
use crate::clouds::{GOLDEN, spiral};
use anyhow::bail;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use surfelshop_cloud::environment_map::Mapping;
use surfelshop_geometry::hashing;
use surfelshop_image::{Image, metrics};

/// Vertices of the ball.
const N_VERTICES: u32 = 6_000;

/// Half the angle of the cone around the mirrored ray, radians.
const CONE: f64 = BLUR;

/// A direction within the cone, evenly distributed.
fn within_cone(axis: DVec3, i: u32) -> DVec3 {
    let random = |counter: u64| hashing::fraction(hashing::scattered(counter));
    let cosine = 1.0 - random(2 * u64::from(i)) * (1.0 - CONE.cos());
    let (sin, cos) = (TAU * random(2 * u64::from(i) + 1)).sin_cos();
    let (a, b) = axis.any_orthonormal_pair();
    axis * cosine + (a * cos + b * sin) * (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// The mean radiance of a cap around a direction by a weight of the cosine with it.
fn mean(sky: &Sky, axis: DVec3, half_angle: f64, weight: impl Fn(f64) -> f64) -> DVec3 {
    let n = 800;
    let (a, b) = axis.any_orthonormal_pair();
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for i in 0..n {
        let cosine = 1.0 - (f64::from(i) + 0.5) / f64::from(n) * (1.0 - half_angle.cos());
        let (sin, cos) = (GOLDEN * f64::from(i)).sin_cos();
        let towards = axis * cosine + (a * cos + b * sin) * (1.0 - cosine * cosine).sqrt();
        sum += sky.radiance(towards) * weight(cosine);
        weights += weight(cosine);
    }
    sum / weights
}

/// How far neighbours are apart, in radii of the ball.
fn spacing() -> f64 {
    (4.0 * PI / f64::from(N_VERTICES)).sqrt()
}

/// What the ball shows of a map whose coordinates its vertices have.
fn of_vertices(ball: &Surface, map: &Map, rays: &[(DVec3, DVec3)]) -> Image {
    let places: Vec<(DVec3, [f64; 2])> =
        rays.iter().map(|(normal, ray)| (*normal, Mapping::Angular.place(*ray))).collect();
    // A Gaussian reaches the next ones.
    let width = spacing();
    let nearest = 1.0 - 4.5 * width * width;
    ball.shaded(|n, _| {
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        for (normal, place) in &places {
            let cosine = n.dot(*normal);
            if cosine > nearest {
                let weight = ((cosine - 1.0) / (0.5 * width * width)).exp();
                sum[0] += weight * place[0];
                sum[1] += weight * place[1];
                weights += weight;
            }
        }
        SHARE * map.at(sum.map(|sum| sum / f64::max(weights, 1e-12)))
    })
}

/// The erratum.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    if which != "T15" {
        bail!("there is no erratum {which} of vertices");
    }
    let sky = Sky::read(bench.path("rnl")?)?;
    let ball = Surface::ball(bench.size());
    let truth = ball.shaded(|n, _| SHARE * mean(&sky, ball.mirrored(n), CONE, |_| 1.0));
    // A Gaussian of the sphere as wide: its mean of 1 - cos is that of the cone. It ends at four deviations.
    let sharpness = 2.0 / (1.0 - CONE.cos());
    let gaussian = |cosine: f64| (sharpness * (cosine - 1.0)).exp();
    let corrected = ball.shaded(|n, _| SHARE * mean(&sky, ball.mirrored(n), 2.0 * CONE, gaussian));
    // Those that the eye sees.
    let normals: Vec<DVec3> =
        spiral(N_VERTICES as usize).filter(|normal| normal.z > -0.2).collect();
    let mirrored = |random: bool| -> Vec<(DVec3, DVec3)> {
        let ray = |(i, normal): (usize, &DVec3)| {
            let ray = ball.mirrored(*normal);
            (*normal, if random { within_cone(ray, i as u32) } else { ray })
        };
        normals.iter().enumerate().map(ray).collect()
    };
    let map = Map::of(&sky);
    let printed = of_vertices(&ball, &map, &mirrored(true));
    let still_rays = mirrored(false);
    let still = of_vertices(&ball, &map, &still_rays);
    // One random ray of each pixel by itself: nothing is blended.
    let size = f64::from(ball.size);
    let alone = ball.shaded(|n, _| {
        let at = |c: f64| ((c + 1.05) / 2.1 * size) as u32;
        let i = at(n.y).wrapping_mul(ball.size).wrapping_add(at(n.x));
        SHARE * map.at(Mapping::Angular.place(within_cone(ball.mirrored(n), i)))
    });
    let mut all = Computed::pair(&printed, &corrected, &truth)?;
    let sharp = ball.shaded(|n, _| SHARE * map.at(Mapping::Angular.place(ball.mirrored(n))));
    for (what, picture, against) in [
        ("RMSE of coordinates blended between vertices, against those of pixels", &still, &sharp),
        ("RMSE of one random ray for each pixel, against the mean", &alone, &truth),
    ] {
        let found = metrics::compare(picture, against, &metrics::Settings::default())?;
        all.number(what, found.errors.map_or(f64::NAN, |errors| errors.rmse), "");
    }
    let width = spacing();
    let across = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let texels: Vec<(DVec3, [f64; 2])> =
        still_rays.iter().map(|(n, ray)| (*n, Mapping::Angular.place(*ray))).collect();
    let mut most = 0.0f64;
    for (i, (normal, place)) in texels.iter().enumerate() {
        let near = texels[..i].iter().filter(|(other, _)| other.distance(*normal) < 1.5 * width);
        most = near.map(|(_, other)| across(place, other)).fold(most, f64::max);
    }
    all.number("largest distance of two neighbours' coordinates", most, "of the map's side");
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_rays_fill_the_cone_evenly() {
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize_or_zero();
        let n = 20_000;
        let rays: Vec<DVec3> = (0..n).map(|i| within_cone(axis, i)).collect();
        assert!(rays.iter().all(|ray| ray.dot(axis) >= CONE.cos() - 1e-9));
        let mean = rays.iter().sum::<DVec3>() / f64::from(n);
        let (along, off) = (mean.dot(axis), mean.reject_from(axis).length());
        // Of evenly distributed directions the mean cosine is the middle of 1 and that of the rim. The standard error
        // across is sin(CONE) / (2 sqrt(n)), 7e-4.
        assert!((along - 0.5 * (1.0 + CONE.cos())).abs() < 3e-4, "{along}");
        assert!(off < 3e-3, "{off}");
    }
}
