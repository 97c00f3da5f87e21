//! A plain renderer of Gaussians in f64: every splat at every pixel.
//!
//! View space has x to the right, y up and z backwards. Nothing of the shaders or of the host is used but the camera's
//! axes.
//!
//! Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering", sections 4 and 6, appendix
//! C, and the program's limit of 1.3 half pictures on slants; Zwicker et al. 2001, "EWA Volume Splatting", the Jacobian;
//! Yu et al. 2024, "Mip-Splatting", equation 10; Huang et al. 2024, "2D Gaussian Splatting", equations 4 to 13.

use super::Gaussians;
use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use surfelshop_api::{Projection, View};

/// What is drawn of each Gaussian.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Projected.
    Space {
        /// Square pixels that are added.
        low_pass: f64,
        /// Whether the sum of opacities is kept.
        keeps_sum: bool,
    },
    /// Met by rays.
    Plane,
}

/// How those of a pixel are put together.
#[derive(Clone, Copy, Debug)]
pub enum How {
    /// Each over those behind it.
    Over,
    /// The mean of those that are at most this share of its distance off the nearest that is half opaque.
    Mean(f64),
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Linear light, and coverage.
    pub color: [f64; 4],
    /// Of unit length where there is any.
    pub normal: DVec3,
    /// The mean distance, scene units.
    pub expected: f64,
    /// The distance of what keeps off the second half of the light, scene units.
    pub median: f64,
    /// How near the light that is let through comes to a half, behind any splat.
    pub to_half: f64,
    /// How far splats lie apart.
    pub distortion: f64,
    /// Splats, each as much as those before it let through: what rounds in blending from far to near.
    pub layers: f64,
    /// The largest number of a colour.
    pub brightest: f64,
}

struct Splat {
    distance: f64,
    center_px: DVec2,
    opacity: f64,
    /// Twice the exponent at which it is not seen any more.
    cutoff: f64,
    color: DVec3,
    normal: DVec3,
    shape: Shape,
}

enum Shape {
    /// The inverse of the covariance, pixels.
    Conic(DMat2),
    /// A place of the plane and its unit axes in view space, and standard deviations along them.
    Plane { place: DVec3, axes: [DVec3; 2], scale: [f64; 2] },
}

/// A camera in numbers of its own.
struct Eye {
    world_to_view: DMat3,
    place: DVec3,
    half: DVec2,
    size: DVec2,
    near: f64,
    parallel: bool,
}

impl Eye {
    fn new(view: &View) -> Self {
        let size = DVec2::new(f64::from(view.size_px[0]), f64::from(view.size_px[1]));
        let (height, parallel) = match view.camera.projection {
            Projection::Perspective { fov_y } => ((fov_y / 2.0).tan(), false),
            Projection::Orthographic { height } => (height / 2.0, true),
        };
        Self {
            world_to_view: view.camera.view_from_world(),
            place: view.camera.eye,
            half: DVec2::new(height * size.x / size.y, height),
            size,
            near: view.near,
            parallel,
        }
    }

    /// Pixels of a step of one at distance 1, or anywhere where rays are parallel; y downwards.
    fn step(&self) -> DVec2 {
        DVec2::new(0.5, -0.5) * self.size / self.half
    }

    fn seen_at(&self, p: DVec3) -> DVec2 {
        let across = if self.parallel { p.truncate() } else { p.truncate() / -p.z };
        0.5 * self.size + self.step() * across
    }

    /// How a step in view space moves what is seen, as the columns of a matrix.
    fn jacobian(&self, p: DVec3) -> [DVec2; 3] {
        let step = self.step();
        if self.parallel {
            return [DVec2::new(step.x, 0.0), DVec2::new(0.0, step.y), DVec2::ZERO];
        }
        let distance = -p.z;
        let slant = (p.truncate() / distance).clamp(-1.3 * self.half, 1.3 * self.half);
        [
            DVec2::new(step.x, 0.0) / distance,
            DVec2::new(0.0, step.y) / distance,
            step * slant / distance,
        ]
    }

    /// Where the ray of a place of the picture starts, and where to it goes.
    fn ray(&self, px: DVec2) -> (DVec3, DVec3) {
        let across = (px - 0.5 * self.size) / self.step();
        match self.parallel {
            true => (across.extend(0.0), DVec3::NEG_Z),
            false => (DVec3::ZERO, across.extend(-1.0)),
        }
    }
}

