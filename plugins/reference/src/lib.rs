//! # `reference`: paths of light over the same surfels
//!
//! What other renderers are measured against, and a way to pictures without a graphics device.
//!
//! | parameter   | type   | default   | meaning                                                      |
//! |-------------|--------|-----------|--------------------------------------------------------------|
//! | `mode`      | choice | `full`    | `full`, `direct` light alone, `environment` alone, or `ambient-occlusion` |
//! | `samples`   | int    | 64        | paths for each pixel                                         |
//! | `bounces`   | int    | 4         | reflections between surfaces, in `full`                      |
//! | `model`     | choice | `lambert` | `lambert`, `phong` as `ewa-phong`, `ggx` as `environment`    |
//! | `kd`, `ks`  | float  | 1, 0.25   | weights of the matte body and of what shines                 |
//! | `shininess` | float  | 64        | of `phong`                                                   |
//! | `roughness`, `metallic`, `ior` | float | 0.4, 0, 1.5 | of `ggx`                                |
//! | `blend`     | bool   | true      | points blended as the host's surface is, not of one surfel   |
//! | `filter`    | bool   | true      | paths all over each pixel, not through its centre            |
//! | `seed`      | int    | 0         | of all random numbers                                        |
//!
//! Method. Path tracing with next-event estimation: lights are asked directly, the environment by
//! directions in proportion to its light and by the material, weighted by the balance heuristic.
//! Discs are met exactly (a hierarchy of boxes, Ylitie et al. 2017), blended with Gaussian weights
//! within the scene's depth tolerance. Numbers depend on pixel, sample and seed alone.
//!
//! Limits: ellipses count as discs of their radius; materials of the scene are not known; a ray that
//! leaves a surface passes discs nearer than two of their radii, so contact shadows begin there. Lights
//! with a place are balls of a ten-thousandth of the scene: what lies within or behind one casts no
//! shadow. The screen-space filter of the host is no part of it: `filter` is a box.
//!
//! Source: Kajiya 1986, "The Rendering Equation"; Veach & Guibas 1995.
//!
//! ```text
//! surfelshop render scan.ply -r reference --set samples=256 -o truth.exr
//! ```

mod environment_map;
mod material;
mod path;
mod random;
mod surface;

use environment_map::{CellDistribution, EnvironmentMap};
use material::{Material, Model};
use path::Scene;
use random::Random;
use std::sync::{Arc, Mutex, PoisonError};
use surface::{Ray, Surface};
use surfelshop_api::Lamp;
use surfelshop_api::glam::{DVec2, DVec3};
use surfelshop_api::prelude::*;
use surfelshop_shading::Reflectance;

choices! {
    /// What of the light is followed.
    pub enum Mode {
        /// All of it.
        Full = "full",
        /// What comes from lights and the environment without a detour.
        Direct = "direct",
        /// What comes from the environment without a detour.
        Environment = "environment",
        /// The share of the sky that each point sees, as a grey.
        AmbientOcclusion = "ambient-occlusion",
    }
}

params! {
    /// Settings of the tracer.
    pub struct Settings {
        /// What of the light is followed: all of it, what comes directly, what comes directly from
        /// the environment, or the share of the sky that each point sees.
        mode: Mode { default: Mode::Full },
        /// Paths for each pixel.
        samples: u32 { default: 64, range: 1..=65_536, quality: true, logarithmic: true },
        /// Reflections between surfaces.
        bounces: u32 { default: 4, range: 0..=64 },
        /// How light is reflected at the surface.
        model: Model { default: Model::Lambert },
        /// Weight of the matte body.
        kd: f32 { default: 1.0, range: 0.0..=1.0, label: "diffuse" },
        /// Weight of what shines.
        ks: f32 { default: 0.25, range: 0.0..=1.0, label: "specular" },
        /// Exponent of the phong highlight.
        shininess: f32 { default: 64.0, range: 1.0..=1024.0, logarithmic: true },
        /// Roughness of the ggx model.
        roughness: f32 { default: 0.4, range: 0.0..=1.0 },
        /// How much of a metal the surface is, in the ggx model.
        metallic: f32 { default: 0.0, range: 0.0..=1.0 },
        /// Index of refraction of the ggx model.
        ior: f32 { default: 1.5, range: 1.0..=4.0, label: "refraction index" },
        /// Points blended of all surfels within the depth tolerance, not of the nearest alone.
        blend: bool { default: true },
        /// Paths all over each pixel, not through its centre.
        filter: bool { default: true },
        /// Of all random numbers.
        seed: u32 { default: 0, range: 0..=65_535 },
    }
}

/// What is kept from tile to tile: the surface and the sky of the last scene.
struct CachedScene {
    /// What they were made of.
    of: (Vec<u64>, Vec<[f64; 3]>, u32, usize, String),
    surface: Surface,
    cells: CellDistribution,
}

struct Reference {
    cached: Mutex<Option<Arc<CachedScene>>>,
    reflectance: Reflectance,
}

impl Tracer for Reference {
    const INFO: UnitInfo = UnitInfo::new(
        "reference",
        "Path traced reference",
        "Paths of light over the same surfels: slow, and as exact as one waits for.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self { cached: Mutex::new(None), reflectance: Reflectance::default() })
    }

