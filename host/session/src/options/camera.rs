//! Where the camera stands: presets that frame the whole cloud, or a place typed in numbers.

use crate::options::LensArguments;
use crate::options::values::{self, field_of_view};
use glam::{DVec3, Vec3};
use surfelshop_api::{Camera, Projection, View};

/// Vertical field of view where none is given, degrees.
const DEFAULT_FOV_DEG: f64 = surfelshop_cloud::scene::DEFAULT_FIELD_OF_VIEW_DEG;

/// What is framed is this much larger than the cloud, so that nothing touches the border.
const MARGIN: f64 = 1.04;

/// Distance of the near plane as a share of the scene's extent, or of the distance to the target
/// where that is less: a stray point far away must not push the plane beyond what is looked at.
///
/// Depth is `near / distance` in f32, whose relative precision is the same for every distance, so a
/// tiny near plane costs no precision and lets the camera go between surfels.
const NEAR_SHARE: f64 = 1e-6;

/// A camera as typed; directions of presets are those of a cloud whose y axis points upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraSpec {
    /// Looks along a direction and frames the cloud.
    Preset {
        /// From the cloud to the camera, not unit length.
        towards_camera: DVec3,
        /// What appears upwards.
        up: DVec3,
    },
    /// Stands where a scan was taken, or in its largest free space, and looks about at eye height; see
    /// [`input::inside`](crate::input::inside).
    Inside,
    /// Stands where the user says.
    Placed {
        /// Position, world space.
        eye: DVec3,
        /// What is in the middle of the picture, world space.
        target: DVec3,
        /// What appears upwards, where given.
        up: Option<DVec3>,
        /// Vertical field of view in degrees, where given.
        fov_deg: Option<f64>,
    },
}

impl CameraSpec {
    /// Reads a preset's name, or `px,py,pz; tx,ty,tz[; ux,uy,uz[; DEGREES]]`.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(preset) = preset(text.trim()) {
            return Ok(preset);
        }
        if !text.contains(';') {
            let expected = "expected front, back, left, right, top, bottom, three-quarter, inside, or \
                            \"px,py,pz; tx,ty,tz[; ux,uy,uz[; DEGREES]]\"";
            return Err(expected.to_owned());
        }
        let parts: Vec<&str> = text.split(';').collect();
        let vector = |what: &str, part: &str| {
            values::vector(part).unwrap_or_else(|| {
                let found = part.trim();
                Err(format!("expected the {what} as three numbers x,y,z, found `{found}`"))
            })
        };
        if parts.len() > 4 {
            let n_parts = parts.len();
            return Err(format!("expected position; target; up; degrees, found {n_parts} parts"));
        }
        let eye = vector("position", parts[0])?;
        let target = vector("target", parts[1])?;
        let up = parts.get(2).map(|part| vector("up direction", part)).transpose()?;
        let fov_deg = parts.get(3).map(|part| field_of_view(part)).transpose()?;
        if (target - eye).try_normalize().is_none() {
            return Err("expected a target apart from the position, found both equal".to_owned());
        }
        if up.is_some_and(|up| up.try_normalize().is_none()) {
            return Err("expected a direction for up, found 0,0,0".to_owned());
        }
        Ok(Self::Placed { eye, target, up, fov_deg })
    }

    /// The preset that most pictures of the demonstration use.
    pub fn three_quarter() -> Self {
        // 30 degrees to the right of the front and 20 degrees above it.
        Self::Preset { towards_camera: DVec3::new(0.47, 0.342, 0.814), up: DVec3::Y }
    }

    /// The preset from +z.
    pub fn front() -> Self {
        Self::Preset { towards_camera: DVec3::Z, up: DVec3::Y }
    }
}

fn preset(name: &str) -> Option<CameraSpec> {
    let (towards_camera, up) = match name {
        "inside" => return Some(CameraSpec::Inside),
        "three-quarter" => return Some(CameraSpec::three_quarter()),
        "front" => return Some(CameraSpec::front()),
        "back" => (DVec3::NEG_Z, DVec3::Y),
        "left" => (DVec3::NEG_X, DVec3::Y),
        "right" => (DVec3::X, DVec3::Y),
        // Seen from above, the front of the object lies at the bottom of the picture.
        "top" => (DVec3::Y, DVec3::NEG_Z),
        "bottom" => (DVec3::NEG_Y, DVec3::Z),
        _ => return None,
    };
    Some(CameraSpec::Preset { towards_camera, up })
}

