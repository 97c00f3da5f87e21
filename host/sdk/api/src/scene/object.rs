use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Where a cloud's own box lies in the world: what textures are fastened to, so that they stay on
/// the cloud where the scene moves, turns or scales it.
///
/// Box coordinates are 0 to 1 along the largest extent of the cloud as it was loaded, and run
/// around 0.5 along the others, so that nothing is stretched.
///
/// Source: Liu 2006, section 5.1 (texture coordinates), with erratum T26: divided by the largest
/// extent, not axis by axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectFrame {
    /// The middle of the box, world space.
    pub center: DVec3,
    /// The largest extent of the box, scene units, above 0. That of a single point is the diameter
    /// of its disc.
    pub size: f64,
    /// How the box is turned in the world; unit length.
    pub rotation: DQuat,
}

impl Default for ObjectFrame {
    /// The unit cube around the world's origin.
    fn default() -> Self {
        Self { center: DVec3::ZERO, size: 1.0, rotation: DQuat::IDENTITY }
    }
}

impl ObjectFrame {
    /// The box around points in world space, not turned; `otherwise` is its size where it has none
    /// or one that is not a number, and 1 where that is none either.
    #[must_use]
    pub fn around(min: DVec3, max: DVec3, otherwise: f64) -> Self {
        let positive = |size: f64| (size > 0.0 && size.is_finite()).then_some(size);
        let size = positive((max - min).max_element()).or(positive(otherwise)).unwrap_or(1.0);
        let center = 0.5 * min + 0.5 * max;
        let center = if center.is_finite() { center } else { DVec3::ZERO };
        Self { center, size, rotation: DQuat::IDENTITY }
    }

    /// A point of world space in box coordinates.
    #[must_use]
    pub fn box_from_world(&self, point: DVec3) -> DVec3 {
        self.rotation.inverse() * ((point - self.center) / self.size) + DVec3::splat(0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_measured_by_their_largest_extent() {
        let far = DVec3::new(5e6, -4e6, 3e6);
        let frame = ObjectFrame::around(far, far + DVec3::new(4.0, 2.0, 0.0), 0.0);
        assert_eq!(frame.box_from_world(far), DVec3::new(0.0, 0.25, 0.5));
        assert_eq!(frame.box_from_world(far + DVec3::new(4.0, 2.0, 0.0)).x, 1.0);
    }

    #[test]
    fn points_and_nothing_have_a_box_too() {
        assert_eq!(ObjectFrame::around(DVec3::ONE, DVec3::ONE, 0.25).size, 0.25);
        assert_eq!(ObjectFrame::around(DVec3::ONE, DVec3::ONE, 0.0).size, 1.0);
        let nowhere = ObjectFrame::around(DVec3::NAN, DVec3::NAN, f64::NAN);
        assert_eq!(nowhere, ObjectFrame::default());
    }
}
