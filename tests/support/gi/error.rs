//! How far pictures of `global-illumination` are from traced ones.

use super::{Bench, Set, text, values};
use crate::stage;
use anyhow::{Context as _, Result};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Value;
use surfelshop_api::{FrameRequest, UnitKind};
use surfelshop_image::Image;
use surfelshop_image::TracedPicture;
use surfelshop_image::metrics::{Settings, compare};
use surfelshop_runtime::plugins::Timeouts;
use surfelshop_runtime::trace::{TraceOrder, trace};

/// Added to the mean that signed errors are divided by, so that black does not decide them.
const LEAST: f64 = 1e-6;

/// How far a picture is from a traced one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Error {
    /// Relative squared error of the whole picture, the reference's noise taken off.
    pub whole: f64,
    /// The same of the pixels that count: at silhouettes pictures differ by how pixels are filtered.
    pub rel_mse: f64,
    /// Mean FLIP of the whole picture.
    pub flip: f64,
    /// Sum of the signed differences over the sum of the reference in pixels that count.
    pub bias: f64,
}

/// Compares a picture with a traced one.
///
/// # Errors
/// Where they do not fit.
pub fn error(picture: &Image, traced: &TracedPicture, counts: &[bool]) -> Result<Error> {
    let compared = compare(picture, traced, &Settings::default())?;
    let errors = compared.errors.context("pictures are finite")?;
    Ok(Error {
        whole: errors.rel_mse,
        rel_mse: rel_mse(picture, traced, counts),
        flip: errors.flip.mean,
        bias: bias(picture, &traced.color, counts),
    })
}

/// The relative squared error in pixels that count: differences from either half of the reference
/// are multiplied, so that its noise is not in it.
fn rel_mse(picture: &Image, traced: &TracedPicture, counts: &[bool]) -> f64 {
    let epsilon = Settings::default().epsilon;
    let [even, odd] = &traced.halves;
    let halves = even.data.chunks_exact(4).zip(odd.data.chunks_exact(4));
    let pixels = picture.data.chunks_exact(4).zip(halves).zip(counts);
    let (mut sum, mut n) = (0.0, 0.0);
    for ((own, (even, odd)), _) in pixels.filter(|(_, counts)| **counts) {
        for channel in 0..3 {
            let [own, even, odd] = [own, even, odd].map(|pixel| f64::from(pixel[channel]));
            let mean = 0.5 * (even + odd);
            sum += (own - even) * (own - odd) / (mean * mean + epsilon);
            n += 1.0;
        }
    }
    sum / f64::max(n, 1.0)
}

/// The sum of signed differences over the sum of the reference, in pixels that count.
#[must_use]
pub fn bias(picture: &Image, reference: &Image, counts: &[bool]) -> f64 {
    let pixels = picture.data.chunks_exact(4).zip(reference.data.chunks_exact(4)).zip(counts);
    let (mut difference, mut sum) = (0.0, LEAST);
    for ((own, other), _) in pixels.filter(|(_, counts)| **counts) {
        for channel in 0..3 {
            let [own, other] = [own, other].map(|p| f64::from(p[channel]) * f64::from(p[3]));
            difference += own - other;
            sum += other;
        }
    }
    difference / sum
}

/// The mean over pixels that count of the size of the difference over the reference.
#[must_use]
pub fn relative(picture: &Image, reference: &Image, counts: &[bool]) -> f64 {
    let pixels = picture.data.chunks_exact(4).zip(reference.data.chunks_exact(4)).zip(counts);
    let sum = |pixel: &[f32]| pixel[..3].iter().map(|v| f64::from(*v)).sum::<f64>();
    let each = pixels.filter(|(_, counts)| **counts).map(|((own, other), _)| {
        let (own, other) = (sum(own), sum(other));
        (own - other).abs() / (other.abs() + 1e-3)
    });
    let (n, total) = each.fold((0.0, 0.0), |(n, total), error| (n + 1.0, total + error));
    total / f64::max(n, 1.0)
}

/// A picture less another.
#[must_use]
pub fn less(one: &Image, other: &Image) -> Image {
    let mut left = one.clone();
    for (own, other) in left.data.chunks_exact_mut(4).zip(other.data.chunks_exact(4)) {
        for channel in 0..3 {
            own[channel] -= other[channel];
        }
    }
    left
}

/// The picture with light from neighbouring pixels averaged over squares of three: what is compared
/// pixel by pixel has the reference's noise in it.
#[must_use]
pub fn blurred(picture: &Image) -> Image {
    let mut mean = picture.clone();
    let [width, height] = [picture.width as i64, picture.height as i64];
    for (i, pixel) in mean.data.chunks_exact_mut(4).enumerate() {
        let (x, y) = (i as i64 % width, i as i64 / width);
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let inside = around.filter(|[x, y]| (0..width).contains(x) && (0..height).contains(y));
        let (mut sums, mut n) = ([0.0; 3], 0.0);
        for [x, y] in inside {
            let other = picture.pixel(x as u32, y as u32);
            sums.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
            n += 1.0;
        }
        pixel.iter_mut().zip(sums).for_each(|(value, sum)| *value = sum / n);
    }
    mean
}

