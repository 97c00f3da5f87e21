//! Sorting and prefix sums as passes, and numbers of things that only the device knows.

use crate::graph::passes::{Pass, Work};
use crate::graph::resources::BufferId;
use serde::{Deserialize, Serialize};

/// How many numbers a pass works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Count {
    /// So many.
    Fixed(u32),
    /// As many as a `u32` of a buffer says when the pass runs, and never more than `at_most`: what is larger counts
    /// as `at_most`.
    Read {
        /// The buffer.
        buffer: BufferId,
        /// Bytes before the number, a multiple of 4.
        offset: u64,
        /// Most that it may say; buffers must have room for them.
        at_most: u32,
    },
}

impl From<u32> for Count {
    fn from(n: u32) -> Self {
        Self::Fixed(n)
    }
}

impl Count {
    /// Most numbers that the pass works on.
    #[must_use]
    pub const fn at_most(self) -> u32 {
        match self {
            Self::Fixed(n) => n,
            Self::Read { at_most, .. } => at_most,
        }
    }
}

/// What a pass sorts. ABI 3.10.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sort {
    /// The keys, a `u32` each, which are put in ascending order.
    pub keys: BufferId,
    /// The values, a `u32` each, which move with their keys.
    pub values: BufferId,
    /// How many there are.
    pub count: Count,
    /// How many of the lowest bits of keys are looked at, 1 to 32; the others are taken for equal.
    pub bits: u32,
}

/// What a pass sums up. ABI 3.10.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Scan {
    /// The numbers, a `u32` each: the sum of those before it takes the place of each.
    pub buffer: BufferId,
    /// How many there are.
    pub count: Count,
    /// Where the sum of all is written: a buffer, and bytes before the number, a multiple of 4.
    #[serde(default)]
    pub total: Option<(BufferId, u64)>,
}

impl Pass {
    /// A pass that sorts `u32` keys in ascending order, in place, and moves the `u32` values of another buffer with
    /// them. Equal keys stay in their order. What lies behind the last of them is left as it is. For keys of `f32`,
    /// store what `ordered_from_f32` of the WGSL module `surfelshop::numbers` makes of them. ABI 3.10.
    ///
    /// ```
    /// use surfelshop_api::graph::{Buffer, Graph, Pass};
    /// let mut graph = Graph::new();
    /// let [keys, values] = ["keys", "values"].map(|name| graph.buffer(name, Buffer::new(4 * 1000)));
    /// graph.pass(Pass::sort("by distance", keys, values, 1000));
    /// ```
    #[must_use]
    pub fn sort(name: &str, keys: BufferId, values: BufferId, count: impl Into<Count>) -> Self {
        let sort = Sort { keys, values, count: count.into(), bits: u32::BITS };
        Self::new(name, "", "", Work::Sort(sort))
    }

    /// A pass that puts in the place of each `u32` the sum of those before it, 0 in that of the first: where the
    /// things of each begin in a list of all. Sums wrap around at 2^32. ABI 3.10.
    #[must_use]
    pub fn scan(name: &str, buffer: BufferId, count: impl Into<Count>) -> Self {
        Self::new(name, "", "", Work::Scan(Scan { buffer, count: count.into(), total: None }))
    }

    /// Sorts by so many of the lowest bits of keys, 1 to 32: fewer take less time. ABI 3.10.
    #[must_use]
    pub fn bits(mut self, bits: u32) -> Self {
        if let Work::Sort(sort) = &mut self.work {
            sort.bits = bits;
        }
        self
    }

    /// Writes the sum of all that a scan adds up, `offset` bytes into a buffer: that of the numbers itself, where it has
    /// room before or behind them, or another. ABI 3.10.
    #[must_use]
    pub fn total(mut self, buffer: BufferId, offset: u64) -> Self {
        if let Work::Scan(scan) = &mut self.work {
            scan.total = Some((buffer, offset));
        }
        self
    }
}

/// A `u32` that is ordered as the float is, as `ordered_from_f32` of the WGSL module `surfelshop::numbers`: -0 comes before 0,
/// numbers that are none before or behind all others, by their sign. ABI 3.10.
#[must_use]
pub const fn ordered_from_f32(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The float that [`ordered_from_f32`] made a number of. ABI 3.10.
#[must_use]
pub const fn f32_from_ordered(ordered: u32) -> f32 {
    f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_ordered_as_floats_are_and_come_back() {
        let ascending = [
            f32::NEG_INFINITY,
            f32::MIN,
            -1.5,
            -f32::MIN_POSITIVE,
            -1e-45,
            -0.0,
            0.0,
            1e-45,
            0.25,
            1.0,
            f32::MAX,
            f32::INFINITY,
        ];
        let ordered = ascending.map(ordered_from_f32);
        assert!(ordered.windows(2).all(|pair| pair[0] < pair[1]), "{ordered:?}");
        for (x, number) in ascending.iter().zip(ordered) {
            assert_eq!(f32_from_ordered(number).to_bits(), x.to_bits());
        }
        assert!(ordered_from_f32(f32::NAN) > ordered_from_f32(f32::INFINITY));
        assert!(ordered_from_f32(-f32::NAN) < ordered_from_f32(f32::NEG_INFINITY));
    }
}
