//! Light from around, texel by texel: what harmonics and blurred maps are measured against.

use super::Computed;
use anyhow::ensure;
use glam::DVec3;
use std::path::Path;
use surfelshop_cloud::environment_map::{Mapping, Probe, read, solid_angles};
use surfelshop_image::Image;

/// Cells around and from pole to pole that light is added up in.
const CELLS: [usize; 2] = [64, 32];

/// Radiance that mirrors are cut off at: a sun of one texel would decide every mean.
const BRIGHTEST: f64 = 4.0;

/// A probe and what it radiates.
pub(super) struct Sky {
    pub(super) probe: Probe,
    /// Directions with radiance times solid angle, and the solid angle.
    cells: Vec<(DVec3, DVec3, f64)>,
}

impl Sky {
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let probe = read(path, None)?;
        let (width, height) = (probe.picture.width, probe.picture.height);
        let angles = solid_angles(probe.mapping, width, height);
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0.0); CELLS[0] * CELLS[1]];
        for (i, (texel, angle)) in probe.picture.rgb.iter().zip(&angles).enumerate() {
            let Some(towards) = direction(&probe, i) else { continue };
            let turn = towards.z.atan2(towards.x) / std::f64::consts::TAU + 0.5;
            let height = 0.5 - 0.5 * towards.y;
            let [n, m] = CELLS;
            let cell = ((height * m as f64) as usize).min(m - 1) * n
                + ((turn * n as f64) as usize).min(n - 1);
            let light = DVec3::from(texel.map(f64::from)) * *angle;
            // By its light, so that a cell shines from where its lights are.
            let weight = light.element_sum() + 1e-9 * angle;
            sums[cell].0 += towards * weight;
            sums[cell].1 += light;
            sums[cell].2 += angle;
        }
        let cells: Vec<_> = sums
            .into_iter()
            .filter(|(_, _, angle)| *angle > 0.0)
            .map(|(towards, light, angle)| (towards.normalize_or(DVec3::Y), light, angle))
            .collect();
        ensure!(!cells.is_empty(), "{}: the probe has no texels", path.display());
        Ok(Self { probe, cells })
    }

    /// What a white diffuse surface radiates where nothing is in the way: irradiance over pi.
    pub(super) fn diffuse(&self, normal: DVec3) -> DVec3 {
        let light =
            |(towards, light, _): &(DVec3, DVec3, f64)| *light * towards.dot(normal).max(0.0);
        self.cells.iter().map(light).sum::<DVec3>() / std::f64::consts::PI
    }

    /// The same for many normals, of each texel by itself.
    pub(super) fn diffuse_of_texels(&self, normals: &[DVec3]) -> Vec<DVec3> {
        use rayon::prelude::*;
        let picture = &self.probe.picture;
        let angles = solid_angles(self.probe.mapping, picture.width, picture.height);
        let lit = picture.rgb.iter().zip(&angles).enumerate().filter_map(|(i, (texel, angle))| {
            Some((direction(&self.probe, i)?, DVec3::from(texel.map(f64::from)) * *angle))
        });
        let lights: Vec<(DVec3, DVec3)> = lit.collect();
        let of = |normal: &DVec3| {
            let light = |(towards, light): &(DVec3, DVec3)| *light * towards.dot(*normal).max(0.0);
            lights.iter().map(light).sum::<DVec3>() / std::f64::consts::PI
        };
        normals.par_iter().map(of).collect()
    }

    /// The mean radiance by a weight of directions.
    pub(super) fn mean(&self, weight: impl Fn(DVec3) -> f64) -> DVec3 {
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for (towards, light, angle) in &self.cells {
            let w = weight(*towards);
            sum += *light * w;
            weights += w * angle;
        }
        sum / weights.max(1e-12)
    }

    /// The radiance from a direction: that of the nearest texel, cut off at [`BRIGHTEST`].
    pub(super) fn radiance(&self, towards: DVec3) -> DVec3 {
        self.texel(self.probe.mapping.place(towards)).min(DVec3::splat(BRIGHTEST))
    }

    /// The radiance of the texel at a place of the picture, 0 to 1.
    fn texel(&self, place: [f64; 2]) -> DVec3 {
        let picture = &self.probe.picture;
        let [x, y] = [(place[0], picture.width), (place[1], picture.height)].map(|(at, n)| {
            let cell = (at * f64::from(n)).floor();
            (cell.clamp(0.0, f64::from(n.saturating_sub(1)))) as usize
        });
        let texel = picture.rgb.get(y * picture.width as usize + x);
        DVec3::from(texel.copied().unwrap_or_default().map(f64::from))
    }

    /// The nine coefficients, each of three channels, from texels that all count alike.
    pub(super) fn unweighted(&self, basis: impl Fn(DVec3) -> [f64; 9]) -> [DVec3; 9] {
        let (mut sums, mut n) = ([DVec3::ZERO; 9], 0.0);
        for (i, texel) in self.probe.picture.rgb.iter().enumerate() {
            let Some(towards) = direction(&self.probe, i) else { continue };
            let light = DVec3::from(texel.map(f64::from));
            sums.iter_mut().zip(basis(towards)).for_each(|(sum, y)| *sum += light * y);
            n += 1.0;
        }
        sums.map(|sum| sum * (4.0 * std::f64::consts::PI / f64::max(n, 1.0)))
    }

    /// The nine coefficients as the program has them.
    pub(super) fn coefficients(&self) -> [DVec3; 9] {
        let all = &self.probe.facts.harmonics;
        std::array::from_fn(|i| all.get(i).map_or(DVec3::ZERO, |c| DVec3::from(*c)))
    }
}

/// The direction of a texel by its number; none in corners that show nothing.
fn direction(probe: &Probe, i: usize) -> Option<DVec3> {
    let (width, height) = (probe.picture.width as usize, probe.picture.height as usize);
    let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
    probe.mapping.direction(at(i % width, width), at(i / width, height))
}

/// A probe as an angular map.
pub(super) fn picture(path: &Path) -> anyhow::Result<Computed> {
    let sky = Sky::read(path)?;
    let n = 256u32;
    let place = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
    let image: Image = super::drawn(n, |x, y| {
        let towards = Mapping::Angular.direction(place(x), place(y))?;
        Some(sky.radiance(towards).to_array())
    });
    let mut all = Computed::default();
    all.picture("angular map", &image)?;
    all.number("texels along a row of the file", f64::from(sky.probe.picture.width), "");
    let total: f64 = sky.cells.iter().map(|(_, _, angle)| angle).sum();
    all.number("solid angle of all texels over 4 pi", total / (4.0 * std::f64::consts::PI), "");
    let light = f64::from(sky.probe.facts.max_radiance as f32);
    all.number("largest radiance, of 1 that is white", light, "");
    Ok(all)
}
