//! Rims: what is seen of discs from behind only because they stick out past the edge of what hides their centres.
//! Twin of `rim_fragment` of `draw_surfels.wgsl` of `host/render`.
//!
//! A body that is closed shows no backs, but for discs of its far side that reach past its silhouette: they are lit as
//! what they are not, which makes bright and dark specks. Their centres are hidden, by the front of the very surface
//! that they belong to, a few radii before them. Such pixels take normal, albedo and accessibility of the nearest
//! pixel of that front, towards the centre of the disc, and keep their distance: nothing is taken away, so no hole
//! comes about. The backs of thin sheets and of what is open have centres that are seen, or hidden by something else.

use crate::cloud::CloudInView;
use crate::columns::geometry::Shape;
use crate::picture::Picture;
use crate::splat::BACK;
use glam::Vec3;
use rayon::prelude::*;

/// What hides the centre of a disc is its own rim up to so many of its radii before it.
const RIM_RADII: f32 = 4.0;

/// Pixels from one that is seen from behind to the centre of its disc; of larger discs the others are left alone.
const MOST_STEPS: i32 = 128;

/// A pixel whose nearest surfel is seen from behind: its place in the picture, and the surfel's number.
pub(crate) type BackPixel = (u32, u32);

/// A picture of the surface, and which of its pixels are seen from behind.
struct SurfacePixels<'a> {
    packed: &'a [[u32; 4]],
    /// A bit a pixel.
    backs: &'a [u64],
    size: [i32; 2],
}

impl SurfacePixels<'_> {
    /// The distance of a pixel that is seen from the front, where it is one.
    fn front(&self, [x, y]: [i32; 2]) -> Option<(usize, f32)> {
        let [width, height] = self.size;
        if x < 0 || y < 0 || x >= width || y >= height {
            return None;
        }
        let at = y as usize * width as usize + x as usize;
        let distance = self.packed.get(at)?[0];
        let is_back = self.backs.get(at / 64)? >> (at % 64) & 1 == 1;
        (distance != 0 && !is_back).then_some((at, f32::from_bits(distance)))
    }

    /// The pixel of the front that stands for one that only sticks out past it.
    fn stands_for(&self, at: u32, number: u32, in_view: &CloudInView<'_>) -> Option<usize> {
        let (eye, columns) = (&in_view.eye, in_view.columns);
        let place = in_view.place(number);
        let (part, own) = columns.geometry_at(place);
        let radius = match &part.shape {
            Shape::Radius(radii) => radii.one(own) * eye.radius_scale,
            Shape::Tangents(u, v) => {
                let half_axis = |axis: [f32; 3]| eye.one_offset(axis).length();
                half_axis(u.one(own)).max(half_axis(v.one(own))) * eye.tangent_scale
            }
        };
        let center: Vec3 = eye.one(part.positions.one(own));
        let distance = -center.z;
        // Round splats, which face the eye, have negative radii.
        if !(radius > 0.0 && distance > eye.near) {
            return None;
        }
        let per_unit = if eye.orthographic { 1.0 } else { 1.0 / distance };
        let px = eye.px_per_unit.map(|px| px * per_unit);
        let x = (eye.middle_px[0] + center.x * px[0]).floor();
        let y = (eye.middle_px[1] - center.y * px[1]).floor();
        let from = [at as i32 % self.size[0], at as i32 / self.size[0]];
        let (dx, dy) = (x - from[0] as f32, y - from[1] as f32);
        let steps = dx.abs().max(dy.abs());
        if !(steps >= 1.0 && steps <= MOST_STEPS as f32) {
            return None;
        }
        let slack = RIM_RADII * (radius + eye.low_pass / px[1]);
        let (_, hides) = self.front([x as i32, y as i32])?;
        if hides > distance || distance - hides > slack {
            return None;
        }
        (1..=steps as i32).find_map(|step| {
            let along = |d: f32| (d * step as f32 / steps + 0.5).floor() as i32;
            let (at, depth) = self.front([from[0] + along(dx), from[1] + along(dy)])?;
            ((depth - distance).abs() <= slack).then_some(at)
        })
    }
}

/// Has pixels that only stick out past a rim look as the front does beside them.
pub(crate) fn smooth(
    picture: &mut Picture,
    backs: &[Vec<BackPixel>],
    cloud_of: impl Fn(u32) -> usize + Sync,
    clouds: &[CloudInView<'_>],
) {
    let size = picture.covered.size();
    if backs.iter().all(Vec::is_empty) {
        return;
    }
    let mut bits = vec![0u64; (size[0] * size[1]).div_ceil(64)];
    for (at, _) in backs.iter().flatten() {
        if let Some(word) = bits.get_mut(*at as usize / 64) {
            *word |= 1 << (at % 64);
        }
    }
    let surface =
        SurfacePixels { packed: &picture.packed, backs: &bits, size: size.map(|side| side as i32) };
    let changed: Vec<(u32, usize)> = backs
        .par_iter()
        .flatten_iter()
        .filter_map(|&(at, number)| {
            let in_view = clouds.get(cloud_of(number))?;
            Some((at, surface.stands_for(at, number & !BACK, in_view)?))
        })
        .collect();
    for (at, from) in changed {
        let source = picture.packed.get(from).copied();
        if let (Some([_, normal, albedo, rest]), Some(pixel)) =
            (source, picture.packed.get_mut(at as usize))
        {
            *pixel = [pixel[0], normal, albedo, rest];
        }
    }
}