    fn tile(
        &self,
        frame: &Frame<Settings>,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        let p = &frame.params;
        let cached = self.cached_scene(frame, scene);
        let material = p.material(&self.reflectance);
        let lights = lights(frame, p.mode);
        let environment_map = match p.mode {
            Mode::AmbientOcclusion => None,
            _ => EnvironmentMap::new(frame.environment.as_ref(), scene, &cached.cells),
        };
        let scene = Scene {
            surface: &cached.surface,
            settings: &frame.scene.surface,
            material: &material,
            environment_map,
            lights: &lights,
            bounces: if p.mode == Mode::Full { p.bounces } else { 0 },
            blend: p.blend,
        };
        for (i, pixel) in pixels.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let i = u32::try_from(i).unwrap_or(u32::MAX);
            let at = [tile.x + i % tile.width, tile.y + i / tile.width];
            if at[0] == tile.x {
                job.check()?;
            }
            let mut random = Random::of(p.seed, at, tile.sample);
            let inside = if p.filter { random.square().as_dvec2() } else { DVec2::splat(0.5) };
            let ray =
                ray(frame, cached.surface.origin, DVec2::new(at[0].into(), at[1].into()) + inside);
            *pixel = match scene.met(&ray) {
                None => [0.0; 4],
                Some(point) if p.mode == Mode::AmbientOcclusion => {
                    let open = scene.accessibility(&point, random.around(point.normal));
                    [open, open, open, 1.0]
                }
                Some(point) => {
                    let light = scene.radiance(point, -ray.direction, &mut random);
                    [light.x, light.y, light.z, 1.0]
                }
            };
        }
        Ok(())
    }
}

impl Settings {
    fn material(&self, reflectance: &Reflectance) -> Material {
        let at_right_angle = (self.ior - 1.0) / (self.ior + 1.0);
        Material {
            model: self.model,
            kd: self.kd,
            ks: self.ks,
            shininess: self.shininess,
            roughness: self.roughness,
            metallic: self.metallic,
            f0: at_right_angle * at_right_angle,
            reflectance: reflectance.clone(),
        }
    }
}

impl Reference {
    /// The surface and the sky of a scene, made when it is a new one.
    fn cached_scene(&self, frame: &Frame<Settings>, scene: &Traced<'_>) -> Arc<CachedScene> {
        let columns = scene.clouds.iter().flat_map(|cloud| &cloud.columns);
        let of = (
            columns.map(|column| column.generation).collect(),
            scene.clouds.iter().map(|cloud| cloud.origin.to_array()).collect(),
            frame.scene.surface.radius_scale.to_bits(),
            scene.texels.len(),
            frame.environment.as_ref().map(|e| e.facts.key.clone()).unwrap_or_default(),
        );
        // Made once while the other threads wait for it; a thread that panics leaves none behind.
        let mut cached = self.cached.lock().unwrap_or_else(PoisonError::into_inner);
        match &*cached {
            Some(known) if known.of == of => known.clone(),
            _ => {
                let surface = Surface::new(scene.clouds, &frame.scene.surface);
                let made = Arc::new(CachedScene {
                    of,
                    surface,
                    cells: CellDistribution::new(scene.texels),
                });
                *cached = Some(made.clone());
                made
            }
        }
    }
}

/// The lights that count, those that follow the camera only where there is no natural light, as with
/// `environment`.
fn lights(frame: &Frame<Settings>, mode: Mode) -> Vec<Lamp> {
    if !matches!(mode, Mode::Full | Mode::Direct) {
        return Vec::new();
    }
    let natural = frame.environment.is_some();
    let lights = frame.scene.lights.iter().filter(|light| !(natural && light.follows_camera()));
    lights.map(|light| Lamp::new(light, &frame.view, &frame.cloud)).collect()
}

/// The ray through a place of the picture, in pixels, from the surface's origin.
fn ray(frame: &Frame<Settings>, origin: DVec3, at: DVec2) -> Ray {
    let view = &frame.view;
    let [half_x, half_y] = view.half_extent();
    let [width, height] = view.size_px.map(f64::from);
    let across =
        DVec2::new((2.0 * at.x / width - 1.0) * half_x, (1.0 - 2.0 * at.y / height) * half_y);
    let world_from_view = view.camera.view_from_world().transpose();
    let eye = view.camera.eye - origin;
    let (start, direction, near) = match view.camera.projection {
        Projection::Perspective { .. } => {
            let direction = across.extend(-1.0);
            // Near counts along the viewing axis.
            (eye, world_from_view * direction, view.near * direction.length())
        }
        Projection::Orthographic { .. } => {
            (eye + world_from_view * across.extend(0.0), world_from_view * DVec3::NEG_Z, view.near)
        }
    };
    let direction = direction.normalize_or(DVec3::NEG_Z).as_vec3();
    Ray { origin: start.as_vec3(), direction, near: near as f32, leaves: false }
}

export_plugin! { id: "org.surfelshop.reference", tracers: [Reference] }
