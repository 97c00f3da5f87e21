use glam::{DMat3, DMat4, DVec3, Mat4, Vec4};
use serde::{Deserialize, Serialize};

/// How a camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Projection {
    /// Central projection; `fov_y` is the full vertical angle of view in radians, in (0, pi).
    Perspective {
        /// Full vertical angle of view, radians.
        fov_y: f64,
    },
    /// Parallel projection; `height` is the visible height in scene units, above 0.
    Orthographic {
        /// Visible height, scene units.
        height: f64,
    },
}

/// A camera in world space, right-handed; it looks from `eye` towards `target`.
///
/// View space has its origin at the eye, x to the right, y up and z backwards, so that what is
/// seen has negative z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Position in world space, scene units.
    pub eye: DVec3,
    /// A point on the viewing axis, in world space; its distance is what orbiting keeps.
    pub target: DVec3,
    /// The direction that appears upwards; need not be unit length or perpendicular.
    pub up: DVec3,
    /// Central or parallel projection.
    pub projection: Projection,
}

impl Camera {
    /// The viewing direction, unit length; -z where eye and target coincide or are not finite.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        (self.target - self.eye).try_normalize().unwrap_or(DVec3::NEG_Z)
    }

    /// The rotation that takes world directions to view directions: rows right, up, backward.
    ///
    /// Where `up` is parallel to the viewing direction, the world axis least aligned with it
    /// stands in.
    #[must_use]
    pub fn view_from_world(&self) -> DMat3 {
        let backward = -self.forward();
        let right = self.up.cross(backward).try_normalize().unwrap_or_else(|| {
            let substitute = if backward.y.abs() < 0.9 { DVec3::Y } else { DVec3::NEG_Z };
            substitute.cross(backward).normalize_or(DVec3::X)
        });
        let up = backward.cross(right);
        DMat3::from_cols(right, up, backward).transpose()
    }
}

/// What one picture shows of the world: camera, size and the depth range in use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Width and height in pixels, each at least 1.
    pub size_px: [u32; 2],
    /// Distance of the near plane along the viewing axis, scene units, above 0.
    pub near: f64,
    /// For parallel projection, the distance at which depth ends; ignored by central projection,
    /// which reaches to infinity.
    pub far: f64,
}

impl View {
    /// Width divided by height.
    #[must_use]
    pub fn aspect(&self) -> f64 {
        f64::from(self.size_px[0]) / f64::from(self.size_px[1].max(1))
    }

    /// The rigid motion from coordinates relative to `origin` (world space) to view space.
    ///
    /// The translation is the difference of two world positions taken in f64, so millimetres
    /// survive far from the world's origin.
    #[must_use]
    pub fn view_from_offset(&self, origin: DVec3) -> DMat4 {
        let rotation = self.camera.view_from_world();
        DMat4::from_mat3_translation(rotation, rotation * (origin - self.camera.eye))
    }

    /// Reverse-Z clip-from-view matrix: depth 1 at the near plane, 0 at infinity (perspective) or
    /// at `far` (orthographic).
    ///
    /// Depth of a point at distance d along the axis is `near / d` for central projection.
    #[must_use]
    pub fn clip_from_view(&self) -> Mat4 {
        match self.camera.projection {
            Projection::Perspective { fov_y } => {
                let y = 1.0 / (0.5 * fov_y).tan();
                let x = y / self.aspect();
                Mat4::from_cols(
                    Vec4::new(x as f32, 0.0, 0.0, 0.0),
                    Vec4::new(0.0, y as f32, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, 0.0, -1.0),
                    Vec4::new(0.0, 0.0, self.near as f32, 0.0),
                )
            }
            Projection::Orthographic { height } => {
                let y = 2.0 / height;
                let x = y / self.aspect();
                let range = (self.far - self.near).max(f64::MIN_POSITIVE);
                // depth(d) = (far - d) / (far - near) with d = -z.
                Mat4::from_cols(
                    Vec4::new(x as f32, 0.0, 0.0, 0.0),
                    Vec4::new(0.0, y as f32, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, (1.0 / range) as f32, 0.0),
                    Vec4::new(0.0, 0.0, (self.far / range) as f32, 1.0),
                )
            }
        }
    }

    /// Half the picture's width and height: as tangents for central projection, in scene units
    /// for parallel projection.
    #[must_use]
    pub fn half_extent(&self) -> [f64; 2] {
        let y = match self.camera.projection {
            Projection::Perspective { fov_y } => (0.5 * fov_y).tan(),
            Projection::Orthographic { height } => 0.5 * height,
        };
        [y * self.aspect(), y]
    }

    /// The ray through a position of the picture in pixels (pixel centres at .5, y downwards):
    /// start and unit direction in view space.
    #[must_use]
    pub fn ray(&self, x_px: f64, y_px: f64) -> (DVec3, DVec3) {
        let [half_x, half_y] = self.half_extent();
        let x = (2.0 * x_px / f64::from(self.size_px[0]) - 1.0) * half_x;
        let y = (1.0 - 2.0 * y_px / f64::from(self.size_px[1])) * half_y;
        match self.camera.projection {
            Projection::Perspective { .. } => {
                (DVec3::ZERO, DVec3::new(x, y, -1.0).normalize_or(DVec3::NEG_Z))
            }
            Projection::Orthographic { .. } => (DVec3::new(x, y, 0.0), DVec3::NEG_Z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(projection: Projection) -> View {
        let camera = Camera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection,
        };
        View { camera, size_px: [200, 100], near: 0.01, far: 10.0 }
    }

    #[test]
    fn rays_hit_the_pixels_their_points_project_to() {
        for projection in
            [Projection::Perspective { fov_y: 0.9 }, Projection::Orthographic { height: 3.0 }]
        {
            let view = view(projection);
            let (start, direction) = view.ray(37.5, 80.5);
            let point = (start + direction * 2.5).as_vec3();
            let clip = view.clip_from_view() * point.extend(1.0);
            let ndc = clip.truncate() / clip.w;
            let x_px = f64::from(ndc.x * 0.5 + 0.5) * 200.0;
            let y_px = f64::from(0.5 - ndc.y * 0.5) * 100.0;
            // Single-precision projection: a few units in the last place of 200 pixels.
            assert!((x_px - 37.5).abs() < 1e-3 && (y_px - 80.5).abs() < 1e-3, "{x_px} {y_px}");
            assert!(ndc.z > 0.0 && ndc.z < 1.0);
        }
    }

    #[test]
    fn looking_along_up_still_gives_a_rotation() {
        let mut view = view(Projection::Perspective { fov_y: 1.0 });
        view.camera.eye = DVec3::Y;
        let rotation = view.camera.view_from_world();
        assert!((rotation.determinant() - 1.0).abs() < 1e-12);
        assert!((rotation * DVec3::NEG_Y - DVec3::NEG_Z).length() < 1e-12);
    }

    #[test]
    fn far_origins_keep_millimetres() {
        let mut view = view(Projection::Perspective { fov_y: 1.0 });
        let far = DVec3::new(5e6, -4e6, 3e6);
        view.camera.eye += far;
        view.camera.target += far;
        let near_view = self::view(Projection::Perspective { fov_y: 1.0 });
        let moved = view.view_from_offset(far + DVec3::splat(1e-3));
        let still = near_view.view_from_offset(DVec3::splat(1e-3));
        // 5e6 has 2^-30 m spacing in f64.
        assert!((moved.w_axis - still.w_axis).length() < 4e-9);
    }
}
