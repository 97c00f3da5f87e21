//! The points around a chunk: the nearest of all that are near, and never more in memory than about twice as many.

use super::spool::Rows;
use glam::DVec3;
use surfelshop_geometry::Bounds;

/// Points around a box.
pub(super) struct Around<'a> {
    bounds: Bounds,
    /// Farther away no point is taken; less once there are enough that are nearer.
    reach: f64,
    most: usize,
    /// Bytes of each column of a point.
    sizes: &'a [usize],
    stride: usize,
    /// Of each point how far away it is, and when it came.
    found: Vec<(f64, u64)>,
    /// The bytes of all columns, point by point.
    bytes: Vec<u8>,
    n_seen: u64,
}

impl<'a> Around<'a> {
    pub(super) fn new(bounds: Bounds, reach: f64, most: usize, sizes: &'a [usize]) -> Self {
        let stride = sizes.iter().sum();
        let (found, bytes, n_seen) = Default::default();
        Self { bounds, reach, most, sizes, stride, found, bytes, n_seen }
    }

    fn away(&self, point: DVec3) -> f64 {
        let Bounds { min, max } = self.bounds;
        (min - point).max(point - max).max(DVec3::ZERO).max_element()
    }

    /// Whether a box may have points that are near.
    pub(super) fn may_take(&self, [low, high]: [DVec3; 2]) -> bool {
        let Bounds { min, max } = self.bounds;
        (min - high).max(low - max).max(DVec3::ZERO).max_element() <= self.reach
    }

    pub(super) fn take(&mut self, rows: &Rows<'_>) {
        for (row, position) in rows.positions.iter().enumerate() {
            let away = self.away(DVec3::from_array(*position));
            if away > self.reach {
                continue;
            }
            for (column, &size) in rows.columns.iter().zip(self.sizes) {
                self.bytes.extend_from_slice(&column[row * size..(row + 1) * size]);
            }
            self.found.push((away, self.n_seen));
            self.n_seen += 1;
            if self.found.len() > 2 * self.most {
                self.prune();
            }
        }
    }

    /// Keeps the nearest; of equally near ones those that came first.
    fn prune(&mut self) {
        if self.found.len() <= self.most || self.most == 0 {
            return;
        }
        let by = |a: &(f64, u64), b: &(f64, u64)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let mut sorted = self.found.clone();
        let (_, last, _) = sorted.select_nth_unstable_by(self.most - 1, by);
        let last = *last;
        let (mut kept, stride) = (0, self.stride);
        for i in 0..self.found.len() {
            if by(&self.found[i], &last).is_gt() {
                continue;
            }
            self.found[kept] = self.found[i];
            self.bytes.copy_within(i * stride..(i + 1) * stride, kept * stride);
            kept += 1;
        }
        self.found.truncate(kept);
        self.bytes.truncate(kept * stride);
        self.reach = self.reach.min(last.0);
    }

    /// Appends the points, column by column; how many they are.
    pub(super) fn append_to(mut self, columns: &mut [Vec<u8>]) -> usize {
        self.prune();
        for mut row in self.bytes.chunks_exact(self.stride.max(1)) {
            for (all, &size) in columns.iter_mut().zip(self.sizes) {
                let (value, more) = row.split_at(size);
                all.extend_from_slice(value);
                row = more;
            }
        }
        self.found.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_kept_in_the_order_in_which_they_came() {
        let bounds = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        let mut around = Around::new(bounds, 10.0, 3, &[1]);
        let positions: Vec<[f64; 3]> =
            [5.0, 20.0, 1.5, 3.0, 4.0, 9.0, 1.25, 8.0, 7.0].map(|x| [x, 0.5, 0.5]).to_vec();
        let names: Vec<u8> = (0..9).collect();
        around.take(&Rows { positions, columns: vec![&names] });
        assert!(around.may_take([DVec3::splat(2.0), DVec3::splat(3.0)]));
        assert!(!around.may_take([DVec3::splat(9.0), DVec3::splat(12.0)]), "others are nearer");
        let mut columns = vec![vec![7]];
        assert_eq!(around.append_to(&mut columns), 3);
        assert_eq!(columns, [[7, 2, 3, 6]]);
    }
}
