//! # `normals`: normals from positions
//!
//! | parameter     | type   | default    | meaning                                                 |
//! |---------------|--------|------------|---------------------------------------------------------|
//! | `neighbours`  | int    | 16         | nearest points that a plane is first fitted to, 3 to 256 |
//! | `orientation` | choice | `outwards` | `outwards`, `towards`, `keep`, `flip` or `visible`       |
//! | `measures`    | bool   | `false`    | adds the columns `planarity` and `normal_error`          |
//! | `towards-x`, `-y`, `-z` | float | 0 | the place that normals face, for `towards`; scene units  |
//!
//! Method. The normal is the direction of least spread of the nearest points; where these are noisy or lie in a
//! row, of up to about 800, and at an edge that of the face which the point lies in. `outwards` makes
//! signs agree from neighbour to neighbour and turns each connected part outwards;
//! `towards` turns each normal to a place, such as where a scanner stood; `keep` takes the sign of
//! the normal that is there; `flip` estimates nothing and turns the normals that are there round;
//! `visible` turns each to the side from where it can be seen: walls face their room, land the sky,
//! things outwards.
//!
//! What is no surface, such as leaves, gets soft normals: outwards from the middle of some 64 points. The column
//! `planarity` says how flat surroundings are, from 0 to 1 of a plane; renderers draw what is below 0.5 as round
//! splats. `normal_error` is about the angle by which a normal may be off by the scatter of its neighbours, in
//! degrees.
//!
//! Limits: a flat sheet has no outside, and parts that nearly touch may be taken for one. Tangents
//! of elliptical surfels stay as they are. Over a pyramid sides follow from each part alone, so that `towards` and
//! `keep` do best.
//!
//! Source: Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992.
//!
//! ```text
//! surfelshop bake scan.ply -t normals --set orientation=towards --set towards-z=2.5 -o out.ply
//! ```

use crate::surfels::{finite, flat, floats, normals, positions, progress_of};
use surfelshop_api::columns::{NORMAL, PLANARITY};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::Neighbours;
use surfelshop_geometry::normals::{estimate_with, is_valid, soften};
use surfelshop_geometry::part;
use surfelshop_geometry::sides::{Hints, by_visibility};

choices! {
    /// Which of its two sides a surface shows.
    pub enum Orientation {
        /// The outer one, part by part.
        Outwards = "outwards",
        /// The one that a place sees.
        Towards = "towards",
        /// The one that the normals there show.
        Keep = "keep",
        /// The other one than the normals there show.
        Flip = "flip",
        /// The one that can be seen from free space.
        Visible = "visible",
    }
}

params! {
    /// Settings of `normals`.
    pub struct Settings {
        /// Nearest points that a plane is fitted to: more are smoother, fewer keep detail.
        neighbours: u32 { default: 16, range: 3..=256, quality: true, logarithmic: true },
        /// Which side normals show: outwards part by part, towards a place, as the normals that
        /// are there (keep), those turned round without estimating any (flip), or the one that can
        /// be seen from free space (visible).
        orientation: Orientation { default: Orientation::Outwards },
        /// Add columns: planarity, in [0, 1], and normal_error, about the angle by which a normal may be off, in
        /// degrees.
        measures: bool { default: false },
        /// The place that normals face, for orientation towards.
        towards_x: f64 { default: 0.0, unit: "scene units" },
        /// The place that normals face, for orientation towards.
        towards_y: f64 { default: 0.0, unit: "scene units" },
        /// The place that normals face, for orientation towards.
        towards_z: f64 { default: 0.0, unit: "scene units" },
    }
}

/// The tool.
pub(crate) struct Normals;

impl Tool for Normals {
    const INFO: UnitInfo =
        UnitInfo::new("normals", "Estimate normals", "Fits normals to the points around each.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Neighbours;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let positions = positions(cloud)?;
        let given = normals(cloud);
        let needs_given = matches!(params.orientation, Orientation::Keep | Orientation::Flip);
        if needs_given && given.is_empty() {
            return Err(Error::new(
                "expected normals whose sides to go by, found none; estimate them with \
                 `orientation=outwards`",
            ));
        }
        let place = place(cloud, params)?;
        if params.orientation == Orientation::Flip {
            job.check()?;
            let turned: Vec<Vec3> = given.iter().map(|&normal| -normal).collect();
            job.progress(1.0, &format!("{} normals turned round", turned.len()));
            return job.edit(&Edit::Columns(vec![floats(NORMAL, 3, &flat(&turned))]));
        }
        let k = params.neighbours.max(3) as usize;
        // To look around takes about as long.
        let share = if params.orientation == Orientation::Visible { 0.5 } else { 0.98 };
        let progress = progress_of(job, 0.0..share, "fitting normals");
        let neighbours = Neighbours::build(&positions, &part(&progress, 0.0..0.1))?;
        let mut found = estimate_with(&neighbours, k, &part(&progress, 0.1..1.0))?;
        let mut parts = String::new();
        match params.orientation {
            Orientation::Outwards => {
                let s = if found.n_components == 1 { "" } else { "s" };
                parts = format!(", {} part{s} turned outwards", found.n_components);
            }
            Orientation::Visible => {
                let progress = progress_of(job, share..0.98, "looking from free space");
                let normals = &mut found.normals;
                let sides = by_visibility(&positions, normals, &Hints::default(), &progress)?;
                parts = format!(
                    ", {} turned to free space, {} of uncertain side; {:.0} % sure which way round all are",
                    sides.decided,
                    sides.uncertain,
                    100.0 * sides.certainty
                );
            }
            Orientation::Towards | Orientation::Keep | Orientation::Flip => {}
        }
        let progress = progress_of(job, 0.98..1.0, "softening what is no surface");
        soften(&neighbours, &mut found.normals, &found.planarity, &progress)?;
        // What is known of a side counts last, for soft normals too.
        for (i, normal) in found.normals.iter_mut().enumerate() {
            match params.orientation {
                Orientation::Towards => face(normal, (place - positions[i].as_dvec3()).as_vec3()),
                Orientation::Keep => face(normal, given.get(i).copied().unwrap_or_default()),
                Orientation::Outwards | Orientation::Visible | Orientation::Flip => {}
            }
        }
        let (n, n_degenerate) = (found.normals.len(), found.n_degenerate);
        let message = format!("{n} normals, {n_degenerate} without a plane around them{parts}");
        job.progress(1.0, &message);
        let normals = flat(&found.normals);
        let degrees: Vec<f32> = found.errors.iter().map(|error| error.to_degrees()).collect();
        let mut columns = vec![floats(NORMAL, 3, &normals)];
        // Planarity that is there is of the normals that were there.
        if params.measures || cloud.column(PLANARITY).is_some() {
            columns.push(floats(PLANARITY, 1, &found.planarity));
        }
        if params.measures {
            columns.push(floats("normal_error", 1, &degrees));
        }
        job.edit(&Edit::Columns(columns))
    }
}

/// Turns a normal to the side of a direction; it stays where that lies in the surface, or is none.
fn face(normal: &mut Vec3, direction: Vec3) {
    if is_valid(direction) && normal.as_dvec3().dot(direction.as_dvec3()) < 0.0 {
        *normal = -*normal;
    }
}

/// The place that normals face, relative to the cloud's origin.
fn place(cloud: &CloudView<'_>, params: &Settings) -> Result<DVec3> {
    let x = finite("towards-x", params.towards_x)?;
    let y = finite("towards-y", params.towards_y)?;
    let z = finite("towards-z", params.towards_z)?;
    Ok(DVec3::new(x, y, z) - cloud.origin)
}
