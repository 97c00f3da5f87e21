//! Gaussians that `KHR_gaussian_splatting_compression_spz_2` packs: a stream of SPZ, versions 2 and 3, in a buffer view.
//!
//! It is unpacked into memory, 56 bytes for each Gaussian and 12 for each spherical harmonic, and read from there as
//! accessors are. The axes of SPZ point right, up and back; the extension says that those of glTF are left, up and front:
//! x and z change their signs.
//!
//! Source: Khronos Group, `KHR_gaussian_splatting_compression_spz_2` (draft); nianticlabs/spz, `load-spz.cc`.

use crate::accessor::Accessor;
use crate::buffers::{Buffers, Span};
use crate::extensions;
use crate::splats::Splats;
use flate2::bufread::GzDecoder;
use gltf::json::Root;
use gltf::json::mesh::Primitive;
use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Read;
use surfelshop_api::prelude::{Error, Result};

/// Bytes of the header.
const HEADER: usize = 16;

/// The highest degree of spherical harmonics that is read.
const MOST_DEGREE: usize = 3;

/// Most bytes that deflate makes of one.
const MOST_RATIO: u64 = 1032;

/// Bytes that are unpacked at once.
const PIECE: usize = 1 << 20;

/// What a step of a colour is of the constant spherical harmonic.
const COLOR: f32 = 0.15;

/// Signs of functions of direction where x and z change theirs, by order and m.
const SIGNS: [&[f32]; MOST_DEGREE + 1] = [
    &[1.0],
    &[1.0, -1.0, -1.0],
    &[-1.0, -1.0, 1.0, 1.0, 1.0],
    &[1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0],
];

/// Gaussians that were unpacked.
pub(crate) struct Packed {
    pub(crate) position: Accessor,
    pub(crate) splats: Splats,
}

/// What a stream says before its points.
struct Header {
    version: u32,
    n: usize,
    degree: usize,
    /// Bits behind the point of positions.
    bits: u8,
}

/// Bytes that are unpacked one after the other.
struct Stream<'a>(GzDecoder<&'a [u8]>);

/// Unpacks the Gaussians of a primitive, which are as many as its accessors say; `None` where none are packed so.
///
/// # Errors
/// Where the stream is damaged, or memory runs out.
pub(crate) fn unpacked(
    root: &Root,
    buffers: &mut Buffers,
    primitive: &Primitive,
    count: u32,
) -> Result<Option<Packed>> {
    let Some(view) = extensions::packed_view(primitive) else { return Ok(None) };
    let wrong = |line: &str| Error::new(format!("packed Gaussians: {line}"));
    let view = usize::try_from(view).unwrap_or(usize::MAX);
    let bytes = buffers.bytes(&buffers.view(root, view)?)?;
    let mut stream = Stream(GzDecoder::new(&bytes[..]));
    let header = Header::read(&mut stream, count, bytes.len() as u64)
        .map_err(|error| wrong(error.message()))?;
    let mut add = |values: Vec<f32>, components: usize| -> Result<Accessor> {
        let span: Span = buffers.add(&values)?;
        Ok(Accessor::of_floats(span, components, count))
    };
    let parts = header.parts(&mut stream).map_err(|error| wrong(error.message()))?;
    let harmonics = parts.harmonics.into_iter().map(|order| {
        order.into_iter().map(|values| add(values, 3)).collect::<Result<Vec<Accessor>>>()
    });
    let harmonics = harmonics.collect::<Result<Vec<_>>>()?;
    let position = add(parts.positions, 3)?;
    let (opacity, scale) = (add(parts.opacities, 1)?, add(parts.scales, 3)?);
    let rotation = add(parts.rotations, 4)?;
    Ok(Some(Packed { position, splats: Splats::of(opacity, scale, rotation, harmonics) }))
}

impl Header {
    fn read(stream: &mut Stream<'_>, count: u32, packed_bytes: u64) -> Result<Self> {
        let mut bytes = [0; HEADER];
        stream.read(&mut bytes)?;
        let (words, _) = bytes.as_chunks::<4>();
        let [magic, version, n] = [0, 1, 2].map(|i| u32::from_le_bytes(words[i]));
        let [degree, bits, ..] = words[3];
        if magic.to_le_bytes() != *b"NGSP" || !(2..=3).contains(&version) {
            return Err(Error::new("expected SPZ of version 2 or 3, found another"));
        }
        if n != count {
            return Err(Error::new(format!("expected {count} of them, found {n} in the stream")));
        }
        let degree = usize::from(degree);
        if degree > MOST_DEGREE || bits > 30 {
            return Err(Error::new(format!(
                "expected spherical harmonics of degree 0 to {MOST_DEGREE} and at most 30 bits behind the point, found \
                 {degree} and {bits}"
            )));
        }
        let header = Self { version, n: n as usize, degree, bits };
        let bytes = header.sizes().iter().map(|size| u64::from(n) * *size as u64).sum::<u64>();
        if bytes / MOST_RATIO > packed_bytes {
            return Err(Error::new(format!(
                "{packed_bytes} bytes of gzip cannot hold {n} Gaussians of {bytes} bytes"
            )));
        }
        Ok(header)
    }