/// A sphere around everything that is drawn, surfels' edges included, and about the convex hull of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    center: DVec3,
    radius: f64,
    /// What is farthest in each of [`directions`], from the centre.
    farthest: [Vec3; N_DIRECTIONS],
}

/// Directions in which the farthest of what is drawn is known: less than 10 degrees from any other direction, so that
/// the hull is right within 1.5 %, which the margin has room for.
pub const N_DIRECTIONS: usize = 128;

/// Directions that lie evenly on the sphere, unit length.
#[must_use]
pub fn directions() -> [Vec3; N_DIRECTIONS] {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    std::array::from_fn(|i| {
        let z = 1.0 - (2 * i + 1) as f32 / N_DIRECTIONS as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        Vec3::new(ring * cos, ring * sin, z)
    })
}

impl Extent {
    #[cfg(test)]
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// A sphere a camera can be placed by: without a size, or without a cloud, it gets one.
    pub fn new(center: DVec3, radius: f64) -> Self {
        let center = if center.is_finite() { center } else { DVec3::ZERO };
        // Below a share of 1e-9 of the coordinates, the position of the camera could not be told
        // from its target to more than a few digits in f64. Below 1e-30, f32 runs out.
        let least = (center.abs().max_element() * 1e-9).max(1e-30);
        let radius = if radius.is_finite() && radius > 0.0 { radius.max(least) } else { 1.0 };
        Self { center, radius, farthest: directions().map(|towards| towards * radius as f32) }
    }

    /// The same of which this is what is farthest in each of [`directions`], from the centre.
    #[must_use]
    pub fn reaching(self, farthest: [Vec3; N_DIRECTIONS]) -> Self {
        match farthest.iter().all(|place| place.is_finite()) {
            true => Self { farthest, ..self },
            false => self,
        }
    }

    /// How far from the centre a camera stands whose picture it fills as it is seen from a direction, and half the
    /// height of a parallel one that it does. Of sphere and hull the one counts that needs less room.
    fn framed(&self, towards: DVec3, up: DVec3, tangents: [f64; 2]) -> [f64; 2] {
        let right = up.cross(towards).normalize_or(DVec3::X);
        let up = towards.cross(right);
        let [across, above] = tangents.map(|tangent| tangent / MARGIN);
        // Not so near that the sphere of something flat is all around.
        let (mut distance, mut half_height) = (1.05 * self.radius, 1e-3 * self.radius);
        for place in self.farthest.map(|place| place.as_dvec3()) {
            let (x, y) = (place.dot(right).abs(), place.dot(up).abs());
            distance = distance.max(place.dot(towards) + (x / across).max(y / above));
            half_height = half_height.max((x * tangents[1] / across).max(y * MARGIN));
        }
        let smaller = tangents[0].min(tangents[1]);
        let framed = self.radius * MARGIN;
        // The sphere touches the cone of the smaller side at the sine of its half angle.
        let of_sphere = [framed / smaller.atan().sin(), framed * tangents[1] / smaller];
        [distance.min(of_sphere[0]), half_height.min(of_sphere[1])]
    }
}

/// The view that these options ask for.
pub fn view(lens: &LensArguments, extent: &Extent, size_px: [u32; 2]) -> View {
    let typed_fov = match lens.camera {
        CameraSpec::Placed { fov_deg, .. } => lens.fov.or(fov_deg),
        CameraSpec::Preset { .. } | CameraSpec::Inside => lens.fov,
    };
    let half_tangent = (0.5 * typed_fov.unwrap_or(DEFAULT_FOV_DEG).to_radians()).tan();
    let aspect = f64::from(size_px[0]) / f64::from(size_px[1].max(1));
    // Without clouds there is no inside.
    let camera = match lens.camera {
        CameraSpec::Inside => CameraSpec::three_quarter(),
        camera => camera,
    };
    let (eye, target, up, half_height) = match camera {
        CameraSpec::Inside => (DVec3::Z, DVec3::ZERO, DVec3::Y, 1.0),
        CameraSpec::Preset { towards_camera, up } => {
            let towards = lens.up.axis().from_y_up(towards_camera).normalize_or(DVec3::Z);
            let up = lens.up.axis().from_y_up(up);
            let tangents = [half_tangent * aspect, half_tangent];
            let [distance, half_height] = extent.framed(towards, up, tangents);
            let eye = extent.center + towards * distance;
            (eye, extent.center, up, half_height)
        }
        CameraSpec::Placed { eye, target, up, .. } => {
            let up = up.unwrap_or_else(|| lens.up.axis().direction());
            (eye, target, up, eye.distance(target) * half_tangent)
        }
    };
    let halves = Halves { tangent: half_tangent, height: half_height };
    let projection = projection(&halves, lens.orthographic, lens.zoom);
    framed_view(Camera { eye, target, up, projection }, extent, size_px)
}

