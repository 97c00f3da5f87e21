//! Creases: the lines at which the face that a splat lies on meets another.
//!
//! Where a sample of a splat is near one of another face, the plane of that one meets the splat's in a
//! line, and the splat ends there. All such lines of a splat are gathered into two at most.

use super::clip::{CreaseLine, Cut, Line};
use super::context::GrowthContext;
use super::plane::{Axes, Plane};
use surfelshop_api::glam::DVec2;

/// The line of one pair of samples in the splat's plane, scene directions, from the plane's middle.
#[derive(Clone, Copy)]
struct PairLine {
    /// Unit vector towards what stays.
    inwards: DVec2,
    /// The point of the line that is nearest to the sample.
    at: DVec2,
    /// How far the line that stands for this may be from it.
    slack: f64,
    /// The sample of the other face.
    across: u32,
}

/// Cosine of the widest angle between the line of a pair and the one that stands for it.
const ALONG: f64 = 0.9;

/// Sine of the least angle between planes that meet in a line.
pub(crate) const LEAST_ANGLE: f64 = 0.25;

/// How far from a sample its face may end, in discs of both samples: farther, it is not the end that the
/// pair is about.
const NEAR: f64 = 1.5;

/// Share of a sample's disc that a line may be off there, beside a half of the tolerance: edges that curve
/// are cut in pieces that are straight to within this.
const SLACK: f64 = 0.1;

/// Lines that are tried to stand for others.
const TRIED: usize = 24;

/// Share of the pairs that no line needs to stand for: samples have noise.
const STRAY: usize = 100;

/// Fewest pairs that a line to cut at stands for.
const FEWEST: usize = 2;

/// Whether two lines are enough to cut a region where it borders on other faces.
pub(crate) fn can_cut(context: &GrowthContext<'_>, plane: &Plane, members: &[u32]) -> bool {
    let near = edge(context, members);
    let axes = Axes::across(plane.normal);
    near.is_empty() || exact(context, plane, &axes, &near, members).is_some()
}

/// Samples of a region and beside it that are on the edge of a face: an ellipse around the region may
/// reach over that edge too.
pub(crate) fn edge(context: &GrowthContext<'_>, region: &[u32]) -> Vec<u32> {
    let graph = context.graph;
    let by_edge = region.iter().copied().filter(|&i| graph.by_edge[i as usize]);
    let around = by_edge.flat_map(|i| std::iter::once(i).chain(graph.joined.of(i).iter().copied()));
    let mut near: Vec<u32> = around.filter(|&i| !graph.across.of(i).is_empty()).collect();
    near.sort_unstable();
    near.dedup();
    near
}

/// The lines at which the faces of samples `near` end; `members` stay. Nothing where two do not suffice.
fn exact(
    context: &GrowthContext<'_>,
    plane: &Plane,
    axes: &Axes,
    near: &[u32],
    members: &[u32],
) -> Option<Cut> {
    let locals: Vec<PairLine> =
        near.iter().flat_map(|&i| locals(context, plane, axes, i)).collect();
    let strays = (locals.len() / STRAY).max(1);
    let (lines, n_left) = lines(locals, 1);
    if n_left > strays {
        return None;
    }
    keep(lines, &stays(context, plane, axes, members))
}

/// The lines that cut a splat best: where those found would cut off samples, as lines of a face do that
/// ends beside it, fewer of them.
pub(crate) fn cut(
    context: &GrowthContext<'_>,
    plane: &Plane,
    axes: &Axes,
    near: &[u32],
    members: &[u32],
) -> Cut {
    let locals: Vec<PairLine> =
        near.iter().flat_map(|&i| locals(context, plane, axes, i)).collect();
    let (lines, _) = lines(locals, FEWEST);
    let stays = stays(context, plane, axes, members);
    if let Some(both) = keep(lines.clone(), &stays) {
        return both;
    }
    let single = lines.into_iter().filter_map(|line| keep(vec![line], &stays));
    single.reduce(|a, _| a).unwrap_or_default()
}

/// At most two lines that stand for as many of all as they can, each for at least so many; and how many
/// none stands for.
fn lines(mut locals: Vec<PairLine>, fewest: usize) -> (Vec<CreaseLine>, usize) {
    let mut found = Vec::new();
    while found.len() < 2 && !locals.is_empty() {
        let (line, n) = best(&locals);
        if n < fewest.max(1) {
            break;
        }
        let (met, rest): (Vec<PairLine>, Vec<PairLine>) =
            locals.iter().partition(|local| fits(&line, local));
        locals = rest;
        found.push(CreaseLine {
            line,
            at: met.iter().map(|local| (local.at, local.across)).collect(),
        });
    }
    (found, locals.len())
}

