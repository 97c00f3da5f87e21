//! The points of a node as columns.

use crate::attributes::{Column, Component, Layout, Number, Storage};
use crate::metadata::Encoding;
use brotli_decompressor::BrotliDecoderParameter;
use surfelshop_api::columns::{Element, Values};
use surfelshop_api::format::{BATCH, CloudSink};
use surfelshop_api::{Error, Result};

/// What BROTLI octrees have added to each whole coordinate.
///
/// Their writers take the smallest coordinate of a node off, and are mistaken in what it is: they begin with the
/// largest number of 64 bits as one of 32, which is -1, and no coordinate is smaller. Potree draws such clouds a step
/// off; an octree of the same points that is not compressed shows where they are.
const ADDED: u32 = 1;

/// Most bytes of a node before they are compressed: nodes have some ten thousand points.
pub(crate) const MOST_BYTES: usize = 1 << 30;

/// Values of a column.
#[derive(Debug)]
enum Decoded {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// The columns of the points of a node.
#[derive(Debug, Default)]
pub(crate) struct Points {
    columns: Vec<(Decoded, usize)>,
    n: usize,
}

impl Points {
    /// The points of a node of so many, from its bytes.
    ///
    /// # Errors
    /// Where there are other bytes than its points have, or no memory.
    pub(crate) fn decode(layout: &Layout, bytes: &[u8], n: usize) -> Result<Self> {
        let expected = n.checked_mul(layout.point_bytes);
        let unpacked;
        let bytes = match layout.encoding {
            Encoding::Plain => bytes,
            Encoding::Brotli => {
                let most = expected.filter(|most| *most <= MOST_BYTES);
                let too_many =
                    || Error::new(format!("it has more than {MOST_BYTES} bytes of points"));
                unpacked = decompressed(bytes, most.ok_or_else(too_many)?)?;
                &unpacked[..]
            }
        };
        if expected != Some(bytes.len()) {
            return Err(Error::new(format!(
                "expected {} bytes a point, found {} bytes",
                layout.point_bytes,
                bytes.len()
            )));
        }
        let is_packed = layout.encoding == Encoding::Brotli;
        let stored = Stored { bytes, n, point_bytes: layout.point_bytes, is_packed };
        let columns = layout
            .columns
            .iter()
            .map(|column| Ok((stored.column(column)?, column.components.len())));
        Ok(Self { columns: columns.collect::<Result<_>>()?, n })
    }

    /// Hands the points over, in batches.
    ///
    /// # Errors
    /// As [`CloudSink::batch`].
    pub(crate) fn hand_over(&self, clouds: &mut CloudSink<'_>) -> Result<()> {
        for start in (0..self.n).step_by(BATCH) {
            let end = (start + BATCH).min(self.n);
            let values: Vec<Values<'_>> = self
                .columns
                .iter()
                .map(|(column, components)| {
                    let range = start * components..end * components;
                    match column {
                        Decoded::I8(values) => Values::I8(&values[range]),
                        Decoded::U8(values) => Values::U8(&values[range]),
                        Decoded::I16(values) => Values::I16(&values[range]),
                        Decoded::U16(values) => Values::U16(&values[range]),
                        Decoded::I32(values) => Values::I32(&values[range]),
                        Decoded::U32(values) => Values::U32(&values[range]),
                        Decoded::F32(values) => Values::F32(&values[range]),
                        Decoded::F64(values) => Values::F64(&values[range]),
                    }
                })
                .collect();
            clouds.batch(&values)?;
        }
        Ok(())
    }
}

/// At most so many bytes that a stream is compressed from; memory is taken as they come.
pub(crate) fn decompressed(bytes: &[u8], most: usize) -> Result<Vec<u8>> {
    use std::io::Read as _;
    let mut stream = brotli_decompressor::Decompressor::new(bytes, 1 << 16);
    // Windows beyond those of RFC 7932 take as much memory as a stream says.
    let large = BrotliDecoderParameter::BROTLI_DECODER_PARAM_LARGE_WINDOW;
    if !stream.set_parameter(large, 0) {
        return Err(Error::new("its stream cannot be read"));
    }
    let mut unpacked = Vec::new();
    let mut piece = vec![0; 1 << 16];
    loop {
        let found = stream
            .read(&mut piece)
            .map_err(|error| Error::new(format!("its stream is damaged: {error}")))?;
        if found == 0 {
            return Ok(unpacked);
        }
        if found > most - unpacked.len() {
            return Err(Error::new(format!(
                "its stream has more than the {most} bytes of its points"
            )));
        }
        unpacked.try_reserve(found)?;
        unpacked.extend_from_slice(&piece[..found]);
    }
}

/// The bytes of a node.
struct Stored<'a> {
    bytes: &'a [u8],
    n: usize,
    point_bytes: usize,
    /// Attribute after attribute, else point after point.
    is_packed: bool,
}

