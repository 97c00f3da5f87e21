//! Bounding boxes in f64.

use crate::hashing;
use glam::{DVec3, Vec3};

/// Distance from the middle half of the points, in its extents, from which on others may be strays. Few devices see as far,
/// whose middle half is the ground within some metres; and a box so many times as large as the rest changes nothing yet
/// that is found out about it.
const APART: f64 = 64.0;

/// Extent of all points, in that of those that do not lie apart, from which on strays hide the rest: it is a hundredth of a
/// picture, and two of the digits that single precision has for it are lost.
const STRETCHED: f64 = 100.0;

/// Share of the points from which on those that lie apart are no strays: there is a small thing in a large scene.
const FEW: f64 = 0.05;

/// Most points that are looked at to tell where most of them are.
const SAMPLES: usize = 20_000;

/// Some of many points, always the same; those that are finite.
fn samples(count: usize, at: impl Fn(usize) -> DVec3) -> Vec<DVec3> {
    let sample = |i: usize| match count > SAMPLES {
        true => at(((hashing::unit(9, i as u64) * count as f64) as usize).min(count - 1)),
        false => at(i),
    };
    (0..SAMPLES.min(count)).map(sample).filter(|point| point.is_finite()).collect()
}

/// Whether those of `far` are so few of `count` that they are strays. Those that coincide count once: devices write what
/// they have not seen as zeros.
pub(crate) fn are_few<T: Ord>(mut far: Vec<T>, count: usize) -> bool {
    far.sort_unstable();
    far.dedup();
    far.len() as f64 <= FEW * count as f64
}

/// An axis-aligned box that holds at least one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner, the unit of the positions.
    pub min: DVec3,
    /// Upper corner, the unit of the positions.
    pub max: DVec3,
}

