//! The header of a LAS file.

use crate::notes;
use crate::numbers::{bytes, f64_at, part, text, u16_at, u32_at, u64_at};
use crate::point_format::PointFormat;
use surfelshop_api::format::FileSource;
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Result};

/// Bytes of the header of LAS 1.0 to 1.2.
pub(crate) const SHORT: usize = 227;
/// Bytes of the header of LAS 1.4.
pub(crate) const LONG: usize = 375;
/// The bit of the global encoding that says that waveforms lie in the file.
const WAVEFORMS_INSIDE: u16 = 1 << 1;

/// What the header says, as far as it is needed.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    /// The minor version, 0 to 5.
    pub(crate) minor: u8,
    /// The format of point records.
    pub(crate) format: PointFormat,
    /// Whether the points are compressed.
    pub(crate) is_compressed: bool,
    /// Bytes of a point record, at least those of its format.
    pub(crate) record_len: usize,
    /// Points that are announced.
    pub(crate) n_points: u64,
    /// Points that the field of older versions announces, where that is another number and not 0.
    pub(crate) n_points_elsewhere: Option<u64>,
    /// Where the points begin.
    pub(crate) points_at: u64,
    /// Where what follows the points begins, as far as the header says.
    pub(crate) points_end: u64,
    /// Bytes of the header.
    pub(crate) len: u64,
    /// Records between header and points.
    pub(crate) n_records: u32,
    /// Where the records behind the points begin, and how many there are.
    pub(crate) later_records: (u64, u32),
    /// Step of coordinates, not 0.
    pub(crate) scale: DVec3,
    /// What is added to coordinates.
    pub(crate) offset: DVec3,
    /// Smallest and largest coordinates.
    pub(crate) bounds: Option<[DVec3; 2]>,
    /// Whether times of pulses are seconds since 1980, less a thousand million; else those of a week.
    pub(crate) is_standard_time: bool,
    /// Number of the flight line or mission; 0 where there is none.
    pub(crate) source_id: u16,
    /// Number of the project in hexadecimal digits; empty where there is none.
    pub(crate) project_id: String,
    /// What made the points.
    pub(crate) system: String,
    /// What wrote the file.
    pub(crate) software: String,
    /// The day it was made; empty where unknown.
    pub(crate) date: String,
}

impl Header {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// Where the file is no LAS file, or is cut short within its header, or the header cannot be right.
    pub(crate) fn read(file: &FileSource) -> Result<Self> {
        let mut header = [0; LONG];
        let found = file.read_at(0, &mut header)?;
        if !header.starts_with(b"LASF") {
            return Err(not_las(&header[..found]));
        }
        if found < SHORT {
            return Err(Error::new(format!(
                "expected a LAS header of {SHORT} bytes, found {found}: the file is cut short"
            )));
        }
        let len = u16_at(&header, 94);
        if usize::from(len) < SHORT {
            return Err(Error::new(format!(
                "expected a LAS header of at least {SHORT} bytes, found {len}"
            )));
        }
        let kept = usize::from(len).min(LONG);
        if found < kept {
            return Err(Error::new(format!(
                "expected a LAS header of {len} bytes, found {found}: the file is cut short"
            )));
        }
        // Fields of later versions count as 0 where the header is too short for them.
        header[kept..].fill(0);
        Self::of_bytes(&header, file.length())
    }

    fn of_bytes(header: &[u8; LONG], file_len: u64) -> Result<Self> {
        let [major, minor] = bytes(header, 24);
        if major != 1 || minor > 5 {
            return Err(Error::new(format!("expected LAS 1.0 to 1.5, found {major}.{minor}")));
        }
        let (format, is_compressed) = point_format(header[104])?;
        let record_len = usize::from(u16_at(header, 105));
        if record_len < format.len {
            return Err(Error::new(format!(
                "expected point records of at least {} bytes in point format {}, found {record_len}",
                format.len, format.id
            )));
        }
        let (len, points_at) = (u64::from(u16_at(header, 94)), u64::from(u32_at(header, 96)));
        if points_at < len {
            return Err(Error::new(format!(
                "expected points behind the header of {len} bytes, found them at byte {points_at}"
            )));
        }
        let older = u64::from(u32_at(header, 107));
        let newer = if minor >= 4 { u64_at(header, 247) } else { 0 };
        let n_points = if newer > 0 { newer } else { older };
        let later_records =
            if minor >= 4 { (u64_at(header, 235), u32_at(header, 243)) } else { (0, 0) };
        let waveforms = if minor >= 3 && u16_at(header, 6) & WAVEFORMS_INSIDE != 0 {
            u64_at(header, 227)
        } else {
            0
        };
        let records = if later_records.1 > 0 { later_records.0 } else { 0 };
        let behind = [waveforms, records].into_iter().filter(|&at| at > points_at);
        let [scale, offset] = steps(header)?;
        Ok(Self {
            minor,
            format,
            is_compressed,
            record_len,
            n_points,
            n_points_elsewhere: (newer > 0 && older > 0 && older != newer).then_some(older),
            points_at,
            points_end: behind.fold(file_len, u64::min),
            len,
            n_records: u32_at(header, 100),
            later_records,
            scale,
            offset,
            bounds: bounds(header),
            is_standard_time: u16_at(header, 6) & 1 != 0,
            source_id: u16_at(header, 4),
            project_id: project_id(&bytes::<16>(header, 8)),
            system: text(part(header, 26, 32)),
            software: text(part(header, 58, 32)),
            date: date(u16_at(header, 90), u16_at(header, 92)),
        })
    }

