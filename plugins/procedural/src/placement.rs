//! The placement of a pattern in the boxes of clouds.

use surfelshop_api::glam::{DMat3, DQuat, DVec3, Vec3};
use surfelshop_api::{ObjectFrame, Uniform};

/// How a pattern lies in the boxes of clouds: turned and scaled about their middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Turn of the pattern, radians about x, then y, then z.
    pub(crate) turn: DVec3,
    /// How large the pattern is: 2 doubles the length of everything in it.
    pub(crate) scale: f64,
}

/// The transform from world space to a pattern: a cloud's anchor there, and a linear map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatternTransform {
    anchor: DVec3,
    /// Turns and scales world-oriented vectors.
    pub(crate) pattern_from_world: DMat3,
}

impl Placement {
    fn rotation(&self) -> DQuat {
        DQuat::from_rotation_z(self.turn.z)
            * DQuat::from_rotation_y(self.turn.y)
            * DQuat::from_rotation_x(self.turn.x)
    }

    /// Where a point of world space, and vectors from it, lie in the pattern of a cloud.
    pub(crate) fn transform(&self, object: &ObjectFrame, point: DVec3) -> PatternTransform {
        // The pattern is turned one way, so places are turned the other way.
        let turned = self.rotation().inverse();
        let scale = 1.0 / self.scale;
        let middle = DVec3::splat(0.5);
        let anchor = turned * ((object.box_from_world(point) - middle) * scale) + middle;
        let rotation = DMat3::from_quat(turned * object.rotation.inverse());
        PatternTransform { anchor, pattern_from_world: rotation * (scale / object.size) }
    }
}

impl PatternTransform {
    /// The anchor in three parts of 12 bits each, which add up to 36 bits of it; what is not finite
    /// counts as 0.
    pub(crate) fn parts(&self) -> [Vec3; 3] {
        let mut left = self.anchor;
        [(); 3].map(|()| {
            let part = left.as_vec3().to_array().map(twelve_bits);
            left -= Vec3::from(part).as_dvec3();
            Vec3::from(part)
        })
    }

    /// The bytes of the shader's `Object`, whose albedo counts by a factor.
    pub(crate) fn bytes(&self, whiten: f32) -> Vec<u8> {
        let [a, b, c] = self.parts();
        let m = self.pattern_from_world.as_mat3();
        let uniform = Uniform::new().vec3(a).vec3(b).vec3(c);
        // A matrix ends with the padding of its last column.
        uniform.vec3(m.x_axis).vec3(m.y_axis).vec4(m.z_axis.extend(0.0)).f32(whiten).into_bytes()
    }
}

/// A number's 12 leading bits.
fn twelve_bits(number: f32) -> f32 {
    if number.is_finite() { f32::from_bits(number.to_bits() & 0xffff_f000) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACEMENT: Placement = Placement { turn: DVec3::new(0.3, -0.2, 1.0), scale: 0.7 };

    #[test]
    fn anchors_keep_36_bits_in_parts_of_12() {
        let object =
            ObjectFrame { center: DVec3::new(5e6, -4e6, 3e6), size: 2.5, ..Default::default() };
        let transform = PLACEMENT.transform(&object, object.center + DVec3::new(0.3, 1.1, -17.0));
        let sum: DVec3 = transform.parts().iter().map(|part| part.as_dvec3()).sum();
        let error = (sum - transform.anchor).abs() / transform.anchor.abs();
        assert!(error.max_element() < 2f64.powi(-35), "{error}");
        for part in transform.parts().iter().flat_map(|part| part.to_array()) {
            assert_eq!(part.to_bits() & 0xfff, 0);
        }
    }

    #[test]
    fn the_middle_stays_and_vectors_lead_from_point_to_point() {
        let object =
            ObjectFrame { center: DVec3::X, size: 3.0, rotation: DQuat::from_rotation_y(1.0) };
        let (p, q) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.25));
        let [a, b] = [p, q].map(|point| PLACEMENT.transform(&object, point));
        assert!((a.anchor + a.pattern_from_world * (q - p) - b.anchor).length() < 1e-12);
        let middle = PLACEMENT.transform(&object, object.center).anchor;
        assert!((middle - DVec3::splat(0.5)).length() < 1e-12);
    }
}
