//! Path tracing, with multiple importance sampling of the environment map.

use crate::environment_map::EnvironmentMap;
use crate::material::Material;
use crate::random::Random;
use crate::surface::{Point, Ray, Surface};
use std::f32::consts::PI;
use surfelshop_api::glam::Vec3;
use surfelshop_api::{Arriving, Lamp, SurfaceSettings};

/// A scene to follow paths in.
pub(crate) struct Scene<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) settings: &'a SurfaceSettings,
    pub(crate) material: &'a Material,
    pub(crate) environment_map: Option<EnvironmentMap<'a>>,
    pub(crate) lights: &'a [Lamp],
    /// Times that light may be reflected before it is reflected to the eye.
    pub(crate) bounces: u32,
    /// Whether points are blended of the surfels that overlap there.
    pub(crate) blend: bool,
}

impl Scene<'_> {
    /// The first point of a ray.
    pub(crate) fn met(&self, ray: &Ray) -> Option<Point> {
        self.surface.met(ray, self.settings, self.blend)
    }

    /// Whether the way from a point in a direction is free, 1 or 0.
    pub(crate) fn accessibility(&self, point: &Point, direction: Vec3) -> f32 {
        self.accessibility_up_to(f32::INFINITY, point, direction)
    }

    /// The same for what lies nearer than an end, as a light is.
    fn accessibility_up_to(&self, end: f32, point: &Point, direction: Vec3) -> f32 {
        let blocked = self.surface.blocks(&point.towards(direction), end, self.settings);
        if blocked { 0.0 } else { 1.0 }
    }

    /// A sample of the radiance that a point sends towards the eye.
    pub(crate) fn radiance(&self, first: Point, to_eye: Vec3, random: &mut Random) -> Vec3 {
        let (mut sum, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        let (mut point, mut eye) = (first, to_eye);
        for bounce in 0..=self.bounces {
            sum += throughput * self.direct(&point, eye, random);
            let direction = self.material.sample(&point, eye, random);
            let density = self.material.density(&point, eye, direction);
            let response = self.material.response(&point, eye, direction);
            if density <= 0.0 || response == Vec3::ZERO {
                break;
            }
            throughput *= response / (PI * density);
            let ray = point.towards(direction);
            let next = match bounce < self.bounces {
                true => self.met(&ray),
                // Only whether there is anything is asked at the end.
                false if self.surface.blocks(&ray, f32::INFINITY, self.settings) => break,
                false => None,
            };
            let Some(next) = next else {
                if let Some(environment_map) = &self.environment_map {
                    // The other way to find this light, in proportion to it, has its share.
                    let share = density / (density + environment_map.density(direction));
                    sum += throughput * share * environment_map.radiance(direction);
                }
                break;
            };
            (point, eye) = (next, -direction);
        }
        sum
    }

    /// Light that reaches a point without a detour.
    ///
    /// Source: Veach & Guibas 1995, "Optimally Combining Sampling Techniques", the balance heuristic.
    fn direct(&self, point: &Point, eye: Vec3, random: &mut Random) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let place = self.surface.origin + point.position.as_dvec3();
        for light in self.lights {
            let Arriving { towards, radiance, distance } = light.arriving(place);
            let towards = towards.as_vec3();
            let reflected = self.material.response(point, eye, towards) * radiance.as_vec3();
            if reflected != Vec3::ZERO {
                sum += reflected * self.accessibility_up_to(distance as f32, point, towards);
            }
        }
        if let Some(environment_map) = &self.environment_map {
            let (direction, density) = environment_map.sample(random);
            let response = self.material.response(point, eye, direction);
            if density > 0.0 && response != Vec3::ZERO {
                let both = density + self.material.density(point, eye, direction);
                let light =
                    environment_map.radiance(direction) * self.accessibility(point, direction);
                sum += response * light / (PI * both);
            }
        }
        sum
    }
}
