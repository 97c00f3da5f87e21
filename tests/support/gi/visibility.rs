//! What virtual lights see of the surface, by rays and by shadow maps.

use super::{Bench, Maps, Vpl};
use anyhow::Result;
use glam::Vec3;
use rayon::prelude::*;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_geometry::discs::{Disc, Discs};
use surfelshop_geometry::silent;

/// Rays do not meet discs nearer to either end than this many of these discs' radii, as those of the
/// tracer `reference`.
const OWN: f32 = 2.0;

/// A light is a disc of this radius over the root of how many there are, units of the extent.
const RADIUS_OF_LIGHT: f32 = 0.7;

/// A place of the surface; lengths in units of the extent.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// From the scene's origin.
    pub position: Vec3,
    /// Unit, towards the camera.
    pub normal: Vec3,
}

/// A light and a place that face each other.
#[derive(Clone, Copy, Debug)]
struct Pair {
    light: u32,
    receiver: u32,
    /// How much light arrives if nothing lies between.
    weight: f32,
    /// Whether nothing does.
    seen: bool,
}

/// All lights and places that face each other.
pub struct Pairs {
    lights: Vec<Vpl>,
    receivers: Vec<Receiver>,
    pairs: Vec<Pair>,
}

/// How far visibility by maps is from that by rays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Share of pairs that see each other and count as shadowed.
    pub shadowed: f64,
    /// Share of pairs that do not see each other and count as lit.
    pub lit: f64,
    /// The same of the light that these pairs would carry.
    pub weighted_shadowed: f64,
    /// The same.
    pub weighted_lit: f64,
    /// Mean over places of the error of the light from all lights, as a share of what would arrive
    /// if nothing lay between; signed: above 0 is too bright.
    pub bias: f64,
    /// The mean of its size.
    pub absolute: f64,
    /// Share of the light that pairs carry that see each other.
    pub open: f64,
}

/// The surface of a cloud of one object as a hierarchy of discs; units of the extent.
fn discs_of(bench: &Bench) -> Result<(Vec<Disc>, Discs)> {
    let (view, extent) = (bench.cloud.view(), bench.extent());
    let origin = view.origin.as_vec3();
    let radii = view.floats(RADIUS, 1).unwrap_or_default();
    let places = view.vectors(POSITION).zip(view.vectors(NORMAL)).zip(radii);
    let disc = |((position, normal), radius): ((Vec3, Vec3), &f32)| Disc {
        centre: (position + origin) / extent,
        normal: normal.normalize_or(Vec3::Y),
        radius: radius / extent,
    };
    let discs: Vec<Disc> = places.map(disc).collect();
    let built = Discs::build(&discs, &silent)?;
    Ok((discs, built))
}

/// Whether nothing lies between two places of the surface.
fn see_each_other(discs: &Discs, from: Vec3, to: Vec3) -> bool {
    let distance = from.distance(to);
    let direction = (to - from) / distance;
    !discs.is_hit(from, direction, 0.0..distance, |met| {
        met.distance > OWN * met.radius && distance - met.distance > OWN * met.radius
    })
}

/// Surfels from all over the cloud that the camera sees, and the surface as discs.
///
/// # Errors
/// Never in practice: nobody stops the hierarchy of discs.
pub fn receivers(bench: &Bench, count: usize) -> Result<(Vec<Receiver>, Discs)> {
    let (all, discs) = discs_of(bench)?;
    let eye = (bench.view.camera.eye / f64::from(bench.extent())).as_vec3();
    let mut found = Vec::with_capacity(count);
    for i in 1..=50 * count {
        // Golden steps through the list: evenly over all of it, however many are wanted.
        let at = (i as f64 * 0.618_033_988_749_895).fract() * all.len() as f64;
        let disc = all[at as usize % all.len()];
        let to_eye = eye - disc.centre;
        if found.len() < count && see_each_other(&discs, disc.centre, eye) {
            let normal = if disc.normal.dot(to_eye) < 0.0 { -disc.normal } else { disc.normal };
            found.push(Receiver { position: disc.centre, normal });
        }
    }
    Ok((found, discs))
}

