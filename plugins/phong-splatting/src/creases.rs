//! Lines that cut a splat where the face it lies on meets another.
//!
//! Where a sample of a splat is near one of another face, the plane of that one meets the splat's in a
//! line, and the splat ends there. All such lines of a splat are gathered into two at most.

use crate::plane::{Axes, Plane};
use crate::regions::Ground;
use surfelshop_api::glam::{DVec2, DVec3};

/// The line of one pair of samples in the splat's plane, scene directions, from the plane's middle.
#[derive(Clone, Copy)]
struct Local {
    /// Unit vector towards what stays.
    inwards: DVec2,
    /// The point of the line that is nearest to the sample.
    at: DVec2,
    /// How far the line that stands for this may be from it.
    slack: f64,
    /// The sample of the other face.
    across: u32,
}

/// A line: what stays is where inwards · x + offset is not negative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) inwards: DVec2,
    pub(crate) offset: f64,
}

impl Line {
    fn of(&self, at: DVec2) -> f64 {
        self.inwards.dot(at) + self.offset
    }
}

/// Lines that cut a splat, and the samples across each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cut {
    pub(crate) lines: Vec<Line>,
    /// Points of each line and the samples across it there.
    pub(crate) met: Vec<Vec<(DVec2, u32)>>,
    /// Whether what is on the side of either line stays, rather than of both.
    pub(crate) either: bool,
}

/// Cosine of the widest angle between the line of a pair and the one that stands for it.
const ALONG: f64 = 0.9;

/// Sine of the least angle between planes that meet in a line.
const LEAST_ANGLE: f64 = 0.25;

/// How far from a sample its face may end, in discs of both samples: farther, it is not the end that the
/// pair is about.
const NEAR: f64 = 1.5;

/// Share of a disc that a line may be off, beside the tolerance.
const SLACK: f64 = 0.25;

/// Lines that are tried to stand for others.
const TRIED: usize = 24;

/// Share of the pairs that no line needs to stand for: samples have noise.
const STRAY: usize = 20;

/// Fewest pairs that make a line.
const FEWEST: usize = 2;

/// Whether two lines are enough to cut a region where it borders on other faces.
pub(crate) fn can_cut(ground: &Ground<'_>, plane: &Plane, members: &[u32]) -> bool {
    if members.iter().all(|&i| ground.graph.across.of(i).is_empty()) {
        return true;
    }
    let axes = Axes::across(plane.normal);
    cut(ground, plane, &axes, members, members).is_some()
}

/// The lines at which the faces of samples `near` end; `members` stay. Nothing where two do not suffice.
pub(crate) fn cut(
    ground: &Ground<'_>,
    plane: &Plane,
    axes: &Axes,
    near: &[u32],
    members: &[u32],
) -> Option<Cut> {
    let mut locals: Vec<Local> =
        near.iter().flat_map(|&i| locals(ground, plane, axes, i)).collect();
    let mut found = Cut::default();
    let strays = locals.len() / STRAY;
    let mut n_left = 0;
    while !locals.is_empty() {
        let (line, n) = best(&locals);
        let (mut met, mut rest) = (Vec::new(), Vec::new());
        for local in locals {
            if fits(&line, &local) { met.push(local) } else { rest.push(local) }
        }
        locals = rest;
        if n < FEWEST || met.is_empty() {
            // What is left has nothing in common.
            n_left += met.len().max(1);
            if met.is_empty() {
                locals.pop();
            }
            continue;
        }
        if found.lines.len() == 2 {
            n_left += met.len();
            continue;
        }
        found.lines.push(line);
        found.met.push(met.iter().map(|local| (local.at, local.across)).collect());
    }
    if n_left > strays.max(FEWEST) {
        return None;
    }
    let slack = ground.tolerance;
    keep(
        &mut found,
        members.iter().map(|&i| {
            let at = axes.of(ground.samples.point(i) - plane.at);
            (at, slack + SLACK * ground.samples.disc(i))
        }),
    )
    .then_some(found)
}

/// Moves lines outwards until all samples stay; false where one would have to move by more than a
/// sample's slack.
fn keep(cut: &mut Cut, samples: impl Iterator<Item = (DVec2, f64)> + Clone) -> bool {
    let values =
        |cut: &Cut, at: DVec2| cut.lines.iter().map(|line| line.of(at)).collect::<Vec<_>>();
    let is_convex = samples.clone().all(|(at, slack)| values(cut, at).iter().all(|&d| d >= -slack));
    cut.either = !is_convex;
    if !is_convex && cut.lines.len() < 2 {
        return false;
    }
    for (at, slack) in samples {
        let values = values(cut, at);
        if cut.either {
            let nearest = usize::from(values[1] > values[0]);
            if values[nearest] < -slack {
                return false;
            }
            cut.lines[nearest].offset += (-values[nearest]).max(0.0);
        } else {
            for (line, value) in cut.lines.iter_mut().zip(values) {
                line.offset += (-value).max(0.0);
            }
        }
    }
    true
}

/// The lines that a sample's neighbours on other faces make in the plane of a splat.
fn locals<'a>(
    ground: &'a Ground<'_>,
    plane: &'a Plane,
    axes: &'a Axes,
    i: u32,
) -> impl Iterator<Item = Local> + 'a {
    let (samples, graph) = (ground.samples, ground.graph);
    let across = graph.across.of(i);
    let at = axes.of(samples.point(i) - plane.at);
    // The face's own side is told by the samples around, since one on the edge itself is on no side.
    let joined = if across.is_empty() { &[][..] } else { graph.joined.of(i) };
    let inside: DVec3 = joined.iter().map(|&j| samples.point(j)).sum();
    let inside = axes.of(inside / joined.len().max(1) as f64 - plane.at);
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
        let sign = (outwards.dot(inside) + offset).signum();
        let line = Line { inwards: outwards * sign, offset: offset * sign };
        let distance = line.of(at);
        let discs = samples.disc(i) + samples.disc(other);
        let slack = ground.tolerance + SLACK * samples.disc(i);
        let is_near = distance <= NEAR * discs && distance >= -slack;
        let found =
            Local { inwards: line.inwards, at: at - line.inwards * distance, slack, across: other };
        is_near.then_some(found)
    })
}

fn fits(line: &Line, local: &Local) -> bool {
    line.inwards.dot(local.inwards) >= ALONG && line.of(local.at).abs() <= local.slack
}

/// The line that stands for most, and for how many.
fn best(locals: &[Local]) -> (Line, usize) {
    let of = |local: &Local| Line { inwards: local.inwards, offset: -local.inwards.dot(local.at) };
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
