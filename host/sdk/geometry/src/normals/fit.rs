//! Planes through the surroundings of points, at the scale that suits each.

use super::lines::{self, Across};
use super::orientation::{LINKS, PLACE_BITS, Run};
use super::plane::{LINE_WIDTH, Moments, Plane};
use super::steps::Steps;
use crate::neighbours::{Close, Neighbours, Scratch, Shared, Tree};
use crate::progress::{Cancelled, Progress, map_with, part, take_runs};
use glam::{DMat3, DVec3, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::ops::Range;

/// Roughness above which a larger neighbourhood is tried: that of a surface which turns by 20 degrees over it.
const ROUGH: f64 = 0.08;

/// Powers of the number of points with which the uncertainty of a plane must fall for a larger neighbourhood to be
/// better: it falls with the first where points are scattered about a plane, with the square root at an edge,
/// and not at all where the surface is curved.
const FALLS: f64 = 0.7;

/// The same where no plane shows at all.
const FALLS_SHAPELESS: f64 = 0.45;

/// Roughness from which on a neighbourhood shows no plane: it may lie within a layer of noise, of which no part
/// is flatter than another.
const SHAPELESS: f64 = 0.45;

/// Mean roughness of the nearest of a leaf's points from which on all of these lie within a layer of noise: of isotropic
/// noise it is 0.65 to 0.7, of a crease in any direction less than 0.5.
const THICK: f64 = 0.62;

/// Points of a neighbourhood within such a layer below which it may show a plane by chance: of many such neighbourhoods
/// some do, in any direction.
const CHANCE: f64 = 80.0;

/// The power for those: about what makes up for the least of several having been taken.
const FALLS_BY_CHANCE: f64 = 0.25;

/// Larger neighbourhoods that are no better until no more are tried, where a plane shows: what few points say is chance.
const PATIENCE: u32 = 2;

/// Deviation along the shorter side of a neighbourhood, in steps of the coordinates, from which on it holds several
/// steps.
const STEP_WIDTH: f64 = 0.75;

/// Shorter over longer side below which a neighbourhood holds too few rows of points to tell a plane: two
/// scan lines.
const SLENDER: f64 = 0.25;

/// Numbers of leaves that are tried where twice the points are better, about 100 to 800 points.
const LEAVES: [usize; 4] = [8, 16, 32, 64];

/// Points among which other lines are looked for, over those of a neighbourhood.
const LINES: usize = 4;

/// Leaves of a run, whose points are fitted by one thread, one after the other, and joined into patches of one sign:
/// so many that few links lead out of it.
const RUN: usize = 256;

const _: () = assert!(RUN * 16 <= 1 << PLACE_BITS);

/// What is known of a point's surroundings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Unit length.
    pub(super) normal: Vec3,
    /// In [0, 1]: see [`Plane::roughness`].
    pub(super) roughness: f32,
    /// Standard deviation across the plane, units of the search.
    pub(super) error: f32,
    /// About the angle by which the normal may be off, radians; a right angle where the points span no plane.
    pub(super) uncertainty: f32,
}

impl Fit {
    pub(super) fn is_degenerate(&self) -> bool {
        self.uncertainty >= FRAC_PI_2
    }
}

impl From<Plane> for Fit {
    fn from(plane: Plane) -> Self {
        Self {
            normal: plane.normal.as_vec3(),
            roughness: if plane.degenerate { 1.0 } else { plane.roughness as f32 },
            error: plane.error as f32,
            // At most 1.57, of which there is less than a right angle.
            uncertainty: match plane.degenerate {
                true => FRAC_PI_2,
                false => plane.uncertainty().atan() as f32,
            },
        }
    }
}

/// What is known of the surroundings of all points, by place.
#[derive(Debug, Default)]
pub(super) struct Fits {
    pub(super) normals: Vec<Vec3>,
    pub(super) roughness: Vec<f32>,
    pub(super) errors: Vec<f32>,
    pub(super) uncertainty: Vec<f32>,
}

impl Fits {
    pub(super) fn len(&self) -> usize {
        self.normals.len()
    }

    pub(super) fn at(&self, place: usize) -> Fit {
        Fit {
            normal: self.normals[place],
            roughness: self.roughness[place],
            error: self.errors[place],
            uncertainty: self.uncertainty[place],
        }
    }

