//! Gaussians out of packed words.

use super::super::{Gaussian, SH_0, rest_of, rotation};
use super::header::Header;
use std::f32::consts::SQRT_2;

/// Gaussians of a chunk.
pub(super) const CHUNK: usize = 256;

/// Smallest and largest values of three numbers.
type Bounds = [[f32; 3]; 2];

/// The bounds of a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    position: Bounds,
    /// Logarithms.
    scale: Bounds,
    color: Bounds,
}

/// A Gaussian as chunks take it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub(super) position: [f64; 3],
    /// Logarithms.
    pub(super) scale: [f32; 3],
    /// As it is shown, 0 to 1.
    pub(super) color: [f32; 3],
    pub(super) opacity: u8,
    /// x, y, z, w.
    pub(super) rotation: [f32; 4],
}

/// The bytes of a word in a row; zeros where there is none, which the header rules out.
fn word(row: &[u8], offset: usize) -> [u8; 4] {
    row.get(offset..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default()
}

impl Chunk {
    /// The chunk of a row.
    pub(super) fn of(header: &Header, row: &[u8]) -> Self {
        let triple = |offsets: &[usize]| -> [f32; 3] {
            std::array::from_fn(|axis| f32::from_le_bytes(word(row, offsets[axis])))
        };
        let bounds = &header.bounds;
        Self {
            position: [triple(&bounds[0..3]), triple(&bounds[3..6])],
            scale: [triple(&bounds[6..9]), triple(&bounds[9..12])],
            color: match &header.color_bounds {
                Some(offsets) => [triple(&offsets[0..3]), triple(&offsets[3..6])],
                None => [[0.0; 3], [1.0; 3]],
            },
        }
    }

    /// The narrowest around these.
    pub(super) fn around<'a>(gaussians: impl Iterator<Item = &'a Prepared>) -> Self {
        let none = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let wide = |[low, high]: &mut Bounds, values: [f32; 3]| {
            for (axis, value) in values.into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        };
        let mut chunk = Self { position: none, scale: none, color: none };
        for gaussian in gaussians {
            wide(&mut chunk.position, gaussian.position.map(|number| number as f32));
            wide(&mut chunk.scale, gaussian.scale);
            wide(&mut chunk.color, gaussian.color);
        }
        chunk
    }

    /// The row of a file, with bounds of colours.
    pub(super) fn bytes(&self) -> [u8; 72] {
        let mut bytes = [0; 72];
        let all = [self.position, self.scale, self.color];
        let numbers = all.as_flattened().as_flattened();
        let (words, _) = bytes.as_chunks_mut::<4>();
        for (word, number) in words.iter_mut().zip(numbers) {
            *word = number.to_le_bytes();
        }
        bytes
    }

    /// The row of a Gaussian within its bounds.
    pub(super) fn packed(&self, gaussian: &Prepared) -> [u8; 16] {
        let Prepared { position, scale, color, opacity, rotation } = *gaussian;
        let [red, green, blue] =
            [0, 1, 2].map(|axis| bits_of(share_of(color[axis].into(), axis, &self.color), 8));
        let words = [
            together(position, &self.position),
            turned(rotation),
            together(scale.map(f64::from), &self.scale),
            red << 24 | green << 16 | blue << 8 | u32::from(opacity),
        ];
        let mut row = [0; 16];
        let (parts, _) = row.as_chunks_mut::<4>();
        for (part, word) in parts.iter_mut().zip(words) {
            *part = word.to_le_bytes();
        }
        row
    }
}

