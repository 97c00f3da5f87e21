//! Highlights of the thesis, with its errata T9 to T12.

use super::optics::{concentration, distribution, ellipsoid, fresnel, fresnel_whole};
use super::sky::Sky;
use super::surface::Surface;
use super::{Bench, Computed};
use anyhow::bail;
use glam::DVec3;

/// Index of refraction.
const INDEX: f64 = 1.5;

/// An erratum, on a model.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let surface = Surface::of(bench, "igea")?;
    match which {
        "T9" => Ok(distributions(&surface)?),
        "T10" => half_vectors(bench, &surface),
        "T11" => fresnels(bench, &surface),
        "T12" => mirrored(bench, &surface),
        other => bail!("there is no erratum {other} of highlights"),
    }
}

fn distributions(surface: &Surface) -> anyhow::Result<Computed> {
    let c = 0.25;
    let light = DVec3::new(0.7, 0.6, 0.4).normalize_or_zero();
    let half = (light + surface.to_eye).normalize_or_zero();
    let lit = |d: &(dyn Fn(f64) -> f64 + Sync)| {
        surface.shaded(|n, _| match n.dot(light) > 0.0 {
            true => DVec3::splat(d(n.dot(half))),
            false => DVec3::ZERO,
        })
    };
    let printed = lit(&|cosine| distribution(cosine, c));
    let corrected = lit(&|cosine| distribution(cosine, c).powi(2));
    let truth = lit(&|cosine| ellipsoid(cosine, c));
    let mut all = Computed::pair(&printed, &corrected, &truth)?;
    let energy = |power: i32| {
        let n = 20_000;
        let at = |i: i32| {
            let cosine = (f64::from(i) + 0.5) / f64::from(n);
            distribution(cosine, 0.1).powi(power) * cosine
        };
        (0..n).map(at).sum::<f64>() / f64::from(n) * std::f64::consts::TAU
    };
    all.number(
        "energy of the printed form over that of the squared one, c = 0.1",
        energy(1) / energy(2),
        "",
    );
    Ok(all)
}

fn half_vectors(bench: &Bench<'_, '_>, surface: &Surface) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    let halved = |cosine: f64| 0.5 * fresnel_whole(cosine, INDEX);
    let lit = |half: &(dyn Fn(DVec3) -> DVec3 + Sync), term: &(dyn Fn(f64) -> f64 + Sync)| {
        surface.shaded(|n, _| {
            let ray = surface.mirrored(n);
            sky.radiance(ray) * term(half(ray + surface.to_eye).dot(surface.to_eye))
        })
    };
    let normalised = |sum: DVec3| sum.normalize_or_zero();
    let printed = lit(&|sum| 0.5 * sum, &halved);
    let corrected = lit(&normalised, &halved);
    let truth = lit(&normalised, &|cosine| fresnel(cosine, INDEX));
    let mut all = Computed::pair(&printed, &corrected, &truth)?;
    let cosine = 75f64.to_radians().cos();
    all.number("F at 75 degrees, as printed", halved(cosine * cosine), "");
    all.number("F at 75 degrees, as corrected", halved(cosine), "");
    Ok(all)
}

fn fresnels(bench: &Bench<'_, '_>, surface: &Surface) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    let lit = |term: &(dyn Fn(f64) -> f64 + Sync)| {
        surface.shaded(|n, _| sky.radiance(surface.mirrored(n)) * term(n.dot(surface.to_eye)))
    };
    let printed = lit(&|cosine| fresnel_whole(cosine, INDEX));
    let corrected = lit(&|cosine| 0.5 * fresnel_whole(cosine, INDEX));
    let truth = lit(&|cosine| fresnel(cosine, INDEX));
    let mut all = Computed::pair(&printed, &corrected, &truth)?;
    all.number("reflected at right angles, as printed", fresnel_whole(1.0, INDEX), "");
    all.number("reflected at grazing angles, as printed", fresnel_whole(0.0, INDEX), "");
    Ok(all)
}

/// Width of the thesis's blurred map: the standard deviation of 11.5 degrees, radians.
pub(super) const BLUR: f64 = 0.2007;

/// What is mirrored of the light, so that a bright probe leaves it below white.
pub(super) const SHARE: f64 = 0.4;

fn mirrored(bench: &Bench<'_, '_>, surface: &Surface) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    let c = 0.3;
    // The map is blurred as in section 3.3, and what D makes of c is nothing.
    let printed = surface.shaded(|n, _| {
        let ray = surface.mirrored(n);
        let half = (ray + surface.to_eye).normalize_or(n);
        let blurred = sky.mean(|towards| ((towards.dot(ray) - 1.0) / BLUR.powi(2)).exp());
        SHARE * blurred * distribution(n.dot(half), c)
    });
    let corrected = surface.shaded(|n, _| {
        let ray = surface.mirrored(n);
        SHARE * sky.mean(|towards| (concentration(c) * (towards.dot(ray) - 1.0)).exp())
    });
    let truth = surface.shaded(|n, _| {
        SHARE
            * sky.mean(|towards| {
                let half = (towards + surface.to_eye).normalize_or(n);
                distribution(n.dot(half), c).powi(2) * towards.dot(n).max(0.0)
            })
    });
    let mut all = Computed::pair(&printed, &corrected, &truth)?;
    let d = |c: f64| {
        let n = DVec3::new(0.3, 0.2, 0.9).normalize_or_zero();
        let half = (surface.mirrored(n) + surface.to_eye).normalize_or(n);
        distribution(n.dot(half), c)
    };
    all.number("D of the mirrored ray, c = 0.1", d(0.1), "");
    all.number("D of the mirrored ray, c = 0.9", d(0.9), "");
    Ok(all)
}
