//! Microfacets, Fresnel and form factors: the printed and the corrected forms, and other ways to the same.

use super::Computed;
use super::curves::{Line, chart, sampled};
use std::f64::consts::PI;

/// Blinn's distribution without its square, as printed: of the cosine between normal and half vector.
pub(super) fn distribution(cosine: f64, c: f64) -> f64 {
    c * c / (cosine * cosine * (c * c - 1.0) + 1.0)
}

/// The distribution of an ellipsoid of revolution's normals, from the area of the ellipsoid that has them: 1 at
/// the pole, as the squared form is. `c` is the half axis along the normal, the others being 1.
///
/// Derived here: a point at parameter t has the normal (sin t, cos t / c); the area of a ring over the solid
/// angle of its normals is the mean curvature radius squared.
pub(super) fn ellipsoid(cosine: f64, c: f64) -> f64 {
    let alpha = cosine.clamp(-1.0, 1.0).acos();
    // tan alpha = c tan t.
    let t_of = |alpha: f64| alpha.sin().atan2(c * alpha.cos());
    let area = |from: f64, to: f64| {
        let n = 16;
        let step = (to - from) / f64::from(n);
        let ring = |t: f64| {
            let (s, k) = t.sin_cos();
            s * (k * k + c * c * s * s).sqrt()
        };
        (0..n).map(|i| ring(from + (f64::from(i) + 0.5) * step)).sum::<f64>() * step
    };
    let angle = |from: f64, to: f64| from.cos() - to.cos();
    let density = |alpha: f64| {
        let h = 1e-3;
        let (from, to) = ((alpha - h).max(0.0), alpha + h);
        area(t_of(from), t_of(to)) / angle(from, to)
    };
    density(alpha) / density(0.0)
}

/// Fresnel's term as printed, without the half; `cosine` between eye and half vector.
pub(super) fn fresnel_whole(cosine: f64, index: f64) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    let g = (index * index + c * c - 1.0).max(0.0).sqrt();
    let first = ((g - c) / (g + c)).powi(2);
    let second = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    first * (1.0 + second * second)
}

/// Fresnel's term from Snell's law: the mean of both polarisations.
pub(super) fn fresnel(cosine: f64, index: f64) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    let sine = (1.0 - c * c).sqrt() / index;
    let k = (1.0 - sine * sine).max(0.0).sqrt();
    let s = ((c - index * k) / (c + index * k)).powi(2);
    let p = ((k - index * c) / (k + index * c)).powi(2);
    0.5 * (s + p)
}

/// Eq. 9 of the thesis: the share of a receiver's cosine-weighted sky that a disc covers.
pub(super) fn form_factor(area: f64, distance: f64, cosines: [f64; 2]) -> f64 {
    area * cosines[0] * cosines[1] / (PI * distance * distance + area)
}

/// The same by an integral over the disc, whose normal has the angle `tilt` with the direction to it, seen at the
/// angle `off` from the receiver's normal, in one plane; radius 1.
fn form_factor_of_disc(distance: f64, off: f64, tilt: f64) -> f64 {
    let n = 96;
    let towards = [off.sin(), 0.0, off.cos()];
    let facing = off + tilt;
    // The emitter's normal points back at the receiver where tilt is 0.
    let normal = [-facing.sin(), 0.0, -facing.cos()];
    let along = [facing.cos(), 0.0, -facing.sin()];
    let mut sum = 0.0;
    for i in 0..n {
        let r = (f64::from(i) + 0.5) / f64::from(n);
        for j in 0..n {
            let (sin, cos) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(n)).sin_cos();
            let place: [f64; 3] = std::array::from_fn(|k| {
                distance * towards[k] + r * cos * along[k] + if k == 1 { r * sin } else { 0.0 }
            });
            let square: f64 = place.iter().map(|x| x * x).sum();
            let root = square.sqrt();
            let receiver = (place[2] / root).max(0.0);
            let dot: f64 = place.iter().zip(normal).map(|(a, b)| a * b).sum();
            let emitter = (-dot / root).max(0.0);
            sum += receiver * emitter / (PI * square) * r;
        }
    }
    sum * 2.0 * PI / f64::from(n * n)
}

/// The curves of figures that are drawings.
pub(super) fn curves(name: &str) -> anyhow::Result<Computed> {
    match name {
        "form-factor" => form_factors(),
        "cosines" => cosines(),
        "reflection" => reflection(),
        _ => lobes(),
    }
}

/// Eq. 9 beside the integral over the disc.
fn form_factors() -> anyhow::Result<Computed> {
    let mut all = Computed::default();
    let lines = [
        Line {
            name: "eq. 9, on the axis",
            points: sampled(0.2, 6.0, |r| form_factor(PI, r, [1.0, 1.0])),
        },
        Line {
            name: "integral, on the axis",
            points: sampled(0.2, 6.0, |r| form_factor_of_disc(r, 0.0, 0.0)),
        },
        Line {
            name: "eq. 9, at 60 degrees",
            points: sampled(0.2, 6.0, |r| form_factor(PI, r, [1.0, 0.5])),
        },
        Line {
            name: "integral, at 60 degrees",
            points: sampled(0.2, 6.0, |r| form_factor_of_disc(r, PI / 3.0, 0.0)),
        },
    ];
    all.drawing(
        "a disc of radius 1",
        chart("what a disc covers of the sky", "distance, radii", "share", &lines)?,
    );
    let apart = |off: f64| {
        (form_factor(PI, 1.0, [1.0, off.cos()]) - form_factor_of_disc(1.0, off, 0.0)).abs()
    };
    all.number(
        "largest error of eq. 9 on the axis",
        sampled(0.5, 6.0, |r| {
            (form_factor(PI, r, [1.0, 1.0]) - form_factor_of_disc(r, 0.0, 0.0)).abs()
        })
        .iter()
        .map(|p| p.1)
        .fold(0.0, f64::max),
        "",
    );
    all.number("error at one radius and 60 degrees", apart(PI / 3.0), "");
    Ok(all)
}

