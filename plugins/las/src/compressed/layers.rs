//! The layers of a chunk: each holds the values of a field.

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use std::io::{self, Read};

/// The bytes of a layer.
#[derive(Default)]
pub(super) struct LayerBytes {
    bytes: Vec<u8>,
    place: usize,
}

impl Read for LayerBytes {
    #[inline]
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut rest = &self.bytes[self.place..];
        let n = rest.read(out)?;
        self.place += n;
        Ok(n)
    }

    #[inline]
    fn read_exact(&mut self, out: &mut [u8]) -> io::Result<()> {
        let end = self.place + out.len();
        let bytes = self.bytes.get(self.place..end).ok_or(io::ErrorKind::UnexpectedEof)?;
        out.copy_from_slice(bytes);
        self.place = end;
        Ok(())
    }
}

/// A layer that is decoded.
pub(super) struct Layer {
    pub(super) decoder: ArithmeticDecoder<LayerBytes>,
    /// Length in bytes.
    len: usize,
    /// Whether there is something to decode that is wanted; else the value of the first point stays.
    pub(super) is_open: bool,
}

impl Layer {
    pub(super) fn new() -> Self {
        Self { decoder: ArithmeticDecoder::new(LayerBytes::default()), len: 0, is_open: false }
    }

    /// Reads the length.
    pub(super) fn read_len(&mut self, bytes: &mut impl Read) -> io::Result<()> {
        let mut len = [0; 4];
        bytes.read_exact(&mut len)?;
        self.len = u32::from_le_bytes(len) as usize;
        Ok(())
    }

    /// Reads the bytes, of which there are as many as the length says, or passes over them.
    pub(super) fn read(
        &mut self,
        bytes: &mut (impl Read + io::Seek),
        is_wanted: bool,
    ) -> io::Result<()> {
        self.is_open = is_wanted && self.len > 0;
        if !self.is_open {
            bytes.seek_relative(self.len as i64)?;
            return Ok(());
        }
        let mut layer = vec![0; self.len];
        bytes.read_exact(&mut layer)?;
        self.decoder = ArithmeticDecoder::new(LayerBytes { bytes: layer, place: 0 });
        self.decoder.read_init_bytes()
    }

    /// The next symbol of a model.
    #[inline]
    pub(super) fn symbol(&mut self, model: &mut ArithmeticModel) -> io::Result<u32> {
        self.decoder.decode_symbol(model)
    }

    /// The next whole number, as a difference from a guess.
    #[inline]
    pub(super) fn integer(
        &mut self,
        model: &mut IntegerDecompressor,
        guess: i32,
        context: usize,
    ) -> io::Result<i32> {
        model.decompress(&mut self.decoder, guess, context as u32)
    }
}

/// A model of so many symbols.
pub(super) fn symbols(n: u32) -> ArithmeticModel {
    ArithmeticModelBuilder::new(n).build()
}

/// A model of whole numbers of so many bits, for so many contexts.
pub(super) fn integers(bits: u32, contexts: u32) -> IntegerDecompressor {
    IntegerDecompressorBuilder::new().bits(bits).contexts(contexts).build_initialized()
}

/// Models of which few are used: they are made when they are.
pub(super) struct Models {
    models: Vec<Option<ArithmeticModel>>,
    n_symbols: u32,
}

impl Models {
    /// So many, each of so many symbols.
    pub(super) fn new(n: usize, n_symbols: u32) -> Self {
        Self { models: vec![None; n], n_symbols }
    }

    /// One of them.
    ///
    /// # Errors
    /// Where there is none of this number; bytes that are decoded do not lead there.
    pub(super) fn get(&mut self, i: usize) -> io::Result<&mut ArithmeticModel> {
        let model = self.models.get_mut(i).ok_or(io::ErrorKind::InvalidData)?;
        Ok(model.get_or_insert_with(|| symbols(self.n_symbols)))
    }
}

/// The median of the last differences, roughly: the smallest and the largest of five leave in turn.
#[derive(Clone, Copy, Default)]
pub(super) struct Median {
    /// In order.
    values: [i32; 5],
    /// Whether it is the turn of the smallest.
    is_low: bool,
}

impl Median {
    #[inline]
    pub(super) fn get(&self) -> i32 {
        self.values[2]
    }

    #[inline]
    pub(super) fn add(&mut self, value: i32) {
        let values = &mut self.values;
        let middle = values[2];
        if self.is_low {
            let mut i = 0;
            while i < 4 && values[i + 1] < value {
                values[i] = values[i + 1];
                i += 1;
            }
            values[i] = value;
            self.is_low = middle < value;
        } else {
            let mut i = 4;
            while i > 0 && value < values[i - 1] {
                values[i] = values[i - 1];
                i -= 1;
            }
            values[i] = value;
            self.is_low = middle <= value;
        }
    }
}