impl Bounds {
    /// The box of the points that are finite; `None` where there is none.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().filter(|point| point.is_finite()).fold(None, |bounds, point| {
            Some(bounds.map_or(Self { min: point, max: point }, |b: Self| Self {
                min: b.min.min(point),
                max: b.max.max(point),
            }))
        })
    }

    /// The box of the positions that are finite; `None` where there is none.
    #[must_use]
    pub fn of_positions(positions: &[Vec3]) -> Option<Self> {
        Self::of(positions.iter().map(|position| position.as_dvec3()))
    }

    /// The box that most of `count` points lie in: along each axis it leaves out a `share` of them, at most a half, at
    /// each end, so that fewer strays do not change it however far away they are. It is that of some of many points, always
    /// the same. `None` where none of these is finite, or what is left is a single place.
    #[must_use]
    pub fn of_most(count: usize, at: impl Fn(usize) -> DVec3, share: f64) -> Option<Self> {
        let samples = samples(count, at);
        let last = samples.len().checked_sub(1)?;
        let out = ((samples.len() as f64 * share) as usize).min(last / 2);
        let mut most = Self { min: DVec3::ZERO, max: DVec3::ZERO };
        for axis in 0..3 {
            let mut along: Vec<f64> = samples.iter().map(|point| point[axis]).collect();
            let (_, low, above) = along.select_nth_unstable_by(out, f64::total_cmp);
            most.min[axis] = *low;
            most.max[axis] = match last - 2 * out {
                0 => *low,
                after => *above.select_nth_unstable_by(after - 1, f64::total_cmp).1,
            };
        }
        (most.extent() > 0.0).then_some(most)
    }

    /// Where the rest of `count` points is, from which others lie apart: far around the middle half of them along each axis.
    /// `None` where there is no telling.
    #[must_use]
    pub fn surroundings(count: usize, at: impl Fn(usize) -> DVec3) -> Option<Self> {
        Self::of_most(count, at, 0.25).map(|half| half.grown(APART * half.extent()))
    }

    /// The box, which is that of `count` points; where a few strays make it a hundred times as large as the others are, the
    /// box of these.
    #[must_use]
    pub fn without_strays(self, count: usize, at: impl Fn(usize) -> DVec3) -> Self {
        let Some(near) = Self::surroundings(count, &at) else { return self };
        if near.holds(self.min) && near.holds(self.max) {
            return self;
        }
        let far = samples(count, &at).into_iter().filter(|point| !near.holds(*point));
        // The sum has one zero.
        let bits = |point: DVec3| (point + DVec3::ZERO).to_array().map(f64::to_bits);
        if !are_few(far.map(bits).collect(), count.min(SAMPLES)) {
            return self;
        }
        let others = Self::of((0..count).map(at).filter(|point| near.holds(*point)));
        others.filter(|others| STRETCHED * others.extent() < self.extent()).unwrap_or(self)
    }

    /// Whether a point lies in the box, or at its border.
    #[must_use]
    pub fn holds(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// The box that reaches farther by a length on all sides.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        Self { min: self.min - by, max: self.max + by }
    }

    /// The middle of the box; it does not overflow.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Lengths of the edges.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the longest edge; 0 for a single point.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.size().max_element()
    }

    /// Length of the diagonal; 0 for a single point. The longest edge is factored out, so that
    /// the squares neither overflow nor underflow.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let extent = self.extent();
        if extent > 0.0 { extent * (self.size() / extent).length() } else { 0.0 }
    }

    /// The largest absolute coordinate.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small thing before a large one that no device saw between is no stray, however large; a few points are.
    #[test]
    fn many_points_far_away_are_no_strays() {
        let thing = (0..1000).map(|i| DVec3::splat(f64::from(i) * 1e-3));
        for (n_far, is_cut) in [(3, true), (40, true), (100, false), (800, false)] {
            let far = (0..n_far).map(|i| DVec3::new(1e4 + f64::from(i), 0.0, 0.0));
            let points: Vec<DVec3> = thing.clone().chain(far).collect();
            let all = Bounds::of(points.iter().copied()).unwrap();
            let core = all.without_strays(points.len(), |i| points[i]);
            assert_eq!(core.extent() < 1.1, is_cut, "{n_far}: {core:?}");
        }
        // What a device has not seen, many times at one place, though not a quarter of all.
        let zeros = [DVec3::splat(-1e6); 200];
        let points: Vec<DVec3> = thing.chain(zeros).collect();
        let all = Bounds::of(points.iter().copied()).unwrap();
        assert!(all.without_strays(points.len(), |i| points[i]).extent() < 1.1);
    }

    #[test]
    fn no_points_have_no_bounds() {
        assert_eq!(Bounds::of_positions(&[]), None);
        assert_eq!(Bounds::of_positions(&[Vec3::NAN, Vec3::INFINITY]), None);
    }

    #[test]
    fn bounds_leave_out_positions_that_are_not_finite() {
        let positions = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(f32::NAN, 9.0, 9.0), Vec3::ZERO];
        let bounds = Bounds::of_positions(&positions).unwrap();
        assert_eq!(bounds.min, DVec3::ZERO);
        assert_eq!(bounds.max, DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn strays_do_not_change_where_most_points_are() {
        let mut points = vec![DVec3::NAN; 5];
        for count in [900, 60_000] {
            points.resize_with(5 + count, || DVec3::ZERO);
            for (i, point) in points.iter_mut().skip(5).enumerate() {
                let along = i as f64 / count as f64;
                *point = DVec3::new(along, 2.0 * along, 7.0);
            }
            for point in points.iter_mut().step_by(10) {
                *point = DVec3::new(1e9, -1e300, 1e38);
            }
            let most = Bounds::of_most(points.len(), |i| points[i], 0.25).unwrap();
            assert!(most.holds(DVec3::new(0.5, 1.0, 7.0)), "{most:?}");
            // A quarter at each end, and some of the strays, which are a tenth.
            assert!(most.size().x > 0.4 && most.extent() < 1.3, "{most:?}");
        }
        assert_eq!(Bounds::of_most(0, |_| DVec3::ZERO, 0.1), None);
        assert_eq!(Bounds::of_most(9, |_| DVec3::ONE, 0.1), None);
        assert_eq!(Bounds::of_most(9, |_| DVec3::NAN, 0.1), None);
        let two = Bounds::of_most(2, |i| DVec3::splat(i as f64), 0.5).unwrap();
        assert_eq!((two.min, two.max), (DVec3::ZERO, DVec3::ONE));
    }

    #[test]
    fn the_diagonal_of_a_huge_or_tiny_box_is_exact() {
        for scale in [1e-200, 1.0, 1e200] {
            let corners = [DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0) * scale];
            let bounds = Bounds::of(corners).unwrap();
            // Four roundings: a relative error of at most 4 * 2^-53.
            assert!((bounds.diagonal() / (5.0 * scale) - 1.0).abs() < 5e-16);
        }
    }
}
