//! The nearest points of all points of a leaf, which share a list of what is near.

use super::search::Scratch;
use super::tree::{Cuboid, LEAF, Tree};

/// A point near another one: the square of its distance in f32, above its place. They sort by distance, ties by place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Close(u64);

impl Close {
    fn new(squared: f32, place: u32) -> Self {
        // Of numbers that are not negative the bits sort like the numbers.
        Self(u64::from(squared.to_bits()) << 32 | u64::from(place))
    }

    pub(crate) fn place(self) -> usize {
        self.0 as u32 as usize
    }

    /// Units of the search.
    pub(crate) fn distance(self) -> f64 {
        f64::from(self.squared()).sqrt()
    }

    /// Square of the distance, units of the search.
    pub(crate) fn squared(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// Square of the distance up to which points are gathered around a leaf, over the largest that a search in the last
/// leaf needed.
const LEAF_REACH: f32 = 1.4;

/// Square of the distance that a search begins with, over that which the last one needed.
const POINT_REACH: f32 = 1.4;

/// Square of the distance when points are gathered again, over that before.
const NEXT_REACH: f32 = 3.0;

/// Points gathered for each one wanted, at most, and besides: around a leaf that a stray stretches there may be all.
const CROWD: usize = 24;
const CROWD_LEAST: usize = 512;

/// Searches for the nearest of points that follow each other: what is near to a leaf is gathered once for all points of
/// it. What is found depends on nothing but the points.
#[derive(Debug, Default)]
pub(crate) struct Shared {
    /// The leaf that points are gathered around, and how many are wanted.
    around: Option<(usize, usize)>,
    /// Square of the distance from the leaf's box up to which all points are gathered; none are where it is negative.
    reach: f32,
    /// The points gathered, of which the first `n_gathered` count.
    axes: [Vec<f32>; 3],
    places: Vec<u32>,
    n_gathered: usize,
    /// The squares of their distances from a place.
    squares: Vec<f32>,
    /// Room for those that are within a limit.
    within: Vec<Close>,
    close: Vec<Close>,
    /// The largest square of a distance that a search in this leaf needed.
    needed: f32,
    /// That of the last search.
    last: f32,
    alone: Scratch,
}

impl Shared {
    /// The `k` distinct positions nearest to `own`, itself left out, nearest first by squares of distances in f32, ties
    /// by place.
    pub(crate) fn nearest(&mut self, tree: &Tree, own: usize, k: usize) -> &[Close] {
        self.close.clear();
        if k == 0 || own >= tree.len() {
            return &self.close;
        }
        let wanted = k.saturating_add(1).min(tree.len());
        let leaf = tree.leaf_of(own);
        if self.around != Some((leaf, k)) {
            let is_same = self.around.is_some_and(|(_, last)| last == k);
            if !is_same || self.needed <= 0.0 {
                self.search_alone(tree, own, wanted);
                self.needed = self.last;
            }
            self.around = Some((leaf, k));
            let reach = LEAF_REACH * self.needed;
            self.needed = 0.0;
            self.gather(tree, leaf, reach, CROWD * wanted + CROWD_LEAST);
        }
        self.search(tree, own, (leaf, wanted));
        self.needed = self.needed.max(self.last);
        self.leave_out(own, k)
    }

    /// [`Self::nearest`] of a point near to the leaf of another one, `from`, of which it is known that they are within
    /// `limit`, the square of a distance: what is gathered around that leaf up to `reach`, another square, serves as
    /// far as it goes.
    pub(crate) fn nearest_beside(
        &mut self,
        tree: &Tree,
        (from, reach): (usize, f32),
        (own, limit): (usize, f32),
        k: usize,
    ) -> &[Close] {
        let wanted = k.saturating_add(1).min(tree.len());
        let leaf = tree.leaf_of(from);
        if self.around != Some((leaf, k)) || (0.0..reach).contains(&self.reach) {
            self.around = Some((leaf, k));
            self.gather(tree, leaf, reach, CROWD * wanted + CROWD_LEAST);
        }
        let root = |squared: f32| f64::from(squared.max(0.0)).sqrt();
        let away = root(tree.squared_to(tree.n_leaves() + leaf, tree.at(own)));
        self.close.clear();
        // A share of rounding on top.
        if away + root(limit) * (1.0 + 1e-6) <= root(self.reach) {
            self.measure(tree.at(own));
            self.select(limit * (1.0 + 1e-6));
        }
        if self.close.len() < wanted {
            self.search_alone(tree, own, wanted);
        }
        self.close.sort_unstable();
        self.close.truncate(wanted);
        self.leave_out(own, k)
    }

    /// What was found but the point itself.
    fn leave_out(&mut self, own: usize, k: usize) -> &[Close] {
        match self.close.iter().position(|close| close.place() == own) {
            Some(at) => drop(self.close.remove(at)),
            // Where squares underflow, others may be as near as the point itself.
            None => self.close.truncate(k),
        }
        &self.close
    }

    /// Finds the point and its nearest, sorted.
    fn search(&mut self, tree: &Tree, own: usize, (leaf, wanted): (usize, usize)) {
        let at = tree.at(own);
        let mut limit = (POINT_REACH * self.last).min(self.reach);
        while self.reach >= 0.0 {
            self.measure(at);
            self.select(limit);
            if self.close.len() < wanted && limit < self.reach {
                limit = self.reach;
                self.select(limit);
            }
            if self.close.len() >= wanted {
                self.close.sort_unstable();
                self.close.truncate(wanted);
                self.last = self.close[wanted - 1].squared();
                return;
            }
            // Of nothing at all a multiple is no more.
            let reach = if self.reach > 0.0 { NEXT_REACH * self.reach } else { f32::INFINITY };
            self.gather(tree, leaf, reach, CROWD * wanted + CROWD_LEAST);
            limit = self.reach;
        }
        self.search_alone(tree, own, wanted);
    }

    /// [`Self::search`] without what was gathered.
    fn search_alone(&mut self, tree: &Tree, own: usize, wanted: usize) {
        let keys = self.alone.keys(tree, own, wanted);
        self.close.clear();
        self.close.extend(keys.iter().map(|&key| Close(key)));
        self.close.sort_unstable();
        self.last = self.close.last().map_or(0.0, |close| close.squared());
    }

    /// Gathers all points near to a leaf's box; none where there are more than `most`.
    fn gather(&mut self, tree: &Tree, leaf: usize, reach: f32, most: usize) {
        self.reach = reach;
        self.n_gathered = 0;
        let around = tree.cuboid(tree.n_leaves() + leaf);
        self.take(tree, leaf, around);
        // Up from the leaf, each time down the other branch: the order is the same whatever the reach is.
        let mut node = tree.n_leaves() + leaf;
        let mut open = [0usize; 2 * usize::BITS as usize];
        while node > 1 {
            (open[0], node) = (node ^ 1, node / 2);
            let mut n_open = 1;
            while n_open > 0 {
                n_open -= 1;
                let here = open[n_open];
                if around.squared_between(tree.cuboid(here)) > reach {
                    continue;
                }
                if here >= tree.n_leaves() {
                    self.take(tree, here - tree.n_leaves(), around);
                    if self.n_gathered > most {
                        self.reach = -1.0;
                        return;
                    }
                    continue;
                }
                open[n_open] = 2 * here + 1;
                open[n_open + 1] = 2 * here;
                n_open += 2;
            }
        }
    }

    /// Takes the points of a leaf that are near to a box.
    fn take(&mut self, tree: &Tree, leaf: usize, around: &Cuboid) {
        let range = tree.leaf(leaf);
        let squares = tree.squared_to_box(&range, around);
        let first = self.n_gathered;
        let axes = tree.axes(&range);
        if self.places.len() < first + LEAF {
            let room = 2 * first + LEAF;
            self.places.resize(room, 0);
            self.axes.iter_mut().for_each(|axis| axis.resize(room, 0.0));
        }
        let places = &mut self.places[first..first + LEAF];
        let [x, y, z] = &mut self.axes;
        let (x, y, z) =
            (&mut x[first..first + LEAF], &mut y[first..first + LEAF], &mut z[first..first + LEAF]);
        let mut count = 0;
        // Each is written, and the next one over it unless it counts: nothing here has to be predicted.
        let points = axes[0].iter().zip(axes[1]).zip(axes[2]).zip(&squares);
        for ((((px, py), pz), square), place) in points.zip(range.start as u32..) {
            let to = count & (LEAF - 1);
            (places[to], x[to], y[to], z[to]) = (place, *px, *py, *pz);
            count += usize::from(*square <= self.reach);
        }
        self.n_gathered += count;
    }

    /// Squares of the distances from a place to all points gathered.
    fn measure(&mut self, at: [f32; 3]) {
        let n = self.n_gathered;
        if self.squares.len() < n {
            self.squares.resize(self.places.len(), 0.0);
            self.within.resize(self.places.len() + 1, Close(0));
        }
        let [x, y, z] = &self.axes;
        let points = x[..n].iter().zip(&y[..n]).zip(&z[..n]);
        for (square, ((x, y), z)) in self.squares[..n].iter_mut().zip(points) {
            let offset = [x - at[0], y - at[1], z - at[2]];
            *square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        }
    }

    /// Chooses the points measured that are within a limit.
    fn select(&mut self, limit: f32) {
        let n = self.n_gathered;
        let within = &mut self.within[..];
        let mut count = 0;
        for (&square, &place) in self.squares[..n].iter().zip(&self.places[..n]) {
            within[count] = Close::new(square, place);
            count += usize::from(square <= limit);
        }
        self.close.clear();
        self.close.extend_from_slice(&within[..count]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Neighbours;
    use super::*;
    use crate::progress::silent;
    use crate::samples::{grid, random_sphere};
    use glam::{DVec3, Vec3};

    /// Invariant: what points share does not change what is near, not even of those that are equally far
    #[test]
    fn what_is_shared_is_what_each_finds_alone() {
        let mut clouds =
            vec![random_sphere(3000, DVec3::ZERO, 1.0, 31), grid(40, Vec3::X, Vec3::Z)];
        let stray = [Vec3::splat(1e6), Vec3::new(0.0, -3e4, 0.0)];
        clouds.push([random_sphere(2000, DVec3::ONE, 1e-3, 32), stray.to_vec()].concat());
        let dense = random_sphere(2000, DVec3::ONE, 1e-3, 33);
        clouds.push([random_sphere(2000, DVec3::ONE, 1.0, 34), dense].concat());
        clouds.push(grid(3, Vec3::X, Vec3::Y));
        for positions in clouds {
            let neighbours = Neighbours::build(&positions, &silent).unwrap();
            let tree = neighbours.tree();
            for k in [1, 8, 20] {
                let (mut shared, mut alone) = (Shared::default(), Scratch::default());
                let mut beside = Shared::default();
                for own in 0..tree.len() {
                    let mut expected = alone.keys(tree, own, (k + 1).min(tree.len())).to_vec();
                    expected.sort_unstable();
                    expected.retain(|&key| key as u32 as usize != own);
                    let found = shared.nearest(tree, own, k).iter().map(|close| close.0);
                    assert!(found.eq(expected.iter().copied()), "{own} of {}, {k}", tree.len());
                    let from = own.saturating_sub(own % 50);
                    let limit = if own % 3 == 0 { 1e-3 } else { 0.5 };
                    let found = beside.nearest_beside(tree, (from, 1.5), (own, limit), k).iter();
                    let found = found.map(|close| close.0);
                    assert!(found.eq(expected), "{own} beside {from} of {}, {k}", tree.len());
                }
            }
        }
    }
}
