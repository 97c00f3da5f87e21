//! The order surfels are drawn in: along a space-filling curve, whatever order they came in.
//!
//! Sums of floats and ties of depth depend on the order of drawing. An order that follows from
//! the surfels alone makes pictures independent of the order in the file; one along a curve keeps
//! neighbours together in memory. Surfels that lines cut come after all others, so that those are
//! drawn without asking.

use crate::surfels::columns::elements::{clips_of, cuts};
use rayon::prelude::*;
use std::cmp::Ordering;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};

/// Bits of the curve's position per axis; three times as many fit into 64.
const BITS: u32 = 21;

/// The bit above those of a curve: a surfel is cut.
const CUT: u64 = 1 << 63;

/// Indices of a cloud's surfels in drawing order: those that are not cut before the others, by the
/// Morton code of the position in the cloud's box, then by position, then by attributes. Surfels
/// equal in all of them may stand in any order without it showing.
pub(crate) fn drawing_order(cloud: &CloudView<'_>) -> Vec<u32> {
    let positions = cloud.floats(columns::POSITION, 3).unwrap_or_default();
    let at = |i: u32| &positions[3 * i as usize..3 * i as usize + 3];
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for position in positions.chunks_exact(3) {
        for axis in 0..3 {
            low[axis] = low[axis].min(f64::from(position[axis]));
            high[axis] = high[axis].max(f64::from(position[axis]));
        }
    }
    let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let per_cell = f64::from(1u32 << BITS) / extent;
    let clips = clips_of(cloud);
    let code = |i: u32| {
        let position = at(i);
        let cell = |axis: usize| {
            // A cloud without extent has one cell; the cast takes NaN there to 0.
            let cell = (f64::from(position[axis]) - low[axis]) * per_cell;
            cell.clamp(0.0, f64::from((1u32 << BITS) - 1)) as u64
        };
        let cut = if clips.is_some_and(|clips| cuts(&clips[i as usize])) { CUT } else { 0 };
        cut | spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2
    };
    let n = u32::try_from(positions.len() / 3).unwrap_or(u32::MAX);
    let mut keyed: Vec<Keyed> = (0..n).into_par_iter().map(|i| (code(i), i)).collect();
    let attributes = attributes_of(cloud);
    let compare_all = |a: &Keyed, b: &Keyed| {
        let by_place = || compare(at(a.1), at(b.1));
        a.0.cmp(&b.0).then_with(by_place).then_with(|| compare_attributes(&attributes, a.1, b.1))
    };
    let sort = |bucket: &mut [Keyed]| bucket.par_sort_unstable_by(compare_all);
    buckets(&mut keyed).into_par_iter().for_each(sort);
    keyed.into_par_iter().map(|(_, i)| i).collect()
}

/// Columns that decide between a cloud's surfels at one place.
fn attributes_of<'a>(cloud: &'a CloudView<'a>) -> Vec<&'a ColumnView<'a>> {
    TIE_BREAKERS.iter().filter_map(|name| cloud.column(name)).collect()
}

