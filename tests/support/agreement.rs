//! How far two pictures of the same surfels agree, pixel by pixel, within what rounding explains.

use crate::twin::{Doubt, Twin};
use glam::{DVec3, Vec3};
use surfelshop_api::{Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_image::display_transform::{DisplayTransform, develop, to_8_bit};

/// One way's pictures of a view.
pub struct DrawnView {
    /// Linear colours.
    pub color: Image,
    /// Distances along the viewing axis, 0 where nothing is.
    pub depth: Image,
    /// World-oriented normals of the nearest surfels.
    pub normal: Image,
}

/// What two ways draw.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// What is seen.
    pub clouds: &'a [Cloud],
    /// How surfels are drawn.
    pub scene: &'a Scene,
    /// From where.
    pub view: &'a View,
    /// Whether surfels blend, or the nearest ones are shown.
    pub blended: bool,
}

/// Pixels of which two ways say different things.
///
/// They cannot agree everywhere: rasterisers snap vertices to 1/256 pixel, so that a pixel whose
/// centre is that near to a splat's edge may fall to either side of it, and a splat whose depth is
/// that near to the depth tolerance may count or not. The twin in f64 says which pixels these are.
#[derive(Clone, Debug, Default)]
pub struct Differences {
    /// Covered by the first.
    pub covered: usize,
    /// Covered by one of them alone.
    pub coverage: usize,
    /// Covered by both, depths differ by more than `depth_bound`.
    pub depth: usize,
    /// Covered by both, encoded colours differ by more than one level of 8 bits.
    pub color: usize,
    /// Of one or more of these kinds.
    pub any: usize,
    /// Of all these pixels the places of those in which rounding decides nothing.
    pub unexplained: Vec<[usize; 2]>,
}

impl Differences {
    /// All that differ as a share of the covered pixels.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.any as f64 / self.covered.max(1) as f64
    }
}

/// Pixels by which a rasteriser may move a point of a quad: each corner is snapped to 1/256 pixel,
/// by at most half of that along each axis, and a point between corners moves no further.
const SNAP_PX: f64 = std::f64::consts::SQRT_2 / 512.0;

/// Relative rounding of a depth on its way through projection, division by w, interpolation and
/// back: fewer than 16 operations, each rounded to 2^-24.
const ROUNDING: f64 = 16.0 / (1 << 24) as f64;

/// How far two depths of one surfel may lie apart in a pixel: its plane moves by [`SNAP_PX`], and what
/// is interpolated is rounded, in parallel projection relative to the whole depth range.
///
/// The plane n p = c meets the ray (q, -1) at the distance c / (n (q, -1)), which changes by the
/// distance times n.xy / (n (q, -1)) for a step of q. Widened discs are less steep than their normal
/// says, never more.
fn depth_bound(view: &View, pixel: [usize; 2], depth: f64, normal: Vec3) -> f64 {
    let [half_x, half_y] = view.half_extent();
    let step = 2.0 * half_y / f64::from(view.size_px[1]);
    let n = match view.camera.view_from_world() * normal.as_dvec3() {
        // Merged surfels may cover a pixel that none of those they stand for does: they are as steep as 45 degrees.
        none if none == DVec3::ZERO => DVec3::new(1.0, 0.0, 1.0),
        known => known,
    };
    let (ray, scale, rounding) = match view.camera.projection {
        Projection::Perspective { .. } => {
            let across = |at: usize, size: u32| 2.0 * (at as f64 + 0.5) / f64::from(size) - 1.0;
            let x = across(pixel[0], view.size_px[0]) * half_x;
            let y = -across(pixel[1], view.size_px[1]) * half_y;
            (DVec3::new(x, y, -1.0), depth, ROUNDING * depth)
        }
        Projection::Orthographic { .. } => {
            (DVec3::NEG_Z, 1.0, ROUNDING * (view.far - view.near).max(depth))
        }
    };
    let slope = scale * n.truncate().length() / n.dot(ray).abs();
    slope * step * SNAP_PX + rounding
}

/// What rounding decides: a pixel's centre within 1/256 pixel of an edge, a depth within what two
/// splats' own are off by ([`depth_bound`]) of the limit of blending.
fn doubt(view: &View) -> Doubt {
    let (relative, absolute) = match view.camera.projection {
        Projection::Perspective { .. } => (ROUNDING, 0.0),
        Projection::Orthographic { .. } => (0.0, ROUNDING * (view.far - view.near)),
    };
    Doubt { edge_px: 1.0 / 256.0, reach: 0.0, step_px: SNAP_PX, relative, absolute }
}

/// Compares two ways of drawing.
///
/// # Panics
/// Where sizes differ.
#[must_use]
pub fn differences(drawn: &Drawn<'_>, a: &DrawnView, b: &DrawnView) -> Differences {
    let view = drawn.view;
    let [width, height] = view.size_px.map(|side| side as usize);
    let levels = |shot: &DrawnView| to_8_bit(&develop(&shot.color, &DisplayTransform::default()));
    let (levels_a, levels_b) = (levels(a), levels(b));
    assert_eq!(levels_a.len(), levels_b.len(), "pictures of one size");
    assert_eq!(levels_a.len(), 4 * width * height, "pictures of the view");
    let at = |image: &Image, i: usize| image.data[i * image.components as usize];
    let mut found = Differences::default();
    let mut differing = Vec::new();
    for i in 0..width * height {
        let place = [i % width, i / width];
        let (depth_a, depth_b) = (f64::from(at(&a.depth, i)), f64::from(at(&b.depth, i)));
        found.covered += usize::from(depth_a > 0.0);
        let coverage = (depth_a > 0.0) != (depth_b > 0.0);
        let n = i * a.normal.components as usize;
        let normal = Vec3::from_slice(&a.normal.data[n..n + 3]);
        let bound = depth_bound(view, place, depth_a, normal);
        // What is no number is off, too.
        let is_near = (depth_a - depth_b).abs() <= bound;
        let off = !is_near;
        let depth = !coverage && depth_a > 0.0 && off;
        let (from, to) = (&levels_a[4 * i..4 * i + 4], &levels_b[4 * i..4 * i + 4]);
        let color = !coverage && from.iter().zip(to).any(|(a, b)| a.abs_diff(*b) > 1);
        found.coverage += usize::from(coverage);
        found.depth += usize::from(depth);
        found.color += usize::from(color);
        differing.extend((coverage || depth || color).then_some(place));
    }
    found.any = differing.len();
    if !differing.is_empty() {
        let twin = Twin::new(drawn.clouds, drawn.scene, view).doubting(doubt(view));
        differing.retain(|[x, y]| {
            let pixel = twin.pixel(*x as u32, *y as u32);
            if drawn.blended { pixel.sure } else { pixel.nearest_sure }
        });
        found.unexplained = differing;
    }
    found
}
