//! # `register`: fits a cloud to another one
//!
//! | parameter | type   | default | meaning                                                          |
//! |-----------|--------|---------|------------------------------------------------------------------|
//! | `to`      | file   |         | the cloud that stays, a PLY file                                 |
//! | `start`   | choice | `place` | `place`: from where it is; `centres`: middles on each other; `axes`: main axes too; `pairs`: as these say |
//! | `pairs`   | text   |         | places of the cloud and of the other one that are the same: `x y z x y z; ...` |
//! | `overlap` | float  | 0.8     | share of the surfels that have a counterpart, 0.1 to 1            |
//! | `rounds`  | int    | 60      | most rounds of each of three steps                               |
//! | `samples` | int    | 20000   | surfels that are compared in the last step                       |
//!
//! Method. Iterated closest points: in each round surfels are paired with the nearest of the other cloud
//! that face about the same way, the farthest pairs beyond the `overlap` are left out, and the
//! rigid motion is found that brings the others onto the planes of their partners. Three steps use ever
//! more surfels, evenly chosen; each ends where a round moves nothing by more than a thousandth of a
//! spacing. `axes` tries the four turns that put main axes on each other and takes the best. `pairs`, three or more,
//! start with the motion that brings the first place of each nearest to the second in the mean square, which is Horn's
//! unit quaternion; they need not be exact.
//!
//! The message tells the root mean square of the distances from planes, the share of pairs,
//! rounds, and the motion as `transform` takes it. Only positions of the whole cloud change, and what turns
//! with it.
//!
//! Limits: rigid motions alone. From `place` the clouds must lie within about a fifth of their size and
//! 30 degrees of each other. What slides on itself, as planes and cylinders do, slides.
//! Triangles of a mesh are left out.
//!
//! Source: Chen and Medioni, "Object modelling by registration of multiple range images", Image and
//! Vision Computing 10(3), 1992; Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4,
//! 1987; Chetverikov et al., "The trimmed iterative closest point algorithm", ICPR
//! 2002.
//!
//! ```text
//! surfelshop bake second.ply -t register --set to=first.ply -o moved.ply
//! ```

mod icp;
mod pairs;

use crate::boolean::NEEDS_SECOND;
use crate::ply::PlyFile;
use crate::register::icp::{Motion, Target, rounds};
use crate::search::Search;
use crate::surfels::{Surfels, finite, median, spacings};
use crate::transform::Placement;
use surfelshop_api::glam::{DMat3, DQuat, DVec3};
use surfelshop_api::params::PLACE_PAIRS;
use surfelshop_api::prelude::*;
use surfelshop_geometry::hashing::scattered;
use surfelshop_geometry::{Bounds, eigen};

choices! {
    /// Where the cloud is moved before it is fitted.
    pub enum Start {
        /// Nowhere.
        Place = "place",
        /// Its middle onto that of the other.
        Centres = "centres",
        /// Its main axes onto those of the other.
        Axes = "axes",
        /// Places onto those that are the same.
        Pairs = "pairs",
    }
}

params! {
    /// Settings of `register`.
    pub struct Settings {
        /// The cloud that stays: a PLY file.
        to: FilePath { default: FilePath::default(), endings: &["ply"] },
        /// Where the fit starts: where the cloud is (place), with the middles on each other
        /// (centres), the main axes too (axes), or typed places on each other (pairs).
        start: Start { default: Start::Place },
        /// Places of the cloud and of the other one that are the same, three or more: `x y z x y z; x y z x y z`.
        pairs: String { default: String::new(), unit: PLACE_PAIRS },
        /// Share of the surfels that have a counterpart.
        overlap: f64 { default: 0.8, range: 0.1..=1.0 },
        /// Most rounds of each of three steps.
        rounds: u32 { default: 60, range: 1..=1000, quality: true, logarithmic: true },
        /// Surfels that are compared in the last step.
        samples: u32 { default: 20_000, range: 100..=1_000_000, quality: true, logarithmic: true },
    }
}

/// The tool.
pub(crate) struct Register;

/// Surfels of the first two steps.
const COARSE: [usize; 2] = [500, 3000];

