//! # `splats`: few ellipses for many samples
//!
//! | parameter         | type  | default | meaning                                                           |
//! |-------------------|-------|---------|-------------------------------------------------------------------|
//! | `tolerance`       | float | 0.0005  | farthest that a sample lies from its splat, share of the diagonal |
//! | `color-tolerance` | float | 0.1     | farthest that its colour is from the splat's, 0 to 1; 1 is off    |
//! | `clip`            | bool  | true    | cut splats where two faces meet in a crease                       |
//! | `crease`          | float | 40      | angle between the normals of two faces from which it is a crease  |
//! | `rounds`          | int   | 3       | rounds of moving splats and exchanging them for fewer             |
//!
//! Makes a new cloud of elliptical surfels beside the one given, which needs the column `normal`. Each
//! splat has `position`, `normal` (the mean of its samples'), `tangent_u`, `tangent_v`, `radius` (the
//! longer half axis) and `normal_field`, where creases are cut `clip`, and the means of `color`, blended
//! in linear light, and of `ao`, where the cloud has them.
//!
//! Every sample is held by a splat: it lies within the tolerance of its plane, on its side, and all of its
//! disc (`radius`, estimated where there is none) is inside of the ellipse. So splats leave no hole where
//! the discs left none; what lines cut off lies beyond an edge, and no sample does.
//!
//! Method. From seeds in scattered order grow regions: connected samples, nearest first, as long as the
//! plane of least squares, moved half way between the highest and the lowest, stays within the tolerance of
//! all, and their colours, encoded as sRGB, within `color-tolerance` of their mean in each component, but
//! for two in a hundred, since colours have noise. A round region tells the curvature, by a fit of all
//! normals, and the ellipse in which it grows anew is longer where the surface bends less. Of regions that
//! hold every sample sixteen times, few are chosen, greedily. In each round regions grow anew from the
//! middle of what each chosen one is the nearest to, and a few at a time are taken out for fewer others, of
//! old and new. The splat is the smallest ellipse, its axes along the principal directions, around the
//! discs of the samples it is the nearest to. Where it stands out, over a place at which the surface falls
//! away by four tolerances or past a crease that its lines do not follow, it is divided. The normal field
//! is that of least squares; where a constant normal is nearer to the samples', it is constant, and where
//! its samples are few it keeps of its slopes what is more than noise.
//!
//! Creases. Where neighbours' normals differ by `crease` or more and each is on a face that bends much
//! less, no region goes on. With `clip` the splat ends at the line in which its plane meets that of the
//! samples across: two lines at most, so that regions end before they meet a third. Edges that curve are
//! cut in straight pieces, off by half the tolerance and a tenth of a disc, and lines are moved outwards
//! until they reach the splat across. A corner that goes inwards keeps what either line keeps.
//!
//! Hard cases. Samples whose position or normal is not finite, or whose normal is zero, are left out, and
//! counted. Copies of a sample count once, with the colour of one of them, and copies whose normals differ by
//! a crease are samples of two faces. A sample that lies in the planes of several faces and has the mean
//! of their normals, as vertices on edges do, becomes one of each. A normal that is opposite to nearly all
//! in its plane is turned; sides of a sheet stay apart otherwise. Single samples, and those that nothing
//! joins, are discs of their own: samples are joined where their discs touch, or where they lie within three
//! spacings and twice that far. Samples on a line have the plane that is nearest to their normals. A
//! tolerance is a share of the diagonal, so a single stray sample makes it large: run `outliers` first.
//!
//! Limits. Between samples and beyond the last of them an ellipse reaches over borders of open surfaces, by
//! no more than a disc and the height of its arc; borders are not cut. Where a crease fades out, splats on
//! both sides overlap. A splat holds 8192 samples at most, and is not longer than ten times its width.
//! What stands out of a solid at its edges is bounded by 1.4 discs of the samples and a tolerance from the
//! nearest sample, so coarse samples of sharp edges show teeth; along edges that curve it is about a
//! tolerance. Drawn from both sides, backs are seen there as a line, and renderers that widen thin splats
//! to a pixel show more of it.
//!
//! Over a pyramid the tolerance is a share of the largest extent of the whole; where two parts meet, splats of both
//! overlap.
//!
//! Columns other than `color` and `ao` are left behind, `material` among them. Flat open parts become few
//! large ellipses, whose arcs reach beyond straight borders.
//!
//! The same on any number of threads and for any order of the samples, copies at one place aside. Memory:
//! about 700 bytes a sample.
//!
//! Source: Wu and Kobbelt 2004, "Optimized Sub-Sampling of Point Sets for Surface Splatting", for regions,
//! greedy choice and relaxation; Botsch et al. 2004, "Phong Splatting", section 3, for planes and normal
//! fields, with errata B1, B2 and B7: one orthonormal frame, sums about the means, normals up to 75 degrees
//! from the plane's. Deviations: planes lie half way between the highest and the lowest sample, which
//! needs fewer splats for the same tolerance; the field is also fitted with weights, since slopes count
//! steep normals for too much, and the better of both by angle is taken; the slopes of a field shrink by
//! what may be noise (Efron & Morris 1975), which two or three samples do not tell.
//!
//! ```text
//! surfelshop bake scan.ply -t splats --set tolerance=0.001 -o splats.ply
//! ```

