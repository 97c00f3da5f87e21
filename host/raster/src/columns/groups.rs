//! Numbers of surfels in groups of lanes.

use crate::lanes::{F, V, WIDTH};
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// Three numbers of each surfel, by groups.
#[derive(Default)]
pub(crate) struct Triples(Vec<[[f32; WIDTH]; 3]>);

/// Groups that a thread fills at a time.
const GROUPS: usize = 1 << 10;

/// Fills groups with a value of each surfel in this order.
fn fill<T>(groups: &mut [T], order: &[u32], put: impl Fn(&mut T, usize, usize)) {
    for (group, order) in groups.iter_mut().zip(order.chunks(WIDTH)) {
        for (lane, &i) in order.iter().enumerate() {
            put(group, lane, i as usize);
        }
    }
}

impl Triples {
    pub(super) fn ordered(order: &[u32], value: impl Fn(usize) -> [f32; 3]) -> Self {
        let mut groups = vec![[[0.0; WIDTH]; 3]; order.len().div_ceil(WIDTH)];
        fill(&mut groups, order, |group, lane, i| {
            for (axis, x) in value(i).into_iter().enumerate() {
                group[axis][lane] = x;
            }
        });
        Self(groups)
    }

    pub(super) fn push(&mut self, values: impl ExactSizeIterator<Item = [f32; 3]>) {
        let first = self.0.len();
        self.0.resize(first + values.len().div_ceil(WIDTH), [[0.0; WIDTH]; 3]);
        for (i, value) in values.enumerate() {
            for (axis, x) in value.into_iter().enumerate() {
                self.0[first + i / WIDTH][axis][i % WIDTH] = x;
            }
        }
    }

    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, group: usize) -> V<S> {
        V::load(simd, &self.0[group])
    }

    #[inline(always)]
    pub(crate) fn one(&self, place: usize) -> [f32; 3] {
        let group = &self.0[place / WIDTH];
        [0, 1, 2].map(|axis| group[axis][place % WIDTH])
    }

    /// Places, those of groups that are not full among them.
    pub(super) fn n_places(&self) -> usize {
        self.0.len() * WIDTH
    }
}

/// A number of each surfel, by groups; zeros where a group is not full.
#[derive(Default)]
pub(crate) struct Singles(Vec<[f32; WIDTH]>);

impl Singles {
    pub(super) fn ordered(order: &[u32], value: impl Fn(usize) -> f32) -> Self {
        let mut groups = vec![[0.0; WIDTH]; order.len().div_ceil(WIDTH)];
        fill(&mut groups, order, |group, lane, i| group[lane] = value(i));
        Self(groups)
    }

    /// The same by all threads.
    pub(super) fn ordered_by_all(order: &[u32], value: impl Fn(usize) -> f32 + Sync) -> Self {
        let mut groups = vec![[0.0; WIDTH]; order.len().div_ceil(WIDTH)];
        let each = groups.par_chunks_mut(GROUPS).zip(order.par_chunks(GROUPS * WIDTH));
        each.for_each(|(groups, order)| {
            fill(groups, order, |group, lane, i| group[lane] = value(i))
        });
        Self(groups)
    }

    pub(super) fn push(&mut self, values: impl ExactSizeIterator<Item = f32>) {
        let first = self.0.len();
        self.0.resize(first + values.len().div_ceil(WIDTH), [0.0; WIDTH]);
        for (i, value) in values.enumerate() {
            self.0[first + i / WIDTH][i % WIDTH] = value;
        }
    }

    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, group: usize) -> F<S> {
        F::load_array_ref(simd, &self.0[group])
    }

    #[inline(always)]
    pub(crate) fn one(&self, place: usize) -> f32 {
        self.0[place / WIDTH][place % WIDTH]
    }

    pub(crate) fn put(&mut self, place: usize, value: f32) {
        self.0[place / WIDTH][place % WIDTH] = value;
    }
}
