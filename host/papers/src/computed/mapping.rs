//! The texel of a direction, with errata T13 and T14 of the thesis.

use super::curves::{Line, chart, sampled};
use super::sky::Sky;
use super::surface::Surface;
use super::{Bench, Computed, drawn};
use anyhow::bail;
use glam::DVec3;
use std::f64::consts::PI;
use surfelshop_cloud::environment_map::Mapping;
use surfelshop_image::Image;

/// Texels along a side of the angular map that is looked up.
const SIDE: u32 = 512;

/// A probe resampled as an angular map, whatever it was.
pub(super) struct Map(Image);

impl Map {
    pub(super) fn of(sky: &Sky) -> Self {
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
        Self(drawn(SIDE, |x, y| {
            let towards = Mapping::Angular.direction(place(x), place(y));
            Some(towards.map_or(DVec3::ZERO, |towards| sky.radiance(towards)).to_array())
        }))
    }

    pub(super) fn at(&self, [u, v]: [f64; 2]) -> DVec3 {
        let cell =
            |at: f64| ((at * f64::from(SIDE)).floor().clamp(0.0, f64::from(SIDE - 1))) as u32;
        let pixel = self.0.pixel(cell(u), cell(v));
        DVec3::new(f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]))
    }
}

/// The code of section 3.2 as it stands, in single precision; its z is our -z.
fn printed(d: DVec3) -> [f64; 2] {
    let (x, y, z) = (d.x as f32, d.y as f32, -d.z as f32);
    let theta = z.acos();
    let tangent = if x.abs() < 0.000_001 { 0.0 } else { y / x };
    let root = (1.0 + tangent * tangent).sqrt() * std::f32::consts::PI;
    let u = if x >= 0.0 { theta / root } else { -theta / root };
    let v = tangent * u;
    [f64::from((u + 1.0) * 0.5), f64::from((1.0 - v) * 0.5)]
}

/// The corrected code, in single precision as well.
fn corrected(d: DVec3) -> [f64; 2] {
    let (x, y, z) = (d.x as f32, d.y as f32, -d.z as f32);
    let s = x.hypot(y);
    let r = s.atan2(z) / std::f32::consts::PI;
    let (a, b) = if s > 0.0 { (x / s, y / s) } else { (0.0, 0.0) };
    [f64::from((r * a + 1.0) * 0.5), f64::from((1.0 - r * b) * 0.5)]
}

/// An erratum, seen in mirrors.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let sky = Sky::read(bench.path("rnl")?)?;
    let map = Map::of(&sky);
    match which {
        "T13" => {
            let ball = Surface::ball(bench.size());
            let lit = |place: &(dyn Fn(DVec3) -> [f64; 2] + Sync)| {
                ball.shaded(|n, _| map.at(place(ball.mirrored(n))))
            };
            let (as_printed, as_corrected) = (lit(&printed), lit(&corrected));
            let truth = ball.shaded(|n, _| sky.radiance(ball.mirrored(n)));
            let mut all = Computed::pair(&as_printed, &as_corrected, &truth)?;
            let apart = as_printed.data.chunks(4).zip(as_corrected.data.chunks(4));
            all.number(
                "pixels of another colour",
                apart.filter(|(a, b)| a != b).count() as f64,
                "",
            );
            let place = |f: &dyn Fn(DVec3) -> [f64; 2]| f(DVec3::Y);
            let (a, b) = (place(&printed), place(&corrected));
            all.number(
                "how far off the texel of (0, 1, 0) is",
                (a[0] - b[0]).hypot(a[1] - b[1]),
                "of the picture",
            );
            let error = |theta: f64| (f64::from((theta.cos() as f32).acos()) - theta).abs() / theta;
            let lines = [Line { name: "arccos of the cosine", points: sampled(1e-5, 2e-3, error) }];
            all.drawing(
                "relative error of a small angle in single precision",
                chart("arccos near 1", "angle", "relative error", &lines)?,
            );
            Ok(all)
        }
        "T14" => {
            let surface = Surface::of(bench, "igea")?;
            let lit = |mapping: Mapping| {
                surface.shaded(|n, _| map.at(mapping.place(surface.mirrored(n))))
            };
            let (as_printed, as_corrected) = (lit(Mapping::MirroredBall), lit(Mapping::Angular));
            let truth = surface.shaded(|n, _| sky.radiance(surface.mirrored(n)));
            let mut all = Computed::pair(&as_printed, &as_corrected, &truth)?;
            let gap = |theta: f64| ((0.5 * theta).sin() - theta / PI).abs();
            let most = sampled(0.0, PI, gap).iter().map(|p| p.1).fold(0.0, f64::max);
            all.number("largest distance of both mappings, in radii", most, "");
            Ok(all)
        }
        other => bail!("there is no erratum {other} of mappings"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_code_is_the_mapping_and_the_printed_one_loses_y() {
        for d in [DVec3::new(0.3, -0.4, 0.86), DVec3::Y, DVec3::NEG_X, DVec3::new(0.0, -0.6, -0.8)]
        {
            let (a, b) = (corrected(d.normalize_or_zero()), Mapping::Angular.place(d));
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6, "{d}: {a:?} {b:?}");
        }
        let d = DVec3::new(0.3, -0.4, 0.86).normalize_or_zero();
        let (a, b) = (printed(d), corrected(d));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-5, "right where x is not 0");
        assert!((printed(DVec3::Y)[1] - 0.5).abs() < 1e-6 && corrected(DVec3::Y)[1] < 0.3);
    }
}