fn compare_attributes(attributes: &[&ColumnView<'_>], a: u32, b: u32) -> Ordering {
    let by_column =
        |column: &&ColumnView<'_>| compare_values(&column.values, column.components as usize, a, b);
    attributes.iter().map(by_column).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// Whether surfels at these places of an order are still in order where others are at the same position; the first
/// `n_whole` of all are not cut.
pub(crate) fn attributes_in_order(
    cloud: &CloudView<'_>,
    order: &[u32],
    places: &[u32],
    n_whole: u32,
) -> bool {
    let Some(positions) = cloud.floats(columns::POSITION, 3) else { return false };
    let at = |i: u32| positions.get(3 * i as usize..3 * i as usize + 3).unwrap_or_default();
    let attributes = attributes_of(cloud);
    // Those that are cut are ordered by themselves.
    let is_before =
        |place: u32, next: u32| match (order.get(place as usize), order.get(next as usize)) {
            (Some(&a), Some(&b)) if next != n_whole => {
                compare(at(a), at(b)).is_ne() || compare_attributes(&attributes, a, b).is_le()
            }
            _ => true,
        };
    let is_in_order = |&place: &u32| {
        is_before(place, place + 1)
            && place.checked_sub(1).is_none_or(|last| is_before(last, place))
    };
    places.par_iter().all(is_in_order)
}

/// A surfel's code and its number.
type Keyed = (u64, u32);

/// Bits of codes by which surfels are put into buckets.
const BUCKET_BITS: u32 = 11;

/// Buckets of which each has smaller codes than the next, made in place by the highest bits that differ: short lists
/// are sorted in fewer steps, and without reaching far in memory.
///
/// Source: the American flag sort of "Engineering Radix Sort", Computing Systems 6 (1), 1993.
fn buckets(keyed: &mut [Keyed]) -> Vec<&mut [Keyed]> {
    let first = keyed.first().map_or(0, |(code, _)| *code);
    let differing = keyed.iter().fold(0, |all, (code, _)| all | code ^ first);
    let shift = (u64::BITS - differing.leading_zeros()).saturating_sub(BUCKET_BITS);
    let bucket = |&(code, _): &Keyed| (code >> shift) as usize & ((1 << BUCKET_BITS) - 1);
    let mut lengths = vec![0usize; 1 << BUCKET_BITS];
    keyed.iter().for_each(|key| lengths[bucket(key)] += 1);
    let mut next: Vec<usize> = Vec::with_capacity(lengths.len());
    let mut sum = 0;
    for length in &lengths {
        next.push(sum);
        sum += length;
    }
    let mut end = 0;
    for (at, length) in lengths.iter().enumerate() {
        end += length;
        while next[at] < end {
            let to = bucket(&keyed[next[at]]);
            keyed.swap(next[at], next[to]);
            next[to] += 1;
        }
    }
    let mut rest = keyed;
    let mut split = |length: usize| {
        let (bucket, others) = std::mem::take(&mut rest).split_at_mut(length);
        rest = others;
        bucket
    };
    lengths.into_iter().map(&mut split).filter(|bucket| bucket.len() > 1).collect()
}

/// Columns that decide between surfels at one place.
pub(crate) const TIE_BREAKERS: [&str; 17] = [
    columns::NORMAL,
    columns::RADIUS,
    columns::ROUND,
    columns::TANGENT_U,
    columns::TANGENT_V,
    columns::COLOR,
    columns::AO,
    columns::MATERIAL,
    columns::NORMAL_FIELD,
    columns::CLIP,
    columns::OPACITY,
    columns::SPLAT_SCALE,
    columns::SPLAT_ROTATION,
    columns::SH[0],
    columns::SH[1],
    columns::SH[2],
    columns::SH[3],
];

/// Puts two empty bits in front of each of the lowest 21.
///
/// Source: Morton 1966; the masks are those of repeated halving.
fn spread(value: u64) -> u64 {
    let mut v = value & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

fn compare(a: &[f32], b: &[f32]) -> Ordering {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.total_cmp(b))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}

/// Compares two surfels' values in a column.
fn compare_values(values: &Values<'_>, components: usize, a: u32, b: u32) -> Ordering {
    let range = |i: u32| components * i as usize..components * (i as usize + 1);
    match values {
        Values::F32(v) => compare(&v[range(a)], &v[range(b)]),
        Values::F64(v) => {
            let pairs = v[range(a)].iter().zip(&v[range(b)]);
            pairs.map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
        }
        Values::I8(v) => v[range(a)].cmp(&v[range(b)]),
        Values::U8(v) => v[range(a)].cmp(&v[range(b)]),
        Values::I16(v) => v[range(a)].cmp(&v[range(b)]),
        Values::U16(v) => v[range(a)].cmp(&v[range(b)]),
        Values::I32(v) => v[range(a)].cmp(&v[range(b)]),
        Values::U32(v) => v[range(a)].cmp(&v[range(b)]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_by_three() {
        assert_eq!(spread(0b111), 0b100_1001);
        assert_eq!(spread(0x1f_ffff).count_ones(), 21);
        assert_eq!(spread(1 << 20), 1 << 60);
    }

    /// Numbers without order, of a generator.
    ///
    /// Source: Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators".
    fn mixed(seed: u64) -> u64 {
        let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z ^ z >> 27
    }

    /// Costs milliseconds.
    #[test]
    fn buckets_are_in_order_and_hold_everything() {
        for (n, mask) in
            [(0, u64::MAX), (1, 7), (5_000, u64::MAX), (5_000, 0xff00), (5_000, 1), (300, 0)]
        {
            let mut keyed: Vec<Keyed> = (0..n).map(|i| (mixed(i.into()) & mask, i)).collect();
            let mut expected = keyed.clone();
            buckets(&mut keyed).into_iter().for_each(<[Keyed]>::sort_unstable);
            expected.sort_unstable();
            assert_eq!(keyed, expected, "{n} {mask:x}");
        }
    }

    fn column<'a>(name: &'a str, components: u32, values: Values<'a>) -> ColumnView<'a> {
        ColumnView { name, components, generation: 0, values }
    }

    const FIELDS: [f32; 12] = [0.0, 0.0, 9.0, 9.0, 0.0, 0.0, 7.0, 9.0, 0.0, 0.0, 8.0, 9.0];

    #[test]
    fn surfels_that_are_cut_come_last() {
        let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0];
        let mut clips = [0.0; 21];
        clips[6] = 1.0;
        // Whose lines are no numbers is not cut.
        (clips[7], clips[13]) = (f32::NAN, 1.0);
        let all = [
            column(columns::POSITION, 3, Values::F32(&positions)),
            column(columns::TANGENT_U, 3, Values::F32(&[1.0; 9])),
            column(columns::TANGENT_V, 3, Values::F32(&[1.0; 9])),
            column(columns::CLIP, 7, Values::F32(&clips)),
        ];
        let ordered = |columns: &[ColumnView<'_>]| {
            drawing_order(&CloudView { len: 3, columns: columns.to_vec(), ..CloudView::default() })
        };
        assert_eq!(ordered(&all), [1, 2, 0]);
        assert_eq!(ordered(&all[..3]), [0, 1, 2]);
        // Lines are drawn of ellipses alone.
        assert_eq!(ordered(&[all[0], all[3]]), [0, 1, 2]);
    }

    #[test]
    fn points_at_one_place_are_ordered_by_their_attributes() {
        let position = column(columns::POSITION, 3, Values::F32(&[1.0; 9]));
        for decisive in [
            column(columns::RADIUS, 1, Values::F32(&[3.0, 1.0, 2.0])),
            column(columns::COLOR, 3, Values::U8(&[9, 9, 9, 9, 9, 7, 9, 9, 8])),
            column(columns::COLOR, 3, Values::U16(&[9, 9, 9, 9, 7, 9, 9, 8, 9])),
            column(columns::AO, 1, Values::F32(&[1.0, 0.25, 0.5])),
            column(columns::MATERIAL, 1, Values::U32(&[3, 1, 2])),
            column(columns::NORMAL_FIELD, 4, Values::F32(&FIELDS)),
        ] {
            let columns = vec![position, decisive];
            let cloud = CloudView { len: 3, columns, ..CloudView::default() };
            assert_eq!(drawing_order(&cloud), [1, 2, 0], "{}", decisive.name);
        }
        assert!(drawing_order(&CloudView::default()).is_empty());
    }
}
