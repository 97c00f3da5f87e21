//! # `splats`: few ellipses for many samples
//!
//! | parameter   | type  | default | meaning                                                            |
//! |-------------|-------|---------|--------------------------------------------------------------------|
//! | `tolerance` | float | 0.001   | farthest that a sample lies from its splat, share of the diagonal  |
//! | `clip`      | bool  | true    | cut splats where two faces meet in a crease                        |
//! | `crease`    | float | 40      | angle between the normals of two faces from which it is a crease   |
//! | `rounds`    | int   | 3       | times that splats are moved to where fewer are needed              |

use crate::{cover, edges};
use crate::graph::{self, Graph};
use crate::output::Columns;
use crate::regions::Ground;
use crate::samples::Samples;
use surfelshop_api::prelude::*;

params! {
    /// Settings of `splats`.
    pub struct Settings {
        /// Farthest that a sample may lie from the plane of the splat that stands for it, as a share of
        /// the diagonal of the cloud's box.
        tolerance: f64 { default: 1e-3, range: 1e-6..=0.1, quality: true, logarithmic: true },
        /// Cut splats at the line where the face they lie on meets another, for sharp edges and corners.
        clip: bool { default: true },
        /// Angle between the normals of neighbouring samples from which they lie on two faces, and no
        /// splat stands for both.
        crease: f64 { default: 40.0, range: 5.0..=85.0, unit: "deg" },
        /// Rounds of moving splats to where fewer of them are needed.
        rounds: u32 { default: 3, range: 0..=32, quality: true },
    }
}

/// The tool.
pub(crate) struct Splats;

impl Tool for Splats {
    const INFO: UnitInfo = UnitInfo::new(
        "splats",
        "Phong splats",
        "Stands few ellipses with linear normal fields in for many samples.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, settings: &Settings, job: &Job<'_>) -> Result<()> {
        let finite = |id: &str, value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => {
                Err(Error::new(format!("expected a number above 0 for `{id}`, found {value}")))
            }
        };
        let share = finite("tolerance", settings.tolerance)?;
        let alike = finite("crease", settings.crease)?.to_radians().cos();
        job.progress(0.0, "looking for neighbours");
        let mut samples = Samples::of(cloud, alike, 0.0..0.15, job)?;
        let n_samples = samples.len();
        let n_turned = graph::turn(&mut samples, 0.15..0.17, job)?;
        let n_split = edges::split(&mut samples, alike, 0.17..0.19, job)?;
        let graph = Graph::of(&samples, alike, 0.19..0.21, job)?;
        let tolerance = share * samples.diagonal;
        // A little less, so that rounding to single precision stays within it.
        let ground = Ground::new(&samples, &graph, tolerance * (1.0 - 1e-6), settings.clip);
        let splats = cover::cover(&ground, settings.rounds, 0.21..0.98, job)?;
        let columns = Columns::of(&samples, &splats);
        job.check()?;
        columns.stage(cloud, &samples, &splats, job)?;
        let count =
            |n: usize, what: &str| if n > 0 { format!(", {n} {what}") } else { String::new() };
        job.progress(
            1.0,
            &format!(
                "{} splats for {} samples: tolerance {:.4e}, largest error {:.4e} scene units{}{}{}{}",
                splats.len(),
                n_samples,
                tolerance * samples.unit,
                columns.error * samples.unit,
                count(columns.n_cut, "cut at creases"),
                count(n_turned, "normals turned"),
                count(n_split, "samples on edges"),
                count(samples.n_refused, "samples without a position or normal left out"),
            ),
        );
        Ok(())
    }
}
