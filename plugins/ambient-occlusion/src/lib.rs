//! # `ambient-occlusion`: how much of its sky each surfel sees
//!
//! Writes the column `ao`: accessibility, 1 less the share of the cosine-weighted hemisphere about
//! the normal that other surfels cover. Renderers darken by it what arrives from everywhere.
//! Chapter 4 of the thesis, with rays beside it to know its error by.
//!
//! | parameter      | type   | default  | meaning                                                    |
//! |----------------|--------|----------|------------------------------------------------------------|
//! | `method`       | choice | `hybrid` | `hybrid`, `rays`, `octree` or `brute-force`                |
//! | `rays`         | int    | 256      | rays of each surfel; at most so many in `hybrid`           |
//! | `tolerance`    | float  | 0.008    | error bound of a node of the octree, a share of the sky    |
//! | `error`        | float  | 0.018    | error at which `hybrid` traces no more, a share of the sky |
//! | `passes`       | int    | 2        | passes of form factors; 1 shades twice what lies in shadow |
//! | `seed`         | int    | 0        | start of the random numbers of the rays                    |
//! | `max-distance` | float  | 0        | what is farther casts no shadow, scene units; 0: unlimited |
//! | `cast-from`    | choice | `back`   | `back` or `front` of an emitter, of `octree`, `brute-force` |
//! | `cone`         | bool   | false    | leave out what is below 15 degrees, as the thesis does     |
//!
//! Methods. `brute-force` adds up eq. 9 over all pairs; each further pass counts an emitter by the
//! share of it that the pass before left open (eq. 10, 11). `octree` does so for distant nodes
//! together, from their moments, where the node's form factor times the square of its angular
//! radius is below `tolerance`. `rays` traces cosine-distributed, stratified rays against discs.
//! `hybrid` gathers from the octree, and traces where what the fronts of emitters cover differs
//! from what their backs do, so that the surface cannot be closed there: open scans, rooms. Where
//! that is a third of a cloud, all of it is traced.
//!
//! `hybrid` traces the rays of at most sixteen neighbours that face about the same way together, in the
//! same directions: they meet the same nodes, so that one ray takes a fifth of the time that it
//! takes alone, and finds the same. 64 directions are traced first. A linear fit to the occlusion of a
//! bundle and those around it, by place, normal and what the octree found, takes away most of the
//! noise, as far as it misses by no more than the noise; where it does, each surfel's own rays have the
//! say. What is left is estimated from what two halves of the rays differ by and from what the fit
//! misses; where that is above `error`, more directions follow, `rays` at most. The estimate for all
//! that were traced is said at the end; on five clouds it was 2 to 6 % below the error against 4096 rays, and
//! 10 % with `error` at 0.01. What lies many discs away from a bundle takes no part in its fit.
//!
//! Every method honours `max-distance` and `cone`, uses the *effective* area of surfels, found from
//! their neighbours (not `radius`, which overlaps), and is the same on any number of threads. The
//! cloud's scale and position do not matter.
//!
//! Deviations from the paper: errata T1, T18 to T24; in short, min for max, shadows cast from the
//! back, each cosine clamped, effective areas, a node opened by an error bound instead of "near" and
//! "distant", flatness by the covariance of a node's normals, which has no scale, instead of a
//! threshold on eigenvalues. `cone` adds an error of about 0.01 and is off.
//!
//! Over a pyramid each part is shaded by the surfels around it and by merged ones farther away, whose radii are
//! seen under 2.4 degrees at most where memory allows.
//!
//! Not here: the octree as a compute shader, the thesis's future work. It was written and gave the same
//! answer for 3.5 times the CPU time, on Mesa's software device, since the lanes here are as
//! wide and share each node's load; nothing is known of its time on a graphics card.
//!
//! Limits: form factors do not know what hides what, so deep folds are off by some 0.1, whatever
//! the tolerance; where both sides of a surface agree by chance, `hybrid` does not trace them.
//! Discs leak where a surface is sampled unevenly. Surfels without a finite position or a normal
//! are left open (1), and counted; so are those that lie a thousand times farther out than the bulk
//! of the cloud.
//!
//! Source: Liu 2006, "High Quality Rendering for Point Sampled Geometry", sections 2.8 and 4;
//! Bunnell 2005, "Dynamic ambient occlusion and indirect lighting".
//!
//! ```text
//! surfelshop bake model.ply -t ambient-occlusion -o model-ao.ply
//! ```

mod bake;
mod beams;
mod brute_force;
mod bundles;
mod form_factor;
mod hierarchy;
mod hybrid;
mod lanes;
mod octree;
mod passes;
mod rays;
mod settings;
mod smoothing;
mod surfels;

pub use settings::{Method, Settings, Side};

use surfelshop_api::prelude::*;

/// The tool.
pub struct AmbientOcclusion;

impl Tool for AmbientOcclusion {
    const INFO: UnitInfo = UnitInfo::new(
        "ambient-occlusion",
        "Ambient occlusion",
        "Finds how much of its sky each surfel sees.",
    );
    type Params = Settings;
    const SCOPE: Scope = Scope::Scene;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, settings: &Settings, job: &Job<'_>) -> Result<()> {
        bake::bake(cloud, settings, job)
    }
}

export_plugin! { id: "org.surfelshop.ambient-occlusion", tools: [AmbientOcclusion] }
