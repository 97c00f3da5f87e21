//! What lies under the pointer.

use crate::views::navigation;
use eframe::egui::{Pos2, Rect};
use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::View;
use surfelshop_image::Image;

/// A picture with what is far how far away in it.
pub(super) struct Picture {
    pub(super) rect: Rect,
    pub(super) view: View,
    pub(super) depth: Image,
}

impl Picture {
    /// A place in pixels of the view, from its upper left corner.
    pub(super) fn pixel(&self, at: Pos2) -> DVec2 {
        let [width, height] = self.view.size_px.map(f64::from);
        let share = (at - self.rect.min) / self.rect.size();
        DVec2::new(f64::from(share.x) * width, f64::from(share.y) * height)
    }

    /// The distance along the viewing axis at a pixel of the view; none where nothing is.
    fn depth(&self, pixel: DVec2) -> Option<f64> {
        let size = DVec2::from(self.view.size_px.map(f64::from));
        let own = DVec2::new(f64::from(self.depth.width), f64::from(self.depth.height));
        let at = (pixel / size * own).floor();
        if !(at.cmpge(DVec2::ZERO).all() && at.cmplt(own).all()) {
            return None;
        }
        let depth = f64::from(self.depth.pixel(at.x as u32, at.y as u32)[0]);
        (depth > 0.0).then_some(depth)
    }

    /// The place on the surface at a pixel, world space.
    fn place(&self, pixel: DVec2) -> Option<DVec3> {
        let size = DVec2::from(self.view.size_px.map(f64::from));
        let position = (pixel - 0.5 * size) / size.y.max(1.0);
        Some(navigation::point_at(&self.view.camera, position, self.depth(pixel)?))
    }

    /// The place and the normal of the surface at a place of the window, turned to the eye.
    pub(super) fn hit(&self, at: Pos2) -> Option<(DVec3, Vec3)> {
        let pixel = self.pixel(at);
        let place = self.place(pixel)?;
        let eye = self.view.camera.eye - place;
        /// Pixels between places that a normal is found from: over less, rounding of depths shows.
        const STEP: f64 = 3.0;
        // On each axis the neighbour that is nearer belongs to the same surface.
        let along = |step: DVec2| {
            let ahead = self.place(pixel + step).map(|other| other - place);
            let behind = self.place(pixel - step).map(|other| place - other);
            let both = ahead.into_iter().chain(behind);
            both.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        };
        let (across, down) = (along(DVec2::X * STEP), along(DVec2::Y * STEP));
        let normal = across.zip(down).map_or(eye, |(across, down)| down.cross(across));
        let normal = normal.normalize_or(eye.normalize_or(DVec3::Y));
        let turned = if normal.dot(eye) < 0.0 { -normal } else { normal };
        Some((place, turned.as_vec3()))
    }

    /// How long a share of the picture's height is at a place, scene units.
    pub(super) fn length_at(&self, place: DVec3, share: f64) -> f64 {
        let depth = (place - self.view.camera.eye).dot(self.view.camera.forward());
        let at = |y: f64| navigation::point_at(&self.view.camera, DVec2::new(0.0, y), depth);
        at(0.0).distance(at(share))
    }
}

/// A number with few digits, so that files of strokes are short: to so much of a radius.
pub(super) fn rounded(place: DVec3, radius: f64) -> DVec3 {
    let digits = (5.0 - radius.log10().floor()).clamp(0.0, 300.0);
    let unit = 10f64.powf(digits);
    let shorter = |value: f64| {
        let near = (value * unit).round() / unit;
        if near.is_finite() { near } else { value }
    };
    DVec3::from_array(place.to_array().map(shorter))
}
