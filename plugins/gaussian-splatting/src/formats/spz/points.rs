//! Gaussians out of the bytes of their attributes, and back.

use super::super::outgoing::byte;
use super::super::{Gaussian, MOST_REST, rest_of, rotation};
use super::header::{Attribute, Header};
use half::f16;

/// What a step of a colour is of the constant spherical harmonic: less than its whole range, so that colours may lie
/// outside what is shown.
const COLOR: f32 = 0.15;

/// Bytes of an attribute of the Gaussian at a place in the batch; `None` where it was not read.
fn part<const N: usize>(bytes: &[Vec<u8>; 6], attribute: Attribute, i: usize) -> Option<[u8; N]> {
    bytes[attribute as usize].get(N * i..)?.first_chunk().copied()
}

/// The Gaussian at a place in the batch. What was not read is as it is by default.
pub(super) fn gaussian(header: &Header, bytes: &[Vec<u8>; 6], i: usize) -> Gaussian {
    let mut found = Gaussian::default();
    found.position =
        if header.version == 1 { halves(bytes, i) } else { fixed(bytes, i, header.bits) }
            .unwrap_or(found.position);
    if let Some([opacity]) = part(bytes, Attribute::Opacities, i) {
        found.opacity = f32::from(opacity) / 255.0;
    }
    if let Some(color) = part::<3>(bytes, Attribute::Colors, i) {
        found.color = color.map(|value| (f32::from(value) / 255.0 - 0.5) / COLOR);
    }
    if let Some(scale) = part::<3>(bytes, Attribute::Sizes, i) {
        found.scale = scale.map(|value| (f32::from(value) / 16.0 - 10.0).exp());
    }
    if header.version < 3 {
        if let Some(xyz) = part::<3>(bytes, Attribute::Rotations, i) {
            let xyz = xyz.map(|value| f32::from(value) / 127.5 - 1.0);
            found.rotation = rotation::without_largest(xyz, 3);
        }
    } else if let Some(bits) = part(bytes, Attribute::Rotations, i) {
        found.rotation = rotation::unpacked(u32::from_le_bytes(bits));
    }
    let n = rest_of(header.degree);
    let harmonics = &bytes[Attribute::Harmonics as usize];
    let (harmonics, _) = harmonics.get(3 * n * i..).unwrap_or_default().as_chunks::<3>();
    for (value, stored) in found.rest.iter_mut().zip(harmonics).take(n.min(MOST_REST)) {
        *value = stored.map(|value| (f32::from(value) - 128.0) / 128.0);
    }
    found
}

fn halves(bytes: &[Vec<u8>; 6], i: usize) -> Option<[f32; 3]> {
    let position = part::<6>(bytes, Attribute::Positions, i)?;
    let (words, _) = position.as_chunks::<2>();
    Some([0, 1, 2].map(|axis| f16::from_le_bytes(words[axis]).to_f32()))
}

fn fixed(bytes: &[Vec<u8>; 6], i: usize, bits: u8) -> Option<[f32; 3]> {
    let position = part::<9>(bytes, Attribute::Positions, i)?;
    let (words, _) = position.as_chunks::<3>();
    let step = 1.0 / (1u32 << bits) as f32;
    Some([0, 1, 2].map(|axis| {
        let [a, b, c] = words[axis];
        // The sign is the highest of 24 bits.
        step * (i32::from_le_bytes([0, a, b, c]) >> 8) as f32
    }))
}

/// Bytes of a Gaussian's attributes but for its position and spherical harmonics, in the order of files, as version 3
/// has them, and whether they hold it.
pub(super) fn bytes(gaussian: &Gaussian) -> ([u8; 1], [u8; 3], [u8; 3], [u8; 4], bool) {
    let mut holds = true;
    let mut cut = |value: f32| {
        holds &= (-0.5..255.5).contains(&value);
        byte(value)
    };
    let color = gaussian.color.map(|value| cut(255.0 * (COLOR * value + 0.5)));
    // Sizes below the smallest are nothing at all.
    let scale = gaussian.scale.map(|value| cut(((value.ln() + 10.0) * 16.0).max(0.0)));
    let rotation = rotation::packed(gaussian.rotation).to_le_bytes();
    ([byte(255.0 * gaussian.opacity)], color, scale, rotation, holds)
}

/// The byte of a spherical harmonic, and whether it holds it.
pub(super) fn harmonic(value: f32) -> (u8, bool) {
    let value = 128.0 * value + 128.0;
    (byte(value), (-0.5..255.5).contains(&value))
}

/// The bytes of a position in steps of so many bits behind the point, which hold it.
pub(super) fn position(place: [f64; 3], bits: u8) -> [u8; 9] {
    let mut bytes = [0; 9];
    let (words, _) = bytes.as_chunks_mut::<3>();
    for (word, number) in words.iter_mut().zip(place) {
        let [a, b, c, _] = ((number * f64::from(1u32 << bits)).round() as i32).to_le_bytes();
        *word = [a, b, c];
    }
    bytes
}