    fn extend(&mut self, fits: &[Fit]) {
        self.normals.extend(fits.iter().map(|fit| fit.normal));
        self.roughness.extend(fits.iter().map(|fit| fit.roughness));
        self.errors.extend(fits.iter().map(|fit| fit.error));
        self.uncertainty.extend(fits.iter().map(|fit| fit.uncertainty));
    }
}

/// Scratch for the work on a run of points.
#[derive(Default)]
struct RunScratch {
    near: Shared,
    wider: Shared,
    widest: Shared,
    offsets: Vec<DVec3>,
    coarse: Scratch,
    points: Vec<DVec3>,
    fits: Vec<Fit>,
    links: Vec<[u32; LINKS]>,
    /// What the nearest of the points of a leaf say.
    firsts: Vec<Best>,
}

/// Fits a plane to each point; `take` gets what `finish` makes of each run of points, in their order. What is kept of
/// it belongs into few large pieces of memory: between many small ones of threads what is let go stays unused.
pub(super) fn all<T: Send>(
    neighbours: &Neighbours,
    k: usize,
    progress: Progress<'_>,
    finish: impl Fn(&Run<'_>) -> T + Sync,
    mut take: impl FnMut(T),
) -> Result<Fits, Cancelled> {
    let coarse = Coarse::build(neighbours, &part(progress, 0.0..0.04))?;
    let steps = Steps::of(neighbours, &part(progress, 0.04..0.05))?;
    let tree = neighbours.tree();
    let all = Fitting { neighbours, coarse: &coarse, steps: &steps, k };
    let fitting = part(progress, 0.05..1.0);
    let mut fits = Fits::default();
    for column in [&mut fits.roughness, &mut fits.errors, &mut fits.uncertainty] {
        column.reserve_exact(tree.len());
    }
    fits.normals.reserve_exact(tree.len());
    let n_runs = tree.n_leaves().div_ceil(RUN);
    let work = |scratch: &mut RunScratch, run: usize| {
        let leaves = run * RUN..((run + 1) * RUN).min(tree.n_leaves());
        let places = tree.leaf(leaves.start).start..tree.leaf(leaves.end - 1).end;
        scratch.fits.clear();
        scratch.links.clear();
        leaves.for_each(|leaf| all.fit_leaf(leaf, scratch));
        let (fits, links) = (&scratch.fits, &scratch.links);
        (fits.clone(), finish(&Run { neighbours, places, fits, links }))
    };
    take_runs(n_runs, &fitting, RunScratch::default, work, |(run, result)| {
        fits.extend(&run);
        take(result);
    })?;
    Ok(fits)
}

/// What planes are fitted to.
struct Fitting<'a> {
    neighbours: &'a Neighbours,
    coarse: &'a Coarse,
    steps: &'a Steps,
    k: usize,
}

