//! How far results are from f64 where textbook forms fail: each beside the form that it replaces.

use crate::natural_light::{Errors, Lab, NaturalLight, lone_sun};
use crate::stage;
use anyhow::{Context as _, Result};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::PI;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::prelude::*;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_image::Image;
use surfelshop_render::{EngineOptions, GpuOptions, SurfelDrawing};

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What is computed, and where that is hard.
    pub what: &'static str,
    /// What the numbers are.
    pub measure: &'static str,
    /// The form that fails, and its error.
    pub before: (&'static str, f64),
    /// The form that is used, and its error.
    pub after: (&'static str, f64),
}

/// All figures.
///
/// # Errors
/// Where something cannot be drawn.
pub fn figures() -> Result<Vec<Figure>> {
    Ok(vec![far_depth()?, sharp_highlight()?, faint_boundary()?, far_patch()?, sun()?])
}

const SIDE: u32 = 256;

/// Computes the host's shader functions for many arguments, which it gives beside each result.
#[derive(Debug)]
pub struct Functions;

impl Renderer for Functions {
    const INFO: UnitInfo = UnitInfo::new("functions", "Functions", "Values of shader functions.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self, Error> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<(), Error> {
        let natural = include_str!("../../host/sdk/shading/src/natural.wgsl");
        // Angles up to a tenth, and the highlight of a normal so far from light and eye.
        let highlight = "
            #import surfelshop::phong
            @fragment fn highlight(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                let angle = (floor(p.x) + 256.0 * floor(p.y)) / 655360.0;
                let z = vec3(0.0, 0.0, 1.0);
                let normal = vec3(sin(angle), 0.0, cos(angle));
                return vec4(phong::half_vector_highlight(normal, z, z, 1024.0), normal.xz, 1.0);
            }";
        // Cosines and how far the index is above 1, both from 1 to a ten-millionth.
        let fresnel = "
            #import shading::natural
            @fragment fn fresnel(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                let cosine = exp2(-floor(p.x) / 11.0);
                // Whole steps of f32 above 1: compilers take the 1 away again without rounding.
                let ior = 1.0 + floor(exp2(23.0 - floor(p.y) / 11.0)) * exp2(-23.0);
                return vec4(natural::fresnel(cosine, ior), cosine, ior, 1.0);
            }";
        for (name, wgsl) in [("highlight", highlight), ("fresnel", fresnel)] {
            let texture = Texture::fixed(Format::Rgba32Float, SIDE, SIDE);
            let texture = graph.texture(name, texture);
            let mut pass = Pass::fullscreen(name, wgsl, name);
            if name == "fresnel" {
                pass = pass.module("shading::natural", "natural.wgsl", natural);
            }
            graph.pass(pass.target(texture));
            graph.output(Output::Debug(name.to_owned()), texture);
        }
        Ok(())
    }
}

surfelshop_api::static_plugin! { id: "org.surfelshop.test.functions", renderers: [Functions] }

/// Values of one of the functions, with its arguments.
fn values_of(name: &str) -> Result<Image> {
    let mut engine = stage::engine();
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    let cloud = crate::clouds::sphere(16, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, SIDE);
    let output = Output::Debug(name.to_owned());
    let outputs = [output.clone()];
    let rendered =
        stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)?;
    Ok(rendered.image(&output).context("no picture")?.clone())
}

/// The largest errors over all values of one of the functions, by the form replaced and the one used; what
/// is no number is as wrong as can be.
fn largest_errors(name: &str, errors: impl Fn([f64; 3]) -> [f64; 2]) -> Result<[f64; 2]> {
    let mut largest = [0.0f64; 2];
    for texel in values_of(name)?.data.chunks_exact(4) {
        let errors = errors([texel[0], texel[1], texel[2]].map(f64::from));
        for (largest, error) in largest.iter_mut().zip(errors) {
            *largest = largest.max(if error.is_nan() { 1.0 } else { error.abs() });
        }
    }
    Ok(largest)
}

/// A slanted plane about 1000 units away, the near plane at 0.01.
fn far_depth() -> Result<Figure> {
    let (near, far) = (0.01, 1e5);
    let normal = DVec3::new(0.3, 0.2, 1.0).normalize_or(DVec3::Z);
    let middle = DVec3::new(0.0, 0.0, -1000.0);
    let mut plane = crate::clouds::Surfels::default();
    plane.push(middle.as_vec3(), normal.as_vec3(), 800.0);
    let cloud: Cloud = plane.cloud();
    let mut view = stage::view(DVec3::ZERO, DVec3::NEG_Z, 64);
    (view.near, view.far) = (near, far);
    // Quads: the CPU knows no clip space.
    let options = EngineOptions { surfels: SurfelDrawing::Quads, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    let mut renderer = stage::built_renderer(&engine, "surfelshop_flat", "flat");
    let outputs = [Output::Depth];
    let scene = Scene::default();
    let rendered = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs)?;
    let depth = rendered.image(&Output::Depth).context("no depth")?;
    let half = DVec2::from(view.half_extent());
    let (mut before, mut after) = (0.0f64, 0.0f64);
    for y in 0..64 {
        for x in 0..64 {
            let at = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / 32.0 - 1.0;
            let ray = DVec3::new(at.x * half.x, -at.y * half.y, -1.0);
            // The normal as it is stored.
            let normal = normal.as_vec3().as_dvec3();
            let truth = middle.dot(normal) / ray.dot(normal);
            after = after.max((f64::from(depth.pixel(x, y)[0]) - truth).abs());
            // Depth as textbooks have it, kept in 32 bits.
            let stored = (far / (far - near) - far * near / (far - near) / truth) as f32;
            let back = far * near / (far - f64::from(stored) * (far - near));
            before = before.max((back - truth).abs());
        }
    }
    Ok(Figure {
        what: "depth at 1000, near plane at 0.01",
        measure: "largest error, units",
        before: ("standard depth in 32 bits", before),
        after: ("from reversed depth without far plane, in f32", after),
    })
}

