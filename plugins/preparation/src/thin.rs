//! # `thin`: fewer surfels that still cover the surface
//!
//! | parameter | type   | default      | meaning                                                  |
//! |-----------|--------|--------------|----------------------------------------------------------|
//! | `method`  | choice | `blue-noise` | `blue-noise`: evenly apart; `grid`: one for each cube      |
//! | `count`   | int    | 0            | surfels that stay; with `spacing` 0 too, half of them      |
//! | `spacing` | float  | 0            | instead: least distance, or edge of the cubes; scene units |
//! | `radius`  | choice | `cover`      | radii of those that stay: `cover`, `scale` or `keep`       |
//! | `seed`    | int    | 1            | of the order in which points take turns, for a `spacing`   |
//!
//! Method. `grid` keeps the point of each cube that is nearest to the mean of all in it.
//! `blue-noise` with a `spacing` is dart throwing: in random order, each point stays that is as far
//! from all that stayed; with a `count` the most crowded are removed one by one until so many are
//! left, which `grid` meets only about. `cover` estimates radii from the points that stay, and
//! keeps those that were larger; `scale` enlarges all by the root of how many fewer there are.
//!
//! Limits: distances are straight, so sides of a sheet thinner than the spacing thin each other.
//! Over a pyramid parts are thinned by themselves: a `count` is refused, and where two parts meet some points may be
//! closer than the `spacing`, the more of them the closer it is to 18 times the spacing of the points. Other columns stay as they were: a colour is that of a point, not the mean around it.
//!
//! Source: Cook 1986 for dart throwing; Yuksel, "Sample Elimination for Generating Poisson Disk
//! Sample Sets", Eurographics 2015.
//!
//! ```text
//! surfelshop bake scan.ply -t thin --set count=50000 -o small.ply
//! ```

use crate::surfels::{count, finite, normals, positions, progress_of, stage_radii};
use surfelshop_api::columns::{CONTEXT, RADIUS};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::{areas, hashing, radii, spread, thinning};

choices! {
    /// Which surfels stay.
    pub enum Method {
        /// Some that lie evenly apart.
        BlueNoise = "blue-noise",
        /// One for each cube.
        Grid = "grid",
    }
}

choices! {
    /// What becomes of radii.
    pub enum Radius {
        /// They cover the surface again.
        Cover = "cover",
        /// All grow alike.
        Scale = "scale",
        /// They stay.
        Keep = "keep",
    }
}

params! {
    /// Settings of `thin`.
    pub struct Settings {
        /// Which surfels stay: some that lie evenly apart, or one for each cube of a grid.
        method: Method { default: Method::BlueNoise },
        /// Surfels that stay; about, for the grid. Where both this and the spacing are 0, half of
        /// them do.
        count: u32 { default: 0, range: 0..=2_000_000_000 },
        /// Least distance of those that stay, or the edge of a grid's cubes, instead of a count.
        spacing: f64 { default: 0.0, range: 0.0..=1e30, unit: "scene units" },
        /// Radii of those that stay: estimated anew so that they cover the surface (cover), all
        /// enlarged alike (scale), or as they were (keep).
        radius: Radius { default: Radius::Cover },
        /// Beginning of the random order in which points take turns, where a spacing is given; with
        /// a count it decides between points that are equally crowded.
        seed: u32 { default: 1, range: 0..=1_000_000_000 },
    }
}

/// The tool.
pub(crate) struct Thin;

