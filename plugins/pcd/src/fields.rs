//! Points field by field, compressed as they come: memory holds what the file will, and no more.

use crate::encode::Field;
use crate::lzf;
use surfelshop_api::prelude::{Job, Result};

/// Bytes of a field that are compressed at once: copies reach 8192 bytes back, so hardly anything is lost.
const PIECE: usize = 1 << 17;

/// Values of a field.
#[derive(Default)]
struct Packed {
    /// Compressed, with the bytes that they were.
    pieces: Vec<(Vec<u8>, usize)>,
    /// Not yet compressed.
    open: Vec<u8>,
}

impl Packed {
    fn close(&mut self) -> Result<()> {
        if !self.open.is_empty() {
            self.pieces.try_reserve(1)?;
            self.pieces.push((lzf::compress(&self.open), self.open.len()));
            self.open.clear();
        }
        Ok(())
    }

    fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.open.try_reserve(bytes.len())?;
        self.open.extend_from_slice(bytes);
        if self.open.len() >= PIECE { self.close() } else { Ok(()) }
    }
}

/// Fields of points, each by itself.
#[derive(Default)]
pub(crate) struct PackedFields {
    fields: Vec<Packed>,
    /// Bytes that were compressed, or will be.
    pub(crate) len: u64,
}

impl PackedFields {
    /// Adds points of these fields.
    ///
    /// # Errors
    /// Where memory runs out.
    pub(crate) fn append(&mut self, rows: &[u8], fields: &[Field]) -> Result<()> {
        self.fields.resize_with(fields.len(), Packed::default);
        let step: usize = fields.iter().map(Field::bytes).sum();
        let (mut offset, mut values) = (0, Vec::new());
        for (field, packed) in fields.iter().zip(&mut self.fields) {
            let end = offset + field.bytes();
            values.clear();
            values.try_reserve(rows.len() / step.max(1) * field.bytes())?;
            for row in rows.chunks_exact(step.max(1)) {
                values.extend_from_slice(&row[offset..end]);
            }
            for part in values.chunks(PIECE) {
                packed.append(part)?;
            }
            offset = end;
        }
        self.len += rows.len() as u64;
        Ok(())
    }

    /// Gives the three coordinates, the first fields, 8 bytes each.
    ///
    /// # Errors
    /// Where memory runs out, or the user asked to stop.
    pub(crate) fn widen(&mut self, job: &Job<'_>) -> Result<()> {
        for axis in self.fields.iter_mut().take(3) {
            axis.close()?;
            for (piece, len) in &mut axis.pieces {
                job.check()?;
                let narrow = lzf::decompress(piece, *len, |_| Ok(()))?;
                let values = narrow.as_chunks::<4>().0.iter();
                let wide: Vec<u8> = values
                    .flat_map(|value| f64::from(f32::from_le_bytes(*value)).to_le_bytes())
                    .collect();
                self.len += (wide.len() - *len) as u64;
                (*piece, *len) = (lzf::compress(&wide), wide.len());
            }
        }
        Ok(())
    }

    /// The compressed bytes, field by field.
    ///
    /// # Errors
    /// Where memory runs out.
    pub(crate) fn finish(mut self) -> Result<Vec<Vec<u8>>> {
        self.fields.iter_mut().try_for_each(Packed::close)?;
        let pieces = self.fields.into_iter().flat_map(|field| field.pieces);
        Ok(pieces.map(|(piece, _)| piece).collect())
    }
}
