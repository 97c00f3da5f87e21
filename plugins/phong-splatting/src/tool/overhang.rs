//! Where a splat stands out: over a place at which the surface falls away, or past the end of its face.

use super::clip::Line;
use super::context::GrowthContext;
use super::outline::{Outline, Splat};
use std::f64::consts::TAU;
use surfelshop_api::glam::DVec2;

/// Farthest that samples under or above a splat may lie from its plane, in tolerances. At the edge of a
/// round splat of a sphere it is 2; where a flat part ends in a round edge, much more.
const OVERHANG: f64 = 4.0;

/// How far past the last sample of a face that ends a splat may reach, in that sample's discs, beside a
/// tolerance: the end of the face is within one disc, and lines are off by less than the rest.
const PAST: f64 = 1.4;

/// Places along the edge of a splat that are looked at.
const PLACES: u32 = 96;

/// Whether a splat that holds some samples stands out.
pub(crate) fn stands_out(context: &GrowthContext<'_>, splat: &Splat, held: &[u32]) -> bool {
    let outline = &splat.outline;
    let discs: f64 = held.iter().map(|&i| context.samples.disc(i)).sum();
    let disc = discs / held.len().max(1) as f64;
    let under = context.under(outline, held, PAST * disc + context.tolerance);
    let falls_away = falls_away(context, outline, &under, disc);
    falls_away || context.clip && is_past_end(context, splat, &under)
}

/// Whether the surface falls away under a splat's edge. Discs reach over whatever there is, and do not
/// count.
fn falls_away(context: &GrowthContext<'_>, outline: &Outline, under: &[u32], disc: f64) -> bool {
    let inner = (outline.ellipse.half - disc).max(DVec2::ZERO) / outline.ellipse.half;
    let inner = inner.max(DVec2::splat(f64::MIN_POSITIVE));
    under.iter().any(|&i| {
        let point = context.samples.point(i);
        (outline.of(point) / inner).length_squared() <= 1.0
            && outline.plane.height_of(point).abs() > OVERHANG * context.tolerance
    })
}

/// Whether lines leave a part of a splat where its face has ended: the nearest of the samples under it is
/// farther away than that sample's disc, and by a crease. At borders of open surfaces ellipses may reach
/// over them, since nothing says that they end there.
fn is_past_end(context: &GrowthContext<'_>, splat: &Splat, under: &[u32]) -> bool {
    if !under.iter().any(|&i| context.graph.by_edge[i as usize]) {
        return false;
    }
    let (samples, outline) = (context.samples, &splat.outline);
    let place = |&i: &u32| outline.axes.of(samples.point(i) - outline.plane.at);
    let places: Vec<DVec2> = under.iter().map(place).collect();
    visible(splat).into_iter().any(|at| {
        let distances = places.iter().map(|other| other.distance_squared(at)).enumerate();
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.is_some_and(|(k, squared)| {
            let reach = PAST * samples.disc(under[k]) + context.tolerance;
            squared > reach * reach && context.graph.by_edge[under[k] as usize]
        })
    })
}

/// Places of a splat that its lines leave: along its edge and half way there, along the lines, and where
/// they meet.
fn visible(splat: &Splat) -> Vec<DVec2> {
    let (ellipse, cut) = (&splat.outline.ellipse, &splat.cut);
    let around = (0..PLACES).map(|k| DVec2::from_angle(f64::from(k) * TAU / f64::from(PLACES)));
    let mut places: Vec<DVec2> = around
        .flat_map(|direction| [1.0, 0.75, 0.5].map(|share| direction * share))
        .map(|at| ellipse.centre + at * ellipse.half)
        .collect();
    let lines: Vec<Line> = cut.lines.iter().map(|met| met.line).collect();
    for line in &lines {
        places.extend(chord(splat, line));
    }
    if let [a, b] = lines[..] {
        let area = a.inwards.perp_dot(b.inwards);
        let meet = (b.inwards.perp() * a.offset - a.inwards.perp() * b.offset) / area;
        places.extend(Some(meet).filter(|at| at.is_finite()));
    }
    let longest = ellipse.half.max_element();
    places.retain(|at| {
        let mut sides = lines.iter().map(|line| line.of(*at) >= -1e-9 * longest);
        let stays = if cut.either { sides.any(|side| side) } else { sides.all(|side| side) };
        stays && ellipse.of(*at).length_squared() <= 1.0 + 1e-9
    });
    places
}

/// Places along the part of a line that is in a splat's ellipse.
fn chord(splat: &Splat, line: &Line) -> impl Iterator<Item = DVec2> + use<> {
    // In units of the half axes the ellipse is a circle.
    let (centre, half) = (splat.outline.ellipse.centre, splat.outline.ellipse.half);
    let normal = line.inwards * half;
    let length = normal.length().max(f64::MIN_POSITIVE);
    let normal = normal / length;
    let foot = -normal * (line.of(centre) / length);
    let reach = (1.0 - foot.length_squared()).max(0.0).sqrt();
    let n = if foot.length_squared() <= 1.0 { PLACES / 4 } else { 0 };
    (0..=n).map(move |k| {
        let along = reach * (2.0 * f64::from(k) / f64::from(n.max(1)) - 1.0);
        centre + (foot + normal.perp() * along) * half
    })
}
