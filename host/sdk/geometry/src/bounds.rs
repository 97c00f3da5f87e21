//! Bounding boxes in f64.

use glam::{DVec3, Vec3};

/// An axis-aligned box that holds at least one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner, the unit of the positions.
    pub min: DVec3,
    /// Upper corner, the unit of the positions.
    pub max: DVec3,
}

impl Bounds {
    /// The box of the points that are finite; `None` where there is none.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().filter(|point| point.is_finite()).fold(None, |bounds, point| {
            Some(bounds.map_or(Self { min: point, max: point }, |b: Self| Self {
                min: b.min.min(point),
                max: b.max.max(point),
            }))
        })
    }

    /// The box of the positions that are finite; `None` where there is none.
    #[must_use]
    pub fn of_positions(positions: &[Vec3]) -> Option<Self> {
        Self::of(positions.iter().map(|position| position.as_dvec3()))
    }

    /// The middle of the box; it does not overflow.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Lengths of the edges.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the longest edge; 0 for a single point.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.size().max_element()
    }

    /// Length of the diagonal; 0 for a single point. The longest edge is factored out, so that
    /// the squares neither overflow nor underflow.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let extent = self.extent();
        if extent > 0.0 { extent * (self.size() / extent).length() } else { 0.0 }
    }

    /// The largest absolute coordinate.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_points_have_no_bounds() {
        assert_eq!(Bounds::of_positions(&[]), None);
        assert_eq!(Bounds::of_positions(&[Vec3::NAN, Vec3::INFINITY]), None);
    }

    #[test]
    fn bounds_leave_out_positions_that_are_not_finite() {
        let positions = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(f32::NAN, 9.0, 9.0), Vec3::ZERO];
        let bounds = Bounds::of_positions(&positions).unwrap();
        assert_eq!(bounds.min, DVec3::ZERO);
        assert_eq!(bounds.max, DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn the_diagonal_of_a_huge_or_tiny_box_is_exact() {
        for scale in [1e-200, 1.0, 1e200] {
            let corners = [DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0) * scale];
            let bounds = Bounds::of(corners).unwrap();
            // Four roundings: a relative error of at most 4 * 2^-53.
            assert!((bounds.diagonal() / (5.0 * scale) - 1.0).abs() < 5e-16);
        }
    }
}
