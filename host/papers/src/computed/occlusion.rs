//! Form factors of all pairs of surfels, with errata T1 and T18 to T21 of the thesis.

use super::optics::form_factor;
use super::{Bench, Computed};
use crate::clouds::surfels;
use anyhow::{Context as _, anyhow, bail};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, WriteOptions, read, silent, write};
use surfelshop_geometry::areas;
use surfelshop_image::png;

/// What of an emitter counts at a receiver: area, distance, cosines of emitter and receiver, both 0 or more.
type Kernel = fn(f64, f64, [f64; 2]) -> f64;

/// Bunnell's own: the solid angle of the disc, and a cosine of the receiver that saturates.
///
/// Source: Bunnell 2005, "Dynamic Ambient Occlusion and Indirect Lighting"; erratum T20b.
fn solid_angle(area: f64, distance: f64, [emitter, receiver]: [f64; 2]) -> f64 {
    let covered = 1.0 - 1.0 / (area / (PI * distance * distance) + 1.0).sqrt();
    covered * emitter.min(1.0) * (4.0 * receiver).min(1.0)
}

/// A cloud and what its surfels shade.
struct Scene {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
}

impl Scene {
    /// Sums over all emitters, which cast from their backs, each times its weight.
    fn pass(&self, kernel: Kernel, weights: &[f64]) -> Vec<f64> {
        let sum = |i: usize| {
            let (place, normal) = (self.positions[i], self.normals[i]);
            let mut sum = 0.0;
            for (j, other) in self.positions.iter().enumerate() {
                let to = *other - place;
                let receiver = normal.dot(to);
                let emitter = self.normals[j].dot(to);
                if receiver > 0.0 && emitter > 0.0 && i != j {
                    let distance = to.length();
                    let cosines = [emitter / distance, receiver / distance];
                    sum += weights[j] * kernel(self.areas[j], distance, cosines);
                }
            }
            sum
        };
        (0..self.positions.len()).into_par_iter().map(sum).collect()
    }

    /// Shadows after two passes; `weight` is what of an emitter counts in the second, of its shadow in the first.
    fn shadows(&self, kernel: Kernel, weight: fn(f64) -> f64) -> Vec<f64> {
        let clamped =
            |sums: Vec<f64>| -> Vec<f64> { sums.into_iter().map(|s| s.min(1.0)).collect() };
        let first = clamped(self.pass(kernel, &vec![1.0; self.positions.len()]));
        clamped(self.pass(kernel, &first.into_iter().map(weight).collect::<Vec<_>>()))
    }
}

/// An erratum on the knot: the column `ao` as printed, as corrected, and of rays.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let cloud = read(bench.path("knot")?, &ReadOptions::default())?.cloud;
    let truth = read(bench.path("knot-rays")?, &ReadOptions::default())?.cloud;
    let truth: Vec<f64> = truth.floats("ao", 1).iter().map(|&value| f64::from(value)).collect();
    if truth.len() != cloud.len() {
        bail!("the rays' cloud has {} surfels, expected {}", truth.len(), cloud.len());
    }
    let (positions, normals, radii) = surfels(&cloud);
    let effective = areas::effective(cloud.positions(), cloud.normals(), &silent)
        .map_err(|cancelled| anyhow!("areas: {cancelled:?}"))?;
    let areas = effective.iter().map(|&area| f64::from(area)).collect();
    let scene = Scene { positions, normals, areas };
    let open = |shadows: &[f64]| -> Vec<f64> { shadows.iter().map(|s| 1.0 - s).collect() };
    let usual = || scene.shadows(form_factor, |shadow| 1.0 - shadow);
    let (printed, corrected) = match which {
        "T1" => {
            let sums = scene.pass(form_factor, &vec![1.0; scene.positions.len()]);
            (sums.into_iter().map(|s| 1.0 - s.max(1.0)).collect(), open(&usual()))
        }
        "T18" => {
            let shadows = usual();
            let corrected = open(&shadows);
            (shadows, corrected)
        }
        "T19" => (open(&scene.shadows(form_factor, |shadow| shadow)), open(&usual())),
        "T20b" => {
            let other = scene.shadows(solid_angle, |shadow| 1.0 - shadow);
            (open(&usual()), open(&other))
        }
        "T21" => {
            let discs = radii.iter().map(|r| PI * r * r).collect();
            let overlapping = Scene {
                areas: discs,
                positions: scene.positions.clone(),
                normals: scene.normals.clone(),
            };
            (open(&overlapping.shadows(form_factor, |shadow| 1.0 - shadow)), open(&usual()))
        }
        other => bail!("there is no erratum {other} of occlusion"),
    };
    let mut pictures = Vec::new();
    for (name, values) in [("printed", &printed), ("corrected", &corrected), ("truth", &truth)] {
        pictures.push(picture(bench, &cloud, name, values)?);
    }
    let mut all = Computed::pair(&pictures[0], &pictures[1], &pictures[2])?;
    for (name, values) in [("printed", &printed), ("corrected", &corrected)] {
        let square = values.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let rmse = (square / truth.len().max(1) as f64).sqrt();
        all.number(&format!("RMSE of the column against rays, as {name}"), rmse, "of the sky");
    }
    if which == "T21" {
        let total = |areas: &[f64]| areas.iter().sum::<f64>();
        let discs: Vec<f64> = radii.iter().map(|r| PI * r * r).collect();
        all.number(
            "areas of discs over that of the surface",
            total(&discs) / total(&scene.areas),
            "",
        );
    }
    Ok(all)
}

/// The picture of a column `ao`, as a grey.
fn picture(
    bench: &Bench<'_, '_>,
    cloud: &Cloud,
    name: &str,
    values: &[f64],
) -> anyhow::Result<surfelshop_image::Image> {
    let column = values.iter().map(|&value| value.clamp(0.0, 1.0) as f32).collect();
    let cloud = cloud.with_columns(vec![Column::new("ao", 1, Buffer::F32(column))])?;
    let path = bench.folder.join(format!("{name}.ply"));
    write(&path, &cloud, &WriteOptions::default())?;
    bench
        .run(&format!(
            "render {{out}}/{name}.ply -r flat --output ao --bits 16 -o {{out}}/{name}.png"
        ))
        .with_context(|| name.to_owned())?;
    std::fs::remove_file(&path).with_context(|| path.display().to_string())?;
    Ok(png::read(&bench.folder.join(format!("{name}.png")), 1 << 24)?)
}
