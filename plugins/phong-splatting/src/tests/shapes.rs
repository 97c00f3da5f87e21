//! Sampled surfaces whose normals are known.

use super::TestCloud;
use std::f64::consts::{PI, TAU};
use surfelshop_api::glam::{DVec3, Vec3};

/// A smooth surface: its samples, area, and the mean of the root of the product of both curvatures.
pub(super) struct Smooth {
    pub(super) name: &'static str,
    pub(super) given: TestCloud,
    /// Splats that would be needed if ellipses tiled it: area over the area of an ellipse, times the
    /// tolerance. None where a curvature is 0.
    pub(super) ideal: Option<f64>,
}

/// Numbers in [0, 1) without a pattern.
pub(super) fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub(super) fn given(points: impl Iterator<Item = (DVec3, DVec3)>) -> TestCloud {
    let (positions, normals) =
        points.map(|(p, n)| (p.as_vec3(), n.normalize_or_zero().as_vec3())).unzip();
    TestCloud { positions, normals, ..TestCloud::default() }
}

/// A spiral over the unit sphere.
pub(super) fn sphere(n: u32) -> TestCloud {
    given((0..n).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let angle = PI * (3.0 - 5f64.sqrt()) * f64::from(i);
        let r = (1.0 - z * z).sqrt();
        let p = DVec3::new(r * angle.cos(), r * angle.sin(), z);
        (p, p)
    }))
}

/// Cells of a grid of rows and columns, a random place in each.
pub(super) fn jittered(rows: u32, columns: u32) -> impl Iterator<Item = (f64, f64)> {
    let mut random = random(7);
    (0..rows * columns).map(move |i| {
        let (row, column) = (f64::from(i / columns), f64::from(i % columns));
        let place = |at: f64, random: f64| at + 0.2 + 0.6 * random;
        (place(row, random()) / f64::from(rows), place(column, random()) / f64::from(columns))
    })
}

fn torus(n: u32) -> TestCloud {
    let rows = (f64::from(n) / 2.5).sqrt() as u32;
    given(jittered(rows, rows * 5 / 2).map(|(s, t)| {
        let (around, across) = (TAU * t, TAU * s);
        let out = DVec3::new(around.cos(), around.sin(), 0.0);
        let normal = out * across.cos() + DVec3::Z * across.sin();
        (out + normal * 0.4, normal)
    }))
}

fn cylinder(n: u32) -> TestCloud {
    let rows = (f64::from(n) / PI).sqrt() as u32;
    given(jittered(rows, rows * 314 / 100).map(|(s, t)| {
        let normal = DVec3::new((TAU * t).cos(), (TAU * t).sin(), 0.0);
        (normal + DVec3::Z * (2.0 * s), normal)
    }))
}

fn saddle(n: u32) -> TestCloud {
    let rows = f64::from(n).sqrt() as u32;
    given(jittered(rows, rows).map(|(s, t)| {
        let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        (DVec3::new(x, y, 0.5 * (x * x - y * y)), DVec3::new(-x, y, 1.0))
    }))
}

/// The integral of the root of |k1 k2| over a torus of radii 1 and 0.4: |cos| / (r (1 + r cos)).
fn torus_ideal() -> f64 {
    let n = 10_000;
    let sum: f64 = (0..n)
        .map(|i| {
            let c = (TAU * f64::from(i) / f64::from(n)).cos();
            let (area, product) = (0.4 * (1.0 + 0.4 * c), c.abs() / (0.4 * (1.0 + 0.4 * c)));
            area * product.sqrt()
        })
        .sum();
    sum * TAU / f64::from(n) * TAU / TAU
}

/// All smooth surfaces, of about `n` samples each.
pub(super) fn smooth(n: u32) -> Vec<Smooth> {
    // The root of the Gaussian curvature, integrated, over 2 pi.
    vec![
        Smooth { name: "sphere", given: sphere(n), ideal: Some(2.0) },
        Smooth { name: "cylinder", given: cylinder(n), ideal: None },
        Smooth { name: "saddle", given: saddle(n), ideal: None },
        Smooth { name: "torus", given: torus(n), ideal: Some(torus_ideal()) },
    ]
}

/// A polygon that is swept: its corners counterclockwise, its sides and both ends; `n` samples a unit.
pub(super) fn prism(
    corners: &[(f64, f64)],
    inside: impl Fn(f64, f64) -> bool,
    n: u32,
) -> TestCloud {
    let mut all: Vec<(DVec3, DVec3)> = Vec::new();
    let extent = corners.iter().map(|c| c.0.max(c.1)).fold(0.0, f64::max);
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (a, b) = (DVec3::new(a.0, a.1, 0.0), DVec3::new(b.0, b.1, 0.0));
        let along = b - a;
        let normal = along.cross(DVec3::Z).normalize_or_zero();
        let columns = (along.length() * f64::from(n)).round() as u32;
        all.extend(jittered(n, columns).map(|(s, t)| (a + along * t + DVec3::Z * s, normal)));
    }
    for (z, normal) in [(0.0, -DVec3::Z), (1.0, DVec3::Z)] {
        let rows = (extent * f64::from(n)).round() as u32;
        let points = jittered(rows, rows).map(|(s, t)| (s * extent, t * extent));
        let points = points.filter(|(x, y)| inside(*x, *y));
        all.extend(points.map(|(x, y)| (DVec3::new(x, y, z), normal)));
    }
    given(all.into_iter())
}

/// A cube of edge 1 with a corner at the origin.
pub(super) fn cube(n: u32) -> TestCloud {
    prism(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], |_, _| true, n)
}

/// A square of edge 2 less one of edge 1.
pub(super) fn ell(n: u32) -> TestCloud {
    let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    prism(&corners, |x, y| x < 1.0 || y < 1.0, n)
}

/// A cone of height 1 over the unit circle, without its base.
pub(super) fn cone(n: u32) -> TestCloud {
    let mut random = random(3);
    given((0..n).map(|i| {
        // Rings of equal area, so that all is sampled alike.
        let r = ((f64::from(i) + random()) / f64::from(n)).sqrt();
        let angle = PI * (3.0 - 5f64.sqrt()) * f64::from(i);
        let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
        (out * r + DVec3::Z * (1.0 - r), out + DVec3::Z)
    }))
}

pub(super) fn moved(given: &TestCloud, by: impl Fn(Vec3) -> Vec3) -> TestCloud {
    TestCloud { positions: given.positions.iter().map(|p| by(*p)).collect(), ..given.clone() }
}
