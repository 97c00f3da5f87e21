//! Compressed points: how they are compressed, where their chunks lie, and how chunks become records.

mod chunks;
mod decoder;
mod fields;
mod first_version;
mod layers;
mod point14;
mod points;
mod table;
mod times;

pub(crate) use chunks::{Chunk, Chunks, PLAUSIBLE};
use decoder::Decoder;
pub(crate) use points::read;

use crate::header::Header;
use crate::numbers::{u16_at, u32_at};
use laz::{LazItemType, LazVlr};
use surfelshop_api::{Error, Result};

/// Most extra bytes of a compressed point: each takes two kilobytes of models, in each thread.
const MOST_EXTRA: usize = 4096;

/// How a LAZ file orders its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// All in one run, without a table.
    Run,
    /// In chunks of points, one after the other.
    Points,
    /// In chunks, each with its fields one after the other.
    Layers,
}

/// How the points of a LAZ file are compressed.
#[derive(Clone, Debug)]
pub(crate) struct Compression {
    pub(crate) order: Order,
    /// Points of a chunk; `None` where the table says how many each has.
    pub(crate) chunk_points: Option<u64>,
    /// Bytes of a record.
    pub(crate) record_len: usize,
    vlr: LazVlr,
}

impl Compression {
    /// What the record of `LASzip` says, for the points of this header.
    ///
    /// # Errors
    /// Where there is no such record, or it says what is unknown or does not fit the header.
    pub(crate) fn new(record: Option<&[u8]>, header: &Header) -> Result<Self> {
        let record = record.ok_or_else(|| {
            Error::new("the points are compressed, but the file does not say how (record 22204)")
        })?;
        if record.len() < 34 {
            return Err(Error::new(format!(
                "expected a record of compression of at least 34 bytes, found {}",
                record.len()
            )));
        }
        let (kind, coder) = (u16_at(record, 0), u16_at(record, 2));
        let order = match kind {
            1 => Order::Run,
            2 => Order::Points,
            3 => Order::Layers,
            _ => {
                return Err(Error::new(format!(
                    "expected points compressed in way 1, 2 or 3, found {kind}"
                )));
            }
        };
        if coder != 0 {
            return Err(Error::new(format!("expected compression by coder 0, found {coder}")));
        }
        let n_items = usize::from(u16_at(record, 32));
        if record.len() < 34 + 6 * n_items {
            return Err(Error::new(format!(
                "expected descriptions of {n_items} compressed fields, found {}",
                (record.len() - 34) / 6
            )));
        }
        let vlr = LazVlr::from_buffer(record).map_err(|error| {
            Error::new(format!(
                "expected fields of points that LAZ compresses, found others: {error}"
            ))
        })?;
        check_items(&vlr, order, header)?;
        let points = u32_at(record, 12);
        let chunk_points = (points != 0 && points != u32::MAX).then_some(u64::from(points));
        let compression = Self { order, chunk_points, record_len: header.record_len, vlr };
        // What the decoder does not know is said before any point is read.
        Decoder::of_chunk(&compression, &[], None)?;
        Ok(compression)
    }

    /// Sizes of layers that follow the first point of a chunk and the number of its points.
    pub(crate) fn n_layers(&self) -> usize {
        let layers = |kind| match kind {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(n) => usize::from(n),
            _ => 1,
        };
        self.vlr.items().iter().map(|item| layers(item.item_type())).sum()
    }
}

/// Whether the compressed fields are those of the point format.
fn check_items(vlr: &LazVlr, order: Order, header: &Header) -> Result<()> {
    let mut expected = expected_items(header);
    let found: Vec<LazItemType> = vlr.items().iter().map(laz::LazItem::item_type).collect();
    let extra = header.record_len - header.format.len;
    if extra > MOST_EXTRA {
        return Err(Error::new(format!(
            "expected at most {MOST_EXTRA} extra bytes of compressed points, found {extra}"
        )));
    }
    if extra > 0 {
        let extra = u16::try_from(extra)?;
        let is_extended = header.format.is_extended();
        expected.push(if is_extended {
            LazItemType::Byte14(extra)
        } else {
            LazItemType::Byte(extra)
        });
    }
    if found != expected {
        return Err(Error::new(format!(
            "expected compressed fields of point format {} and {extra} extra bytes, found {found:?}",
            header.format.id
        )));
    }
    let is_layered = order == Order::Layers;
    let known = if is_layered { 3..=4 } else { 1..=2 };
    match vlr.items().iter().find(|item| !known.contains(&item.version())) {
        Some(item) => Err(Error::new(format!(
            "expected compression of version {} or {} of {:?}, found {}",
            known.start(),
            known.end(),
            item.item_type(),
            item.version()
        ))),
        None => Ok(()),
    }
}

/// The compressed fields of a point format without extra bytes.
pub(crate) fn expected_items(header: &Header) -> Vec<LazItemType> {
    let format = header.format;
    let mut items = Vec::new();
    if format.is_extended() {
        items.push(LazItemType::Point14);
        match (format.color, format.nir) {
            (Some(_), Some(_)) => items.push(LazItemType::RGBNIR14),
            (Some(_), None) => items.push(LazItemType::RGB14),
            _ => {}
        }
        if format.waveform.is_some() {
            items.push(LazItemType::WavePacket14);
        }
        return items;
    }
    items.push(LazItemType::Point10);
    if format.gps_time.is_some() {
        items.push(LazItemType::GpsTime);
    }
    if format.color.is_some() {
        items.push(LazItemType::RGB12);
    }
    if format.waveform.is_some() {
        items.push(LazItemType::WavePacket13);
    }
    items
}
