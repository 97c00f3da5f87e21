//! The surface of all clouds that rays are intersected with.

use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::{CloudView, SurfaceSettings};
use surfelshop_geometry::discs::{Disc, Discs, Hit};
use surfelshop_geometry::silent;

/// All surfels of a scene around one origin.
pub(crate) struct Surface {
    /// What positions are relative to, world space.
    pub(crate) origin: DVec3,
    discs: Discs,
    surfels: Vec<Surfel>,
}

#[derive(Clone, Copy)]
struct Surfel {
    normal: Vec3,
    radius: f32,
    albedo: Vec3,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) position: Vec3,
    /// Unit, on the side the ray came from.
    pub(crate) normal: Vec3,
    pub(crate) albedo: Vec3,
}

/// Rays that leave the surface do not meet discs nearer than this many of these discs' radii: what
/// covers the point they start from lies in front of it by less, as the discs of a smooth surface
/// overlap.
const OWN: f32 = 2.0;

impl Surface {
    /// The surfels of clouds; ellipses count as discs of their radius.
    pub(crate) fn new(clouds: &[CloudView<'_>], settings: &SurfaceSettings) -> Self {
        let origin = clouds.first().map_or(DVec3::ZERO, |cloud| cloud.object.center);
        let (mut discs, mut surfels) = (Vec::new(), Vec::new());
        for cloud in clouds {
            let offset = cloud.origin - origin;
            let radii = cloud.floats(RADIUS, 1).unwrap_or_default();
            let places = cloud.vectors(POSITION).zip(cloud.vectors(NORMAL)).zip(radii);
            for (((position, normal), radius), albedo) in places.zip(cloud.albedos()) {
                let radius = radius * settings.radius_scale;
                let normal = normal.normalize_or(Vec3::Y);
                let centre = (position.as_dvec3() + offset).as_vec3();
                discs.push(Disc { centre, normal, radius });
                surfels.push(Surfel { normal, radius, albedo });
            }
        }
        // Nobody asks this hierarchy to stop.
        let discs = Discs::build(&discs, &silent).or_else(|_| Discs::build(&[], &silent));
        let discs = discs.unwrap_or_default();
        Self { origin, discs, surfels }
    }

    /// What a ray meets first, blended with what lies behind it within the depth tolerance, as the
    /// host's surface is, or alone.
    pub(crate) fn met(&self, ray: &Ray, settings: &SurfaceSettings, blend: bool) -> Option<Point> {
        let counts = |hit: Hit| {
            let own = if ray.leaves { OWN * self.surfels[hit.index as usize].radius } else { 0.0 };
            hit.distance > own && (hit.front || settings.two_sided)
        };
        let first =
            self.discs.nearest(ray.origin, ray.direction, ray.near..f32::INFINITY, counts)?;
        let surfel = self.surfels[first.index as usize];
        let (mut normal, mut albedo, mut weights) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        let mut add = |hit: Hit| {
            let surfel = self.surfels[hit.index as usize];
            let weight = (-4.0 * hit.share_squared).exp();
            normal += weight * if hit.front { surfel.normal } else { -surfel.normal };
            albedo += weight * surfel.albedo;
            weights += weight;
        };
        if blend {
            let reach = settings.depth_tolerance * self.largest(surfel.radius);
            let end = first.distance + reach;
            self.discs.each(ray.origin, ray.direction, ray.near..end.next_up(), |hit| {
                let own = settings.depth_tolerance * self.surfels[hit.index as usize].radius;
                let near = hit.distance <= first.distance + own;
                if near && hit.front == first.front && hit.distance >= first.distance {
                    add(hit);
                }
            });
        } else {
            add(first);
        }
        let facing = if first.front { surfel.normal } else { -surfel.normal };
        Some(Point {
            position: ray.origin + first.distance * ray.direction,
            normal: normal.normalize_or(facing),
            albedo: albedo / weights.max(1e-12),
        })
    }

    /// A radius that no disc near one of this radius exceeds by much.
    fn largest(&self, radius: f32) -> f32 {
        4.0 * radius
    }

    /// Whether something nearer than `end` lies in the way of a ray.
    pub(crate) fn blocks(&self, ray: &Ray, end: f32, settings: &SurfaceSettings) -> bool {
        self.discs.is_hit(ray.origin, ray.direction, ray.near..end, |meeting| {
            let own = if ray.leaves { OWN * meeting.radius } else { 0.0 };
            meeting.distance > own && (meeting.front || settings.two_sided)
        })
    }
}

/// A ray of unit direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// From the surface's origin.
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// Where it begins to count.
    pub(crate) near: f32,
    /// Whether it leaves the surface, whose discs are then not met.
    pub(crate) leaves: bool,
}

impl Point {
    /// A ray from here.
    pub(crate) fn towards(&self, direction: Vec3) -> Ray {
        Ray { origin: self.position, direction, near: 0.0, leaves: true }
    }
}