/// What negative cosines do.
fn cosines() -> anyhow::Result<Computed> {
    let mut all = Computed::default();
    let both = |tilt: f64| (tilt.to_radians().cos(), (tilt + 60.0).to_radians().cos());
    let lines = [
        Line {
            name: "product, not clamped",
            points: sampled(0.0, 180.0, |t| {
                let (a, b) = both(t);
                a * b
            }),
        },
        Line {
            name: "each cosine clamped",
            points: sampled(0.0, 180.0, |t| {
                let (a, b) = both(t);
                a.max(0.0) * b.max(0.0)
            }),
        },
    ];
    all.drawing(
        "cosines 60 degrees apart",
        chart(
            "two negative cosines multiply to a shadow",
            "angle of the receiver, degrees",
            "",
            &lines,
        )?,
    );
    all.number(
        "largest shadow from behind, where cosines are not clamped",
        sampled(90.0, 180.0, |t| {
            let (a, b) = both(t);
            a * b
        })
        .iter()
        .map(|p| p.1)
        .fold(0.0, f64::max),
        "",
    );
    Ok(all)
}

/// Fresnel's term and the distribution.
fn reflection() -> anyhow::Result<Computed> {
    let mut all = Computed::default();
    let degrees = |f: &dyn Fn(f64) -> f64| sampled(0.0, 89.9, |d| f(d.to_radians().cos()));
    let lines = [
        Line { name: "F, n = 1.5", points: degrees(&|c| fresnel(c, 1.5)) },
        Line { name: "D squared, c = 0.3", points: degrees(&|c| distribution(c, 0.3).powi(2)) },
        Line { name: "D as printed, c = 0.3", points: degrees(&|c| distribution(c, 0.3)) },
    ];
    all.drawing(
        "Fresnel's term and the distribution",
        chart("section 2.9", "angle, degrees", "", &lines)?,
    );
    all.number("Fresnel's term F, seen straight on", fresnel(1.0, 1.5), "");
    all.number("F at 75 degrees", fresnel(75f64.to_radians().cos(), 1.5), "");
    all.number(
        "the same by the other formula, halved",
        0.5 * fresnel_whole(75f64.to_radians().cos(), 1.5),
        "",
    );
    Ok(all)
}

/// Lobes around the mirrored ray, and the Gaussians that stand for them.
fn lobes() -> anyhow::Result<Computed> {
    let mut all = Computed::default();
    let lobe =
        |c: f64| sampled(0.0, 90.0, move |d| distribution((0.5 * d).to_radians().cos(), c).powi(2));
    let gauss = |c: f64| {
        sampled(0.0, 90.0, move |d| (concentration(c) * (d.to_radians().cos() - 1.0)).exp())
    };
    let lines = [
        Line { name: "lobe, c = 0.3", points: lobe(0.3) },
        Line { name: "Gaussian, c = 0.3", points: gauss(0.3) },
        Line { name: "lobe, c = 0.1", points: lobe(0.1) },
        Line { name: "Gaussian, c = 0.1", points: gauss(0.1) },
    ];
    all.drawing(
        "the cone of the random ray",
        chart("lobes around the mirrored ray", "from the mirrored ray, degrees", "", &lines)?,
    );
    let apart = sampled(0.0, 90.0, |d| {
        (distribution((0.5 * d).to_radians().cos(), 0.3).powi(2)
            - (concentration(0.3) * (d.to_radians().cos() - 1.0)).exp())
        .abs()
    });
    all.number(
        "largest difference of lobe and Gaussian, c = 0.3",
        apart.iter().map(|p| p.1).fold(0.0, f64::max),
        "",
    );
    Ok(all)
}

/// The concentration of the Gaussian on the sphere that is as narrow as the lobe around its middle.
pub(super) fn concentration(c: f64) -> f64 {
    (1.0 - c * c) / (c * c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_of_fresnel_and_both_ways_to_the_distribution_agree() {
        for i in 1..=20 {
            let cosine = f64::from(i) / 20.0;
            assert!((fresnel(cosine, 1.5) - 0.5 * fresnel_whole(cosine, 1.5)).abs() < 1e-12);
            for c in [0.1, 0.3, 0.8] {
                let (a, b) = (ellipsoid(cosine, c), distribution(cosine, c).powi(2));
                assert!((a - b).abs() < 2e-3, "{cosine} {c}: {a} {b}");
            }
        }
        // Printed without the half: 0.08 and 2.
        assert!((fresnel_whole(1.0, 1.5) - 0.08).abs() < 1e-12);
        assert!((fresnel_whole(0.0, 1.5) - 2.0).abs() < 1e-12);
        assert!((0.5 * fresnel_whole(0.0, 1.5) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_disc_on_the_axis_covers_what_eq_9_says() {
        for distance in [0.5, 1.0, 3.0] {
            let exact = form_factor(PI, distance, [1.0, 1.0]);
            assert!((form_factor_of_disc(distance, 0.0, 0.0) - exact).abs() < 2e-4, "{distance}");
        }
        assert!(form_factor_of_disc(2.0, 0.0, 0.5 * PI) < 0.02, "edge-on");
    }
}
