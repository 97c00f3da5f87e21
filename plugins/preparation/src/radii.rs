//! # `radii`: radii at which discs cover the surface
//!
//! | parameter | type   | default   | meaning                                                      |
//! |-----------|--------|-----------|--------------------------------------------------------------|
//! | `method`  | choice | `points`  | `points`: from the points around; `triangles`: of the mesh    |
//! | `factor`  | float  | 1         | factor on the radii found                                    |
//! | `minimum` | float  | 0         | smallest radius, scene units; 0 for none                     |
//! | `maximum` | float  | 0         | largest radius, scene units; 0 for none                      |
//!
//! Method. `points` is what a file without radii gets when it is read: each disc reaches the corners
//! of its point's Voronoi cell in the tangent plane, and what is no surface, by the column `planarity` or else as the
//! points around say, gets splats that just touch. `triangles` reaches all that is nearest to a
//! vertex in the triangles around it; vertices without a triangle are treated as points.
//!
//! Elliptical surfels keep their shape: their tangents grow and shrink with the radius.
//!
//! Limits: a factor below 1 may leave holes.
//!
//! ```text
//! surfelshop bake scan.ply -t radii --set factor=1.2 -o out.ply
//! ```

use crate::surfels::{finite, normals, positions, progress_of, stage_radii};
use surfelshop_api::columns::PLANARITY;
use surfelshop_api::glam::Vec3;
use surfelshop_api::prelude::*;
use surfelshop_geometry::normals::{DEFAULT_NEIGHBOURS, planarity};
use surfelshop_geometry::{Neighbours, mesh, radii};

choices! {
    /// What radii follow from.
    pub enum Method {
        /// The points around each.
        Points = "points",
        /// The triangles around each.
        Triangles = "triangles",
    }
}

params! {
    /// Settings of `radii`.
    pub struct Settings {
        /// What radii follow from: the points around each surfel, or the triangles of a mesh.
        method: Method { default: Method::Points },
        /// Factor on the radii that just cover the surface.
        factor: f64 { default: 1.0, range: 0.01..=100.0, logarithmic: true },
        /// Smallest radius; 0 for none.
        minimum: f64 { default: 0.0, range: 0.0..=1e30, unit: "scene units" },
        /// Largest radius; 0 for none.
        maximum: f64 { default: 0.0, range: 0.0..=1e30, unit: "scene units" },
    }
}

/// The tool.
pub(crate) struct Radii;

impl Tool for Radii {
    const INFO: UnitInfo =
        UnitInfo::new("radii", "Estimate radii", "Finds radii at which discs cover the surface.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Neighbours;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let positions = positions(cloud)?;
        let factor = finite("factor", params.factor)?;
        let minimum = finite("minimum", params.minimum)?;
        let maximum = finite("maximum", params.maximum)?;
        if maximum > 0.0 && minimum > maximum {
            return Err(Error::new(format!(
                "expected a `minimum` of at most the `maximum` {maximum}, found {minimum}"
            )));
        }
        let normals = normals(cloud);
        let mut found = match params.method {
            Method::Points => of_points(cloud, &positions, &normals, job)?,
            Method::Triangles => of_triangles(cloud, &positions, &normals, job)?,
        };
        let (least, most) = (minimum as f32, if maximum > 0.0 { maximum as f32 } else { f32::MAX });
        let (mut n_raised, mut n_lowered) = (0, 0);
        for radius in &mut found {
            *radius = (f64::from(*radius) * factor) as f32;
            n_raised += usize::from(*radius < least);
            n_lowered += usize::from(*radius > most);
            // Graphics hardware takes numbers below this for zero.
            *radius = radius.max(least).min(most).max(f32::MIN_POSITIVE);
        }
        let n = found.len();
        job.progress(1.0, &format!("{n} radii, {n_raised} raised, {n_lowered} lowered to limits"));
        stage_radii(cloud, &found, job)
    }
}

/// Radii from the points around.
fn of_points(
    cloud: &CloudView<'_>,
    positions: &[Vec3],
    normals: &[Vec3],
    job: &Job<'_>,
) -> Result<Vec<f32>> {
    let progress = progress_of(job, 0.0..0.1, "looking for neighbours");
    let neighbours = Neighbours::build(positions, &progress)?;
    let progress = progress_of(job, 0.1..0.4, "telling what is a surface");
    let found;
    let planarity = match cloud.floats(PLANARITY, 1) {
        Some(known) => known,
        None => {
            found = planarity(&neighbours, DEFAULT_NEIGHBOURS, &progress)?;
            &found
        }
    };
    let progress = progress_of(job, 0.4..0.98, "covering the surface");
    Ok(radii::estimate_with(&neighbours, normals, planarity, &progress)?)
}

/// Radii from the triangles around, and from points where there is none.
fn of_triangles(
    cloud: &CloudView<'_>,
    positions: &[Vec3],
    normals: &[Vec3],
    job: &Job<'_>,
) -> Result<Vec<f32>> {
    crate::sample::has_faces(cloud)?;
    job.progress(0.0, "covering the triangles");
    let mut found = mesh::vertex_radii(positions, normals, cloud.faces);
    job.check()?;
    if found.contains(&0.0) {
        let others = of_points(cloud, positions, normals, job)?;
        for (radius, other) in found.iter_mut().zip(others) {
            *radius = if *radius > 0.0 { *radius } else { other };
        }
    }
    Ok(found)
}
