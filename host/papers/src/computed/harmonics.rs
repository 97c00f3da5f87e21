//! The nine harmonics of the thesis, with its errata T2 to T8, T16 and T17.
//!
//! Coefficients are in the order `l (l + 1) + m`, the basis without the sign (-1)^m.

use super::curves::{Line, chart};
use super::sky::Sky;
use super::surface::Surface;
use super::{Bench, Computed};
use crate::clouds::spiral;
use crate::outcome::Grid;
use anyhow::bail;
use glam::DVec3;
use std::f64::consts::PI;
use surfelshop_geometry::harmonics;

/// The reflectance of models that are shown in grey.
const ALBEDO: f64 = 0.4;

/// What the clamped cosine leaves of orders 0, 1, 2, over pi.
const COSINE_OF_ORDER: [f64; 3] = [1.0, 2.0 / 3.0, 0.25];

/// The constants n0 to n4 of eq. 3.
fn constants() -> [f64; 5] {
    let p = PI.sqrt();
    [
        0.5 / p,
        3f64.sqrt() / (2.0 * p),
        15f64.sqrt() / (2.0 * p),
        5f64.sqrt() / (4.0 * p),
        15f64.sqrt() / (4.0 * p),
    ]
}

/// The nine functions.
pub(super) fn basis(d: DVec3) -> [f64; 9] {
    let [n0, n1, n2, n3, n4] = constants();
    [
        n0,
        n1 * d.y,
        n1 * d.z,
        n1 * d.x,
        n2 * d.x * d.y,
        n2 * d.y * d.z,
        n3 * (3.0 * d.z * d.z - 1.0),
        n2 * d.x * d.z,
        n4 * (d.x * d.x - d.y * d.y),
    ]
}

fn order(i: usize) -> usize {
    match i {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    }
}

/// What a white diffuse surface radiates.
fn diffuse(coefficients: &[DVec3; 9], normal: DVec3) -> DVec3 {
    let terms = coefficients.iter().zip(basis(normal)).enumerate();
    terms.map(|(i, (c, y))| *c * y * COSINE_OF_ORDER[order(i)]).sum()
}

/// Coefficients that make of [`diffuse`] what the printed form makes of the right ones.
fn printed(which: &str, sky: &Sky) -> anyhow::Result<[DVec3; 9]> {
    let right = sky.coefficients();
    let scaled = |factor: &dyn Fn(usize) -> f64| std::array::from_fn(|i| right[i] * factor(i));
    let one = |at: usize, value: f64| move |i: usize| if i == at { value } else { 1.0 };
    Ok(match which {
        // l (l + 1) is even: (-1)^index is the negative of the sign that eq. 4 undoes.
        "T2" => scaled(&|_| -1.0),
        // (Y11; Y10; Y1-1) = (x; y; z): the coefficients of y and z change places.
        "T3" => {
            let mut swapped = right;
            swapped.swap(1, 2);
            swapped
        }
        "T4" => scaled(&one(8, 15f64.sqrt())),
        "T5" => scaled(&one(6, 3f64.sqrt())),
        "T6" => scaled(&one(7, 0.0)),
        "T7" => sky.unweighted(basis),
        "T8" => scaled(&|i| ((2 * order(i) + 1) as f64 / (4.0 * PI)).sqrt()),
        "T16" => {
            let sigma = 11.5f64.to_radians();
            scaled(&|i| {
                let l = order(i) as f64;
                (-0.5 * l * (l + 1.0) * sigma * sigma).exp()
            })
        }
        "T17" => right,
        other => bail!("there is no erratum {other} of the harmonics"),
    })
}

/// An erratum in the light of the probe.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let has_albedo = which == "T17";
    let surface = Surface::of(bench, if has_albedo { "chameleon" } else { "igea" })?;
    let sky = Sky::read(bench.path("rnl")?)?;
    let (wrong, right) = (printed(which, &sky)?, sky.coefficients());
    // Else the surface is grey, so that a bright probe leaves it below white.
    let colored =
        |light: DVec3, albedo: DVec3| if has_albedo { light * albedo } else { light * ALBEDO };
    let uncolored = |light: DVec3| if has_albedo { light } else { light * ALBEDO };
    let as_printed = surface.shaded(|n, _| uncolored(diffuse(&wrong, n)));
    let as_corrected = surface.shaded(|n, albedo| colored(diffuse(&right, n), albedo));
    let truth = surface.shaded(|n, albedo| colored(sky.diffuse(n), albedo));
    let mut all = Computed::pair(&as_printed, &as_corrected, &truth)?;
    let mean = |coefficients: &[DVec3; 9]| {
        let all = spread_directions();
        all.iter().map(|d| diffuse(coefficients, *d).element_sum() / 3.0).sum::<f64>()
            / all.len() as f64
    };
    all.number("mean over all normals, as printed", mean(&wrong), "");
    all.number("mean over all normals, as corrected", mean(&right), "");
    Ok(all)
}

/// Directions spread evenly.
fn spread_directions() -> Vec<DVec3> {
    spiral(500).collect()
}

