//! # `outliers`: removing points that do not belong
//!
//! | parameter    | type   | default  | meaning                                                      |
//! |--------------|--------|----------|--------------------------------------------------------------|
//! | `method`     | choice | `robust` | `robust`, `statistical` or `radius`                          |
//! | `neighbours` | int    | 16       | nearest points whose mean distance counts                    |
//! | `deviations` | float  | 8        | deviations from the usual distance that are too many          |
//! | `radius`     | float  | 0        | of `radius`: how far companions may be; 0: four times the usual distance |
//! | `companions` | int    | 4        | of `radius`: fewer points than this within it are too few     |
//!
//! Method. A point's mean distance to its nearest others is compared with that of all. `statistical`
//! takes the mean and the standard deviation, which outliers themselves raise; `robust` the median
//! and the median deviation, scaled to agree where distances vary normally. `radius` counts points
//! within a radius instead. Points that coincide count once.
//!
//! Limits: one measure for the whole cloud, so that a part that is sampled much more coarsely than
//! the rest counts as outlying; raise `deviations` there. Over a pyramid the usual distance is that of each part. A dense clump of stray points has near
//! neighbours and stays.
//!
//! Source: Rusu et al., "Towards 3D Point cloud based object maps for household environments", 2008,
//! for the statistics of mean distances; Rousseeuw & Croux 1993 for the robust ones.
//!
//! ```text
//! surfelshop bake scan.ply -t outliers --set deviations=4 -o clean.ply
//! ```

use crate::surfels::{count, finite, positions, progress_of};
use surfelshop_api::columns::CONTEXT;
use surfelshop_api::prelude::*;
use surfelshop_geometry::Neighbours;
use surfelshop_geometry::outliers::{
    accompanied, mean_and_deviation, mean_distances, median_and_deviation,
};

choices! {
    /// What tells a point that does not belong.
    pub enum Method {
        /// Its distance to the nearest, against the median of all.
        Robust = "robust",
        /// Its distance to the nearest, against the mean of all.
        Statistical = "statistical",
        /// How many there are within a radius.
        Radius = "radius",
    }
}

params! {
    /// Settings of `outliers`.
    pub struct Settings {
        /// What tells a point that does not belong: its mean distance to the nearest others
        /// against the median (robust) or the mean (statistical) of all, or how few there are within
        /// a radius.
        method: Method { default: Method::Robust },
        /// Nearest points whose mean distance counts.
        neighbours: u32 { default: 16, range: 1..=256, logarithmic: true },
        /// Deviations above the usual distance that are too many.
        deviations: f64 { default: 8.0, range: 0.0..=1000.0, logarithmic: true },
        /// How far companions may be, for method radius; 0 for four times the usual distance to the
        /// nearest point.
        radius: f64 { default: 0.0, range: 0.0..=1e30, unit: "scene units" },
        /// Points that there have to be within the radius, for method radius.
        companions: u32 { default: 4, range: 1..=256 },
    }
}

/// Usual distances to the nearest point that companions may be away where nobody says otherwise:
/// two rings and some of a regular sampling.
const USUAL_DISTANCES: f64 = 4.0;

/// The tool.
pub(crate) struct Outliers;

impl Tool for Outliers {
    const INFO: UnitInfo =
        UnitInfo::new("outliers", "Remove outliers", "Removes points far away from all others.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Neighbours;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let positions = positions(cloud)?;
        let deviations = finite("deviations", params.deviations)?;
        let radius = finite("radius", params.radius)?;
        let progress = progress_of(job, 0.0..0.3, "looking for neighbours");
        let neighbours = Neighbours::build(&positions, &progress)?;
        let progress = progress_of(job, 0.3..0.98, "measuring distances");
        let k = params.neighbours.max(1) as usize;
        let (kept, rule) = match params.method {
            Method::Radius => {
                let radius = match radius > 0.0 {
                    true => radius,
                    false => {
                        let nearest =
                            mean_distances(&neighbours, 1, &progress_of(job, 0.3..0.5, ""))?;
                        USUAL_DISTANCES * median_and_deviation(&nearest).middle
                    }
                };
                let n = params.companions;
                let progress = progress_of(job, 0.5..0.98, "counting companions");
                let kept = accompanied(&neighbours, n as usize, radius, &progress)?;
                (kept, format!("fewer than {n} points within {radius:.4}"))
            }
            Method::Robust | Method::Statistical => {
                let means = mean_distances(&neighbours, k, &progress)?;
                let usual = match params.method {
                    Method::Statistical => mean_and_deviation(&means),
                    _ => median_and_deviation(&means),
                };
                let limit = usual.limit(deviations);
                let kept = means.iter().map(|&mean| mean <= limit).collect();
                (kept, format!("more than {limit:.4} from their nearest neighbours"))
            }
        };
        let n_gone = kept.len() - count(&kept);
        // A part of a cloud may be all outliers.
        if n_gone == kept.len() && cloud.column(CONTEXT).is_none() {
            return Err(Error::new(format!(
                "expected surfels to stay, found all {n_gone} to be outliers ({rule}); ask for \
                 more `deviations` or fewer `companions`"
            )));
        }
        job.progress(1.0, &format!("{n_gone} of {} removed: {rule}", kept.len()));
        job.edit(&Edit::Keep(kept.into()))
    }
}
