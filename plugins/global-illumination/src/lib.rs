//! # `global-illumination`: light that bounces between points
//!
//! Places that lights reach become lights themselves: virtual point lights, with shadow maps made of the
//! cloud's points, light everything again, and so on from bounce to bounce.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `bounces` | int | 2 | reflections between surfaces; 0 is direct light |
//! | `vpls` | int | 64 | virtual point lights of each bounce in a frame |
//! | `frames` | int | 8 | frames that are added up while nothing moves, each with others |
//! | `ism-size` | int | 512 | texels on a side of all shadow maps of a bounce together; 32 for each point at most |
//! | `ism-points` | int | 200000 | surfels that go over all these maps |
//! | `pull-push` | int | 2 | holes of twice 2^n texels are filled, of 8 where something lies behind; 0 fills none |
//! | `interleaving` | int | 4 | n: of n x n pixels each takes every n^2-th light |
//! | `smoothing` | int | 2 | 0 none, 1 over a block of n x n pixels, 2 over those around too |
//! | `near` | choice | `disc` | lights are a `disc`, or `bounded`, near surfaces |
//! | `softening` | float | 1 | how large that disc or bound is |
//! | `compensation` | int | 8 | places around each pixel by which it is made up for; 0 is none |
//! | `light-map` | int | 512 | texels on a side of what a lamp sees: a power of two, four million for all lamps at most |
//! | `diffuse`, `specular`, `shininess` | float | 1, 0, 64 | as `ewa-phong` |
//! | `ior` | float | 1 | highlights have Schlick's factor of this index; 1 leaves it out |
//! | `show` | choice | `all` | `all` light, `direct` or `indirect` alone |
//!
//! `debug.vpls` shows where lights are, `debug.ism` and `debug.ism-points` the maps of the first ones with
//! and without holes filled, as one over the distance: as many as a picture has room for.
//!
//! Method. Lights are cameras: what they see is their shadow map and where the first virtual lights are
//! placed, in proportion to the flux that is reflected there (Halton's points, warped down a pyramid of
//! importance), each with its flux over N times its probability. All points of the cloud go once over the
//! imperfect shadow maps of all lights, hemispheres as paraboloids, each into one map, enlarged as far as
//! edges of shadows do not grow by more than holes let through. Holes are filled where both sides of them
//! show one surface. Pixels are lit interleaved and merged where they show one surface. The lights of the
//! next bounce lie where a direction, chosen in proportion to what a light reflects, meets the surface in
//! its map: a path's flux changes by reflection over probability, nothing counts twice. At rest frames
//! with other lights are added up. While something moves and the host draws one surfel of several, maps of
//! virtual lights have as many fewer points and texels (sixteen times at most), and those of lights as many
//! fewer texels (four times at most: their edges are seen).
//!
//! Deviations from the paper: errata P1 to P8. A point light is six pictures. Discs' areas go with 1/d^2.
//! Each pixel's light is weighted by n^2. Direct light enters the first set of lights alone. New lights
//! are chosen with a known probability and not by a depth test. Holes are not pulled and pushed up and
//! down a pyramid, which widened every edge: with this, a quarter to a half of the maps' error against
//! rays is left. Light does not go to infinity near a virtual light (`near`), which leaves out light in
//! corners; `compensation` gathers it from what the picture shows around.
//!
//! Bias that stays however many frames are added up: shadows of virtual lights begin about half an enlarged
//! disc behind their occluders and are as coarse as the maps; what `near` leaves out and no pixel shows;
//! highlights of lights are widened by the disc, which is what keeps them from sparkling.
//!
//! Compensation sees no occlusion, takes highlights of neighbours as they look from the eye, and takes each
//! bounce to have half the light of the one before. Points that barely overlap let light through their
//! shadow maps, a few per cent through a closed surface.
//!
//! Limits: natural light and ambient occlusion are not part of it; surfels that lines cut cast shadows
//! whole, and ellipses as discs of their area. Where the scene draws one side only, lights see that side
//! only, too, and backs cast no shadows of direct light, as they do to the tracer.
//!
//! Source: Preiner 2010, "Real-Time Global Illumination in Point Clouds"; Ritschel et al. 2008, "Imperfect
//! Shadow Maps for Efficient Computation of Indirect Illumination"; Keller 1997, "Instant Radiosity".
//!
//! ```text
//! surfelshop render assets/cornell-box.scene.toml -r global-illumination --set bounces=3 -o box.png
//! ```

mod frame;
mod light_views;
mod modules;
mod passes;
mod settings;
mod shading;
mod shadow_maps;
mod vpls;

use frame::Passes;
use settings::Settings;
use surfelshop_api::prelude::*;

struct GlobalIllumination;

impl Renderer for GlobalIllumination {
    const INFO: UnitInfo = UnitInfo::new(
        "global-illumination",
        "Global illumination",
        "Light that bounces between points: virtual point lights with imperfect shadow maps.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        Passes::new(frame, graph).all();
        Ok(())
    }
}

export_plugin! { id: "org.surfelshop.global-illumination", renderers: [GlobalIllumination] }
