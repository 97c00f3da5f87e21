//! File formats of Gaussian splats.

mod batch;
mod compressed_ply;
mod outgoing;
mod rotation;
mod sog;
mod splat;
mod spz;

pub(crate) use compressed_ply::CompressedPly;
pub(crate) use sog::Sog;
pub(crate) use splat::Splat;
pub(crate) use spz::Spz;

/// The spherical harmonic of order 0, which is constant.
const SH_0: f32 = 0.282_094_8;

/// The comment on scenes that were trained with antialiasing.
const ANTIALIASED: &str = "trained with antialiasing";

/// Spherical harmonics of the orders 1 to 3.
const MOST_REST: usize = 15;

/// Spherical harmonics of the orders 1 to `degree`.
const fn rest_of(degree: usize) -> usize {
    degree * (degree + 2)
}

/// A Gaussian as files have it: sizes as they are, not their logarithms, but the signs of spherical harmonics as 3DGS
/// has them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gaussian {
    position: [f32; 3],
    opacity: f32,
    scale: [f32; 3],
    /// x, y, z, w.
    rotation: [f32; 4],
    /// Order 0, red, green and blue.
    color: [f32; 3],
    /// Orders 1 to 3, from m = -l to l.
    rest: [[f32; 3]; MOST_REST],
}

impl Default for Gaussian {
    fn default() -> Self {
        Self {
            position: [0.0; 3],
            opacity: 1.0,
            scale: [0.0; 3],
            rotation: rotation::IDENTITY,
            color: [0.0; 3],
            rest: [[0.0; 3]; MOST_REST],
        }
    }
}

/// The sign between the conventions of files and ours of a spherical harmonic, counted from the first of order 1: the
/// Condon-Shortley phase turns odd m round.
const fn sign(index: usize) -> f32 {
    // Of the order l the first has the index l² - 1 and m = -l.
    let order = match index {
        0..3 => 1,
        3..8 => 2,
        _ => 3,
    };
    let from_first = index + 1 - order * order;
    if (from_first + order).is_multiple_of(2) { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod sign_tests {
    use super::*;

    #[test]
    fn odd_numbers_m_are_turned_round() {
        let signs: Vec<f32> = (0..MOST_REST).map(sign).collect();
        let orders = [
            [-1.0, 1.0, -1.0].as_slice(),
            &[1.0, -1.0, 1.0, -1.0, 1.0],
            &[-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0],
        ];
        assert_eq!(signs, orders.concat());
        assert_eq!([0, 1, 2, 3, 4].map(rest_of), [0, 3, 8, 15, 24]);
    }
}