impl Fitting<'_> {
    /// The plane across lines at a point.
    fn across(&self, place: usize, scratch: &mut RunScratch) -> Option<Across> {
        let near = scratch.widest.nearest(self.neighbours.tree(), place, LINES * self.k);
        let here = self.neighbours.point(place);
        scratch.offsets.clear();
        scratch
            .offsets
            .extend(near.iter().map(|close| self.neighbours.point(close.place()) - here));
        Across::of(&scratch.offsets)
    }

    /// Fits the points of a leaf.
    fn fit_leaf(&self, leaf: usize, scratch: &mut RunScratch) {
        let Self { neighbours, coarse, k, .. } = self;
        let tree = neighbours.tree();
        let mut firsts = std::mem::take(&mut scratch.firsts);
        firsts.clear();
        firsts.extend(tree.leaf(leaf).map(|place| self.first(place, scratch)));
        let sum: f64 = firsts.iter().map(|first| first.plane.roughness).sum();
        let is_thick = sum > THICK * firsts.len() as f64;
        let mut around: Option<Vec<u32>> = None;
        for (place, first) in tree.leaf(leaf).zip(firsts.drain(..)) {
            let mut best = Best { is_thick, ..first };
            if best.is_wanting() {
                let grain = grain(neighbours, place);
                let near = scratch.wider.nearest(tree, place, 2 * k);
                best.try_wider(plane(neighbours, place, near, grain, &mut scratch.points));
                let point = neighbours.point(place);
                for &count in &LEAVES {
                    if !best.is_wanting() {
                        break;
                    }
                    let around =
                        around.get_or_insert_with(|| coarse.around(leaf, &mut scratch.coarse));
                    best.try_wider(coarse.plane(&around[..count.min(around.len())], point, grain));
                }
            }
            scratch.fits.push(best.plane.into());
        }
        scratch.firsts = firsts;
    }

    /// What the nearest of a point say, which it is linked with.
    fn first(&self, place: usize, scratch: &mut RunScratch) -> Best {
        let Self { neighbours, steps, k, .. } = self;
        let near = scratch.near.nearest(neighbours.tree(), place, (*k).max(LINKS));
        let mut links = [place as u32; LINKS];
        for (link, close) in links.iter_mut().zip(near) {
            *link = close.place() as u32;
        }
        let (own, grain) = (&near[..near.len().min(*k)], grain(neighbours, place));
        let first = plane(neighbours, place, own, grain, &mut scratch.points);
        let least = STEP_WIDTH * steps.at(neighbours.point(place));
        let (here, others) = (scratch.points[0], &scratch.points[1..]);
        // Points of one step lie in rows that are no scan lines.
        let is_line = least <= 0.0 && lines::are_line(first.normal, here, others, own);
        let across = if is_line { self.across(place, scratch) } else { None };
        let plane = match &across {
            Some(across) if !across.agrees_with(&first) => across.plane,
            _ => first,
        };
        scratch.links.push(links);
        Best { plane, failures: 0, least, across, is_thick: false }
    }
}

/// The best plane so far of neighbourhoods that grow.
struct Best {
    plane: Plane,
    /// Larger neighbourhoods that were no better since.
    failures: u32,
    /// The least deviation along the shorter side of a neighbourhood that is no part of a step.
    least: f64,
    /// Where the nearest are of one line: what shows which planes are of the surface.
    across: Option<Across>,
    /// Whether it lies within a layer of noise.
    is_thick: bool,
}

impl Best {
    /// Whether a larger neighbourhood is worth trying.
    fn is_wanting(&self) -> bool {
        let is_rough = self.plane.roughness > ROUGH || self.plane.width < SLENDER;
        let is_step = self.plane.side < self.least;
        let is_shapeless = self.is_thick || self.plane.roughness > SHAPELESS;
        is_step || is_rough && (self.failures < PATIENCE || is_shapeless)
    }

    /// Takes a larger neighbourhood where it tells more.
    fn try_wider(&mut self, wider: Plane) {
        let plane = &self.plane;
        let is_wider = plane.width < SLENDER && wider.width > 1.2 * plane.width;
        let falls = match plane.roughness > SHAPELESS {
            _ if self.is_thick && plane.count < CHANCE => FALLS_BY_CHANCE,
            true => FALLS_SHAPELESS,
            false => FALLS,
        };
        let share = (plane.count / wider.count).powf(falls);
        let is_surer = wider.uncertainty() < share * plane.uncertainty();
        // A larger part of a step is no worse; a mixture of surfaces is.
        let leaves_step = plane.side < self.least && wider.roughness < SHAPELESS;
        let is_better = plane.degenerate || is_wider || is_surer || leaves_step;
        let agrees = self.across.as_ref().is_none_or(|across| across.agrees_with(&wider));
        if !wider.degenerate && is_better && agrees {
            (self.plane, self.failures) = (wider, 0);
        } else {
            self.failures += 1;
        }
    }
}

/// The plane through a point and those near to it.
fn plane(
    neighbours: &Neighbours,
    place: usize,
    near: &[Close],
    grain: f64,
    points: &mut Vec<DVec3>,
) -> Plane {
    points.clear();
    points.push(neighbours.point(place));
    points.extend(near.iter().map(|close| neighbours.point(close.place())));
    let mut plane = Plane::through(&Moments::of(points), grain, LINE_WIDTH);
    if near.len() < 2 {
        plane.degenerate = true;
    }
    plane
}

/// One rounding step of an f32 coordinate here, units of the search: positions do not tell apart what is
/// closer together.
fn grain(neighbours: &Neighbours, place: usize) -> f64 {
    neighbours.point(place).abs().max_element() * f64::from(f32::EPSILON)
}

