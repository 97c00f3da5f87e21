//! Fitting splats to regions: ellipses around the samples that each is the nearest to.

use super::clip::{CreaseLine, Cut};
use super::context::GrowthContext;
use super::creases;
use super::ellipse::Ellipse;
use super::normal_field::{Field, Normal};
use super::outline::{Outline, Splat};
use super::overhang;
use super::plane::{Plane, Shape};
use surfelshop_api::glam::{DVec2, DVec3};

/// Share of the tolerance that a region's shape has to make in height for the directions of its
/// curvature to be those of its axes; flatter ones follow where their samples lie.
const CURVED: f64 = 0.05;

/// The ellipse around the discs of samples in a plane, its axes along what suits the `members`.
pub(crate) fn outline(
    context: &GrowthContext<'_>,
    plane: Plane,
    members: &[u32],
    held: &[u32],
) -> Outline {
    let samples = context.samples;
    let shape = Shape::of(samples, members, &plane);
    let bend = (shape.curvatures[0] - shape.curvatures[1]).abs() * shape.spread;
    let axes = if bend < CURVED * context.tolerance {
        Shape::extents(samples, members, &plane)
    } else {
        shape.axes
    };
    let disc = |&i: &u32| (axes.of(samples.point(i) - plane.at), samples.disc(i));
    let discs: Vec<(DVec2, f64)> = held.iter().map(disc).collect();
    Outline { plane, axes, ellipse: Ellipse::around(&discs) }
}

/// The outline of a whole region.
pub(crate) fn whole(context: &GrowthContext<'_>, region: &[u32]) -> Outline {
    outline(context, Plane::fit(context.samples, region), region, region)
}

/// The splat of a region that has to hold the discs of the samples `held`, at least one: as small as it
/// can be, since where splats lie over each other they blur.
fn splat(context: &GrowthContext<'_>, region: &[u32], held: &[u32]) -> Splat {
    let samples = context.samples;
    let mut found = outline(context, Plane::fit(samples, region), region, held);
    let mut members = inside(context, &found, region, held);
    // The plane of what is inside suits it better; it is taken where it keeps within the tolerance.
    let plane = Plane::fit(samples, &members);
    if plane.height <= context.tolerance {
        let closer = outline(context, plane, &members, held);
        let stay = inside(context, &closer, region, held);
        if stay.iter().all(|&i| plane.height_of(samples.point(i)).abs() <= context.tolerance) {
            (found, members) = (closer, stay);
        }
    }
    let sum: DVec3 = members.iter().map(|&i| samples.normal(i)).sum();
    found.plane.mean = sum.try_normalize().unwrap_or(found.plane.normal);
    let normals = normals_of(context, &found, &members);
    let (field, fit) = Field::fit(&normals, found.plane.normal, &found.axes, found.plane.mean);
    let cut = if context.clip { lines(context, &found, region, &members) } else { Cut::default() };
    Splat { outline: found, members, field, fit, cut }
}

/// Cosine of the angle to the mean normal from which on a sample beside a splat's own is of its surface.
const ALIKE: f64 = 0.9;

/// What a splat's field is fitted to: its samples. Those in a row say nothing of the slope across it; then it is also
/// those near to them that the splat covers.
fn normals_of(context: &GrowthContext<'_>, found: &Outline, members: &[u32]) -> Vec<Normal> {
    let samples = context.samples;
    let normal = |&i: &u32| Normal { at: found.of(samples.point(i)), normal: samples.normal(i) };
    let own: Vec<Normal> = members.iter().map(normal).collect();
    if Field::is_told_by(&own) {
        return own;
    }
    let covered = |i: &u32| {
        let (point, plane) = (samples.point(*i), &found.plane);
        plane.height_of(point).abs() <= context.tolerance
            && found.of(point).length_squared() <= 1.0
            && samples.normal(*i).dot(plane.mean) >= ALIKE
    };
    let near = members.iter().flat_map(|&i| &samples.near[i as usize]).copied().filter(covered);
    let mut all: Vec<u32> = members.iter().copied().chain(near).collect();
    all.sort_unstable();
    all.dedup();
    all.iter().map(normal).collect()
}

/// Times that a splat is divided at most.
const MOST_DIVISIONS: u32 = 8;

/// Fewest samples that a splat is divided between.
const FEWEST: usize = 4;

/// Shares of its samples at which a splat is divided along its longer axis, or the other: in the middle,
/// where that helps, or else where the fewest parts stand out.
const DIVIDED: [(f64, bool); 6] =
    [(0.5, true), (0.25, true), (0.75, true), (0.5, false), (0.25, false), (0.75, false)];

