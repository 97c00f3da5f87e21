//! The surface buffer and the baseline's lighting computed in f64, pixel by pixel, for small
//! scenes: the same rules as the shaders, without a rasteriser.

use glam::{DMat4, DVec2, DVec3};
use surfelshop_api::{Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;

/// One pixel of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Distance along the viewing axis; 0 where nothing is.
    pub depth: f64,
    /// Blended unit normal, world-oriented.
    pub normal: DVec3,
    /// Blended linear albedo.
    pub albedo: DVec3,
    /// How near some surfel's edge or depth limit is to deciding otherwise here, as a fraction of
    /// the radius: pixels below a bound are left out of comparisons.
    pub margin: f64,
}

/// Settings of the twin's lighting, as the baseline's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    /// Factor on the diffuse term.
    pub diffuse: f64,
    /// Radiance of the highlight's peak.
    pub specular: f64,
    /// Exponent of the highlight.
    pub shininess: f64,
    /// Radiance of an unlit white surface.
    pub ambient: f64,
}

struct Splat {
    center: DVec3,
    axis_u: DVec3,
    axis_v: DVec3,
    normal: DVec3,
    albedo: DVec3,
    reach: f64,
    share: f64,
    back: bool,
}

/// The blended surface of a view. Costs pixels times surfels.
#[must_use]
pub fn surface(cloud: &Cloud, scene: &Scene, view: &View) -> Vec<Pixel> {
    let colors = cloud.linear_colors();
    let splats: Vec<Splat> = (0..cloud.len())
        .map(|i| {
            let color = colors.as_ref().map_or([0.5; 3], |colors| colors[i]);
            Splat::new(cloud, i, DVec3::from_array(color.map(f64::from)), scene, view)
        })
        .filter(|splat| scene.surface.two_sided || !splat.back)
        .collect();
    let [width, height] = view.size_px;
    let world_from_view = view.camera.view_from_world().transpose();
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let (start, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let hits: Vec<Hit<'_>> = splats
                .iter()
                .filter_map(|splat| splat.meet(start, direction))
                .filter(|hit| hit.depth >= view.near)
                .collect();
            let to_eye = world_from_view * -direction;
            pixels.push(blend(&hits, scene, view, to_eye));
        }
    }
    pixels
}

struct Hit<'a> {
    splat: &'a Splat,
    depth: f64,
    r2: f64,
}