/// Width up to which points of leaves are a line, a share of its length: their squares are sums in f32, which are exact to
/// 2^-24 and of which a width is the root, four times that.
const COARSE_LINE_WIDTH: f64 = 1e-3;

/// Sums over the points of each leaf, and which leaves are near which.
struct Coarse {
    /// By leaf, in units of the search.
    leaves: Vec<Leaf>,
    /// The middles of the leaves.
    tree: Tree,
    /// For each leaf its place in the tree.
    place: Vec<u32>,
}

/// What is kept of a leaf's points.
#[derive(Clone, Copy)]
struct Leaf {
    count: f32,
    /// As exact as points are.
    mean: Vec3,
    /// xx, yy, zz, xy, xz, yz
    spread: [f32; 6],
}

impl Leaf {
    fn of(neighbours: &Neighbours, range: Range<usize>) -> Self {
        let points: Vec<DVec3> = range.map(|place| neighbours.point(place)).collect();
        let moments = Moments::of(&points);
        let m = &moments.spread;
        let spread = [m.x_axis.x, m.y_axis.y, m.z_axis.z, m.y_axis.x, m.z_axis.x, m.z_axis.y];
        let spread = spread.map(|sum| sum as f32);
        Self { count: moments.weight as f32, mean: moments.mean.as_vec3(), spread }
    }

    /// The sums, relative to a point.
    fn from(&self, point: DVec3) -> Moments {
        let [xx, yy, zz, xy, xz, yz] = self.spread.map(f64::from);
        let spread = DMat3::from_cols(
            DVec3::new(xx, xy, xz),
            DVec3::new(xy, yy, yz),
            DVec3::new(xz, yz, zz),
        );
        Moments { weight: f64::from(self.count), mean: self.mean.as_dvec3() - point, spread }
    }
}

impl Coarse {
    fn build(neighbours: &Neighbours, progress: Progress<'_>) -> Result<Self, Cancelled> {
        let tree = neighbours.tree();
        let leaves = map_with(
            tree.n_leaves(),
            &part(progress, 0.0..0.5),
            || (),
            |(), leaf| Leaf::of(neighbours, tree.leaf(leaf)),
        )?;
        let middles = leaves.iter().map(|leaf| leaf.mean);
        let (tree, place) = Tree::of_points(middles, &part(progress, 0.5..1.0))?;
        Ok(Self { leaves, tree, place })
    }

    /// The leaves nearest to a leaf, itself first.
    fn around(&self, leaf: usize, scratch: &mut Scratch) -> Vec<u32> {
        let most = LEAVES[LEAVES.len() - 1] - 1;
        let near = scratch.nearest(&self.tree, self.place[leaf] as usize, most);
        let near = near.iter().map(|found| self.tree.index(found.place as usize) as u32);
        std::iter::once(leaf as u32).chain(near).collect()
    }

    /// The plane through the points of leaves, of which those near to the point weigh most.
    fn plane(&self, leaves: &[u32], point: DVec3, grain: f64) -> Plane {
        let leaf = |&leaf: &u32| &self.leaves[leaf as usize];
        let away = |leaf: &Leaf| leaf.mean.as_dvec3().distance_squared(point);
        let reach = leaves.iter().map(|l| away(leaf(l))).fold(0.0, f64::max) * 1.2;
        if reach <= 0.0 {
            return Plane::through(&Moments::NOTHING, grain, COARSE_LINE_WIDTH);
        }
        // The sums about the point are combined, and moved to the mean at the end: its surroundings are small.
        let (mut weight, mut weights, mut sum, mut squares) = (0.0, 0.0, DVec3::ZERO, DMat3::ZERO);
        for leaf in leaves.iter().map(leaf) {
            let factor = (1.0 - away(leaf) / reach).powi(2);
            let moments = leaf.from(point);
            let count = factor * moments.weight;
            weight += count;
            weights += factor * count;
            sum += moments.mean * count;
            squares += moments.spread * factor + super::plane::outer(moments.mean) * count;
        }
        let mean = sum / weight;
        let spread = squares - super::plane::outer(mean) * weight;
        // As many points of equal weight say as much.
        let count = weight * weight / weights.max(f64::MIN_POSITIVE);
        let moments = Moments { weight, mean, spread };
        Plane { count, ..Plane::through(&moments, grain, COARSE_LINE_WIDTH) }
    }
}
