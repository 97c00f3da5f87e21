//! Bytes of elements as numbers.

use crate::accessor::Shape;
use gltf::json::accessor::ComponentType;

/// Numbers of a type, from their bytes.
macro_rules! numbers {
    ($bytes:expr, $type:ty) => {
        $bytes.as_chunks::<{ size_of::<$type>() }>().0.iter().map(|b| <$type>::from_le_bytes(*b))
    };
}
pub(crate) use numbers;

/// Calls a body with the numbers of bytes as an iterator of `f64`, normalised where they are meant so.
fn each(bytes: &[u8], shape: Shape, mut take: impl FnMut(f64)) {
    macro_rules! taken {
        ($type:ty) => {{
            // Signed numbers have one more below zero than above.
            let largest = f64::from(<$type>::MAX);
            for value in numbers!(bytes, $type) {
                let value = f64::from(value);
                take(if shape.normalized { (value / largest).max(-1.0) } else { value });
            }
        }};
    }
    match shape.kind {
        ComponentType::I8 => taken!(i8),
        ComponentType::U8 => taken!(u8),
        ComponentType::I16 => taken!(i16),
        ComponentType::U16 => taken!(u16),
        ComponentType::U32 => taken!(u32),
        ComponentType::F32 => numbers!(bytes, f32).for_each(|value| take(f64::from(value))),
    }
}

/// All numbers, components one after the other.
pub(crate) fn floats(bytes: &[u8], shape: Shape) -> Vec<f64> {
    let mut out = Vec::with_capacity(bytes.len() / shape.kind.size());
    each(bytes, shape, |value| out.push(value));
    out
}
