//! Surfels by where they are seen in a picture.

use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use glam::{DVec2, DVec3};
use surfelshop_api::View;

/// A part of a picture; positions in pixels from its upper left corner, y downwards.
#[derive(Clone, Debug, PartialEq)]
pub enum ScreenShape {
    /// Between two corners.
    Rectangle([DVec2; 2]),
    /// Within a line that is closed; what it goes round twice is outside.
    Lasso(Vec<DVec2>),
    /// At most so many pixels from a place.
    Circle {
        /// The middle.
        center: DVec2,
        /// The radius, pixels.
        radius: f64,
    },
}

/// How far away each pixel of a picture is.
#[derive(Clone, Copy, Debug)]
pub struct DepthPicture<'a> {
    /// Pixels in a row; the picture may be smaller or larger than the view.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Distances along the viewing axis, scene units; 0 where nothing is.
    pub values: &'a [f32],
}

/// What is seen in a part of a picture.
#[derive(Clone, Debug)]
pub struct ScreenRegion<'a> {
    /// What the picture shows of the world.
    pub view: View,
    /// The part.
    pub shape: ScreenShape,
    /// Where this is there only surfels that are visible are selected, and else all that lie behind each other.
    pub depth: Option<DepthPicture<'a>>,
}

/// A surfel counts as visible to this share of its distance behind what is shown: rounding of depths in pictures.
const TOLERANCE: f64 = 1e-4;

impl ScreenShape {
    fn contains(&self, at: DVec2) -> bool {
        match self {
            Self::Rectangle([a, b]) => at.cmpge(a.min(*b)).all() && at.cmple(a.max(*b)).all(),
            Self::Circle { center, radius } => at.distance_squared(*center) <= radius * radius,
            Self::Lasso(line) => {
                let ends = line.iter().zip(line.iter().cycle().skip(1));
                let crosses = ends.filter(|(a, b)| {
                    (a.y > at.y) != (b.y > at.y)
                        && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x)
                });
                crosses.count() % 2 == 1
            }
        }
    }

    /// The box around it.
    fn bounds(&self) -> [DVec2; 2] {
        match self {
            Self::Rectangle([a, b]) => [a.min(*b), a.max(*b)],
            Self::Circle { center, radius } => [*center - *radius, *center + *radius],
            Self::Lasso(line) => line.iter().fold(
                [DVec2::splat(f64::INFINITY), DVec2::splat(f64::NEG_INFINITY)],
                |[low, high], at| [low.min(*at), high.max(*at)],
            ),
        }
    }
}

impl DepthPicture<'_> {
    /// The distance at a pixel; 0 where nothing is.
    fn at(&self, x: i64, y: i64) -> f64 {
        let inside =
            (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        let index = y * i64::from(self.width) + x;
        let value = usize::try_from(index).ok().filter(|_| inside).and_then(|i| self.values.get(i));
        value.map_or(0.0, |value| f64::from(*value))
    }

    /// Whether something at a place of the picture, in shares of its size, and this far away is in front.
    fn shows(&self, share: DVec2, depth: f64, reach: f64) -> bool {
        let limit = |shown: f64| shown > 0.0 && depth <= shown + reach + TOLERANCE * depth;
        let [x, y] = [share.x * f64::from(self.width), share.y * f64::from(self.height)]
            .map(|place| place.floor() as i64);
        let middle = self.at(x, y);
        if middle > 0.0 {
            return limit(middle);
        }
        // A surfel of less than a pixel may have been drawn beside its centre.
        (-1..=1).any(|dy| (-1..=1).any(|dx| limit(self.at(x + dx, y + dy))))
    }
}

impl ScreenRegion<'_> {
    /// The surfels whose centres are seen in the part of the picture.
    ///
    /// # Errors
    /// Where there is no memory.
    pub fn select(&self, cloud: &Cloud) -> Result<Selection, SelectionError> {
        let view_from_cloud = self.view.view_from_offset(cloud.origin());
        let [half_x, half_y] = self.view.half_extent();
        let size = DVec2::from(self.view.size_px.map(f64::from));
        let central =
            matches!(self.view.camera.projection, surfelshop_api::Projection::Perspective { .. });
        let (positions, radii) = (cloud.positions(), cloud.radii());
        let [low, high] = self.shape.bounds();
        let share = |in_view: DVec3| {
            let depth = -in_view.z;
            let scale = if central { depth } else { 1.0 };
            let x = 0.5 + 0.5 * in_view.x / (scale * half_x);
            let y = 0.5 - 0.5 * in_view.y / (scale * half_y);
            (depth > 0.0).then_some((DVec2::new(x, y), depth))
        };
        Selection::of(cloud.len(), |i| {
            let in_view = view_from_cloud.transform_point3(positions[i].as_dvec3());
            let Some((share, depth)) = share(in_view) else { return false };
            let at = share * size;
            if !(at.cmpge(low).all() && at.cmple(high).all() && self.shape.contains(at)) {
                return false;
            }
            let reach = f64::from(radii.get(i).copied().unwrap_or(0.0));
            self.depth.is_none_or(|picture| picture.shows(share, depth, reach))
        })
    }
}
