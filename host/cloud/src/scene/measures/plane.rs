//! The plane through places that go around something.

use glam::{DVec2, DVec3};

/// A plane with axes in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) origin: DVec3,
    /// Unit, turned upwards.
    pub(super) normal: DVec3,
    across: DVec3,
    along: DVec3,
}

/// Twice the area of a polygon as a vector along its normal, whatever its shape; of differences, which are exact far
/// from the origin, too.
///
/// Source: Newell's method; Sutherland, Sproull and Schumacker 1974.
pub(super) fn twice_area(places: &[DVec3]) -> DVec3 {
    let Some(first) = places.first() else { return DVec3::ZERO };
    let pairs = places.windows(2);
    pairs.map(|pair| (pair[0] - *first).cross(pair[1] - *first)).sum()
}

impl Plane {
    /// The plane through the middle of places, with the normal of the polygon that they are; `None` where they enclose
    /// nothing.
    pub(super) fn through(places: &[DVec3], up: DVec3) -> Option<Self> {
        let first = places.first()?;
        let offsets: DVec3 = places.iter().map(|place| *place - *first).sum();
        let origin = *first + offsets / places.len() as f64;
        let twice = twice_area(places);
        let longest = places.iter().map(|place| place.distance_squared(*first)).fold(0.0, f64::max);
        // What rounding leaves of places on a line is no area.
        if twice.length() <= 1e-12 * longest {
            return None;
        }
        let normal = twice.try_normalize()?;
        let normal = if normal.dot(up) < 0.0 { -normal } else { normal };
        let (across, along) = normal.any_orthonormal_pair();
        Some(Self { origin, normal, across, along })
    }

    /// Where a place is in the plane, and how high above it.
    pub(super) fn local(&self, place: DVec3) -> (DVec2, f64) {
        let offset = place - self.origin;
        (DVec2::new(offset.dot(self.across), offset.dot(self.along)), offset.dot(self.normal))
    }
}

/// Whether a point is inside of a polygon: lines that leave it cross an odd number of edges.
pub(super) fn is_inside(polygon: &[DVec2], at: DVec2) -> bool {
    let mut inside = false;
    let mut before = polygon.len().saturating_sub(1);
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[before]);
        if (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        before = i;
    }
    inside
}

/// The area of a polygon; turned the other way it is negative.
fn signed_area(polygon: &[DVec2]) -> f64 {
    let Some(first) = polygon.first() else { return 0.0 };
    let pairs = polygon.windows(2);
    0.5 * pairs.map(|pair| (pair[0] - *first).perp_dot(pair[1] - *first)).sum::<f64>()
}

/// The area of what of a polygon lies in a box, whatever the shape of the polygon.
///
/// Source: Sutherland and Hodgman 1974; edges that clipping leaves twice enclose nothing.
pub(super) fn area_within(polygon: &[DVec2], low: DVec2, high: DVec2) -> f64 {
    let mut clipped = polygon.to_vec();
    for (axis, bound, sign) in
        [(0, low.x, 1.0), (0, high.x, -1.0), (1, low.y, 1.0), (1, high.y, -1.0)]
    {
        let depth = |at: &DVec2| sign * (at[axis] - bound);
        let mut next = Vec::with_capacity(clipped.len() + 4);
        let mut before = clipped.last().copied();
        for &at in &clipped {
            if let Some(from) = before {
                let (a, b) = (depth(&from), depth(&at));
                if (a < 0.0) != (b < 0.0) {
                    next.push(from.lerp(at, a / (a - b)));
                }
            }
            if depth(&at) >= 0.0 {
                next.push(at);
            }
            before = Some(at);
        }
        clipped = next;
    }
    signed_area(&clipped).abs()
}
