//! The decoders of the fields of records.

use super::first_version::{PointBytes, PointColors};
use super::point14::Point14;
use super::times::PointTimes;
use laz::las::{v1, v2, v3, v4};
use laz::record::{LayeredPointRecordDecompressor, SequentialPointRecordDecompressor};
use laz::{LasZipError, LazItem, LazItemType};
use std::io::{Read, Seek};
use surfelshop_api::Result;

/// Adds the decoders of fields of points that are compressed one after the other.
///
/// # Errors
/// Where the compression of a field is of a version that is unknown.
pub(super) fn add_points<R: Read>(
    decoder: &mut SequentialPointRecordDecompressor<'_, R>,
    items: &[LazItem],
) -> Result<()> {
    for item in items {
        match (item.item_type(), item.version()) {
            (LazItemType::Point10, 1) => {
                decoder.add_field_decompressor(v1::LasPoint0Decompressor::default());
            }
            (LazItemType::Point10, 2) => {
                decoder.add_field_decompressor(v2::LasPoint0Decompressor::default());
            }
            (LazItemType::GpsTime, 1) => {
                decoder.add_field_decompressor(v1::LasGpsTimeDecompressor::default());
            }
            (LazItemType::GpsTime, 2) => decoder.add_field_decompressor(PointTimes::new()),
            (LazItemType::RGB12, 1) => decoder.add_field_decompressor(PointColors::new()),
            (LazItemType::RGB12, 2) => {
                decoder.add_field_decompressor(v2::LasRGBDecompressor::default());
            }
            (LazItemType::WavePacket13, 1 | 2) => {
                decoder.add_field_decompressor(v1::LasWavepacketDecompressor::default());
            }
            (LazItemType::Byte(n), 1) => decoder.add_field_decompressor(PointBytes::new(n)),
            (LazItemType::Byte(n), 2) => {
                decoder.add_field_decompressor(v2::LasExtraByteDecompressor::new(n.into()));
            }
            (kind, version) => {
                return Err(LasZipError::UnsupportedLazItemVersion(kind, version).into());
            }
        }
    }
    Ok(())
}

/// Adds the decoders of fields of points that are compressed in layers.
///
/// # Errors
/// As [`add_points`].
pub(super) fn add_layers<R: Read + Seek>(
    decoder: &mut LayeredPointRecordDecompressor<'_, R>,
    items: &[LazItem],
) -> Result<()> {
    for item in items {
        match (item.item_type(), item.version()) {
            (LazItemType::Point14, 3) => decoder.add_field_decompressor(Point14::<3>::new()),
            (LazItemType::Point14, 4) => decoder.add_field_decompressor(Point14::<4>::new()),
            (LazItemType::RGB14, 3) => {
                decoder.add_field_decompressor(v3::LasRGBDecompressor::default());
            }
            (LazItemType::RGB14, 4) => {
                decoder.add_field_decompressor(v4::LasRGBDecompressor::default());
            }
            (LazItemType::RGBNIR14, 3) => {
                decoder.add_field_decompressor(v3::LasRGBDecompressor::default());
                decoder.add_field_decompressor(v3::LasNIRDecompressor::default());
            }
            (LazItemType::RGBNIR14, 4) => {
                decoder.add_field_decompressor(v4::LasRGBDecompressor::default());
                decoder.add_field_decompressor(v4::LasNIRDecompressor::default());
            }
            (LazItemType::WavePacket14, 3) => {
                decoder.add_field_decompressor(v3::LasWavepacketDecompressor::default());
            }
            (LazItemType::WavePacket14, 4) => {
                decoder.add_field_decompressor(v4::LasWavepacketDecompressor::default());
            }
            (LazItemType::Byte14(n), 3) => {
                decoder.add_field_decompressor(v3::LasExtraByteDecompressor::new(n.into()));
            }
            (LazItemType::Byte14(n), 4) => {
                decoder.add_field_decompressor(v4::LasExtraByteDecompressor::new(n.into()));
            }
            (kind, version) => {
                return Err(LasZipError::UnsupportedLazItemVersion(kind, version).into());
            }
        }
    }
    Ok(())
}
