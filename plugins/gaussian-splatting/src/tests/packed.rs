//! SPZ files made byte by byte.

use super::noise;
use flate2::Compression;
use flate2::write::GzEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Write;

/// The bytes of a file, attribute by attribute.
#[derive(Clone)]
pub(super) struct Packed {
    pub(super) version: u32,
    pub(super) points: u32,
    pub(super) degree: u8,
    pub(super) bits: u8,
    pub(super) flags: u8,
    /// Positions, opacities, colours, sizes, rotations, spherical harmonics.
    pub(super) attributes: [Vec<u8>; 6],
    /// Before the table of version 4, behind the points of others.
    pub(super) extensions: Vec<u8>,
}

impl Packed {
    /// A file of bytes that mean nothing.
    pub(super) fn noise(version: u32, degree: u8, points: u32) -> Self {
        let position = if version == 1 { 6 } else { 9 };
        let rotation = if version < 3 { 3 } else { 4 };
        let harmonics = 3 * usize::from(degree) * (usize::from(degree) + 2);
        let sizes = [position, 1, 3, 3, rotation, harmonics];
        let mut attributes =
            sizes.map(|size| noise(size * points as usize, size as u64 * 77 + u64::from(version)));
        if version == 1 {
            // Numbers below 2.
            attributes[0].iter_mut().skip(1).step_by(2).for_each(|high| *high &= 0xbf);
        }
        let (bits, flags, extensions) = (12, 0, Vec::new());
        Self { version, points, degree, bits, flags, attributes, extensions }
    }

    fn head(&self, last: u8) -> Vec<u8> {
        let [version, points] = [self.version, self.points].map(u32::to_le_bytes);
        [b"NGSP", &version[..], &points, &[self.degree, self.bits, self.flags, last]].concat()
    }

    /// What a file of versions 1 to 3 is before it is packed.
    pub(super) fn plain(&self) -> Vec<u8> {
        [self.head(0), self.attributes.concat(), self.extensions.clone()].concat()
    }

    pub(super) fn file(&self) -> Vec<u8> {
        if self.version < 4 {
            return gzip(&self.plain());
        }
        let kept = self.attributes.iter().filter(|bytes| !bytes.is_empty());
        let streams: Vec<Vec<u8>> = kept
            .clone()
            .map(|bytes| compress_to_vec(&bytes[..], CompressionLevel::Fastest))
            .collect();
        let mut file = self.head(streams.len() as u8);
        file.extend((32 + self.extensions.len() as u32).to_le_bytes());
        file.extend([0; 12]);
        file.extend(&self.extensions);
        for (packed, bytes) in streams.iter().zip(kept) {
            file.extend((packed.len() as u64).to_le_bytes());
            file.extend((bytes.len() as u64).to_le_bytes());
        }
        [file, streams.concat()].concat()
    }
}

pub(super) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}