impl Tool for Register {
    const INFO: UnitInfo =
        UnitInfo::new("register", "Register", "Moves a cloud onto another one of the same thing.");
    type Params = Settings;
    const LIMITS: &'static [LimitInfo] = &[
        LimitInfo::new("outputs", NEEDS_SECOND),
        LimitInfo::new("threads", NEEDS_SECOND),
        LimitInfo::new("again", NEEDS_SECOND),
        LimitInfo::new("reordered", NEEDS_SECOND),
    ];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let surfels = Surfels::of(cloud)?;
        let overlap = finite("overlap", params.overlap)?;
        if params.to.is_empty() {
            return Err(Error::new("expected the cloud that stays in `to`, found no file"));
        }
        let by_pairs = match (params.start, params.pairs.trim().is_empty()) {
            (Start::Pairs, _) => Some(pairs::motion(&params.pairs, cloud.origin)?),
            (_, true) => None,
            (_, false) => {
                return Err(Error::new("expected `start=pairs` with `pairs`, found another"));
            }
        };
        job.progress(0.0, "reading the other cloud");
        let file = PlyFile::read(params.to.as_path())?;
        let others = file.surfels(cloud.origin, job, 0.0..0.1)?;
        let search = Search::build(&others.places, job)?;
        let apart = spacings(&search, &others.places, job, 0.1..0.2)?;
        let spacing = median(apart.into_iter()).unwrap_or(0.0);
        let target = Target { surfels: &others, search: &search, spacing };
        let order = order(surfels.places.len());
        let sizes = COARSE.into_iter().chain([params.samples as usize]);
        let steps: Vec<&[u32]> = sizes.map(|n| &order[..n.min(order.len())]).collect();
        job.progress(0.2, "fitting a few surfels");
        let mut n_rounds = 0;
        let mut fit = |start: Motion, step: usize, share| {
            let found =
                rounds(&surfels, steps[step], &target, start, (overlap, params.rounds), job, share);
            found.inspect(|fit| n_rounds += fit.rounds)
        };
        let starts = starts(&surfels, &others, params.start, by_pairs);
        let mut best = None;
        for (i, start) in starts.iter().enumerate() {
            let at = |i: usize| 0.2 + 0.2 * i as f64 / starts.len() as f64;
            let found = fit(*start, 0, at(i)..at(i + 1))?;
            let is_better = |best: &icp::Fit| found.residual < best.residual;
            if best.as_ref().is_none_or(is_better) {
                best = Some(found);
            }
        }
        let best = best.ok_or_else(|| Error::new("expected a start, found none"))?;
        job.progress(0.4, "fitting more surfels");
        let finer = fit(best.motion, 1, 0.4..0.55)?;
        job.progress(0.55, "fitting most surfels");
        let last = fit(finer.motion, 2, 0.55..0.9)?;
        if last.n_pairs < 6 {
            return Err(Error::new(format!(
                "{}: expected surfels that face as those of the cloud do near them, found {} pairs; \
                 try `start=axes`",
                params.to, last.n_pairs
            )));
        }
        let Motion { turn, translation } = last.motion;
        // The motion of offsets from the cloud's origin, as one of places.
        let translation = translation + cloud.origin - turn * cloud.origin;
        let bounds = Bounds::of(surfels.places.iter().copied());
        let (middle, extent) = bounds.map_or((DVec3::ZERO, 1.0), |b| (b.centre(), b.extent()));
        let middle = cloud.origin + middle;
        let about_middle = translation + turn * middle - middle;
        let ended = if last.settled { "" } else { ", not settled" };
        let words = format!(
            "; RMS {:.3e}, {:.0} % in pairs, {n_rounds} rounds{ended}: about=centre {}",
            last.residual,
            100.0 * last.n_pairs as f64 / steps[2].len() as f64,
            as_transform(turn, about_middle, extent)
        );
        Placement::rigid(turn, translation).stage(cloud, job, &words)
    }
}

/// A motion of a cloud of some extent as parameters of `transform`, to a millionth of a degree and of about
/// the extent.
fn as_transform(turn: DQuat, t: DVec3, extent: f64) -> String {
    let m = DMat3::from_quat(turn);
    let y = -m.x_axis.z.clamp(-1.0, 1.0).asin();
    // Looking along the turned axis, only the sum of the other two angles counts.
    let is_upright = m.x_axis.z.abs() > 1.0 - 1e-12;
    let (x, z) = if is_upright {
        (0.0, (-m.y_axis.x).atan2(m.y_axis.y))
    } else {
        (m.y_axis.z.atan2(m.z_axis.z), m.x_axis.y.atan2(m.x_axis.x))
    };
    let [x, y, z] = [x, y, z].map(f64::to_degrees);
    let digits = (6.0 - extent.log10().floor()).clamp(0.0, 15.0) as usize;
    let named = [
        ("rotate-x", x, 6),
        ("rotate-y", y, 6),
        ("rotate-z", z, 6),
        ("translate-x", t.x, digits),
        ("translate-y", t.y, digits),
        ("translate-z", t.z, digits),
    ];
    let words = named.map(|(name, value, digits)| format!("{name}={value:.digits$}"));
    words.join(" ")
}

/// Numbers of surfels in an order that looks random and is always the same.
fn order(n: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by_cached_key(|&i| (scattered(u64::from(i)), i));
    order
}

/// Where the fit may start.
fn starts(
    surfels: &Surfels,
    others: &Surfels,
    start: Start,
    by_pairs: Option<Motion>,
) -> Vec<Motion> {
    let middle = |places: &[DVec3]| places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    let box_of = |places: &[DVec3]| Bounds::of(places.iter().copied()).map(|b| b.centre());
    let (own, other) = (middle(&surfels.places), middle(&others.places));
    let onto = |turn: DQuat| Motion { turn, translation: other - turn * own };
    match start {
        Start::Place => vec![Motion::default()],
        Start::Pairs => by_pairs.into_iter().collect(),
        Start::Centres => {
            let boxes = box_of(&surfels.places).zip(box_of(&others.places));
            let by_box = boxes
                .map(|(own, other)| Motion { turn: DQuat::IDENTITY, translation: other - own });
            [onto(DQuat::IDENTITY)].into_iter().chain(by_box).collect()
        }
        Start::Axes => {
            let (a, b) = (axes(&surfels.places, own), axes(&others.places, other));
            let turns = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
            let turn = |(x, y): (f64, f64)| {
                let turned = DMat3::from_cols(x * a.x_axis, y * a.y_axis, x * y * a.z_axis);
                onto(DQuat::from_mat3(&(b * turned.transpose())).normalize())
            };
            turns.into_iter().map(turn).collect()
        }
    }
}

/// The right-handed main axes of places.
fn axes(places: &[DVec3], middle: DVec3) -> DMat3 {
    let extent = Bounds::of(places.iter().copied()).map_or(1.0, |bounds| bounds.extent());
    let mut sum = DMat3::ZERO;
    for place in places {
        let d = (*place - middle) / extent;
        sum += DMat3::from_cols(d.x * d, d.y * d, d.z * d);
    }
    let [a, b, _] = eigen::symmetric(sum).vectors;
    DMat3::from_cols(a, b, a.cross(b))
}