/// The splats of a region that hold the discs of the samples `held`, and what each of them holds: one, or
/// where that would stand out, its parts.
pub(crate) fn splats(
    context: &GrowthContext<'_>,
    region: &[u32],
    held: &[u32],
) -> Vec<(Splat, Vec<u32>)> {
    let mut found = Vec::new();
    let mut open = vec![(Part::of(context, region, held.to_vec()), 0)];
    while let Some((part, divided)) = open.pop() {
        if !part.stands_out || divided >= MOST_DIVISIONS || part.held.len() < FEWEST {
            found.push((part.splat, part.held));
        } else {
            open.extend(part.divided(context, region).map(|part| (part, divided + 1)));
        }
    }
    found
}

/// A splat and what it holds.
struct Part {
    splat: Splat,
    held: Vec<u32>,
    stands_out: bool,
}

impl Part {
    fn of(context: &GrowthContext<'_>, region: &[u32], held: Vec<u32>) -> Self {
        let splat = splat(context, region, &held);
        let stands_out = overhang::stands_out(context, &splat, &held);
        Self { splat, held, stands_out }
    }

    /// Two parts that hold the same together.
    fn divided(&self, context: &GrowthContext<'_>, region: &[u32]) -> [Self; 2] {
        let divided = |(share, is_along): (f64, bool)| {
            let outline = &self.splat.outline;
            let is_u = (outline.ellipse.half.x >= outline.ellipse.half.y) == is_along;
            let along = |i: u32| {
                let at = outline.of(context.samples.point(i));
                if is_u { at.x } else { at.y }
            };
            let mut sorted = self.held.clone();
            sorted.sort_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
            let middle = (sorted.len() as f64 * share) as usize;
            let (first, second) = sorted.split_at(middle.clamp(1, sorted.len() - 1));
            [first, second].map(|held| Self::of(context, region, held.to_vec()))
        };
        let n_out = |parts: &[Self; 2]| parts.iter().filter(|part| part.stands_out).count();
        let mut best = divided(DIVIDED[0]);
        for &way in &DIVIDED[1..] {
            if n_out(&best) == 0 {
                break;
            }
            let parts = divided(way);
            if n_out(&parts) < n_out(&best) {
                best = parts;
            }
        }
        best
    }
}

/// Samples of a region whose centres are inside an outline, those it holds first.
fn inside(
    context: &GrowthContext<'_>,
    outline: &Outline,
    region: &[u32],
    held: &[u32],
) -> Vec<u32> {
    let others = region
        .iter()
        .copied()
        .filter(|&i| outline.of(context.samples.point(i)).length_squared() <= 1.0);
    let mut all: Vec<u32> = held.iter().copied().chain(others).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The lines that cut a splat, and only those that cut something off its ellipse.
fn lines(context: &GrowthContext<'_>, outline: &Outline, region: &[u32], members: &[u32]) -> Cut {
    let mut near = creases::edge(context, region);
    near.retain(|&i| outline.of(context.samples.point(i)).length_squared() <= REACH * REACH);
    creases::cut(context, &outline.plane, &outline.axes, &near, members)
}

/// Distance in half axes up to which samples tell where a splat is to be cut.
const REACH: f64 = 1.5;

/// Distance in half axes up to which a line has to reach the splats across: a little past the ellipse,
/// since lines have few points on small ones.
const ON: f64 = 1.1;

/// How far outwards each line of a splat has to move to reach the splats across it: their planes are off
/// the samples by as much as the tolerance, and what is between would be a crack.
pub(crate) fn moves<'a>(
    context: &GrowthContext<'_>,
    splat: &Splat,
    plane_of: impl Fn(u32) -> &'a Plane,
) -> Vec<f64> {
    let (axes, plane) = (&splat.outline.axes, &splat.outline.plane);
    let farthest = |met: &CreaseLine| {
        let inwards = axes.u * met.line.inwards.x + axes.v * met.line.inwards.y;
        // Beyond the ellipse there is nothing to move.
        let is_on = |at: DVec2| splat.outline.ellipse.of(at).length_squared() <= ON * ON;
        let reaches = met.at.iter().filter(|(at, _)| is_on(*at)).map(|(at, across)| {
            let other = plane_of(*across);
            let steepness = other.normal.dot(inwards);
            let point = plane.at + axes.u * at.x + axes.v * at.y;
            let beyond = other.height_of(point) / steepness;
            let is_near = beyond.abs() * steepness.abs() <= 2.0 * context.tolerance;
            let is_steep = steepness.abs() >= creases::LEAST_ANGLE;
            if is_near && is_steep { beyond - met.line.of(*at) } else { 0.0 }
        });
        reaches.fold(0.0, f64::max)
    };
    splat.cut.lines.iter().map(farthest).collect()
}