/// The lobe of exponent 1024.
fn sharp_highlight() -> Result<Figure> {
    let [before, after] = largest_errors("highlight", |[value, x, z]| {
        let truth = (z / x.hypot(z)).powi(1024);
        // Eleven bits of the cosine.
        let half = (z * 2048.0).round() / 2048.0;
        [half.powi(1024) - truth, value - truth]
    })?;
    Ok(Figure {
        what: "highlight of exponent 1024",
        measure: "largest error of values up to 1",
        before: ("power of a cosine in half precision", before),
        after: ("from the sine, in f32", after),
    })
}

/// What a boundary reflects whose index is near 1.
fn faint_boundary() -> Result<Figure> {
    let [before, after] = largest_errors("fresnel", |[value, c, n]| {
        let truth = fresnel(c, n);
        [f64::from(textbook_fresnel(c as f32, n as f32)) - truth, value - truth]
    })?;
    Ok(Figure {
        what: "Fresnel's reflectance, index 1 to 2, at any angle",
        measure: "largest error of values up to 1",
        before: ("g - c as it stands", before),
        after: ("(n - 1) (n + 1) / (g + c)", after),
    })
}

/// Reflectance of a boundary for unpolarised light by the amplitudes of both polarisations.
fn fresnel(cosine: f64, index: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt() / index;
    let inside = (1.0 - sine * sine).max(0.0).sqrt();
    // Of squared cosines Snell's law leaves the index alone.
    let s = (1.0 - index * index) / (cosine + index * inside).powi(2);
    let p = ((index * cosine).powi(2) - inside * inside) / (index * cosine + inside).powi(2);
    0.5 * (s * s + p * p)
}

/// The same as printed, in f32.
fn textbook_fresnel(c: f32, n: f32) -> f32 {
    let g = (n * n + c * c - 1.0).sqrt();
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    0.5 * a * a * (1.0 + b * b)
}

/// A patch a tenth wide at coordinates of 10,000, and the direction of its plane.
fn far_patch() -> Result<Figure> {
    let normal = DVec3::new(0.48, 0.6, 0.64);
    let origin = DVec3::splat(1e4);
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let offsets: Vec<Vec3> = (0..200)
        .map(|i| {
            let (r, turn) = ((f64::from(i) / 200.0).sqrt() * 0.05, 2.399_963 * f64::from(i));
            (u * (r * turn.cos()) + v * (r * turn.sin())).as_vec3()
        })
        .collect();
    let estimated =
        surfelshop_geometry::normals::estimate(&offsets, 16, &surfelshop_geometry::silent);
    let estimated = estimated.ok().context("cancelled")?;
    let angle = |found: DVec3| found.cross(normal).length().atan2(found.dot(normal).abs());
    let after = estimated.normals.iter().map(|&n| angle(n.as_dvec3())).fold(0.0, f64::max);
    let absolute: Vec<Vec3> = offsets.iter().map(|p| (p.as_dvec3() + origin).as_vec3()).collect();
    Ok(Figure {
        what: "plane of a patch of 0.1 at coordinates of 10,000",
        measure: "largest angle, degrees",
        before: ("E[xx] - E[x]E[x] of f32 coordinates", angle(one_pass(&absolute)).to_degrees()),
        after: ("second pass about the mean, from an origin in f64", after.to_degrees()),
    })
}

/// The direction in which points vary least by moments about the origin, in f32.
fn one_pass(points: &[Vec3]) -> DVec3 {
    let n = points.len() as f32;
    let (mut mean, mut squares) = (Vec3::ZERO, [Vec3::ZERO; 3]);
    for &p in points {
        mean += p / n;
        for (row, value) in squares.iter_mut().zip(p.to_array()) {
            *row += p * value / n;
        }
    }
    let rows = [0, 1, 2].map(|i| (squares[i] - mean * mean[i]).as_dvec3());
    let covariance = DMat3::from_cols(rows[0], rows[1], rows[2]);
    // What is least of it is most of this.
    let most = rows.iter().map(|row| row.length()).sum::<f64>();
    let turned = DMat3::from_diagonal(DVec3::splat(most)) - covariance;
    let start = DVec3::new(0.3, 0.5, 0.7);
    (0..10_000).fold(start, |direction, _| (turned * direction).normalize_or(start))
}

/// Matte light under a lone small sun.
fn sun() -> Result<Figure> {
    let probe = Probe::from_picture("a lone sun of 1e5", lone_sun(1e5), None)?;
    let truth = NaturalLight::of(&probe);
    let mut lab = Lab::new(20_000, 48);
    let mut mean = |helped: bool| -> Result<f64> {
        let values = Values::from([
            ("ks".to_owned(), Value::Float(0.0)),
            ("sun".to_owned(), Value::Bool(helped)),
            ("window".to_owned(), Value::Bool(helped)),
        ]);
        let mut pixels = Vec::new();
        // From all around: half of a ball sees no sun.
        for turn in 0..4 {
            let angle = 0.5 * PI * f64::from(turn);
            lab.view.camera.eye = DVec3::new(angle.sin(), 0.0, angle.cos()) * 4.0;
            pixels.extend(lab.pixels(&probe, &values)?);
        }
        Ok(Errors::of(&pixels, |seen| truth.white_diffuse(seen.normal)).mean)
    };
    Ok(Figure {
        what: "light of a lone sun on matte surfaces, nine harmonics",
        measure: "mean error as a share of the mean",
        before: ("all in harmonics", mean(false)?),
        after: ("the sun apart", mean(true)?),
    })
}
