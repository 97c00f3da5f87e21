//! Numbers within bytes, most significant byte first. What lies behind the end reads as zeros: callers have
//! checked their places against the record before.

/// So many bytes from a place.
fn chunk<const N: usize>(bytes: &[u8], place: usize) -> [u8; N] {
    bytes.get(place..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
}

/// The byte at a place.
pub(crate) fn u8_at(bytes: &[u8], place: usize) -> u8 {
    bytes.get(place).copied().unwrap_or(0)
}

/// The 16-bit number at a place.
pub(crate) fn u16_at(bytes: &[u8], place: usize) -> u16 {
    u16::from_be_bytes(chunk(bytes, place))
}

/// The 32-bit number at a place.
pub(crate) fn u32_at(bytes: &[u8], place: usize) -> u32 {
    u32::from_be_bytes(chunk(bytes, place))
}

/// The 32-bit float at a place.
pub(crate) fn f32_at(bytes: &[u8], place: usize) -> f32 {
    f32::from_be_bytes(chunk(bytes, place))
}

/// The 64-bit float at a place.
pub(crate) fn f64_at(bytes: &[u8], place: usize) -> f64 {
    f64::from_be_bytes(chunk(bytes, place))
}

/// Three 32-bit floats from a place.
pub(crate) fn vector_at(bytes: &[u8], place: usize) -> [f32; 3] {
    [f32_at(bytes, place), f32_at(bytes, place + 4), f32_at(bytes, place + 8)]
}

/// Stores bytes at a place of a record; those that would lie behind its end are dropped.
pub(crate) fn put(record: &mut [u8], place: usize, bytes: &[u8]) {
    let rest = record.get_mut(place..).unwrap_or_default();
    for (to, from) in rest.iter_mut().zip(bytes) {
        *to = *from;
    }
}