    /// Spherical harmonics beyond the constant one.
    fn n_rest(&self) -> usize {
        self.degree * (self.degree + 2)
    }

    /// Bytes of a Gaussian by attribute, in the order of the stream: positions, opacities, colours, sizes, rotations,
    /// spherical harmonics.
    fn sizes(&self) -> [usize; 6] {
        [9, 1, 3, 3, if self.version < 3 { 3 } else { 4 }, 3 * self.n_rest()]
    }

    fn parts(&self, stream: &mut Stream<'_>) -> Result<Parts> {
        let [positions, opacities, colors, scales, rotations, rest] = self.sizes();
        let mut next = |size: usize| stream.bytes(size * self.n);
        let step = 1.0 / (1u32 << self.bits) as f32;
        let positions = next(positions)?;
        let place = |[a, b, c]: &[u8; 3], axis: usize| {
            // The sign is the highest of 24 bits.
            let number = step * (i32::from_le_bytes([0, *a, *b, *c]) >> 8) as f32;
            if axis == 1 { number } else { -number }
        };
        let positions = positions.as_chunks::<3>().0.iter().enumerate();
        let positions = collected(positions.map(|(i, bytes)| place(bytes, i % 3)))?;
        let opacities = collected(next(opacities)?.iter().map(|byte| f32::from(*byte) / 255.0))?;
        let color = |byte: &u8| (f32::from(*byte) / 255.0 - 0.5) / COLOR;
        let colors = collected(next(colors)?.iter().map(color))?;
        let scale = |byte: &u8| (f32::from(*byte) / 16.0 - 10.0).exp();
        let scales = collected(next(scales)?.iter().map(scale))?;
        let bytes = next(rotations)?;
        let rotations = match self.version {
            2 => collected(bytes.as_chunks::<3>().0.iter().flat_map(of_three_bytes))?,
            _ => collected(bytes.as_chunks::<4>().0.iter().flat_map(of_four_bytes))?,
        };
        let bytes = next(rest)?;
        let mut harmonics = vec![vec![colors]];
        for (order, signs) in SIGNS.iter().enumerate().take(self.degree + 1).skip(1) {
            let of = |m: usize| {
                let at = order * order - 1 + m;
                let own = bytes.chunks_exact(3 * self.n_rest());
                let value = |byte: &u8| signs[m] * (f32::from(*byte) - 128.0) / 128.0;
                collected(own.flat_map(|own| own[3 * at..3 * at + 3].iter().map(value)))
            };
            harmonics.push((0..=2 * order).map(of).collect::<Result<Vec<_>>>()?);
        }
        Ok(Parts { positions, opacities, scales, rotations, harmonics })
    }
}

/// Numbers of all Gaussians.
struct Parts {
    positions: Vec<f32>,
    opacities: Vec<f32>,
    scales: Vec<f32>,
    rotations: Vec<f32>,
    /// By order and m.
    harmonics: Vec<Vec<Vec<f32>>>,
}

/// Numbers in memory that was asked for.
fn collected(numbers: impl Iterator<Item = f32>) -> Result<Vec<f32>> {
    let mut all = Vec::new();
    for number in numbers {
        if all.len() == all.capacity() {
            all.try_reserve(all.len().max(1 << 10))?;
        }
        all.push(number);
    }
    Ok(all)
}

/// A quaternion of three components of 8 bits; that of w is at least 0.
fn of_three_bytes(bytes: &[u8; 3]) -> [f32; 4] {
    let [x, y, z] = bytes.map(|byte| f32::from(byte) / 127.5 - 1.0);
    let w = (1.0 - (x * x + y * y + z * z)).max(0.0).sqrt();
    turned([x, y, z, w])
}

/// A quaternion of 32 bits: which component is the largest, then a sign and nine bits of each of the others.
fn of_four_bytes(bytes: &[u8; 4]) -> [f32; 4] {
    let bits = u32::from_le_bytes(*bytes);
    let largest = (bits >> 30) as usize;
    let mut q = [0.0; 4];
    let mut rest = bits;
    // The last component has the lowest bits.
    for place in (0..4).rev().filter(|place| *place != largest) {
        let share = FRAC_1_SQRT_2 * (rest & 511) as f32 / 511.0;
        q[place] = if rest & 512 == 0 { share } else { -share };
        rest >>= 10;
    }
    q[largest] = (1.0 - q.iter().map(|c| c * c).sum::<f32>()).max(0.0).sqrt();
    turned(q)
}

/// A rotation in axes of which two point the other way.
fn turned([x, y, z, w]: [f32; 4]) -> [f32; 4] {
    let length = (x * x + y * y + z * z + w * w).sqrt();
    [-x, y, -z, w].map(|c| c / length)
}

impl Stream<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<()> {
        self.0.read_exact(bytes).map_err(|error| {
            Error::new(format!(
                "expected a stream of gzip, found one that ends or is damaged: {error}"
            ))
        })
    }

    /// The next bytes; memory is taken for what is there, and a piece more.
    fn bytes(&mut self, len: usize) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        while bytes.len() < len {
            let (start, n) = (bytes.len(), PIECE.min(len - bytes.len()));
            bytes.try_reserve(n)?;
            bytes.resize(start + n, 0);
            self.read(&mut bytes[start..])?;
        }
        Ok(bytes)
    }
}
