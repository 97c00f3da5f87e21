//! Writing: points as they come, then the header.

use crate::Encoding;
use crate::encode::Encoder;
use crate::fields::PackedFields;
use crate::header_text::{Facts, text};
use crate::read::ORIENTATION;
use crate::store::Store;
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink, HeaderSupport};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::prelude::{Error, Job, Result};

/// Writes the next cloud; adds what the format cannot hold.
pub(crate) fn write(
    clouds: &mut CloudSource<'_>,
    encoding: Encoding,
    file: &FileSink,
    job: &Job<'_>,
    lines: &mut Vec<String>,
) -> Result<()> {
    let header = clouds.next_cloud()?.ok_or_else(|| Error::new("expected a cloud, found none"))?;
    let mut encoder = Encoder::new(&header, encoding, lines)?;
    let [width, height] =
        header.grid.map_or([header.rows.unwrap_or(0), 1], |grid| grid.map(u64::from));
    let viewpoint = header.scanner.filter(|place| place.is_finite()).unwrap_or(DVec3::ZERO);
    let orientation = orientation(&header).unwrap_or_default();
    let mut facts = Facts { encoding, width, height, viewpoint, orientation };
    // What is announced need not come, so there is room for any number.
    let room = facts.room(&encoder.fields());
    let (start, len) = (room as u64, 0);
    let mut store = match encoding {
        Encoding::Binary => Store::Binary { file, start, len },
        Encoding::Ascii => Store::Text { file, start, len },
        Encoding::BinaryCompressed => Store::Packed(PackedFields::default()),
    };
    if !matches!(store, Store::Packed(_)) {
        file.write_at(0, text(&encoder.fields(), &facts, room).as_bytes())?;
    }
    let rows = points(clouds, &header, &mut encoder, &mut store, job)?;
    if width.checked_mul(height) != Some(rows) {
        if header.grid.is_some() {
            lines.push(format!(
                "the grid of {width} x {height} was left out: there are {rows} points"
            ));
        }
        (facts.width, facts.height) = (rows, 1);
    }
    // Zero is what programs write that know no sensor, and believed of grids alone.
    let is_said = facts.height > 1 || viewpoint != DVec3::ZERO || orientation != DQuat::IDENTITY;
    let held = HeaderSupport { scanner: is_said, grid: true, ..HeaderSupport::default() };
    let mut header = header.clone();
    header.comments.retain(|comment| !comment.starts_with(ORIENTATION) || !is_said);
    lines.extend(header.left_out("PCD", held));
    let fields = encoder.fields();
    match store {
        Store::Packed(packed) => {
            let mut out = Output { file, place: 0 };
            out.write(text(&fields, &facts, 0).as_bytes())?;
            compressed(packed, &mut out, job)?;
        }
        _ => file.write_at(0, text(&fields, &facts, room).as_bytes())?,
    }
    job.progress(1.0, "");
    Ok(())
}

/// How the sensor was turned, as a comment of the reader says it, where a sensor is known.
fn orientation(header: &CloudHeader) -> Option<DQuat> {
    header.scanner?;
    let text = header.comments.iter().find_map(|comment| comment.strip_prefix(ORIENTATION))?;
    let numbers: Vec<f64> = text.split(' ').map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let [w, x, y, z] = numbers.try_into().ok()?;
    let turn = DQuat::from_xyzw(x, y, z, w);
    (turn.is_finite() && turn.is_normalized()).then_some(turn)
}

/// The end of a file that grows.
struct Output<'a> {
    file: &'a FileSink,
    place: u64,
}

impl Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_at(self.place, bytes)?;
        self.place += bytes.len() as u64;
        Ok(())
    }
}

/// Puts all points of a cloud into the store; returns how many.
fn points(
    clouds: &mut CloudSource<'_>,
    header: &CloudHeader,
    encoder: &mut Encoder,
    store: &mut Store<'_>,
    job: &Job<'_>,
) -> Result<u64> {
    let (mut bytes, mut rows) = (Vec::new(), 0);
    while let Some(batch) = clouds.next_batch()? {
        job.check()?;
        if encoder.must_widen(&batch) {
            store.widen(encoder.step(), job)?;
            encoder.widen();
        }
        encoder.encode(&batch, &mut bytes)?;
        store.append(&bytes, &encoder.fields(), job)?;
        rows += (bytes.len() / encoder.step()) as u64;
        if let Some(all) = header.rows.filter(|&all| all > 0) {
            job.progress((rows as f64 / all as f64).min(1.0), "");
        }
    }
    Ok(rows)
}

fn compressed(packed: PackedFields, out: &mut Output<'_>, job: &Job<'_>) -> Result<()> {
    let too_large = || {
        Error::new(
            "expected less than 4 GiB of points, found more; take `encoding=binary`, which holds any number",
        )
    };
    let len = u32::try_from(packed.len).ok().ok_or_else(too_large)?;
    let pieces = packed.finish()?;
    let total: usize = pieces.iter().map(Vec::len).sum();
    let total = u32::try_from(total).ok().ok_or_else(too_large)?;
    out.write(&total.to_le_bytes())?;
    out.write(&len.to_le_bytes())?;
    for piece in pieces {
        job.check()?;
        out.write(&piece)?;
    }
    Ok(())
}