/// Where a number lies between the bounds of an axis, 0 to 1; 0 where these are equal.
fn share_of(number: f64, axis: usize, [low, high]: &Bounds) -> f64 {
    let (low, high) = (f64::from(low[axis]), f64::from(high[axis]));
    if high > low { ((number - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
}

/// So many bits of a share, as [`share`] takes them.
fn bits_of(share: f64, bits: u32) -> u32 {
    (share * f64::from((1u32 << bits) - 1)).round() as u32
}

/// Numbers between bounds in 11, 10 and 11 bits, as [`between`] takes them.
fn together(numbers: [f64; 3], bounds: &Bounds) -> u32 {
    let bits = |axis: usize, n: u32| bits_of(share_of(numbers[axis], axis, bounds), n);
    bits(0, 11) << 21 | bits(1, 10) << 11 | bits(2, 11)
}

/// The word of a rotation: two bits for the place of the largest of w, x, y, z, then ten for each of the others.
fn turned(rotation: [f32; 4]) -> u32 {
    let [x, y, z, w] = rotation::unit(rotation);
    let q = [w, x, y, z];
    let place = rotation::largest(q);
    let others = (0..4).filter(|i| *i != place);
    others.fold(place as u32, |word, i| {
        let number = q[i] * q[place].signum() / SQRT_2 + 0.5;
        word << 10 | bits_of(f64::from(number).clamp(0.0, 1.0), 10)
    })
}

/// The packed words of a Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    position: u32,
    rotation: u32,
    scale: u32,
    color: u32,
}

/// The share of its range of a number of so many bits.
fn share(word: u32, shift: u32, bits: u32) -> f32 {
    let most = (1u32 << bits) - 1;
    ((word >> shift) & most) as f32 / most as f32
}

/// Numbers of 11, 10 and 11 bits between bounds.
fn between(word: u32, bounds: &Bounds) -> [f32; 3] {
    mixed([share(word, 21, 11), share(word, 11, 10), share(word, 0, 11)], bounds)
}

fn mixed(shares: [f32; 3], [low, high]: &Bounds) -> [f32; 3] {
    std::array::from_fn(|axis| low[axis] * (1.0 - shares[axis]) + high[axis] * shares[axis])
}

impl Vertex {
    /// The words of a row.
    pub(super) fn of(header: &Header, row: &[u8]) -> Self {
        let [position, rotation, scale, color] =
            header.packed.map(|offset| u32::from_le_bytes(word(row, offset)));
        Self { position, rotation, scale, color }
    }

    /// The Gaussian, with the bounds of its chunk.
    pub(super) fn gaussian(&self, chunk: &Chunk) -> Gaussian {
        let three = [20, 10, 0].map(|shift| (share(self.rotation, shift, 10) - 0.5) * SQRT_2);
        let [w, x, y, z] = rotation::without_largest(three, (self.rotation >> 30) as usize);
        let [red, green, blue, opacity] = [24, 16, 8, 0].map(|shift| share(self.color, shift, 8));
        Gaussian {
            position: between(self.position, &chunk.position),
            opacity,
            scale: between(self.scale, &chunk.scale).map(f32::exp),
            rotation: [x, y, z, w],
            color: mixed([red, green, blue], &chunk.color).map(|shown| (shown - 0.5) / SH_0),
            ..Gaussian::default()
        }
    }
}

/// Puts the spherical harmonics of a row into a Gaussian.
pub(super) fn add_harmonics(header: &Header, row: &[u8], gaussian: &mut Gaussian) {
    let n = rest_of(header.degree());
    for (k, value) in gaussian.rest.iter_mut().take(n).enumerate() {
        *value = std::array::from_fn(|channel| {
            let offset = header.rest.get(channel * n + k);
            let byte = offset.and_then(|offset| row.get(*offset)).copied();
            byte.map_or(0.0, harmonic)
        });
    }
}

/// A spherical harmonic between -4 and 4, of the middle of its step but at the ends.
fn harmonic(byte: u8) -> f32 {
    let share = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (f32::from(byte) + 0.5) / 256.0,
    };
    8.0 * (share - 0.5)
}

/// The byte of a spherical harmonic, and whether it holds it; 0 of what is no number.
pub(super) fn harmonic_byte(value: f32) -> (u8, bool) {
    let value = if value.is_finite() { value } else { 0.0 };
    let step = (256.0 * (value / 8.0 + 0.5)).floor();
    (step as u8, (0.0..=256.0).contains(&step))
}