/// Table 1 with numbers, and what the program of section 3.1 makes of it.
pub(super) fn registers(bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    // With the signs of eq. 2, which Table 1 has.
    let signs = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0];
    let right = sky.coefficients();
    let l: [DVec3; 9] = std::array::from_fn(|i| right[i] * signs[i]);
    let [n0, n1, n2, n3, n4] = constants();
    let (h1, h2) = (COSINE_OF_ORDER[1], COSINE_OF_ORDER[2]);
    let (c0, c1, c2, c3, c4) = (n0, h1 * n1, h2 * n2, h2 * n3, h2 * n4);
    let a = [-c1 * l[3], -c1 * l[1], c1 * l[2], c0 * l[0] - c3 * l[6]];
    let b = [c2 * l[4], -c2 * l[5], 3.0 * c3 * l[6], -c2 * l[7]];
    let c = c4 * l[8];
    let program = |n: DVec3| {
        let first = a[0] * n.x + a[1] * n.y + a[2] * n.z + a[3];
        let second = b[0] * n.x * n.y + b[1] * n.y * n.z + b[2] * n.z * n.z + b[3] * n.z * n.x;
        first + second + c * (n.x * n.x - n.y * n.y)
    };
    let mut all = Computed::default();
    let directions = spread_directions();
    let apart = |d: &DVec3| (program(*d) - diffuse(&right, *d)).abs().max_element();
    all.number(
        "largest difference from the nine terms of eq. 4",
        directions.iter().map(apart).fold(0.0, f64::max),
        "",
    );
    let names = ["cAr", "cAg", "cAb", "cBr", "cBg", "cBb", "cC"];
    let mut head = vec![String::new()];
    head.extend(names.map(str::to_owned));
    let row = |name: &str, at: usize| {
        let value = |value: f64| format!("{value:.4}");
        let mut row = vec![name.to_owned()];
        row.extend(a[at].to_array().map(value));
        row.extend(b[at].to_array().map(value));
        row.push(if at < 3 { value(c[at]) } else { "any".to_owned() });
        row
    };
    let rows = ["x", "y", "z", "w"].iter().enumerate().map(|(at, name)| row(name, at)).collect();
    all.tables.push(Grid { caption: "The registers for this probe".to_owned(), head, rows });
    Ok(all)
}

/// The irradiance of eq. 6 by the order of the harmonics, against the sum over all texels.
pub(super) fn irradiance(bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    let directions = spread_directions();
    let truth = sky.diffuse_of_texels(&directions);
    let grey = |light: DVec3| light.element_sum() / 3.0;
    let mean = truth.iter().map(|light| grey(*light)).sum::<f64>() / truth.len() as f64;
    let mut all = Computed::default();
    let found = &sky.probe.facts.harmonics;
    let light = std::array::from_fn(|i| found.get(i).copied().unwrap_or_default());
    for order in [0, 1, 2, 4] {
        let coefficients = harmonics::of_diffuse_surface(&light, order, Default::default());
        let off = |(normal, light): (&DVec3, &DVec3)| {
            let found = DVec3::from(harmonics::evaluate(&coefficients, *normal));
            (grey(found) - grey(*light)).abs() / mean.max(f64::MIN_POSITIVE)
        };
        let errors: Vec<f64> = directions.iter().zip(&truth).map(off).collect();
        let average = errors.iter().sum::<f64>() / errors.len() as f64;
        let largest = errors.iter().copied().fold(0.0, f64::max);
        let what = |which: &str| format!("irradiance to order {order}: {which} error");
        all.number(&what("mean"), 100.0 * average, "%");
        all.number(&what("largest"), 100.0 * largest, "%");
    }
    Ok(all)
}

/// The harmonics by the angle from the axis.
pub(super) fn angles() -> anyhow::Result<Computed> {
    let along = |f: &dyn Fn(DVec3) -> f64| -> Vec<(f64, f64)> {
        (0..=180)
            .map(|degree| {
                let theta = f64::from(degree).to_radians();
                (f64::from(degree), f(DVec3::new(theta.sin(), 0.0, theta.cos())))
            })
            .collect()
    };
    let lines = [0, 2, 3, 6, 7, 8].map(|i| {
        let name = ["Y00", "", "Y10", "Y11", "", "", "Y20", "Y21", "Y22"][i];
        Line { name, points: along(&move |d| basis(d)[i]) }
    });
    let mut all = Computed::default();
    all.drawing(
        "theta in degrees, phi = 0",
        chart("harmonics of a direction", "theta, degrees", "", &lines)?,
    );
    // The angles are those of the functions' definition: orthonormal over the sphere.
    let directions = spread_directions();
    let product = |i: usize, j: usize| {
        let sum: f64 = directions.iter().map(|d| basis(*d)[i] * basis(*d)[j]).sum();
        4.0 * PI * sum / directions.len() as f64
    };
    let worst = (0..9).flat_map(|i| (0..9).map(move |j| (i, j)));
    let worst =
        worst.map(|(i, j)| (product(i, j) - f64::from(u8::from(i == j))).abs()).fold(0.0, f64::max);
    all.number("largest deviation of products from 1 and 0, of 500 directions", worst, "");
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_form_is_the_closed_form_of_a_point_far_away() {
        // A light of unit irradiance from +z: 9 terms are 1/4 + cos/2 + 5/32 (3 cos^2 - 1), over pi.
        let l = basis(DVec3::Z).map(DVec3::splat);
        for d in spread_directions() {
            let expected = (0.25 + 0.5 * d.z + 5.0 / 32.0 * (3.0 * d.z * d.z - 1.0)) / PI;
            assert!((diffuse(&l, d).x - expected).abs() < 1e-12, "{d}");
        }
    }
}