impl Tool for Thin {
    const INFO: UnitInfo =
        UnitInfo::new("thin", "Thin out", "Keeps fewer surfels, evenly, and enlarges them.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Neighbours;
    const LIMITS: &'static [LimitInfo] = &[
        LimitInfo::new(
            "reordered",
            "which of several neighbours stays depends on their order in the file",
        )
        .at_most(0.5),
        LimitInfo::new("parts", "which of several neighbours stays depends on their order")
            .at_most(0.5),
    ];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let positions = positions(cloud)?;
        let spacing = finite("spacing", params.spacing)?;
        if spacing > 0.0 && params.count > 0 {
            return Err(Error::new(format!(
                "expected a `count` or a `spacing`, found both ({} and {spacing}); leave one at 0",
                params.count
            )));
        }
        if params.count > 0 && cloud.column(CONTEXT).is_some() {
            return Err(Error::new(
                "expected a `spacing`, found a `count`: the cloud is thinned part by part, and no part \
                 knows how many the others keep",
            ));
        }
        let normals = normals(cloud);
        let kept = match cloud.column(CONTEXT) {
            Some(_) if params.method == Method::BlueNoise && spacing > 0.0 => {
                let progress = progress_of(job, 0.0..0.7, "choosing surfels");
                let turn = by_place(cloud.origin, &positions, spacing, params.seed);
                spread::apart_by(&positions, spacing, &turn, &progress)?
            }
            _ => chosen(&positions, &normals, params, spacing, job)?,
        };
        let n_kept = count(&kept);
        if n_kept == 0 {
            return Err(Error::new("expected finite positions, found none"));
        }
        let progress = progress_of(job, 0.7..0.98, "covering the surface");
        let grown = match (params.radius, cloud.floats(RADIUS, 1)) {
            (Radius::Keep, _) | (_, None) => None,
            (Radius::Scale, Some(before)) => {
                let factor = (positions.len() as f64 / n_kept as f64).sqrt();
                let grow = |&radius: &f32| (f64::from(radius) * factor).min(1e38) as f32;
                Some(before.iter().map(grow).collect())
            }
            (Radius::Cover, Some(before)) => {
                let part: Vec<Vec3> = of(&positions, &kept);
                let found = radii::estimate(&part, &of(&normals, &kept), &progress)?;
                let mut found = found.into_iter();
                let grow = |(&before, &stays): (&f32, &bool)| match stays {
                    true => found.next().map_or(before, |radius| radius.max(before)),
                    false => before,
                };
                Some(before.iter().zip(&kept).map(grow).collect::<Vec<f32>>())
            }
        };
        job.check()?;
        if let Some(radii) = grown {
            stage_radii(cloud, &radii, job)?;
        }
        job.progress(1.0, &format!("{n_kept} of {} surfels stay", kept.len()));
        job.edit(&Edit::Keep(kept.into()))
    }
}

/// Which surfels stay.
/// An order that follows from where points lie in the world, and not from their numbers: parts of a cloud that have the
/// same points around choose alike.
fn by_place(
    origin: DVec3,
    positions: &[Vec3],
    spacing: f64,
    seed: u32,
) -> impl Fn(u32) -> u64 + use<'_> {
    // Positions are rounded differently from part to part, by far less than this.
    let step = spacing / 1024.0;
    move |index| {
        let place = (origin + positions[index as usize].as_dvec3()) / step;
        let numbers = place.to_array().map(|x| (x.round() as i64).cast_unsigned());
        numbers.into_iter().fold(hashing::scattered(u64::from(seed)), |key, number| {
            hashing::scattered(key ^ hashing::scattered(number))
        })
    }
}

fn chosen(
    positions: &[Vec3],
    normals: &[Vec3],
    params: &Settings,
    spacing: f64,
    job: &Job<'_>,
) -> Result<Vec<bool>> {
    let wanted = match params.count {
        0 => positions.len().div_ceil(2),
        count => count as usize,
    };
    let (all, first, then) = (
        progress_of(job, 0.0..0.7, "choosing surfels"),
        progress_of(job, 0.0..0.3, "measuring the surface"),
        progress_of(job, 0.3..0.7, "choosing surfels"),
    );
    let seed = u64::from(params.seed);
    Ok(match (params.method, spacing > 0.0) {
        (Method::Grid, true) => thinning::one_per_cube(positions, spacing, &all)?,
        (Method::Grid, false) => {
            let edge = thinning::edge_for(positions, wanted, &first)?;
            thinning::one_per_cube(positions, edge, &then)?
        }
        (Method::BlueNoise, true) => spread::apart(positions, spacing, seed, &all)?,
        (Method::BlueNoise, false) => {
            let shares = areas::effective(positions, normals, &first)?;
            let area = shares.into_iter().map(f64::from).sum();
            spread::evenly(positions, wanted, area, seed, &then)?
        }
    })
}

/// The vectors whose entry is true.
fn of(vectors: &[Vec3], mask: &[bool]) -> Vec<Vec3> {
    let chosen = vectors.iter().zip(mask).filter(|(_, kept)| **kept);
    chosen.map(|(vector, _)| *vector).collect()
}