/// Associated Legendre polynomials without the Condon-Shortley sign.
fn legendre(l: i32, m: i32, z: f64) -> f64 {
    let rim = (1.0 - z * z).max(0.0).sqrt();
    let odd: f64 = (1..=m).map(|k| f64::from(2 * k - 1)).product();
    let start = odd * rim.powi(m);
    match l - m {
        0 => start,
        1 => z * f64::from(2 * m + 1) * start,
        _ => {
            let lower = legendre(l - 1, m, z) * z * f64::from(2 * l - 1);
            (lower - f64::from(l + m - 1) * legendre(l - 2, m, z)) / f64::from(l - m)
        }
    }
}

/// A real spherical harmonic, orthonormal, without the Condon-Shortley sign.
pub fn harmonic(l: i32, m: i32, d: DVec3) -> f64 {
    let n = m.abs();
    let factorial = |k: i32| (1..=k).map(f64::from).product::<f64>();
    let norm = f64::from(2 * l + 1) / (4.0 * PI) * factorial(l - n) / factorial(l + n);
    let p = norm.sqrt() * legendre(l, n, d.z);
    let angle = d.y.atan2(d.x);
    match m.cmp(&0) {
        std::cmp::Ordering::Equal => p,
        std::cmp::Ordering::Greater => 2f64.sqrt() * p * (f64::from(n) * angle).cos(),
        std::cmp::Ordering::Less => 2f64.sqrt() * p * (f64::from(n) * angle).sin(),
    }
}

/// The colour of a Gaussian in a direction from the eye.
fn radiance(all: &Gaussians, i: usize, order: usize, direction: DVec3) -> DVec3 {
    let mut sum = DVec3::splat(0.5);
    for (l, values) in all.harmonics.iter().enumerate().take(order + 1) {
        let n = 2 * l + 1;
        for k in 0..n.min(values.len()) {
            let at = 3 * (i * n + k);
            let c = DVec3::from_array([0, 1, 2].map(|channel| f64::from(values[at + channel])));
            sum += c * harmonic(l as i32, k as i32 - l as i32, direction);
        }
    }
    sum.max(DVec3::ZERO)
}

impl Splat {
    fn new(all: &Gaussians, i: usize, eye: &Eye, kind: Kind, order: usize) -> Option<Self> {
        let world = all.positions[i].as_dvec3();
        let place = eye.world_to_view * (world - eye.place);
        if -place.z < eye.near {
            return None;
        }
        let forward = -eye.world_to_view.transpose().z_axis;
        let direction = match eye.parallel {
            true => forward,
            false => (world - eye.place).normalize_or_zero(),
        };
        let turn = DMat3::from_quat(DQuat::from_array(all.rotations[i].map(f64::from)));
        let scale = all.scales[i].map(f64::from);
        let mut opacity = f64::from(all.opacities[i]);
        // As the shader decides where two are equal.
        let flattest = match scale {
            [x, y, z] if x < y.min(z) => 0,
            [_, y, z] if y < z => 1,
            _ => 2,
        };
        let longest = [(flattest + 1) % 3, (flattest + 2) % 3];
        let shape = match kind {
            Kind::Plane => Shape::Plane {
                place,
                axes: longest.map(|axis| eye.world_to_view * turn.col(axis)),
                scale: longest.map(|axis| scale[axis]),
            },
            Kind::Space { low_pass, keeps_sum } => {
                let stretch = DMat3::from_diagonal(DVec3::from_array(scale));
                let covariance = turn * stretch * stretch * turn.transpose();
                let seen = eye.world_to_view * covariance * eye.world_to_view.transpose();
                let steps = eye.jacobian(place);
                let mut projected = DMat2::ZERO;
                for (row, from) in steps.iter().enumerate() {
                    for (column, to) in steps.iter().enumerate() {
                        let outer = DMat2::from_cols(*from * to.x, *from * to.y);
                        projected += outer * seen.col(column)[row];
                    }
                }
                let widened = projected + DMat2::from_diagonal(DVec2::splat(low_pass));
                if keeps_sum {
                    opacity *= (projected.determinant() / widened.determinant()).sqrt();
                }
                Shape::Conic(widened.inverse())
            }
        };
        let normal = turn.col(flattest);
        Some(Self {
            distance: -place.z,
            center_px: eye.seen_at(place),
            opacity,
            cutoff: 2.0 * (255.0 * opacity).ln(),
            color: radiance(all, i, order, direction),
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            shape,
        })
    }

