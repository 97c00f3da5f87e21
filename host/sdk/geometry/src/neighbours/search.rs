//! The nearest points of a place.

use super::tree::{LEAF, Tree};

/// A point found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) place: u32,
    /// Units of the search.
    pub(crate) distance: f64,
}

/// Scratch for a search, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// Squares of distances, whose bits sort like the numbers, above places.
    keys: Vec<u64>,
    spare: Vec<u64>,
    found: Vec<Found>,
    /// How many the last search was for, and the square of the distance that it needed.
    last: Option<(usize, f32)>,
}

/// The square of the distance that a search begins with, over that which the last one needed. Points that lie
/// together have their nearest at much the same distance.
const FIRST_REACH: f32 = 1.5;

/// The same when a search begins again.
const NEXT_REACH: f32 = 3.0;

/// A search that is under way.
struct Search<'a> {
    tree: &'a Tree,
    at: [f32; 3],
    wanted: usize,
    /// Square of the distance up to which points count.
    limit: f32,
    /// Of which the first `count` are found.
    keys: &'a mut Vec<u64>,
    count: usize,
    spare: &'a mut Vec<u64>,
}

/// The square of a distance that a key holds.
fn squared(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

impl Search<'_> {
    /// Looks through a leaf.
    fn scan(&mut self, leaf: usize) {
        let range = self.tree.leaf(leaf);
        let mut distances = [f32::NAN; LEAF];
        self.tree.squared(self.at, &range, &mut distances);
        if self.keys.len() < self.count + LEAF {
            self.keys.resize(2 * self.count + 4 * LEAF, 0);
        }
        // Each is written, and the next one over it unless it counts: nothing here has to be predicted.
        let room = &mut self.keys[self.count..self.count + LEAF];
        let mut count = 0;
        for (place, distance) in (range.start as u64..).zip(distances) {
            room[count & (LEAF - 1)] = u64::from(distance.to_bits()) << 32 | place;
            count += usize::from(distance <= self.limit);
        }
        self.count += count;
        if self.count > 3 * self.wanted + LEAF {
            self.select();
        }
    }

    /// Keeps the nearest, in the order in which they were found: it is the same whatever the limit was.
    fn select(&mut self) {
        if self.count <= self.wanted {
            return;
        }
        self.spare.clear();
        self.spare.extend_from_slice(&self.keys[..self.count]);
        let (_, &mut last, _) = self.spare.select_nth_unstable(self.wanted - 1);
        let mut kept = 0;
        for i in 0..self.count {
            let key = self.keys[i];
            self.keys[kept] = key;
            kept += usize::from(key <= last);
        }
        self.count = kept;
        self.limit = squared(last);
    }

    /// Looks through a node, nearer half first.
    fn descend(&mut self, node: usize) {
        let n_leaves = self.tree.n_leaves();
        if node >= n_leaves {
            self.scan(node - n_leaves);
            return;
        }
        let (mut near, mut far) = (2 * node, 2 * node + 1);
        let mut away = (self.tree.squared_to(near, self.at), self.tree.squared_to(far, self.at));
        if away.1 < away.0 {
            (near, far) = (far, near);
            away = (away.1, away.0);
        }
        if away.0 <= self.limit {
            self.descend(near);
        }
        if away.1 <= self.limit {
            self.descend(far);
        }
    }

    /// Looks through all that is within the limit, from a leaf upwards: most of what it needs lies in the
    /// same branch.
    fn run(&mut self, leaf: usize) {
        self.scan(leaf);
        let mut node = self.tree.n_leaves() + leaf;
        while node > 1 {
            let sibling = node ^ 1;
            if self.tree.squared_to(sibling, self.at) <= self.limit {
                self.descend(sibling);
            }
            node /= 2;
        }
        self.select();
    }
}

impl Scratch {
    /// The `k` points nearest to `own`, itself left out, in no order.
    ///
    /// They are chosen by squared distances in f32, whose differences are exact but for one rounding, ties by place.
    pub(super) fn choose(&mut self, tree: &Tree, own: usize, k: usize) -> &mut [Found] {
        self.found.clear();
        if k == 0 || own >= tree.len() {
            return &mut self.found;
        }
        // The point finds itself.
        let wanted = k.saturating_add(1).min(tree.len());
        let count = self.keys(tree, own, wanted).len();
        let from = tree.point(own);
        let others =
            self.keys[..count].iter().map(|&key| key as u32).filter(|&place| place as usize != own);
        self.found.extend(
            others
                .map(|place| Found { place, distance: tree.point(place as usize).distance(from) }),
        );
        // Where squares underflow, others may be as near as the point itself.
        self.found.truncate(k);
        &mut self.found
    }

    /// The `wanted` points nearest to `own`, itself among them and at most all that there are: squares of distances,
    /// whose bits sort like the numbers, above places.
    pub(super) fn keys(&mut self, tree: &Tree, own: usize, wanted: usize) -> &[u64] {
        let (at, leaf) = (tree.at(own), tree.leaf_of(own));
        let usual = self.last.filter(|&(last, _)| last == wanted).map(|(_, reach)| reach);
        let mut limit = usual.map_or(f32::INFINITY, |usual| FIRST_REACH * usual);
        loop {
            let (keys, spare) = (&mut self.keys, &mut self.spare);
            let mut search = Search { tree, at, wanted, limit, keys, count: 0, spare };
            search.run(leaf);
            if search.count >= wanted || limit == f32::INFINITY {
                let (count, limit) = (search.count, search.limit);
                self.last = Some((wanted, limit));
                return &self.keys[..count];
            }
            // Of nothing at all a multiple is no more.
            limit = if limit > 0.0 { limit * NEXT_REACH } else { f32::INFINITY };
        }
    }

    /// The `k` points nearest to `own`, itself left out, nearest first by distances in f64, ties by place.
    pub(crate) fn nearest(&mut self, tree: &Tree, own: usize, k: usize) -> &[Found] {
        let found = self.choose(tree, own, k);
        found
            .sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.place.cmp(&b.place)));
        found
    }
}
