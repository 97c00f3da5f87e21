//! Quaternions x, y, z, w out of few bits.

use std::f32::consts::FRAC_1_SQRT_2;

/// No rotation.
pub(super) const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// The same rotation, of length 1; none where there is no telling.
pub(super) fn unit(q: [f32; 4]) -> [f32; 4] {
    let length = q.iter().map(|c| c * c).sum::<f32>().sqrt();
    if length.is_finite() && length > 0.0 { q.map(|c| c / length) } else { IDENTITY }
}

/// A quaternion of whose components three are stored, in order, and the one at `place` is the largest, at least 0.
pub(super) fn without_largest(three: [f32; 3], place: usize) -> [f32; 4] {
    let [a, b, c] = three;
    let largest = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    unit(match place {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    })
}

/// Bits of a number of the [`packed`] form: its sign, and its share of √½.
const SHARE: u32 = (1 << 9) - 1;

/// The quaternion of 32 bits: two for the place of the largest, then ten for each of the others, a sign and a share
/// of √½.
pub(super) fn unpacked(bits: u32) -> [f32; 4] {
    let number = |shift: u32| {
        let bits = bits >> shift;
        let share = FRAC_1_SQRT_2 * (bits & SHARE) as f32 / SHARE as f32;
        if bits & (SHARE + 1) == 0 { share } else { -share }
    };
    without_largest([number(20), number(10), number(0)], (bits >> 30) as usize)
}

/// The place of the component that is farthest from 0, the first of equal ones.
pub(super) fn largest(q: [f32; 4]) -> usize {
    (1..4).fold(0, |most, i| if q[i].abs() > q[most].abs() { i } else { most })
}

/// The 32 bits of a quaternion, as [`unpacked`] takes them.
pub(super) fn packed(q: [f32; 4]) -> u32 {
    let q = unit(q);
    let place = largest(q);
    let others = (0..4).filter(|i| *i != place);
    others.fold(place as u32, |bits, i| {
        let sign = u32::from((q[i] < 0.0) != (q[place] < 0.0));
        let share = (q[i].abs() / FRAC_1_SQRT_2 * SHARE as f32).round() as u32;
        (bits << 10) | (sign << 9) | share.min(SHARE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_rotations_come_back() {
        for i in 0..2000 {
            let q = [0.7, 1.3, 2.1, 3.7].map(|f| (i as f32 * f + f).sin());
            let q = unit(q);
            let found = unpacked(packed(q));
            let turn: f32 = q.iter().zip(found).map(|(a, b)| a * b).sum();
            assert!(turn.abs() > 1.0 - 1e-5, "{q:?} {found:?}");
        }
        assert_eq!(unpacked(packed(IDENTITY)), IDENTITY);
        assert_eq!(unit([0.0; 4]), IDENTITY);
        assert_eq!(unit([f32::NAN, 0.0, 0.0, 0.0]), IDENTITY);
    }

    #[test]
    fn any_bits_are_a_unit_quaternion() {
        for i in 0..100_000u32 {
            let length: f32 = unpacked(i.wrapping_mul(0x9e37_79b9)).iter().map(|c| c * c).sum();
            assert!((length - 1.0).abs() < 1e-5);
        }
    }
}