    /// Twice the exponent at a place of the picture, and the distance of what is seen there.
    fn met(&self, eye: &Eye, px: DVec2) -> (f64, f64) {
        let off = px - self.center_px;
        let Shape::Plane { place, axes, scale } = &self.shape else {
            let Shape::Conic(inverse) = &self.shape else { return (f64::INFINITY, 0.0) };
            return (off.dot(*inverse * off), self.distance);
        };
        let (start, along) = eye.ray(px);
        let normal = axes[0].cross(axes[1]);
        let hit = start + along * (normal.dot(*place - start) / normal.dot(along));
        let u = (hit - *place).dot(axes[0]) / scale[0];
        let v = (hit - *place).dot(axes[1]) / scale[1];
        let (in_plane, on_screen) = (u * u + v * v, 2.0 * off.length_squared());
        if in_plane <= on_screen { (in_plane, -hit.z) } else { (on_screen, self.distance) }
    }
}

/// A splat at a pixel.
struct Hit<'a> {
    splat: &'a Splat,
    distance: f64,
    /// Its opacity, then how much of it is seen.
    share: f64,
}

/// How much of each is seen; those that are not are dropped.
fn put_together(hits: &mut Vec<Hit<'_>>, how: How) {
    match how {
        How::Over => {
            let mut left = 1.0;
            for hit in hits {
                hit.share *= left;
                left -= hit.share;
            }
        }
        How::Mean(tolerance) => {
            let opaque = hits.iter().filter(|hit| hit.share >= 0.5);
            let nearest = opaque.map(|hit| hit.distance).fold(f64::INFINITY, f64::min);
            let reach = if nearest.is_finite() { tolerance * nearest } else { -1.0 };
            hits.retain(|hit| (hit.distance - nearest).abs() <= reach);
            let sum: f64 = hits.iter().map(|hit| hit.share).sum();
            hits.iter_mut().for_each(|hit| hit.share /= sum.max(1.0));
        }
    }
}

fn shown(splats: &[Splat], eye: &Eye, px: DVec2, how: How) -> Pixel {
    let mut hits = Vec::new();
    for splat in splats {
        let (exponent, distance) = splat.met(eye, px);
        // As much as an opacity of less than 1/255.
        if exponent.is_nan() || exponent > splat.cutoff || distance < eye.near {
            continue;
        }
        let share = (splat.opacity * (-0.5 * exponent).exp()).min(0.99);
        hits.push(Hit { splat, distance, share });
    }
    put_together(&mut hits, how);
    let mut pixel = Pixel { to_half: 0.5, ..Pixel::default() };
    let (mut left, mut sum, mut moments) = (1.0, DVec3::ZERO, [0.0; 3]);
    for Hit { splat, distance, share } in hits {
        sum += splat.color * share;
        pixel.normal += splat.normal * share;
        // As the program of Huang et al. adds it up.
        let [weights, distances, squares] = moments;
        pixel.distortion +=
            share * (distance * distance * weights + squares - 2.0 * distance * distances);
        moments =
            [weights + share, distances + share * distance, squares + share * distance * distance];
        pixel.layers += left;
        pixel.brightest = pixel.brightest.max(splat.color.max_element());
        let before = left;
        left -= share;
        if before > 0.5 && left <= 0.5 {
            pixel.median = distance;
        }
        pixel.to_half = pixel.to_half.min((left - 0.5f64).abs());
    }
    let coverage = moments[0];
    let decoded = |c: f64| {
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    pixel.color = [decoded(sum.x), decoded(sum.y), decoded(sum.z), coverage];
    pixel.normal = pixel.normal.normalize_or_zero();
    pixel.expected = if coverage > 0.0 { moments[1] / coverage } else { 0.0 };
    pixel
}

/// The picture, row by row from the top.
pub fn draw(all: &Gaussians, view: &View, kind: Kind, order: usize) -> Vec<Pixel> {
    draw_as(all, view, kind, order, How::Over)
}

/// The same, put together in this way.
pub fn draw_as(all: &Gaussians, view: &View, kind: Kind, order: usize, how: How) -> Vec<Pixel> {
    let eye = Eye::new(view);
    let of = |i| Splat::new(all, i, &eye, kind, order);
    let mut splats: Vec<Splat> = (0..all.len()).into_par_iter().filter_map(of).collect();
    splats.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let [width, height] = view.size_px;
    let of_pixel = |at: u32| {
        let px = DVec2::new(f64::from(at % width) + 0.5, f64::from(at / width) + 0.5);
        shown(&splats, &eye, px, how)
    };
    (0..width * height).into_par_iter().map(of_pixel).collect()
}

/// Colours of a picture.
pub fn colors(pixels: &[Pixel]) -> Vec<[f64; 4]> {
    pixels.iter().map(|pixel| pixel.color).collect()
}
