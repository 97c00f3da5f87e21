//! Points in the first version of the compression, as `LASzip` wrote them: what `laz` 0.13 writes otherwise is here.

use laz::compressors::{IntegerCompressor, IntegerCompressorBuilder};
use laz::encoders::ArithmeticEncoder;
use laz::las::v1;
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::{FieldCompressor, RecordCompressor as _, SequentialPointRecordCompressor};
use laz::{LazItem, LazItemType};
use std::io;

/// Records, compressed in one run.
pub(super) fn compressed(items: &Vec<LazItem>, records: &[u8]) -> Vec<u8> {
    let mut compressor = SequentialPointRecordCompressor::new(Vec::new());
    if items[0].version() == 1 {
        for item in items {
            match item.item_type() {
                LazItemType::GpsTime => {
                    compressor.add_field_compressor(v1::LasGpsTimeCompressor::default());
                }
                LazItemType::RGB12 => compressor.add_field_compressor(Bytes::of_colors()),
                LazItemType::WavePacket13 => {
                    compressor.add_field_compressor(v1::LasWavepacketCompressor::default());
                }
                LazItemType::Byte(n) => compressor.add_field_compressor(Bytes::new(n.into())),
                _ => compressor.add_field_compressor(v1::LasPoint0Compressor::default()),
            }
        }
    } else {
        compressor.set_fields_from(items).unwrap();
    }
    compressor.compress_many(records).unwrap();
    compressor.done().unwrap();
    compressor.into_inner()
}

/// Bytes, each as a difference from that of the last point; of colours only those that change, and first which.
struct Bytes {
    last: Vec<u8>,
    changes: Option<ArithmeticModel>,
    differences: IntegerCompressor,
}

impl Bytes {
    fn new(n: usize) -> Self {
        let mut differences = IntegerCompressorBuilder::new();
        let differences = differences.bits(8).contexts(n as u32).build_initialized();
        Self { last: vec![0; n], changes: None, differences }
    }

    fn of_colors() -> Self {
        let changes = ArithmeticModelBuilder::new(64).with_compression(true).build();
        Self { changes: Some(changes), ..Self::new(6) }
    }
}

impl<W: io::Write> FieldCompressor<W> for Bytes {
    fn size_of_field(&self) -> usize {
        self.last.len()
    }

    fn compress_first(&mut self, out: &mut W, first: &[u8]) -> io::Result<()> {
        self.last.copy_from_slice(first);
        out.write_all(first)
    }

    fn compress_with(&mut self, out: &mut ArithmeticEncoder<W>, bytes: &[u8]) -> io::Result<()> {
        let changed = |i: usize| self.last[i] != bytes[i];
        let written: Vec<bool> =
            (0..bytes.len()).map(|i| self.changes.is_none() || changed(i)).collect();
        if let Some(model) = &mut self.changes {
            let bits = written.iter().enumerate().map(|(i, written)| u32::from(*written) << i);
            out.encode_symbol(model, bits.sum())?;
        }
        for (i, _) in written.iter().enumerate().filter(|(_, written)| **written) {
            let (last, now) = (i32::from(self.last[i]), i32::from(bytes[i]));
            self.differences.compress(out, last, now, i as u32)?;
        }
        self.last.copy_from_slice(bytes);
        Ok(())
    }
}
