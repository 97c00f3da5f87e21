//! Which splats touch the picture, from near to far.

use super::footprint::Footprint;
use super::grid::SIZE;
use super::view::{Kind, Splats, View, Words};
use rayon::prelude::*;

/// A splat, with what is known of it in a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Visible {
    pub(super) footprint: Footprint,
    /// Twice the exponent at which it is not seen any more.
    pub(super) cutoff: f32,
    /// Left, top, right and bottom of what it may cover, pixels, the latter two beyond.
    pub(super) pixels: [u16; 4],
}

impl Visible {
    fn new(words: &Words, kind: Kind, view: &View) -> Option<Self> {
        let footprint = Footprint::of(words);
        let cutoff = footprint.cutoff()?;
        let pixels = footprint.pixels(kind, cutoff, view)?;
        Some(Self { footprint, cutoff, pixels })
    }
}

/// A splat that touches the picture: what it is sorted and listed by, without looking at all of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Keyed {
    /// Grows with the distance.
    key: u32,
    pub(super) number: u32,
    /// Columns and rows of tiles that it touches, the latter two beyond.
    tiles: [u16; 4],
}

impl Keyed {
    fn new(splat: &Visible, number: usize) -> Self {
        let size = SIZE as u16;
        let [left, top, right, bottom] = splat.pixels;
        let tiles = [left / size, top / size, right.div_ceil(size), bottom.div_ceil(size)];
        Self { key: ordered(splat.footprint.distance[2]), number: number as u32, tiles }
    }

    /// Calls `visit` with each tile of so many across that it touches.
    #[inline]
    pub(super) fn each_tile(&self, across: usize, mut visit: impl FnMut(usize)) {
        let [left, top, right, bottom] = self.tiles.map(usize::from);
        for row in top..bottom {
            (left..right).for_each(|column| visit(row * across + column));
        }
    }
}

/// Splats that one thread looks at.
const BLOCK: usize = 1 << 14;

/// The splats of a view, by number, and which of them touch the picture.
#[derive(Debug, Default)]
pub(super) struct VisibleSplats {
    /// By number; those that do not touch the picture are as they were.
    pub(super) splats: Vec<Visible>,
    /// Those that do, in order.
    pub(super) keyed: Vec<Keyed>,
    /// Memory to sort with.
    other: Vec<Keyed>,
}

impl VisibleSplats {
    /// Looks at all splats anew; those that touch the picture are in the order of their numbers.
    pub(super) fn look(&mut self, splats: &Splats<'_>, view: &View) {
        self.splats.resize(splats.footprints.len(), Visible::default());
        let of_block = |(block, (footprints, known)): (usize, (&[Words], &mut [Visible]))| {
            let mut keyed = Vec::with_capacity(footprints.len());
            for (i, (words, known)) in footprints.iter().zip(known).enumerate() {
                if let Some(splat) = Visible::new(words, splats.kind, view) {
                    *known = splat;
                    keyed.push(Keyed::new(&splat, block * BLOCK + i));
                }
            }
            keyed
        };
        let blocks = splats.footprints.par_chunks(BLOCK).zip(self.splats.par_chunks_mut(BLOCK));
        let blocks: Vec<Vec<Keyed>> = blocks.enumerate().map(of_block).collect();
        self.keyed.clear();
        blocks.iter().for_each(|block| self.keyed.extend_from_slice(block));
    }

    /// Puts those that touch the picture in order from near to far, those of equal distances by number.
    pub(super) fn sort(&mut self) {
        sort(&mut self.keyed, &mut self.other);
    }
}

/// Whole numbers in the order of finite numbers; zeros of both signs are told apart, which harms nothing.
fn ordered(number: f32) -> u32 {
    let bits = number.to_bits();
    bits ^ (((bits.cast_signed() >> 31).cast_unsigned()) | 0x8000_0000)
}

/// Bits of a digit.
const DIGIT: u32 = 11;
const N_DIGITS: usize = 1 << DIGIT;

/// By keys, those of equal keys in the order that they have: a radix sort, whose time grows with
/// the number alone.
fn sort(list: &mut Vec<Keyed>, other: &mut Vec<Keyed>) {
    other.resize(list.len(), Keyed::default());
    for shift in [0, DIGIT, 2 * DIGIT] {
        let digit = |key: u32| (key >> shift) as usize & (N_DIGITS - 1);
        let mut next = [0usize; N_DIGITS];
        list.iter().for_each(|splat| next[digit(splat.key)] += 1);
        if next.contains(&list.len()) {
            continue;
        }
        let mut sum = 0;
        for place in &mut next {
            (*place, sum) = (sum, sum + *place);
        }
        for splat in list.iter() {
            let place = &mut next[digit(splat.key)];
            other[*place] = *splat;
            *place += 1;
        }
        std::mem::swap(list, other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_in_the_order_of_numbers() {
        let numbers = [f32::MIN, -1.0, -1e-30, 0.0, 1e-40, 0.5, 1.0, 1e30, f32::MAX];
        assert!(numbers.is_sorted());
        assert!(numbers.map(ordered).is_sorted());
    }

    #[test]
    fn equal_keys_keep_their_order() {
        let mut state = 1u32;
        let mut next = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % n
        };
        for (n, n_keys) in [(0, 1), (1, 1), (5000, 3), (5000, 1 << 24), (4096, 1)] {
            let of = |number: u32, key: u32| Keyed { key: key << 7, number, tiles: [0; 4] };
            let list: Vec<Keyed> = (0..n).map(|i| of(i, next(n_keys))).collect();
            let mut expected = list.clone();
            expected.sort_by_key(|splat| splat.key);
            let mut sorted = list;
            sort(&mut sorted, &mut Vec::new());
            assert_eq!(sorted, expected);
        }
    }
}