/// The bits 0, 3, 6 and so on of a number, of 16 of them, as one number.
fn every_third(dealt: u64) -> u32 {
    (0..16).fold(0, |found, bit| found | ((dealt >> (3 * bit) & 1) as u32) << bit)
}

impl Stored<'_> {
    /// A value of each component of each point, from its bytes.
    fn gather<T: Copy + Default, const LEN: usize>(
        &self,
        components: &[Component],
        value: impl Fn([u8; LEN], &Component) -> T,
    ) -> Result<Vec<T>> {
        let len = self.n * components.len();
        let mut values = Vec::new();
        values.try_reserve_exact(len)?;
        values.resize(len, T::default());
        for (i, component) in components.iter().enumerate() {
            let Component { before, size, within, .. } = *component;
            let (first, step) = match self.is_packed {
                true => (before * self.n + within, size),
                false => (before + within, self.point_bytes),
            };
            let places = values.iter_mut().skip(i).step_by(components.len());
            for (point, place) in places.enumerate() {
                // They are there: all bytes of the node were counted.
                let rest = self.bytes.get(first + point * step..).unwrap_or_default();
                *place = value(rest.first_chunk().copied().unwrap_or([0; LEN]), component);
            }
        }
        Ok(values)
    }

    fn column(&self, column: &Column) -> Result<Decoded> {
        let Column { file, storage, components } = column;
        let number = match *storage {
            Storage::DealtPlaces => return self.places(components).map(Decoded::F64),
            Storage::DealtColors => return self.colors(components).map(Decoded::U16),
            Storage::Numbers(number) => number,
        };
        let is_plain =
            file.element == number.element() && !matches!(number, Number::I64 | Number::U64);
        match file.element {
            _ if is_plain && !components.iter().any(Component::is_scaled) => {
                self.plain(number, components)
            }
            Element::F32 => {
                let wide = self.scaled(number, components)?;
                let mut values = Vec::new();
                values.try_reserve_exact(wide.len())?;
                values.extend(wide.iter().map(|&value| value as f32));
                Ok(Decoded::F32(values))
            }
            _ => self.scaled(number, components).map(Decoded::F64),
        }
    }

    /// Numbers as they are.
    fn plain(&self, number: Number, components: &[Component]) -> Result<Decoded> {
        macro_rules! of {
            ($variant:ident, $type:ty) => {
                Decoded::$variant(
                    self.gather(components, |bytes, _| <$type>::from_le_bytes(bytes))?,
                )
            };
        }
        Ok(match number {
            Number::I8 => of!(I8, i8),
            Number::U8 => of!(U8, u8),
            Number::I16 => of!(I16, i16),
            Number::U16 => of!(U16, u16),
            Number::I32 => of!(I32, i32),
            Number::U32 => of!(U32, u32),
            Number::F32 => of!(F32, f32),
            Number::F64 | Number::I64 | Number::U64 => of!(F64, f64),
        })
    }

    /// Numbers that are multiplied and added to.
    fn scaled(&self, number: Number, components: &[Component]) -> Result<Vec<f64>> {
        macro_rules! of {
            ($type:ty) => {
                self.gather(components, |bytes, component| {
                    <$type>::from_le_bytes(bytes) as f64 * component.scale + component.offset
                })
            };
        }
        match number {
            Number::I8 => of!(i8),
            Number::U8 => of!(u8),
            Number::I16 => of!(i16),
            Number::U16 => of!(u16),
            Number::I32 => of!(i32),
            Number::U32 => of!(u32),
            Number::I64 => of!(i64),
            Number::U64 => of!(u64),
            Number::F32 => of!(f32),
            Number::F64 => of!(f64),
        }
    }

    /// Coordinates whose bits were dealt in turn, upper halves first.
    fn places(&self, components: &[Component]) -> Result<Vec<f64>> {
        self.gather(components, |bytes: [u8; 16], component| {
            let (halves, _) = bytes.as_chunks::<8>();
            let half = |half: usize| every_third(u64::from_le_bytes(halves[half]) >> component.bit);
            let whole = (half(0) << 16 | half(1)).wrapping_sub(ADDED).cast_signed();
            f64::from(whole) * component.scale + component.offset
        })
    }

    /// Colours whose bits were dealt in turn.
    fn colors(&self, components: &[Component]) -> Result<Vec<u16>> {
        self.gather(components, |bytes: [u8; 8], component| {
            every_third(u64::from_le_bytes(bytes) >> component.bit) as u16
        })
    }
}