/// Where samples of a splat are, and how far off each a line may be.
fn stays(
    context: &GrowthContext<'_>,
    plane: &Plane,
    axes: &Axes,
    members: &[u32],
) -> Vec<(DVec2, f64)> {
    let place = |&i: &u32| {
        let at = axes.of(context.samples.point(i) - plane.at);
        (at, slack(context, i))
    };
    members.iter().map(place).collect()
}

/// Moves lines outwards until all samples stay; nothing where one would have to move by more than a
/// sample's slack.
fn keep(lines: Vec<CreaseLine>, samples: &[(DVec2, f64)]) -> Option<Cut> {
    let keeps = |met: &CreaseLine, at: DVec2, slack: f64| met.line.of(at) >= -slack;
    let all = samples.iter().all(|&(at, slack)| lines.iter().all(|line| keeps(line, at, slack)));
    let mut cut = Cut { lines, either: !all };
    if cut.either && !is_reflex(&cut.lines) {
        return None;
    }
    for &(at, slack) in samples {
        let values: Vec<f64> = cut.lines.iter().map(|met| met.line.of(at)).collect();
        if cut.either {
            let nearest = usize::from(values[1] > values[0]);
            if values[nearest] < -slack {
                return None;
            }
            cut.lines[nearest].line.offset += (-values[nearest]).max(0.0);
        } else {
            for (met, value) in cut.lines.iter_mut().zip(values) {
                met.line.offset += (-value).max(0.0);
            }
        }
    }
    Some(cut)
}

/// Whether two lines meet in a corner that goes inwards: each goes on where the other cuts off.
fn is_reflex(lines: &[CreaseLine]) -> bool {
    let [a, b] = lines else { return false };
    let beyond = |met: &CreaseLine, other: &CreaseLine| {
        let values = met.at.iter().map(|(at, _)| other.line.of(*at));
        values.sum::<f64>() < 0.0
    };
    beyond(a, b) && beyond(b, a)
}

/// The lines that a sample's neighbours on other faces make in the plane of a splat.
fn locals<'a>(
    context: &'a GrowthContext<'_>,
    plane: &'a Plane,
    axes: &'a Axes,
    i: u32,
) -> impl Iterator<Item = PairLine> + 'a {
    let (samples, graph) = (context.samples, context.graph);
    let across = graph.across.of(i);
    let at = axes.of(samples.point(i) - plane.at);
    across.iter().filter_map(move |&other| {
        let (point, normal) = (samples.point(other), samples.normal(other));
        let direction = axes.of(normal);
        let steepness = direction.length();
        if steepness < LEAST_ANGLE {
            return None;
        }
        let outwards = direction / steepness;
        // Distance from the other plane along the splat's.
        let offset = normal.dot(plane.at - point) / steepness;
        // Where the other face falls away from this one, what is below it stays; where it rises, what is
        // above. Samples around the other tell, since one on the edge itself does neither.
        let around = graph.joined.of(other).iter().chain([&other]);
        let rise: f64 =
            around.map(|&j| samples.normal(i).dot(samples.point(j) - samples.point(i))).sum();
        let sign = rise.signum();
        let line = Line { inwards: outwards * sign, offset: offset * sign };
        let distance = line.of(at);
        let discs = samples.disc(i) + samples.disc(other);
        let slack = slack(context, i);
        let is_near = distance <= NEAR * discs && distance >= -slack;
        let found = PairLine {
            inwards: line.inwards,
            at: at - line.inwards * distance,
            slack,
            across: other,
        };
        is_near.then_some(found)
    })
}

/// How far a line may be off at a sample.
fn slack(context: &GrowthContext<'_>, sample: u32) -> f64 {
    0.5 * context.tolerance + SLACK * context.samples.disc(sample)
}

fn fits(line: &Line, local: &PairLine) -> bool {
    line.inwards.dot(local.inwards) >= ALONG && line.of(local.at).abs() <= local.slack
}

/// The line that stands for most, and for how many.
fn best(locals: &[PairLine]) -> (Line, usize) {
    let of =
        |local: &PairLine| Line { inwards: local.inwards, offset: -local.inwards.dot(local.at) };
    let count = |line: &Line| locals.iter().filter(|local| fits(line, local)).count();
    let stride = locals.len().div_ceil(TRIED).max(1);
    let mut found = (of(&locals[0]), 0);
    for local in locals.iter().step_by(stride) {
        let line = of(local);
        let n = count(&line);
        if n > found.1 {
            found = (line, n);
        }
    }
    // The mean of all it stands for, where that stands for as many.
    let met = || locals.iter().filter(|local| fits(&found.0, local));
    let inwards: DVec2 = met().map(|local| local.inwards).sum();
    if let Some(inwards) = inwards.try_normalize() {
        let offsets: f64 = met().map(|local| -inwards.dot(local.at)).sum();
        let mean = Line { inwards, offset: offsets / met().count().max(1) as f64 };
        let n = count(&mean);
        if n >= found.1 {
            return (mean, n);
        }
    }
    found
}