/// The view through a scene's camera, with what was typed about the lens: its field of view, its
/// zoom, and whether the projection is parallel.
pub fn through(
    camera: &Camera,
    lens: &LensArguments,
    parallel: Option<bool>,
    extent: &Extent,
    size_px: [u32; 2],
) -> View {
    let distance = camera.eye.distance(camera.target);
    let typed = lens.fov.map(|degrees| degrees.to_radians());
    let halves = match (typed, camera.projection) {
        (Some(fov_y), _) | (None, Projection::Perspective { fov_y }) => {
            let tangent = (0.5 * fov_y).tan();
            Halves { tangent, height: distance * tangent }
        }
        (None, Projection::Orthographic { height }) => {
            Halves { tangent: 0.5 * height / distance, height: 0.5 * height }
        }
    };
    let is_parallel = matches!(camera.projection, Projection::Orthographic { .. });
    let projection = projection(&halves, parallel.unwrap_or(is_parallel), lens.zoom);
    framed_view(Camera { projection, ..*camera }, extent, size_px)
}

/// What a camera sees above the middle of the picture.
struct Halves {
    /// Tangent of the angle.
    tangent: f64,
    /// Height at the target, scene units.
    height: f64,
}

fn projection(halves: &Halves, is_parallel: bool, zoom: f64) -> Projection {
    if is_parallel {
        Projection::Orthographic { height: 2.0 * halves.height / zoom }
    } else {
        Projection::Perspective { fov_y: 2.0 * (halves.tangent / zoom).atan() }
    }
}

/// What a camera sees of a scene that reaches so far.
pub fn framed_view(camera: Camera, extent: &Extent, size_px: [u32; 2]) -> View {
    let [near, far] = depth_range(&camera, extent);
    View { camera, size_px, near, far }
}

