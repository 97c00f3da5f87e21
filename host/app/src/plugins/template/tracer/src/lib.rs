//! # `{{id}}`: rays on the CPU
//!
//! One ray for each sample of a pixel meets the nearest disc, which the scene's lights shine on, with
//! shadows. A tracer may compute pixels in any way, also through another interface; the host calls `tile`
//! for rectangles of the picture on all cores and takes the mean of the samples.
//!
//! | parameter | type | default | meaning                           |
//! |-----------|------|---------|-----------------------------------|
//! | `samples` | int  | 16      | rays for each pixel               |
//! | `shadows` | bool | true    | whether surfels hide lights       |

use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::Lamp;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::glam::{DVec2, DVec3, Vec3, Vec4};
use surfelshop_api::prelude::*;
use surfelshop_geometry::discs::{Disc, Discs};
use surfelshop_geometry::silent;

params! {
    /// Settings of `{{id}}`: the panel, `--set` and `report` are made from these lines.
    pub struct Settings {
        /// Rays for each pixel. The host takes the mean over as many samples as a parameter of this
        /// name says.
        samples: u32 { default: 16, range: 1..=4096, quality: true, logarithmic: true },
        /// Whether surfels hide lights.
        shadows: bool { default: true },
    }
}

/// The discs of a scene, kept from tile to tile.
struct Scenery {
    /// Of what they were made: generations and places of the clouds, and how large discs are.
    of: (Vec<u64>, Vec<[f64; 3]>, u32),
    /// What positions are relative to, world space.
    origin: DVec3,
    discs: Discs,
    normals: Vec<Vec3>,
    albedos: Vec<Vec3>,
}

#[derive(Default)]
struct {{Name}} {
    kept: Mutex<Option<Arc<Scenery>>>,
}

/// Shadow rays do not meet discs nearer than this many of these discs' radii: the discs of a smooth
/// surface overlap, and would shadow each other.
const OWN: f32 = 2.0;

impl Tracer for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Rays, lights and shadows on the processor: begin here with a tracer of your own.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self::default())
    }

    fn tile(
        &self,
        frame: &Frame<Settings>,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        let kept = self.kept(frame, scene);
        let lights = frame.scene.lights.iter();
        let lamps: Vec<Lamp> = lights
            .map(|light| Lamp::new(light, &frame.view, &frame.cloud))
            .collect();
        let inside = place_of_sample(tile.sample);
        for (i, pixel) in pixels.chunks_exact_mut(4).enumerate() {
            let (column, row) = (i as u32 % tile.width, i as u32 / tile.width);
            if column == 0 {
                job.check()?; // Once a row is often enough to stop soon.
            }
            let at = DVec2::new((tile.x + column).into(), (tile.y + row).into()) + inside;
            let seen = kept.seen(frame, &lamps, at);
            let light = seen.map_or(Vec4::ZERO, |light| light.extend(1.0));
            pixel.copy_from_slice(&light.to_array());
        }
        Ok(())
    }
}

/// Where in its pixel a sample lies: the first in the middle, the others evenly around it.
///
/// Source: Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences".
fn place_of_sample(sample: u32) -> DVec2 {
    let step = DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053);
    (0.5 + f64::from(sample) * step).fract()
}

impl {{Name}} {
    /// The discs of a scene, made when it is a new one.
    fn kept(&self, frame: &Frame<Settings>, scene: &Traced<'_>) -> Arc<Scenery> {
        let columns = scene.clouds.iter().flat_map(|cloud| &cloud.columns);
        let of = (
            columns.map(|column| column.generation).collect(),
            scene
                .clouds
                .iter()
                .map(|cloud| cloud.origin.to_array())
                .collect(),
            frame.scene.surface.radius_scale.to_bits(),
        );
        // Made once, while the other threads wait for it.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some(known) if known.of == of => known.clone(),
            _ => {
                let made = Arc::new(Scenery::new(of, frame, scene));
                *kept = Some(made.clone());
                made
            }
        }
    }
}

impl Scenery {
    fn new(
        of: (Vec<u64>, Vec<[f64; 3]>, u32),
        frame: &Frame<Settings>,
        scene: &Traced<'_>,
    ) -> Self {
        // Positions are f32 around an f64 origin, so that millimetres survive far from zero.
        let origin = scene
            .clouds
            .first()
            .map_or(DVec3::ZERO, |cloud| cloud.object.center);
        let (mut discs, mut albedos) = (Vec::new(), Vec::new());
        for cloud in scene.clouds {
            let offset = cloud.origin - origin;
            let radii = cloud.floats(RADIUS, 1).unwrap_or_default();
            let surfels = cloud
                .vectors(POSITION)
                .zip(cloud.vectors(NORMAL))
                .zip(radii);
            discs.extend(surfels.map(|((position, normal), radius)| Disc {
                centre: (position.as_dvec3() + offset).as_vec3(),
                normal: normal.normalize_or(Vec3::Y),
                radius: radius * frame.scene.surface.radius_scale,
            }));
            albedos.extend(cloud.albedos());
        }
        let normals = discs.iter().map(|disc| disc.normal).collect();
        // Nobody asks this hierarchy to stop.
        let discs = Discs::build(&discs, &silent).unwrap_or_default();
        Self {
            of,
            origin,
            discs,
            normals,
            albedos,
        }
    }

    /// The light that comes through a place of the picture; nothing where no disc is.
    fn seen(&self, frame: &Frame<Settings>, lamps: &[Lamp], at: DVec2) -> Option<Vec3> {
        let view = &frame.view;
        let two_sided = frame.scene.surface.two_sided;
        let (start, direction) = view.ray(at.x, at.y);
        let world_from_view = view.camera.view_from_world().transpose();
        let start = (world_from_view * start + view.camera.eye - self.origin).as_vec3();
        // The near plane counts along the viewing axis.
        let near = (view.near / -direction.z) as f32;
        let direction = (world_from_view * direction).as_vec3();
        let counts = |front: bool| front || two_sided;
        let hit = self
            .discs
            .nearest(start, direction, near..f32::INFINITY, |hit| {
                counts(hit.front)
            })?;

        let (i, place) = (hit.index as usize, start + hit.distance * direction);
        let normal = if hit.front {
            self.normals[i]
        } else {
            -self.normals[i]
        };
        let mut light = DVec3::ZERO;
        for lamp in lamps {
            let arriving = lamp.arriving(place.as_dvec3() + self.origin);
            let (towards, end) = (arriving.towards.as_vec3(), arriving.distance as f32);
            let is_hidden = || {
                self.discs.is_hit(place, towards, 0.0..end, |meeting| {
                    meeting.distance > OWN * meeting.radius && counts(meeting.front)
                })
            };
            let facing = normal.dot(towards);
            if facing > 0.0 && !(frame.params.shadows && is_hidden()) {
                light += arriving.radiance * f64::from(facing);
            }
        }
        Some((light * self.albedos[i].as_dvec3()).as_vec3())
    }
}

export_plugin! { id: "{{package}}",{{minor}} tracers: [{{Name}}] }
