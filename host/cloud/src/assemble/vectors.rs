//! Columns of three numbers as vectors, and back.

use crate::cloud::buffer::Buffer;
use crate::table::Table;
use glam::Vec3;

/// Vectors as a flat buffer; nothing is copied.
pub(super) fn flat(vectors: Vec<Vec3>) -> Buffer {
    Buffer::F32(bytemuck::cast_vec(vectors))
}

/// Triples of numbers as vectors, where they are a number of whole ones; their memory is kept
/// unless it has an odd size.
pub(super) fn whole_vectors<
    T: bytemuck::NoUninit,
    V: bytemuck::AnyBitPattern + bytemuck::NoUninit,
>(
    triples: Vec<T>,
) -> Vec<V> {
    bytemuck::try_cast_vec(triples)
        .unwrap_or_else(|(_, triples)| bytemuck::cast_slice::<T, V>(&triples).to_vec())
}

/// Takes three columns as vectors in f32; what exceeds its range becomes infinite.
pub(super) fn take_vectors(table: &mut Table, names: [&str; 3]) -> Option<Vec<Vec3>> {
    if let Some(Buffer::F32(_)) = table.woven(&names)
        && let Some(Buffer::F32(triples)) = table.take_woven(&names)
    {
        return Some(whole_vectors(triples));
    }
    let [x, y, z] = table.take(names)?.each_ref().map(Buffer::to_f32);
    Some(x.iter().zip(&y).zip(&z).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect())
}