impl Bench {
    /// Traces the bench's view: a mode of the tracer, reflections, paths a pixel.
    ///
    /// # Errors
    /// Those of the tracer.
    pub fn traced(&self, mode: &str, bounces: u32, paths: u32) -> Result<TracedPicture> {
        let unit = stage::built_unit("surfelshop-reference", UnitKind::Tracer, "reference");
        let sets = [
            ("mode", text(mode)),
            ("model", text("lambert")),
            ("bounces", Value::Int(i64::from(bounces))),
            ("samples", Value::Int(i64::from(paths))),
        ];
        let order = TraceOrder {
            request: FrameRequest {
                view: self.view,
                scene: self.scene.clone(),
                cloud: self.cloud.facts().clone(),
                frame_index: 0,
                values: values(&sets),
                environment: None,
            },
            clouds: vec![self.cloud.clone()],
            texels: Arc::default(),
            samples: paths,
            threads: 0,
        };
        trace(&unit, order, &Timeouts::default(), |_| true).map_err(anyhow::Error::msg)
    }

    /// The picture after so many frames, and the mean time of a frame but the first, milliseconds;
    /// of one frame the median of three.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn after(&mut self, sets: &[Set<'_>], frames: u32) -> Result<(Image, f64)> {
        let mut sets = sets.to_vec();
        sets.push(("frames", super::int(frames)));
        let mut drawn = self.draw(&sets, &[Output::Color], 0)?;
        let mut times = Vec::new();
        let numbers: Vec<u32> = if frames > 1 { (1..frames).collect() } else { vec![0; 3] };
        for number in numbers {
            if frames == 1 {
                self.engine.forget_surfaces();
            }
            let started = Instant::now();
            drawn = self.draw(&sets, &[Output::Color], number)?;
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        let color = drawn.image(&Output::Color).context("no colours")?.clone();
        Ok((color, super::quartiles(times)[1]))
    }

    /// Which pixels show the inside of one surface: all around them have about their normal, and lie
    /// near their plane.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn inside(&mut self) -> Result<Vec<bool>> {
        let outputs = [Output::Normal, Output::Depth];
        let drawn = self.draw(&[("bounces", super::int(0))], &outputs, 0)?;
        let normals = drawn.image(&Output::Normal).context("no normals")?;
        let depth = drawn.image(&Output::Depth).context("no depths")?;
        let [width, height] = [i64::from(depth.width), i64::from(depth.height)];
        let at = |x: i64, y: i64| {
            let normal = Vec3::from_slice(normals.pixel(x as u32, y as u32));
            (normal, depth.pixel(x as u32, y as u32)[0])
        };
        let is_inside = |i: i64| {
            let (x, y) = (i % width, i / width);
            let (normal, z) = at(x, y);
            let around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (x + dx, y + dy)));
            let mut around = around.map(|(x, y)| {
                let seen = (0..width).contains(&x) && (0..height).contains(&y);
                if seen { at(x, y) } else { (Vec3::ZERO, 0.0) }
            });
            z > 0.0 && around.all(|(n, d)| n.dot(normal) > 0.9 && (d - z).abs() < 0.05 * z)
        };
        Ok((0..width * height).map(is_inside).collect())
    }

    /// Which pixels show the box within so many scene units of one of its twelve edges, of those
    /// that show it at all.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn near_edges(&mut self, reach: f64) -> Result<Vec<bool>> {
        let drawn = self.draw(&[("bounces", super::int(0))], &[Output::Depth], 0)?;
        let depth = drawn.image(&Output::Depth).context("no depths")?;
        let camera = &self.view.camera;
        let backward = (camera.eye - camera.target).normalize_or(DVec3::Z);
        let right = camera.up.cross(backward).normalize_or(DVec3::X);
        let up = backward.cross(right);
        let [half_x, half_y] = self.view.half_extent();
        let near = |i: usize| {
            let (x, y) = (i as u32 % depth.width, i as u32 / depth.width);
            let z = f64::from(depth.pixel(x, y)[0]);
            let at = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let across =
                right * (at(x, depth.width) * half_x) - up * (at(y, depth.height) * half_y);
            let place = camera.eye + (across - backward) * z;
            let walls = place.abs().to_array().into_iter().filter(|c| (1.0 - c).abs() < reach);
            z > 0.0 && walls.count() > 1
        };
        Ok((0..depth.data.len() / depth.components as usize).map(near).collect())
    }
}
