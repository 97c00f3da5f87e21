//! Smallest ellipses, their axes given, around discs in a plane.

use surfelshop_api::glam::DVec2;

/// An ellipse whose axes are those of the coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    pub(crate) centre: DVec2,
    pub(crate) half: DVec2,
}

/// Ratio of the axes beyond which an ellipse is not made narrower.
const LONGEST: f64 = 10.0;

/// Corners of the polygon that stands in for a disc.
const CORNERS: usize = 8;

/// Steps of the search for the ratio of the axes: each leaves 0.62 of the range, and 16 leave 0.2 percent.
const STEPS: usize = 16;

impl Ellipse {
    /// The smallest ellipse around discs: centres and radii. A polygon around each stands in for it, so
    /// that all of the disc is inside.
    ///
    /// The area of the smallest circle of stretched coordinates has one minimum over the stretch, since
    /// smallest ellipses with given axes are a convex problem; it is found by the golden section.
    pub(crate) fn around(discs: &[(DVec2, f64)]) -> Self {
        let reach = 1.0 / (std::f64::consts::PI / CORNERS as f64).cos();
        let corners: Vec<DVec2> = (0..CORNERS)
            .map(|i| DVec2::from_angle(std::f64::consts::TAU * i as f64 / CORNERS as f64) * reach)
            .collect();
        let points = discs.iter().flat_map(|(at, r)| corners.iter().map(move |c| *at + *c * *r));
        let hull = scattered(hull(points.collect()));
        let at = |log: f64| -> Self {
            let stretch = DVec2::new(log.exp(), (-log).exp());
            let stretched: Vec<DVec2> = hull.iter().map(|point| *point * stretch).collect();
            let (centre, radius) = circle(&stretched);
            Self { centre: centre / stretch, half: DVec2::splat(radius) / stretch }
        };
        let area = |log: f64| at(log).half.element_product();
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let most = 0.5 * LONGEST.ln();
        let (mut low, mut high) = (-most, most);
        let [mut a, mut b] = [high - golden * (high - low), low + golden * (high - low)];
        let [mut area_a, mut area_b] = [area(a), area(b)];
        for _ in 0..STEPS {
            if area_a <= area_b {
                (high, b, area_b) = (b, a, area_a);
                a = high - golden * (high - low);
                area_a = area(a);
            } else {
                (low, a, area_a) = (a, b, area_b);
                b = low + golden * (high - low);
                area_b = area(b);
            }
        }
        // A round ellipse, where it is as small, says so.
        let (found, round) = (at(low.midpoint(high)), at(0.0));
        let least = found.half.element_product();
        if round.half.element_product() <= least * (1.0 + 1e-3) { round } else { found }
    }

    /// Coordinates in units of the half axes.
    pub(crate) fn of(&self, point: DVec2) -> DVec2 {
        (point - self.centre) / self.half
    }
}

/// The corners of the convex hull, counterclockwise; all points where they are fewer than three.
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut found: Vec<DVec2> = Vec::with_capacity(64);
    let mut half = |points: &mut dyn Iterator<Item = DVec2>| {
        let start = found.len();
        for point in points {
            while found.len() >= start + 2 {
                let [a, b] = [found[found.len() - 2], found[found.len() - 1]];
                if (b - a).perp_dot(point - a) > 0.0 {
                    break;
                }
                found.pop();
            }
            found.push(point);
        }
        found.pop();
    };
    half(&mut points.iter().copied());
    half(&mut points.iter().rev().copied());
    found
}

/// Points in another order, so that the first few of a row lie all around.
fn scattered(points: Vec<DVec2>) -> Vec<DVec2> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    // Multiples of the golden ratio fall evenly, and far from one another.
    order.sort_unstable_by_key(|&i| (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    order.into_iter().map(|i| points[i]).collect()
}

/// How much larger than its circle a distance may be by rounding.
const SLACK: f64 = 1.0 + 1e-12;

/// The smallest circle around points: its centre and radius.
///
/// Source: Welzl 1991, "Smallest enclosing disks", without recursion. Takes time in proportion to
/// the number of points where they come scattered.
fn circle(points: &[DVec2]) -> (DVec2, f64) {
    let Some(&first) = points.first() else { return (DVec2::ZERO, 0.0) };
    let mut found = (first, 0.0);
    let outside = |found: (DVec2, f64), point: DVec2| point.distance(found.0) > found.1 * SLACK;
    for i in 1..points.len() {
        if !outside(found, points[i]) {
            continue;
        }
        found = (points[i], 0.0);
        for j in 0..i {
            if !outside(found, points[j]) {
                continue;
            }
            found = of_two(points[i], points[j]);
            for k in 0..j {
                if outside(found, points[k]) {
                    found = of_three(points[i], points[j], points[k]);
                }
            }
        }
    }
    // Whatever rounding did, all are inside.
    let farthest = points.iter().map(|point| point.distance(found.0)).fold(0.0, f64::max);
    (found.0, farthest)
}

fn of_two(a: DVec2, b: DVec2) -> (DVec2, f64) {
    (a.midpoint(b), 0.5 * a.distance(b))
}

/// The circle through three points; around the two farthest apart where they are on a line.
fn of_three(a: DVec2, b: DVec2, c: DVec2) -> (DVec2, f64) {
    let (p, q) = (b - a, c - a);
    let area = 2.0 * p.perp_dot(q);
    let centre = a + DVec2::new(
        q.y * p.length_squared() - p.y * q.length_squared(),
        p.x * q.length_squared() - q.x * p.length_squared(),
    ) / area;
    if centre.is_finite() {
        return (centre, centre.distance(a));
    }
    let pairs = [of_two(a, b), of_two(b, c), of_two(c, a)];
    pairs.into_iter().max_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((a, 0.0))
}