/// Distances of the near and far plane that hold the whole extent.
fn depth_range(camera: &Camera, extent: &Extent) -> [f64; 2] {
    let reach = extent.radius * MARGIN;
    let middle = (extent.center - camera.eye).dot(camera.forward());
    let least = (extent.radius.min(camera.eye.distance(camera.target)) * NEAR_SHARE).max(1e-36);
    let near = match camera.projection {
        Projection::Perspective { .. } => least,
        // Depth of a parallel projection is linear: a tight range keeps its precision.
        Projection::Orthographic { .. } => (middle - reach).max(least),
    };
    // With everything behind the camera there is nothing to see, and the range is only valid.
    [near, (middle + reach).max(near + reach)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::UpAxis;

    fn lens(camera: &str) -> LensArguments {
        let camera = CameraSpec::parse(camera).unwrap();
        LensArguments { camera, up: UpAxis::Y, fov: None, orthographic: false, zoom: 1.0 }
    }

    const PRESETS: [&str; 7] = ["front", "back", "left", "right", "top", "bottom", "three-quarter"];

    /// The largest coordinate, in [-1, 1] inside the picture, of points on the sphere.
    fn reach_in_picture(view: &View, extent: &Extent) -> [f32; 2] {
        let clip_from_view = view.clip_from_view();
        let view_from_offset = view.view_from_offset(extent.center);
        let mut reach = [0.0f32; 2];
        for i in 0..2000 {
            // A spiral over the sphere.
            let z = 1.0 - (f64::from(i) + 0.5) / 1000.0;
            let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
            let ring = (1.0 - z * z).sqrt();
            let point = DVec3::new(ring * cos, ring * sin, z) * extent.radius;
            let clip =
                clip_from_view * view_from_offset.transform_point3(point).as_vec3().extend(1.0);
            assert!(clip.w > 0.0 && clip.z > 0.0 && clip.z <= clip.w, "{clip}");
            reach[0] = reach[0].max((clip.x / clip.w).abs());
            reach[1] = reach[1].max((clip.y / clip.w).abs());
        }
        reach
    }

    #[test]
    fn presets_frame_the_sphere_in_the_smaller_side() {
        for (size, orthographic) in [
            ([200, 100], false),
            ([100, 200], false),
            ([80, 80], false),
            ([300, 90], true),
            ([90, 300], true),
        ] {
            for preset in PRESETS {
                let extent = Extent::new(DVec3::new(3.0, -2.0, 9.0), 4.0);
                let lens = LensArguments { orthographic, ..lens(preset) };
                let [x, y] = reach_in_picture(&view(&lens, &extent, size), &extent);
                let largest = x.max(y);
                assert!(largest < 1.0 && largest > 0.9, "{preset} {size:?}: {x} {y}");
            }
        }
    }

    #[test]
    fn presets_frame_what_is_there_where_it_takes_less_room_than_the_sphere() {
        // A bar that stands askew.
        let (a, b) = (DVec3::new(4.0, 1.0, 0.5), DVec3::new(-0.2, 0.3, 0.4));
        let corners = [a + b, a - b, b - a, -a - b];
        let farthest = directions().map(|towards| {
            let along = |corner: &DVec3| corner.dot(towards.as_dvec3());
            let farthest = corners.iter().max_by(|a, b| along(a).total_cmp(&along(b)));
            farthest.unwrap().as_vec3()
        });
        let center = DVec3::new(3.0, -2.0, 9.0);
        let extent = Extent::new(center, (a + b).length()).reaching(farthest);
        for (size, orthographic) in
            [([200, 100], false), ([100, 200], false), ([80, 80], true), ([300, 90], true)]
        {
            for preset in PRESETS {
                let lens = LensArguments { orthographic, ..lens(preset) };
                let view = view(&lens, &extent, size);
                let (clip, offset) = (view.clip_from_view(), view.view_from_offset(center));
                let reach = |corner: &DVec3| {
                    let at = clip * offset.transform_point3(*corner).as_vec3().extend(1.0);
                    (at.x / at.w).abs().max((at.y / at.w).abs())
                };
                let reach = corners.iter().map(reach).fold(0.0, f32::max);
                // The margin of 1.04, of which the sphere's perspective leaves less; from the end of the bar it is the
                // distance to the bar that counts.
                let is_end_on = ["left", "right"].contains(&preset) && !orthographic;
                let least = if is_end_on { 0.2 } else { 0.95 };
                assert!(reach < 1.0 && reach > least, "{preset} {size:?}: {reach}");
            }
        }
        // A ball takes what its sphere does.
        let ball = Extent::new(DVec3::ZERO, 1.0);
        assert_eq!(ball, ball.reaching(directions()));
    }

    #[test]
    fn clouds_without_extent_have_a_valid_view() {
        let far = DVec3::splat(1e9);
        for extent in [
            Extent::new(DVec3::ZERO, 0.0),
            Extent::new(DVec3::ZERO, f64::NAN),
            Extent::new(DVec3::NAN, f64::INFINITY),
            Extent::new(far, 1e-30),
            Extent::new(DVec3::ZERO, 1e-40),
        ] {
            for preset in PRESETS {
                let view = view(&lens(preset), &extent, [64, 64]);
                let camera = view.camera;
                assert!(camera.eye.is_finite() && camera.eye != camera.target, "{extent:?}");
                assert!(camera.forward().is_finite());
                assert!(view.near as f32 > 0.0 && view.far > view.near, "{view:?}");
                assert!(view.clip_from_view().is_finite());
            }
        }
    }

    #[test]
    fn zoom_enlarges_by_its_factor_from_the_same_place() {
        let extent = Extent::new(DVec3::ZERO, 1.0);
        for orthographic in [false, true] {
            let wide = LensArguments { orthographic, ..lens("front") };
            let close = LensArguments { zoom: 2.0, ..wide.clone() };
            let (wide, close) = (view(&wide, &extent, [64, 64]), view(&close, &extent, [64, 64]));
            assert_eq!(wide.camera.eye, close.camera.eye);
            assert!((wide.half_extent()[1] / close.half_extent()[1] - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn placed_cameras_stand_where_they_are_told() {
        let lens = lens("1,2,3; 1,2,0; 1,0,0; 90");
        let view = view(&lens, &Extent::new(DVec3::ZERO, 1.0), [64, 64]);
        assert_eq!(view.camera.eye, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(view.camera.up, DVec3::X);
        assert!((view.half_extent()[1] - 1.0).abs() < 1e-12);
        let parallel = LensArguments { orthographic: true, ..lens };
        let view = super::view(&parallel, &Extent::new(DVec3::ZERO, 1.0), [64, 64]);
        // What is at the target keeps its size: 3 units away, a half angle of 45 degrees.
        assert!((view.half_extent()[1] - 3.0).abs() < 1e-12);
    }

    #[test]
    fn cameras_of_scenes_see_what_typed_ones_see() {
        let extent = Extent::new(DVec3::ZERO, 1.0);
        let typed = lens("1,2,3; 1,2,0; 1,0,0; 24");
        for zoom in [1.0, 2.5] {
            for orthographic in [false, true] {
                let typed = LensArguments { zoom, orthographic, ..typed.clone() };
                let expected = view(&typed, &extent, [64, 48]);
                let projection = Projection::Perspective { fov_y: 24f64.to_radians() };
                let camera = Camera { projection, ..expected.camera };
                let lens = LensArguments { zoom, ..lens("front") };
                let found = through(&camera, &lens, Some(orthographic), &extent, [64, 48]);
                assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn what_is_typed_about_the_lens_changes_a_scene_s_camera() {
        let extent = Extent::new(DVec3::ZERO, 1.0);
        let projection = Projection::Orthographic { height: 3.0 };
        let camera = Camera { eye: DVec3::Z * 2.0, target: DVec3::ZERO, up: DVec3::Y, projection };
        let seen = |lens: &LensArguments, parallel| {
            through(&camera, lens, parallel, &extent, [64, 64]).camera.projection
        };
        let plain = lens("front");
        assert_eq!(seen(&plain, None), projection);
        let zoomed = LensArguments { zoom: 2.0, ..plain.clone() };
        assert_eq!(seen(&zoomed, None), Projection::Orthographic { height: 1.5 });
        // 2 units away, a half angle of 45 degrees.
        let wide = LensArguments { fov: Some(90.0), ..plain.clone() };
        let Projection::Orthographic { height } = seen(&wide, None) else { panic!("central") };
        assert!((height - 4.0).abs() < 1e-12);
        let Projection::Perspective { fov_y } = seen(&plain, Some(false)) else {
            panic!("parallel")
        };
        assert!(((0.5 * fov_y).tan() - 0.75).abs() < 1e-12, "the target keeps its size");
    }

    #[test]
    fn clouds_with_z_upwards_are_seen_from_minus_y() {
        let extent = Extent::new(DVec3::ZERO, 1.0);
        let view = view(&LensArguments { up: UpAxis::Z, ..lens("front") }, &extent, [64, 64]);
        assert!((view.camera.forward() - DVec3::Y).length() < 1e-12);
        assert_eq!(view.camera.up, DVec3::Z);
    }

    #[test]
    fn stray_points_do_not_push_the_near_plane_beyond_the_target() {
        let extent = Extent::new(DVec3::ZERO, 1e9);
        let view = view(&lens("0,0,0.1; 0,0,0"), &extent, [64, 64]);
        assert!(view.near < 1e-3 && view.far > 1e9, "{view:?}");
    }

    #[test]
    fn mistakes_in_a_camera_are_named() {
        for (text, expected) in [
            ("fornt", "three-quarter"),
            ("1,2;0,0,0", "position as three numbers x,y,z, found `1,2`"),
            ("1,2,3; 0,x,0", "target as three numbers"),
            ("1,2,3; 1,2,3", "found both equal"),
            ("1,2,3; 0,0,0; 0,0,0", "found 0,0,0"),
            ("1,2,3; 0,0,0; 0,1,0; 200", "degrees"),
            ("1,2,3; 0,0,0; 0,1,0; 20; 5", "found 5 parts"),
        ] {
            let error = CameraSpec::parse(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
