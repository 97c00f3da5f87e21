//! Compressed points, which lie field by field.
//!
//! Small files are decompressed whole. Of large ones a first pass finds where each field begins, and a decoder for each
//! field goes on from there beside the others, so that memory does not grow with the file.

use crate::decode::{Place, Rows};
use crate::header::{Field, Header};
use crate::layout::Layout;
use crate::lzf::{self, Decoder};
use crate::read::{batch_rows, cut_short, hand_over};
use surfelshop_api::format::{BATCH, CloudSink, FileSource};
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes of points up to which they are decompressed whole.
pub(crate) const MOST_WHOLE: usize = 256 << 20;

/// What a file says of its compressed points.
struct Sizes {
    /// Bytes as they are in the file.
    packed: u64,
    /// Bytes of the points.
    len: usize,
    /// Whether padding is among them: PCL leaves it out, other programs may not.
    has_padding: bool,
}

impl Sizes {
    fn read(file: &FileSource, header: &Header) -> Result<Self> {
        let mut sizes = [0; 8];
        file.read_exact_at(header.start, &mut sizes)?;
        let [a, b, c, d, e, f, g, h] = sizes;
        let (packed, unpacked) =
            (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        let padding = header.fields.iter().filter(|field| field.is_padding());
        let n_padding: usize = padding.map(Field::bytes).sum();
        let whole = header.rows.saturating_mul(header.step as u64);
        let without = header.rows.saturating_mul((header.step - n_padding) as u64);
        if u64::from(unpacked) != whole && u64::from(unpacked) != without {
            return Err(Error::new(format!(
                "expected {without} bytes of decompressed points, found {unpacked} announced; the header does not fit the points"
            )));
        }
        let left = file.length().saturating_sub(header.start + 8);
        if u64::from(packed) > left {
            return Err(cut_short(u64::from(packed), left));
        }
        lzf::check_size(usize::try_from(packed)?, usize::try_from(unpacked)?)?;
        let has_padding = u64::from(unpacked) == whole;
        Ok(Self { packed: u64::from(packed), len: usize::try_from(unpacked)?, has_padding })
    }

    /// Bytes of a field of all points.
    fn of_field(&self, field: &Field, n: usize) -> usize {
        if self.has_padding || !field.is_padding() { field.bytes() * n } else { 0 }
    }
}

/// Reads the points of a file; those of more than `most_whole` bytes field by field beside each other.
pub(crate) fn read(
    file: &FileSource,
    header: &Header,
    layout: &Layout,
    most_whole: usize,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let sizes = Sizes::read(file, header)?;
    match sizes.len <= most_whole {
        true => whole(file, header, layout, &sizes, clouds, job),
        false => beside(file, header, layout, &sizes, clouds, job),
    }
}

fn whole(
    file: &FileSource,
    header: &Header,
    layout: &Layout,
    sizes: &Sizes,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    // At most `len`, which fits.
    let n = usize::try_from(header.rows)?;
    let input = file.bytes_at(header.start + 8, sizes.packed)?;
    job.progress(0.1, "");
    let share = |out: usize| 0.1 + 0.4 * out as f64 / sizes.len.max(1) as f64;
    let bytes = lzf::decompress(&input, sizes.len, |out| {
        job.progress(share(out), "");
        job.check()
    })?;
    drop(input);
    let (mut start, mut places) = (0, Vec::with_capacity(header.fields.len()));
    for field in &header.fields {
        places.push(Place { start, stride: field.bytes() });
        start += sizes.of_field(field, n);
    }
    for first in (0..n).step_by(BATCH) {
        job.check()?;
        let (fields, count) = (&header.fields, BATCH.min(n - first));
        let rows = Rows { bytes: &bytes, fields, places: &places, first, n: count };
        hand_over(&rows, layout, clouds)?;
        job.progress(0.5 + 0.5 * (first + count) as f64 / n as f64, "");
    }
    Ok(())
}

fn beside(
    file: &FileSource,
    header: &Header,
    layout: &Layout,
    sizes: &Sizes,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let n = usize::try_from(header.rows)?;
    let mut decoders = Vec::new();
    let start = header.start + 8;
    let mut decoder = Decoder::new(file, start..start + sizes.packed);
    let mut done = 0;
    for field in &header.fields {
        let len = sizes.of_field(field, n);
        decoders.push((len > 0).then(|| decoder.clone()));
        done += len;
        decoder.skip(len, job)?;
        job.progress(0.5 * done as f64 / sizes.len.max(1) as f64, "");
    }
    let at_once = batch_rows(header.step);
    let (mut bytes, mut first) = (Vec::new(), 0);
    while first < n {
        job.check()?;
        let count = at_once.min(n - first);
        bytes.clear();
        let mut places = Vec::with_capacity(decoders.len());
        for (field, decoder) in header.fields.iter().zip(&mut decoders) {
            places.push(Place { start: bytes.len(), stride: field.bytes() });
            if let Some(decoder) = decoder {
                decoder.read(count * field.bytes(), &mut bytes)?;
            }
        }
        let rows =
            Rows { bytes: &bytes, fields: &header.fields, places: &places, first: 0, n: count };
        hand_over(&rows, layout, clouds)?;
        first += count;
        job.progress(0.5 + 0.5 * first as f64 / n as f64, "");
    }
    Ok(())
}
