//! The bytes of a column: little endian, byte planes apart, compressed by LZ4.

use std::borrow::Cow;
use surfelshop_api::columns::{Element, Values};
use surfelshop_cloud::Buffer;

/// How a column is stored.
pub(crate) const RAW: u32 = 0;
/// Byte planes apart, then an LZ4 block.
pub(crate) const SHUFFLED_LZ4: u32 = 1;

/// An LZ4 block stands for at most 255 times as many bytes: what announces more is damaged, and takes no memory.
const MOST_PACKED: usize = 256;

/// The bytes of values, little endian.
pub(crate) fn bytes_of(values: &Values<'_>) -> Vec<u8> {
    macro_rules! bytes {
        ($($variant:ident),*) => {
            match values {
                $(Values::$variant(values) => {
                    values.iter().flat_map(|value| value.to_le_bytes()).collect()
                })*
            }
        };
    }
    bytes!(I8, U8, I16, U16, I32, U32, F32, F64)
}

/// First all lowest bytes, then all second ones, and so on: those of neighbours are alike.
fn shuffled(bytes: &[u8], size: usize) -> Vec<u8> {
    let n = bytes.len() / size;
    let mut planes = vec![0; bytes.len()];
    for (i, value) in bytes.chunks_exact(size).enumerate() {
        for (plane, byte) in value.iter().enumerate() {
            planes[plane * n + i] = *byte;
        }
    }
    planes
}

fn unshuffled(planes: &[u8], size: usize) -> Vec<u8> {
    let n = planes.len() / size;
    let mut bytes = vec![0; planes.len()];
    for (i, value) in bytes.chunks_exact_mut(size).enumerate() {
        for (plane, byte) in value.iter_mut().enumerate() {
            *byte = planes[plane * n + i];
        }
    }
    bytes
}

/// A column's stored bytes, and how they are stored.
pub(crate) fn encode(values: &Values<'_>) -> (u32, Vec<u8>) {
    let bytes = bytes_of(values);
    let packed = lz4_flex::block::compress(&shuffled(&bytes, values.element().size()));
    if packed.len() < bytes.len() { (SHUFFLED_LZ4, packed) } else { (RAW, bytes) }
}

/// The values of stored bytes; `None` where they are not what they should be.
pub(crate) fn decode(
    stored: &[u8],
    encoding: u32,
    element: Element,
    n_values: usize,
) -> Option<Buffer> {
    let size = n_values.checked_mul(element.size())?;
    if size > stored.len().saturating_mul(MOST_PACKED) {
        return None;
    }
    let bytes = match encoding {
        RAW => Cow::Borrowed(stored),
        SHUFFLED_LZ4 => {
            let planes = lz4_flex::block::decompress(stored, size).ok()?;
            Cow::Owned(unshuffled(&planes, element.size()))
        }
        _ => return None,
    };
    (bytes.len() == size).then(|| Buffer::from_little_endian(element, &bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_comes_back_bit_by_bit() {
        let n = 1000i16;
        let all = [
            Buffer::I8((0..n).map(|i| i as i8).collect()),
            Buffer::U8((0..n).map(|i| i as u8).collect()),
            Buffer::I16((0..n).map(|i| i * 3 - 500).collect()),
            Buffer::U16((0..n).map(|i| i.cast_unsigned() * 17).collect()),
            Buffer::I32((0..n).map(|i| i32::from(i) * -70_001).collect()),
            Buffer::U32((0..n).map(|i| u32::from(i.cast_unsigned()) * 2_000_003).collect()),
            Buffer::F32((0..n).map(|i| f32::from(i).sin()).collect()),
            Buffer::F64((0..n).map(|i| f64::from(i).sqrt()).collect()),
        ];
        for values in all {
            let (encoding, stored) = encode(&values.as_values());
            let back = decode(&stored, encoding, values.element(), values.len());
            assert_eq!(back.as_ref(), Some(&values));
            assert_eq!(decode(&stored, encoding, values.element(), values.len() + 1), None);
            assert_eq!(decode(&stored[1..], RAW, values.element(), values.len()), None);
        }
    }
}
