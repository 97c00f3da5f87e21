//! Writing: points as they come, then the header.

use crate::encode::{Encoder, Field};
use crate::header_text::{Facts, text};
use crate::store::Store;
use crate::{Encoding, lzf};
use std::fmt::Write;
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink};
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes that are compressed at once: copies reach 8192 bytes back, so hardly anything is lost.
const PIECE: usize = 1 << 17;

/// Bytes of text that are written at once.
const BLOCK: usize = 1 << 20;

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
    let mut facts = Facts { encoding, width, height, viewpoint };
    let mut store = match encoding {
        Encoding::Binary => {
            // What is announced need not come, so there is room for any number.
            let room = facts.room(&encoder.fields());
            file.write_at(0, text(&encoder.fields(), &facts, room).as_bytes())?;
            Store::File { file, start: room as u64, len: 0 }
        }
        _ => Store::Memory(Vec::new()),
    };
    let rows = points(clouds, &header, &mut encoder, &mut store, job, lines)?;
    if width.checked_mul(height) != Some(rows) {
        if header.grid.is_some() {
            lines.push(format!(
                "the grid of {width} x {height} was left out: there are {rows} points"
            ));
        }
        (facts.width, facts.height) = (rows, 1);
    }
    lines.extend(header.without_system());
    let fields = encoder.fields();
    let bytes = match store {
        Store::File { start, .. } => {
            let room = usize::try_from(start)?;
            file.write_at(0, text(&fields, &facts, room).as_bytes())?;
            job.progress(1.0, "");
            return Ok(());
        }
        Store::Memory(bytes) => bytes,
    };
    let mut out = Output { file, place: 0 };
    out.write(text(&fields, &facts, 0).as_bytes())?;
    match encoding {
        Encoding::BinaryCompressed => compressed(bytes, &encoder, &mut out, job)?,
        _ => as_text(&bytes, &encoder, &mut out, job)?,
    }
    job.progress(1.0, "");
    Ok(())
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
    lines: &mut Vec<String>,
) -> Result<u64> {
    let share = if matches!(store, Store::Memory(_)) { 0.5 } else { 1.0 };
    let (mut bytes, mut rows, mut has_faces) = (Vec::new(), 0, header.has_faces);
    while let Some(batch) = clouds.next_batch()? {
        job.check()?;
        if encoder.must_widen(&batch) {
            store.widen(encoder.step(), job)?;
            encoder.widen();
        }
        encoder.encode(&batch, &mut bytes)?;
        store.append(&bytes)?;
        rows += (bytes.len() / encoder.step()) as u64;
        has_faces |= !batch.faces.is_empty();
        if let Some(all) = header.rows.filter(|&all| all > 0) {
            job.progress(share * (rows as f64 / all as f64).min(1.0), "");
        }
    }
    if has_faces {
        lines.push("triangles were left out".to_owned());
    }
    Ok(rows)
}

fn compressed(rows: Vec<u8>, encoder: &Encoder, out: &mut Output<'_>, job: &Job<'_>) -> Result<()> {
    let too_large = || {
        Error::new(
            "expected less than 4 GiB of points, found more; take `encoding=binary`, which holds any number",
        )
    };
    let len = u32::try_from(rows.len()).ok().ok_or_else(too_large)?;
    let columns = columns(&rows, encoder)?;
    drop(rows);
    let pieces: Vec<&[u8]> = columns.chunks(PIECE).collect();
    let packed = job.map(pieces.len(), 0.6..0.9, |i| lzf::compress(pieces[i]))?;
    let total: usize = packed.iter().map(Vec::len).sum();
    let total = u32::try_from(total).ok().ok_or_else(too_large)?;
    out.write(&total.to_le_bytes())?;
    out.write(&len.to_le_bytes())?;
    for piece in packed {
        job.check()?;
        out.write(&piece)?;
    }
    Ok(())
}

/// Points field by field.
fn columns(rows: &[u8], encoder: &Encoder) -> Result<Vec<u8>> {
    let mut columns = Vec::new();
    columns.try_reserve_exact(rows.len())?;
    let mut offset = 0;
    for Field { size, count, .. } in encoder.fields() {
        let end = offset + size * count;
        for row in rows.chunks_exact(encoder.step()) {
            columns.extend_from_slice(&row[offset..end]);
        }
        offset = end;
    }
    Ok(columns)
}

fn as_text(rows: &[u8], encoder: &Encoder, out: &mut Output<'_>, job: &Job<'_>) -> Result<()> {
    let (fields, mut block) = (encoder.fields(), String::with_capacity(BLOCK + 4096));
    let mut written = 0;
    for row in rows.chunks_exact(encoder.step()) {
        let mut rest = row;
        for field in &fields {
            for _ in 0..field.count {
                let (value, behind) = rest.split_at(field.size);
                append(&mut block, field, value);
                rest = behind;
            }
        }
        block.pop();
        block.push('\n');
        written += row.len();
        if block.len() >= BLOCK {
            job.check()?;
            job.progress(0.5 + 0.5 * written as f64 / rows.len() as f64, "");
            out.write(block.as_bytes())?;
            block.clear();
        }
    }
    out.write(block.as_bytes())
}

/// Appends a value and a space.
fn append(text: &mut String, field: &Field, bytes: &[u8]) {
    // Writing to a string cannot fail.
    let written = match (field.letter, bytes) {
        ('F', &[a, b, c, d]) => number(text, f32::from_le_bytes([a, b, c, d])),
        ('F', &[a, b, c, d, e, f, g, h]) => {
            number(text, f64::from_le_bytes([a, b, c, d, e, f, g, h]))
        }
        ('I', &[a]) => write!(text, "{} ", i8::from_le_bytes([a])),
        ('I', &[a, b]) => write!(text, "{} ", i16::from_le_bytes([a, b])),
        ('I', &[a, b, c, d]) => write!(text, "{} ", i32::from_le_bytes([a, b, c, d])),
        ('U', &[a]) => write!(text, "{a} "),
        ('U', &[a, b]) => write!(text, "{} ", u16::from_le_bytes([a, b])),
        ('U', &[a, b, c, d]) => write!(text, "{} ", u32::from_le_bytes([a, b, c, d])),
        _ => write!(text, "0 "),
    };
    debug_assert!(written.is_ok());
}

/// The shortest text that is read as the same number; `nan` as PCL writes it.
fn number<T: Into<f64> + Copy + std::fmt::Display + std::fmt::LowerExp>(
    text: &mut String,
    value: T,
) -> std::fmt::Result {
    let size = value.into().abs();
    if size.is_nan() {
        write!(text, "nan ")
    } else if size.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size) {
        write!(text, "{value:e} ")
    } else {
        write!(text, "{value} ")
    }
}