fn blend(hits: &[Hit<'_>], scene: &Scene, view: &View, to_eye: DVec3) -> Pixel {
    let inside = |hit: &&Hit<'_>| hit.r2 <= 1.0;
    let Some(nearest) = hits.iter().filter(inside).min_by(|a, b| a.depth.total_cmp(&b.depth))
    else {
        let edge = hits.iter().map(|hit| hit.r2.sqrt() - 1.0).fold(1.0, f64::min);
        return Pixel { margin: edge, ..Pixel::default() };
    };
    let tolerance = f64::from(scene.surface.depth_tolerance);
    let (mut normal, mut albedo, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let mut margin = 1.0f64;
    for hit in hits {
        let splat = hit.splat;
        let slack = tolerance * splat.reach;
        let pulled = match view.camera.projection {
            Projection::Orthographic { .. } => hit.depth - slack,
            Projection::Perspective { .. } => {
                let distance = splat.center.length().max(slack);
                hit.depth / (distance / (distance - slack).max(0.5 * distance)).min(2.0)
            }
        };
        margin = margin.min((hit.r2.sqrt() - 1.0).abs());
        if hit.r2 > 1.0 {
            continue;
        }
        margin = margin.min((pulled - nearest.depth).abs() / splat.reach);
        if !std::ptr::eq(hit, nearest) {
            let sides_differ = splat.back != nearest.splat.back;
            let order = (hit.depth - nearest.depth).abs() / splat.reach;
            if sides_differ {
                margin = margin.min(order);
            }
        }
        if pulled > nearest.depth || splat.back != nearest.splat.back {
            continue;
        }
        let w = (-4.0 * hit.r2).exp() * splat.share;
        normal += splat.normal * w;
        albedo += splat.albedo * w;
        weight += w;
    }
    let normal = if normal.length() > 1e-4 * weight { normal.normalize_or_zero() } else { to_eye };
    Pixel { depth: nearest.depth, normal, albedo: albedo / weight, margin }
}

impl Splat {
    fn new(cloud: &Cloud, i: usize, albedo: DVec3, scene: &Scene, view: &View) -> Self {
        let view_from_offset: DMat4 = view.view_from_offset(cloud.origin());
        let center = view_from_offset.transform_point3(cloud.positions()[i].as_dvec3());
        let world_normal = cloud.normals()[i].as_dvec3();
        let n = view_from_offset.transform_vector3(world_normal);
        let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
        let towards = if orthographic { DVec3::Z } else { -center };
        let back = n.dot(towards) < 0.0;
        let reach = f64::from(cloud.radii()[i]) * f64::from(scene.surface.radius_scale);
        let (u, v) = n.any_orthonormal_pair();
        let splat = Self {
            center,
            axis_u: u * reach,
            axis_v: v * reach,
            normal: if back { -world_normal } else { world_normal },
            albedo,
            reach,
            share: 1.0,
            back,
        };
        splat.filtered(f64::from(scene.surface.low_pass), view, orthographic)
    }

    /// Widens the splat as `filtered` of the surfel shaders does, from the singular values of the
    /// projection's Jacobian.
    fn filtered(mut self, low_pass: f64, view: &View, orthographic: bool) -> Self {
        let distance = if orthographic { 1.0 } else { -self.center.z };
        if low_pass <= 0.0 || (!orthographic && distance <= self.reach) {
            return self;
        }
        let half = DVec2::from_array(view.half_extent());
        let size = DVec2::new(f64::from(view.size_px[0]), f64::from(view.size_px[1]));
        let px = 0.5 * size / (half * distance);
        let slope = if orthographic { DVec2::ZERO } else { self.center.truncate() / distance };
        let project = |axis: DVec3| px * (axis.truncate() + slope * axis.z);
        let (ju, jv) = (project(self.axis_u), project(self.axis_v));
        let (xx, xy, yy) =
            (ju.x * ju.x + jv.x * jv.x, ju.x * ju.y + jv.x * jv.y, ju.y * ju.y + jv.y * jv.y);
        let major = 0.5 * (xx + yy) + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        let area = (ju.x * jv.y - ju.y * jv.x).abs();
        let minor = area * area / major;
        // The angle of the major axis of a symmetric matrix.
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let direction = DVec2::from_angle(angle);
        let across = direction.perp();
        let widened = [major, minor].map(|l| (l + low_pass * low_pass).sqrt());
        let along = |d: DVec2| self.axis_u * ju.dot(d) + self.axis_v * jv.dot(d);
        let axis_u = if major >= 1.0 {
            along(direction) * (widened[0] / major)
        } else {
            (direction / px).extend(0.0) * widened[0]
        };
        let axis_v = if minor >= 4.0 {
            along(across) * (widened[1] / minor)
        } else {
            (across / px).extend(0.0) * widened[1]
        };
        (self.axis_u, self.axis_v) = (axis_u, axis_v);
        self.reach = axis_u.length().max(axis_v.length());
        self.share = (area / (widened[0] * widened[1])).max(0.01);
        self
    }

    /// Where a ray meets the splat's plane, if near enough to its edge to matter.
    fn meet(&self, start: DVec3, direction: DVec3) -> Option<Hit<'_>> {
        let plane = self.axis_u.cross(self.axis_v);
        let t = plane.dot(self.center - start) / plane.dot(direction);
        let offset = start + direction * t - self.center;
        let area = plane.length_squared();
        let u = offset.dot(self.axis_v.cross(plane)) / area;
        let v = offset.dot(plane.cross(self.axis_u)) / area;
        let r2 = u * u + v * v;
        let depth = -(start + direction * t).z;
        (t > 0.0 && r2 < 4.0).then_some(Hit { splat: self, depth, r2 })
    }
}

/// The baseline's radiance of a pixel, as `ewa-phong` computes it.
#[must_use]
pub fn shade(pixel: &Pixel, scene: &Scene, view: &View, position_px: [f64; 2], p: &Phong) -> DVec3 {
    let world_from_view = view.camera.view_from_world().transpose();
    let (_, direction) = view.ray(position_px[0], position_px[1]);
    let to_eye = world_from_view * -direction;
    let mut radiance = pixel.albedo * p.ambient;
    for light in &scene.lights {
        let Light::Directional { towards, radiance: light, follows_camera } = *light;
        let towards = if follows_camera { world_from_view * towards } else { towards };
        let towards = towards.normalize_or_zero();
        let cosine = pixel.normal.dot(towards).max(0.0);
        let half = (towards + to_eye).normalize_or_zero();
        let lit =
            if cosine > 0.0 { pixel.normal.dot(half).max(0.0).powf(p.shininess) } else { 0.0 };
        radiance +=
            light.as_dvec3() * (pixel.albedo * p.diffuse * cosine + DVec3::splat(p.specular * lit));
    }
    radiance
}