    /// The minor and major version and what else there is, for people: `LAZ 1.2, point format 3`.
    pub(crate) fn describe(&self, is_copc: bool) -> String {
        let points = format!("point format {}", self.format.id);
        match (is_copc, self.is_compressed) {
            (true, _) => format!("COPC 1.0, {points}"),
            (false, true) => format!("LAZ 1.{}, {points}", self.minor),
            (false, false) => format!("LAS 1.{}, {points}", self.minor),
        }
    }
}

/// What is said of a file that is none.
fn not_las(head: &[u8]) -> Error {
    const SHOWN: usize = 20;
    let is_printable = |byte: &&u8| matches!(byte, b' '..=b'~');
    let shown: String =
        head.iter().take_while(is_printable).take(SHOWN).copied().map(char::from).collect();
    let is_text = !head.is_empty() && head.iter().all(|byte| matches!(byte, 9..=13 | 32..));
    let found = match (head.is_empty(), shown.is_empty()) {
        (true, _) => "an empty file".to_owned(),
        (false, true) => "another beginning".to_owned(),
        (false, false) => format!("`{}`", shown.trim_end()),
    };
    let hint =
        if is_text { "; if it is a table of points, read it with `--format xyz`" } else { "" };
    Error::new(format!("expected a file that begins with LASF, found {found}{hint}"))
}

/// The format of records, and whether the highest bit says that they are compressed.
fn point_format(byte: u8) -> Result<(PointFormat, bool)> {
    // The second bit is one that writers of LAZ set while the format was new.
    let id = byte & 0x3f;
    let format = PointFormat::of(id)
        .ok_or_else(|| Error::new(format!("expected a point format from 0 to 10, found {id}")))?;
    Ok((format, byte & 0x80 != 0))
}

/// Scale and offset of coordinates.
fn steps(header: &[u8; LONG]) -> Result<[DVec3; 2]> {
    let three =
        |at: usize| DVec3::new(f64_at(header, at), f64_at(header, at + 8), f64_at(header, at + 16));
    let (scale, offset) = (three(131), three(155));
    if !scale.is_finite() || scale.cmpeq(DVec3::ZERO).any() {
        return Err(Error::new(format!(
            "expected scales of coordinates that are not 0, found {scale}"
        )));
    }
    if !offset.is_finite() {
        return Err(Error::new(format!("expected finite offsets of coordinates, found {offset}")));
    }
    Ok([scale, offset])
}

/// Smallest and largest coordinates, where they are in order.
fn bounds(header: &[u8; LONG]) -> Option<[DVec3; 2]> {
    let every_second = |at: usize| {
        DVec3::new(f64_at(header, at), f64_at(header, at + 16), f64_at(header, at + 32))
    };
    let (most, least) = (every_second(179), every_second(187));
    let in_order = least.is_finite() && most.is_finite() && least.cmple(most).all();
    in_order.then_some([least, most])
}

/// Sixteen bytes as hexadecimal digits; nothing where all are 0.
fn project_id(bytes: &[u8; 16]) -> String {
    match bytes.iter().all(|byte| *byte == 0) {
        true => String::new(),
        false => notes::digits(bytes),
    }
}

/// Days of each month.
pub(crate) fn months(year: u32) -> [u32; 12] {
    let is_century = year.is_multiple_of(100);
    let is_leap = year.is_multiple_of(if is_century { 400 } else { 4 });
    [31, if is_leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]
}

/// A day of a year, counted from 1, as a date; the year alone where there is no such day.
fn date(day: u16, year: u16) -> String {
    let mut left = u32::from(day);
    if year == 0 || left == 0 {
        return if year == 0 { String::new() } else { year.to_string() };
    }
    for (month, days) in (1..).zip(months(u32::from(year))) {
        if left <= days {
            return format!("{year:04}-{month:02}-{left:02}");
        }
        left -= days;
    }
    year.to_string()
}
