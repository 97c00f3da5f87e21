//! How a measure is drawn: lines, dots and a label, in world space.

use super::plane::twice_area;
use super::{Measure, MeasureKind, Profile};
use glam::{DQuat, DVec3};

/// Pieces of the arc of an angle.
const ARC: u32 = 24;

/// The radius of an arc, share of the shorter side.
const ARC_RADIUS: f64 = 0.35;

/// A line of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its ends, world space.
    pub ends: [DVec3; 2],
    /// Whether it only helps to read the figure.
    pub is_faint: bool,
}

/// How a measure is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Its lines.
    pub segments: Vec<Segment>,
    /// Its places, each with a dot.
    pub places: Vec<DVec3>,
    /// Where its label stands; `None` where there is no place.
    pub anchor: Option<DVec3>,
}

impl Figure {
    /// The figure of a measure, also of one that lacks places yet; `up` is a unit vector.
    #[must_use]
    pub fn of(measure: &Measure, up: DVec3) -> Self {
        let places = measure.places.clone();
        let line = |a: DVec3, b: DVec3| Segment { ends: [a, b], is_faint: false };
        let mut segments: Vec<Segment> =
            places.windows(2).map(|pair| line(pair[0], pair[1])).collect();
        let [Some(first), Some(last)] = [places.first(), places.last()] else {
            return Self::default();
        };
        let middle = first.midpoint(*last);
        let mut anchor = middle;
        match (measure.kind, &places[..]) {
            (MeasureKind::Distance, [_, _, _, ..]) => anchor = *last,
            (MeasureKind::Angle, [a, apex, b]) => {
                let (arc, at) = arc(*a, *apex, *b);
                segments.extend(arc.windows(2).map(|pair| line(pair[0], pair[1])));
                anchor = at;
            }
            (MeasureKind::Height, [a, b]) => {
                let corner = *a + (*b - *a).dot(up) * up;
                let faint = |from, to| Segment { ends: [from, to], is_faint: true };
                segments = vec![line(*a, corner), faint(corner, *b), faint(*a, *b)];
                anchor = a.midpoint(corner);
            }
            (MeasureKind::Area | MeasureKind::Volume, [_, _, _, ..]) => {
                segments.push(line(*last, *first));
                anchor = center(&places);
            }
            (MeasureKind::Profile, [a, b]) => segments.extend(slab(measure, *a, *b, up)),
            _ => {}
        }
        Self { segments, places, anchor: Some(anchor) }
    }
}

/// The arc of an angle, and a place in its middle.
fn arc(a: DVec3, apex: DVec3, b: DVec3) -> (Vec<DVec3>, DVec3) {
    let (first, second) = (a - apex, b - apex);
    let radius = ARC_RADIUS * first.length().min(second.length());
    let axis = first.cross(second).try_normalize();
    let (Some(axis), Some(start)) = (axis, first.try_normalize()) else {
        return (Vec::new(), apex);
    };
    let angle = first.angle_between(second);
    let at = |share: f64| apex + DQuat::from_axis_angle(axis, share * angle) * start * radius;
    ((0..=ARC).map(|i| at(f64::from(i) / f64::from(ARC))).collect(), at(0.5))
}

/// The middle of what places enclose, by its area; the mean of the places where they enclose nothing.
fn center(places: &[DVec3]) -> DVec3 {
    let Some(first) = places.first() else { return DVec3::ZERO };
    let whole = twice_area(places);
    let mean = *first + places.iter().map(|p| *p - *first).sum::<DVec3>() / places.len() as f64;
    let Some(normal) = whole.try_normalize() else { return mean };
    let parts = places.windows(2).map(|pair| {
        let (a, b) = (pair[0] - *first, pair[1] - *first);
        (a + b) / 3.0 * a.cross(b).dot(normal)
    });
    let at = *first + parts.sum::<DVec3>() / whole.length();
    if at.is_finite() { at } else { mean }
}

/// The edges of a profile's slab at the height of its line.
fn slab(measure: &Measure, a: DVec3, b: DVec3, up: DVec3) -> Vec<Segment> {
    let across = (b - a) - (b - a).dot(up) * up;
    let Some(along) = across.try_normalize() else { return Vec::new() };
    let half = 0.5 * measure.thickness.unwrap_or(Profile::USUAL_THICKNESS * across.length());
    let aside = up.cross(along) * half;
    let corners = [a - aside, b - aside, b + aside, a + aside];
    (0..4).map(|i| Segment { ends: [corners[i], corners[(i + 1) % 4]], is_faint: true }).collect()
}