mod clip;
mod colors;
mod context;
mod cover;
mod creases;
mod edge_samples;
mod ellipse;
mod graph;
mod greedy_cover;
mod normal_field;
mod outline;
mod output;
mod overhang;
mod plane;
mod region_growing;
mod ruin_recreate;
mod samples;
mod splat_fit;

use colors::Colors;
use context::GrowthContext;
use graph::Graph;
use output::Columns;
use samples::Samples;
use surfelshop_api::columns::CONTEXT;
use surfelshop_api::prelude::*;

params! {
    /// Settings of `splats`.
    pub struct Settings {
        /// Farthest that a sample may lie from the plane of the splat that stands for it, as a share of
        /// the diagonal of the cloud's box.
        tolerance: f64 { default: 5e-4, range: 1e-6..=0.1, quality: true, logarithmic: true },
        /// Largest difference between a component of a sample's colour, as it is shown, and the mean of the
        /// splat that stands for it; 1 lets splats of any size blend colours away. Of the samples of a
        /// splat, two in a hundred may differ by more.
        color_tolerance: f64 { default: 0.1, range: 0.0..=1.0, quality: true },
        /// Cut splats at the line where the face they lie on meets another, for sharp edges and corners.
        clip: bool { default: true },
        /// Angle between the normals of neighbouring samples from which they lie on two faces, and no
        /// splat stands for both.
        crease: f64 { default: 40.0, range: 5.0..=85.0, unit: "deg" },
        /// Rounds of moving splats and exchanging them for fewer: three find about a tenth fewer than none.
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
    const SCOPE: Scope = Scope::Neighbours;

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
        if !settings.color_tolerance.is_finite() {
            return Err(Error::new(
                "expected a number from 0 to 1 for `color-tolerance`, found none",
            ));
        }
        let alike = finite("crease", settings.crease)?.to_radians().cos();
        job.progress(0.0, "looking for neighbours");
        let mut samples = Samples::of(cloud, alike, 0.0..0.15, job)?;
        let n_samples = samples.len();
        let n_turned = graph::turn(&mut samples, 0.15..0.17, job)?;
        let n_split = edge_samples::split(&mut samples, alike, 0.17..0.19, job)?;
        let graph = Graph::of(&samples, alike, 0.19..0.21, job)?;
        // A part of a cloud has the tolerance of the whole, of which it knows the largest extent.
        let diagonal = match cloud.column(CONTEXT) {
            Some(_) => cloud.object.size / samples.unit,
            None => samples.diagonal,
        };
        let tolerance = share * diagonal;
        // A little less, so that what is rounded to single precision stays within it.
        let rounded = (tolerance - samples.grain).max(0.5 * tolerance) * (1.0 - 1e-6);
        let colors = (settings.color_tolerance < 1.0)
            .then(|| Colors::of(cloud, &samples, settings.color_tolerance))
            .flatten();
        let context =
            GrowthContext::new(&samples, &graph, rounded, settings.clip).with_colors(colors);
        let splats = cover::cover(&context, settings.rounds, 0.21..0.98, job)?;
        let columns = Columns::of(&samples, &splats);
        job.check()?;
        columns.stage(cloud, &samples, &splats, job)?;
        let count =
            |n: usize, what: &str| if n > 0 { format!(", {n} {what}") } else { String::new() };
        job.progress(
            1.0,
            &format!(
                "{} splats hold {} samples: tolerance {:.4e}, largest error {:.4e} scene units{}{}{}{}",
                splats.len(),
                match columns.n_uncovered() {
                    0 => format!("all {n_samples}"),
                    n_uncovered => format!("all but {n_uncovered} of {n_samples}"),
                },
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
