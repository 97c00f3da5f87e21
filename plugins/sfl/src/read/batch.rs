//! Records of a file, batch by batch, and the values of columns that are decoded from them.

use super::columns::{Buffer, Plan, Source};
use super::geometry::Geometry;
use super::set::SurfelSet;
use crate::big_endian::{f32_at, u8_at, u16_at, u32_at};
use crate::surfel::color::ColorModel;
use crate::surfel::layout::Layout;
use crate::surfel::plain::Stored;
use crate::surfel::property;
use surfelshop_api::format::{BATCH, FileSource};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Job, Result};

/// Most bytes of records that are read at once.
const MAX_BATCH_BYTES: u64 = 16 << 20;

/// The records of a set.
pub(crate) struct Records<'a> {
    file: &'a FileSource,
    set: &'a SurfelSet,
    record: u64,
    done: u64,
    bytes: Vec<u8>,
}

impl<'a> Records<'a> {
    /// The records from the first one.
    ///
    /// # Errors
    /// Where a record is larger than memory.
    pub(crate) fn new(file: &'a FileSource, set: &'a SurfelSet) -> Result<Self> {
        let record = u64::try_from(set.layout.record)?;
        Ok(Self { file, set, record, done: 0, bytes: Vec::new() })
    }

    /// Begins again with the first record.
    pub(crate) fn rewind(&mut self) {
        self.done = 0;
    }

    /// The next records; `None` after the last.
    ///
    /// # Errors
    /// Where the system refuses, or there is no memory.
    pub(crate) fn next_batch(&mut self) -> Result<Option<&[u8]>> {
        let most = (MAX_BATCH_BYTES / self.record).clamp(1, BATCH as u64);
        let n = (self.set.rows - self.done).min(most);
        if n == 0 {
            return Ok(None);
        }
        // The rows of a set lie within the file.
        let len = usize::try_from(n * self.record)?;
        self.bytes.try_reserve_exact(len.saturating_sub(self.bytes.len()))?;
        self.bytes.resize(len, 0);
        self.file.read_exact_at(self.set.start + self.done * self.record, &mut self.bytes)?;
        self.done += n;
        Ok(Some(&self.bytes))
    }
}

/// Whether any diffuse colour is not opaque.
///
/// # Errors
/// Where the file cannot be read, or the user asked to stop.
pub(crate) fn has_opacity(
    records: &mut Records<'_>,
    layout: &Layout,
    job: &Job<'_>,
) -> Result<bool> {
    let alpha = layout.colors.and_then(ColorModel::alpha);
    let place = layout.place(property::DIFFUSE).zip(alpha).map(|(place, alpha)| place + alpha);
    let Some(place) = place else { return Ok(false) };
    while let Some(bytes) = records.next_batch()? {
        if bytes.chunks_exact(layout.record).any(|record| u8_at(record, place) != 255) {
            return Ok(true);
        }
        job.check()?;
    }
    Ok(false)
}

/// What is doubtful of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubtful {
    /// Normals whose codes are invalid.
    pub(crate) invalid_normals: u64,
    /// Colours other than the diffuse one that are not opaque.
    pub(crate) opacities_left_out: u64,
}

/// Puts new values in the place of old ones.
fn fill<T>(to: &mut Vec<T>, values: impl Iterator<Item = T>) {
    to.clear();
    to.extend(values);
}

/// The three components of a vector as 32-bit floats.
fn singles(vector: DVec3) -> [f32; 3] {
    vector.as_vec3().to_array()
}

/// Decodes whole records into the columns of a plan.
pub(crate) fn decode(
    bytes: &[u8],
    plan: &Plan,
    geometry: &Geometry<'_>,
    buffers: &mut [Buffer],
) -> Doubtful {
    let mut doubtful = Doubtful::default();
    let records = || bytes.chunks_exact(geometry.layout.record);
    for (source, buffer) in plan.sources().zip(buffers) {
        match (source, buffer) {
            (Source::Position, Buffer::F32(to)) => {
                fill(to, records().flat_map(|record| singles(geometry.position(record))));
            }
            (Source::MovedPosition, Buffer::F64(to)) => {
                fill(to, records().flat_map(|record| geometry.position(record).to_array()));
            }
            (Source::Normal, Buffer::F32(to)) => {
                let invalid = &mut doubtful.invalid_normals;
                let normal = |record| {
                    singles(geometry.normal(record).unwrap_or_else(|| {
                        *invalid += 1;
                        DVec3::ZERO
                    }))
                };
                fill(to, records().flat_map(normal));
            }
            (Source::Radius, Buffer::F32(to)) => {
                fill(to, records().map(|record| geometry.radius(record) as f32));
            }
            (Source::TangentU, Buffer::F32(to)) => {
                fill(to, records().flat_map(|record| singles(geometry.tangents(record)[0])));
            }
            (Source::TangentV, Buffer::F32(to)) => {
                fill(to, records().flat_map(|record| singles(geometry.tangents(record)[1])));
            }
            (Source::Color { place, components, is_diffuse }, Buffer::U8(to)) => {
                let Some(model) = geometry.layout.colors else { continue };
                let left_out = &mut doubtful.opacities_left_out;
                to.clear();
                for record in records() {
                    let rgba = model.rgba(record.get(place..).unwrap_or_default());
                    *left_out += u64::from(!is_diffuse && rgba[3] != 255);
                    to.extend(&rgba[..components.min(4)]);
                }
            }
            (Source::Plain { place, components, stored }, buffer) => {
                let places = || {
                    let of_record = move |record| {
                        (0..components).map(move |i| (record, place + i * stored.size()))
                    };
                    records().flat_map(of_record)
                };
                plain(places(), stored, buffer);
            }
            // A plan makes its buffers of the types of its sources.
            _ => {}
        }
    }
    doubtful
}

/// Decodes numbers as they are.
fn plain<'a>(places: impl Iterator<Item = (&'a [u8], usize)>, stored: Stored, buffer: &mut Buffer) {
    match (stored, buffer) {
        (Stored::Float, Buffer::F32(to)) => {
            fill(to, places.map(|(record, place)| f32_at(record, place)));
        }
        (Stored::Share, Buffer::F32(to)) => {
            fill(to, places.map(|(record, place)| f32::from(u8_at(record, place)) / 255.0));
        }
        (Stored::Byte, Buffer::U8(to)) => {
            fill(to, places.map(|(record, place)| u8_at(record, place)));
        }
        (Stored::Short, Buffer::U16(to)) => {
            fill(to, places.map(|(record, place)| u16_at(record, place)));
        }
        (Stored::Word, Buffer::U32(to)) => {
            fill(to, places.map(|(record, place)| u32_at(record, place)));
        }
        _ => {}
    }
}
