//! What is seen of discs from behind only because they stick out past a rim looks as the rim's front.

use super::{Pixel, Splat, Twin};
use glam::{DVec2, IVec2};
use surfelshop_api::Projection;

/// Definitions, as `rims.rs` of `host/raster` has them.
const RIM_RADII: f64 = 4.0;
const MOST_STEPS: f64 = 128.0;

/// What f32 moves a place on the screen by, pixels, and a depth, as a share of the limit.
const DOUBT: f64 = 1e-3;

/// A pixel of which rounding may decide something besides.
struct Checked {
    pixel: Pixel,
    sure: bool,
}

impl Twin<'_> {
    /// The pixel as it is where it shows the back of a splat.
    pub(super) fn of_rim(&self, own: Pixel, splat: &Splat, at: [u32; 2]) -> Pixel {
        let Checked { pixel, sure } = self.told(own, splat, at);
        let nearest_sure = own.nearest_sure && pixel.nearest_sure && sure;
        Pixel {
            depth: own.depth,
            slope: own.slope,
            sure: own.nearest_sure && pixel.sure && sure,
            nearest_sure,
            ..pixel
        }
    }

    fn told(&self, own: Pixel, splat: &Splat, at: [u32; 2]) -> Checked {
        let view = self.view;
        let left = |sure| Checked { pixel: own, sure };
        let distance = -splat.center.z;
        let radius = splat.axis_u.length().max(splat.axis_v.length());
        if distance <= view.near || radius <= 0.0 {
            return left(true);
        }
        let center = splat.screen_from_disc(view).z_axis;
        let center = center.truncate() / center.z;
        // Where no pixel that may be the centre's shows a front, it does not matter which one it is.
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
        let centers = corners.map(|(x, y)| (center + DOUBT * DVec2::new(x, y)).floor());
        let fronts = centers.map(|at| self.front(at));
        if fronts.iter().all(|(front, _)| front.is_none()) {
            return left(fronts.iter().all(|(_, known)| *known));
        }
        let to_edge = (center - center.round()).abs().min_element();
        let mut sure = to_edge > DOUBT;
        let from = DVec2::new(f64::from(at[0]), f64::from(at[1]));
        let way = center.floor() - from;
        let steps = way.abs().max_element();
        if !(1.0..=MOST_STEPS).contains(&steps) {
            return left(sure);
        }
        let per_unit = 0.5 * f64::from(view.size_px[1]) / view.half_extent()[1];
        let px = match view.camera.projection {
            Projection::Orthographic { .. } => per_unit,
            Projection::Perspective { .. } => per_unit / distance,
        };
        let slack = RIM_RADII * (radius + f64::from(self.scene.surface.low_pass) / px);
        let is_near = |a: f64, b: f64| (a - b).abs() < DOUBT * slack;
        let (hides, known) = self.front(center.floor());
        sure &= known;
        let Some(hides) = hides.map(|pixel| pixel.depth) else { return left(sure) };
        sure &= !is_near(hides, distance) && !is_near(distance - hides, slack);
        if hides > distance || distance - hides > slack {
            return left(sure);
        }
        for step in 1..=steps as u32 {
            let place = from + (way * f64::from(step) / steps + 0.5).floor();
            let (front, known) = self.front(place);
            sure &= known;
            let Some(pixel) = front else { continue };
            sure &= !is_near((pixel.depth - distance).abs(), slack);
            if (pixel.depth - distance).abs() <= slack {
                return Checked { pixel, sure };
            }
        }
        left(sure)
    }

    /// A pixel that is seen from the front, if it is one, and whether that is sure.
    fn front(&self, at: DVec2) -> (Option<Pixel>, bool) {
        let at = IVec2::new(at.x as i32, at.y as i32);
        let size = self.view.size_px.map(|side| side as i32);
        if at.min_element() < 0 || at.x >= size[0] || at.y >= size[1] {
            return (None, true);
        }
        let (pixel, nearest) = self.raw(at.x as u32, at.y as u32);
        let is_front = nearest.is_some_and(|splat| !splat.back);
        (is_front.then_some(pixel), pixel.nearest_sure)
    }
}
