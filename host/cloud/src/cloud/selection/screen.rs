//! Surfels by where they are seen in a picture.

use super::depth::DepthPicture;
use super::placement::Placement;
use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::transform::Transform;
use glam::{DMat4, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use surfelshop_api::{Projection, View};

/// A part of a picture; positions in pixels from its upper left corner, y downwards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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

/// What is seen in a part of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScreenRegion {
    /// What the picture shows of the world.
    pub view: View,
    /// The part.
    pub shape: ScreenShape,
    /// Where this is there only surfels that are visible are selected, and else all that lie behind each other.
    pub depth: Option<DepthPicture>,
}

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

    /// The box around it; of no places, ends that are the wrong way round.
    pub(super) fn bounds(&self) -> [DVec2; 2] {
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

/// Where places in view space come to lie in a picture.
struct Projected {
    half: DVec2,
    size: DVec2,
    central: bool,
}

impl Projected {
    fn new(view: &View) -> Self {
        let central = matches!(view.camera.projection, Projection::Perspective { .. });
        let half = DVec2::from_array(view.half_extent());
        Self { half, size: DVec2::from(view.size_px.map(f64::from)), central }
    }

    /// In shares of the picture's size, and how far away; nothing behind the camera.
    fn share(&self, in_view: DVec3) -> Option<(DVec2, f64)> {
        let depth = -in_view.z;
        let scale = if self.central { depth } else { 1.0 };
        let x = 0.5 + 0.5 * in_view.x / (scale * self.half.x);
        let y = 0.5 - 0.5 * in_view.y / (scale * self.half.y);
        (depth > 0.0).then_some((DVec2::new(x, y), depth))
    }

    /// Scene units of a pixel this far away.
    fn pixel(&self, depth: f64) -> f64 {
        let scale = if self.central { depth } else { 1.0 };
        2.0 * scale * self.half.y / self.size.y.max(1.0)
    }

    /// Whether a ball may be seen between two corners, pixels.
    fn may_show(&self, in_view: DVec3, radius: f64, [low, high]: [DVec2; 2]) -> bool {
        let depth = -in_view.z;
        // How far right and up the sides lie, of a distance of 1 or anywhere.
        let right = |at: f64| (2.0 * at / self.size.x - 1.0) * self.half.x;
        let up = |at: f64| (1.0 - 2.0 * at / self.size.y) * self.half.y;
        let sides = [
            (in_view.x, right(high.x)),
            (-in_view.x, -right(low.x)),
            (in_view.y, up(low.y)),
            (-in_view.y, -up(high.y)),
        ];
        sides.into_iter().all(|(across, side)| match self.central {
            true => (across - side * depth) / (1.0 + side * side).sqrt() <= radius,
            false => across - side <= radius,
        })
    }
}

impl ScreenRegion {
    /// The surfels whose centres are seen in the part of the picture.
    ///
    /// # Errors
    /// Where there is no memory.
    pub fn select(&self, cloud: &Cloud) -> Result<Selection, SelectionError> {
        self.select_placed(cloud, &Transform::default())
    }

    /// The same of a cloud that `placed` puts into the world.
    ///
    /// # Errors
    /// Where there is no memory.
    pub fn select_placed(
        &self,
        cloud: &Cloud,
        placed: &Transform,
    ) -> Result<Selection, SelectionError> {
        let placement = Placement::new(placed, cloud.origin());
        let view_from_cloud =
            self.view.view_from_offset(placement.origin()) * DMat4::from_mat3(placement.linear());
        let picture = Projected::new(&self.view);
        let (positions, radii) = (cloud.positions(), cloud.radii());
        let [low, high] = self.shape.bounds();
        Selection::of(cloud.len(), |i| {
            let in_view = view_from_cloud.transform_point3(positions[i].as_dvec3());
            let Some((share, depth)) = picture.share(in_view) else { return false };
            let at = share * picture.size;
            if !(at.cmpge(low).all() && at.cmple(high).all() && self.shape.contains(at)) {
                return false;
            }
            let reach = placement.scale * f64::from(radii.get(i).copied().unwrap_or(0.0));
            self.depth.as_ref().is_none_or(|seen| {
                let merged = f64::from(seen.merged_px) * picture.pixel(depth);
                seen.shows(share, depth, reach + merged)
            })
        })
    }

    /// Whether something of a ball in the world may be selected.
    pub(super) fn may_reach(&self, middle: DVec3, radius: f64) -> bool {
        let in_view = self.view.view_from_offset(DVec3::ZERO).transform_point3(middle);
        if -in_view.z + radius <= 0.0 {
            return false;
        }
        let picture = Projected::new(&self.view);
        let is_in_front = self.depth.as_ref().is_none_or(|seen| {
            let nearest = -in_view.z - radius;
            let merged = f64::from(seen.merged_px) * picture.pixel(nearest.max(0.0));
            nearest <= 0.0 || seen.may_show(nearest, radius + merged)
        });
        is_in_front && picture.may_show(in_view, radius, self.shape.bounds())
    }
}
