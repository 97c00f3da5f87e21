//! Normals as 16 or 32 bits: a face of a cube and two coordinates on it.
//!
//! From the lowest bit: `u`, `v` (6 bits each, or 14), an unused bit, the sign of the largest component, and which component
//! that is (two bits). Codes of face 3 are the null vector, or invalid where the sign is set.

use surfelshop_api::glam::DVec3;

/// The face of the null vector, and of invalid codes.
const NO_FACE: u32 = 3;

/// A kind of code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cube {
    /// 16 bits: directions are up to 1.3 degrees wrong.
    Cub16,
    /// 32 bits: directions are up to 0.005 degrees wrong.
    Cub32,
}

impl Cube {
    /// Bits of a coordinate.
    const fn bits(self) -> u32 {
        match self {
            Self::Cub16 => 6,
            Self::Cub32 => 14,
        }
    }

    /// Half of the edge of a face, in steps of a coordinate.
    fn half(self) -> f64 {
        f64::from((1_u32 << self.bits()) - 1) / 2.0
    }

    /// Place of the sign.
    const fn sign_bit(self) -> u32 {
        2 * self.bits() + 1
    }

    /// The unit vector of a code, zero for the null vector; `None` where the code is invalid.
    pub(crate) fn decode(self, code: u32) -> Option<DVec3> {
        let (bits, h) = (self.bits(), self.half());
        let mask = (1 << bits) - 1;
        let is_negative = code >> self.sign_bit() & 1 == 1;
        let face = code >> (self.sign_bit() + 1) & 3;
        if face == NO_FACE {
            return (!is_negative).then_some(DVec3::ZERO);
        }
        let a = f64::from(code & mask) - h;
        let b = f64::from(code >> bits & mask) - h;
        let f = 1.0 / (h * h + a * a + b * b).sqrt();
        let major = if is_negative { -h * f } else { h * f };
        Some(match face {
            0 => DVec3::new(a * f, b * f, major),
            1 => DVec3::new(a * f, major, b * f),
            _ => DVec3::new(major, a * f, b * f),
        })
    }

    /// The code of a vector of any length; the null vector's where it is zero or not finite.
    pub(crate) fn encode(self, vector: DVec3) -> u32 {
        let (bits, h) = (self.bits(), self.half());
        let size = vector.abs();
        let (face, major, minors) = if size.z > size.x && size.z > size.y {
            (0, vector.z, [vector.x, vector.y])
        } else if size.y > size.x {
            (1, vector.y, [vector.x, vector.z])
        } else {
            (2, vector.x, [vector.y, vector.z])
        };
        if major == 0.0 || !vector.is_finite() {
            return NO_FACE << (self.sign_bit() + 1);
        }
        // A minor component is at most as large as the major one: the sum lies in the bits of a coordinate.
        let [u, v] =
            minors.map(|minor| (h * (minor / major.abs()) + f64::from(1_u32 << (bits - 1))) as u32);
        u | v << bits | u32::from(major < 0.0) << self.sign_bit() | face << (self.sign_bit() + 1)
    }
}