impl Pairs {
    /// Casts rays between all lights and places that face each other.
    #[must_use]
    pub fn new(lights: &[Vpl], receivers: &[Receiver], discs: &Discs) -> Self {
        let radius_squared = RADIUS_OF_LIGHT * RADIUS_OF_LIGHT / lights.len().max(1) as f32;
        let pairs_of = |(i, receiver): (usize, &Receiver)| {
            let pair = |(j, light): (usize, &Vpl)| {
                let offset = light.position - receiver.position;
                let square = offset.length_squared();
                let direction = offset / square.sqrt().max(1e-10);
                let received = receiver.normal.dot(direction);
                let sent = -light.normal.dot(direction);
                let faces = light.alive && square > 1e-14 && received > 0.0 && sent > 0.0;
                faces.then(|| Pair {
                    light: j as u32,
                    receiver: i as u32,
                    weight: light.power * received * sent / (square + radius_squared),
                    seen: see_each_other(discs, light.position, receiver.position),
                })
            };
            lights.iter().enumerate().filter_map(pair).collect::<Vec<_>>()
        };
        let pairs = receivers.par_iter().enumerate().flat_map_iter(pairs_of).collect();
        Self { lights: lights.to_vec(), receivers: receivers.to_vec(), pairs }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Compares what maps say, with a bias of factors on the renderer's thickness and on what a
    /// texel's width leaves open.
    #[must_use]
    pub fn errors(&self, maps: &Maps, bias: [f32; 2]) -> Errors {
        let bias = [bias[0] * maps.thickness(), bias[1]];
        let seen = |pair: &Pair| {
            let light = &self.lights[pair.light as usize];
            let receiver = &self.receivers[pair.receiver as usize];
            let offset = receiver.position - light.position;
            let distance = offset.length();
            let direction = offset / distance;
            let cosine = -receiver.normal.dot(direction);
            maps.is_seen(pair.light as usize, direction, distance, cosine, bias)
        };
        let by_maps: Vec<bool> = self.pairs.par_iter().map(seen).collect();
        self.compared(&by_maps)
    }

    /// Compares visibility pair by pair.
    fn compared(&self, by_maps: &[bool]) -> Errors {
        let mut errors = Errors::default();
        let mut all = 0.0;
        let mut at = vec![(0.0, 0.0); self.receivers.len()];
        for (pair, mapped) in self.pairs.iter().zip(by_maps) {
            let weight = f64::from(pair.weight);
            let sign = f64::from(i8::from(*mapped) - i8::from(pair.seen));
            let (shadowed, lit) = (f64::from(sign < 0.0), f64::from(sign > 0.0));
            errors.shadowed += shadowed;
            errors.lit += lit;
            errors.weighted_shadowed += shadowed * weight;
            errors.weighted_lit += lit * weight;
            errors.open += if pair.seen { weight } else { 0.0 };
            all += weight;
            let (error, total) = &mut at[pair.receiver as usize];
            *error += sign * weight;
            *total += weight;
        }
        let n = self.pairs.len().max(1) as f64;
        for count in [&mut errors.shadowed, &mut errors.lit] {
            *count /= n;
        }
        for sum in [&mut errors.weighted_shadowed, &mut errors.weighted_lit, &mut errors.open] {
            *sum /= f64::max(all, 1e-30);
        }
        let lit: Vec<f64> =
            at.iter().filter(|(_, all)| *all > 0.0).map(|(error, all)| error / all).collect();
        errors.bias = lit.iter().sum::<f64>() / lit.len().max(1) as f64;
        errors.absolute = lit.iter().map(|e| e.abs()).sum::<f64>() / lit.len().max(1) as f64;
        errors
    }
}
