//! The variable-length records of a LAS file: those of them that are of use.

use crate::header::Header;
use crate::numbers::{part, text, u16_at, u64_at};
use crate::up_record;
use surfelshop_api::Result;
use surfelshop_api::format::{FileSource, UpAxis};

/// Most records that are looked at; files have a few dozen.
const MOST: u32 = 1 << 16;
/// Longest payload that is read, in bytes. Coordinate systems have some thousands.
const LONGEST: u64 = 1 << 20;
/// Most records that are not read and named all the same.
const MOST_OTHERS: usize = 100;
/// Most bytes of all texts for people.
const MOST_TEXT: usize = 1 << 18;

/// What records say.
#[derive(Clone, Debug, Default)]
pub(crate) struct Records {
    /// How points are compressed.
    pub(crate) laszip: Option<Vec<u8>>,
    /// What a COPC file says of its octree: 160 bytes.
    pub(crate) copc: Option<Vec<u8>>,
    /// Descriptions of extra bytes, 192 bytes each.
    pub(crate) extra_bytes: Vec<u8>,
    /// The coordinate system as WKT; may be empty.
    pub(crate) wkt: String,
    /// The directory of `GeoTIFF` keys, its floats and its texts.
    pub(crate) geo_keys: [Vec<u8>; 3],
    /// The axis that points up, where a record of our own says so.
    pub(crate) up: Option<UpAxis>,
    /// Texts for people.
    pub(crate) texts: Vec<String>,
    /// Names of records that are not read, with their numbers and bytes.
    pub(crate) others: Vec<String>,
}

/// Where records lie: their first byte, the byte behind the last, their number, and the length of the
/// header of each.
struct Place {
    at: u64,
    end: u64,
    n: u32,
    head: usize,
}

impl Records {
    /// Reads the records of a file; adds a line to `warnings` where some are not there.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn read(
        file: &FileSource,
        header: &Header,
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        let mut records = Self::default();
        let length = file.length();
        let before = Place {
            at: header.len,
            end: header.points_at.min(length),
            n: header.n_records,
            head: 54,
        };
        let (at, n) = header.later_records;
        records.take_all(file, &before, warnings)?;
        records.take_all(file, &Place { at, end: length, n, head: 60 }, warnings)?;
        Ok(records)
    }

    fn take_all(
        &mut self,
        file: &FileSource,
        place: &Place,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let (mut at, mut head) = (place.at, [0; 60]);
        for i in 0..place.n {
            let body = at.saturating_add(place.head as u64);
            let fits = i < MOST && body <= place.end;
            if fits {
                file.read_exact_at(at, &mut head[..place.head])?;
            }
            let len =
                if place.head == 54 { u64::from(u16_at(&head, 20)) } else { u64_at(&head, 20) };
            if !fits || len > place.end - body {
                let where_to = if place.head == 54 { "before the points" } else { "in the file" };
                warnings.push(format!(
                    "the header announces {} variable-length records, {i} fit {where_to}",
                    place.n
                ));
                return Ok(());
            }
            self.take(file, &head, body, len, warnings)?;
            at = body + len;
        }
        Ok(())
    }

    fn take(
        &mut self,
        file: &FileSource,
        head: &[u8],
        at: u64,
        len: u64,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let (user, id) = (text(part(head, 2, 16)), u16_at(head, 18));
        let kind = (user.as_str(), id);
        let is_of_use = matches!(
            kind,
            ("laszip encoded", 22204)
                | ("LASF_Spec", 3 | 4)
                | ("LASF_Projection", 2112 | 34735..=34737)
                | ("copc", 1)
                | (up_record::USER, up_record::ID)
        );
        if !is_of_use {
            // The hierarchy is read where an octree is asked for, and belongs to the order of the points.
            if user != "copc" && self.others.len() < MOST_OTHERS {
                self.others.push(format!("`{user}` {id}, {len} bytes"));
            }
            return Ok(());
        }
        if len > LONGEST {
            warnings.push(format!(
                "the record {id} of `{user}` has {len} bytes and is passed over; at most {LONGEST} are read"
            ));
            return Ok(());
        }
        let body = file.bytes_at(at, len)?;
        match kind {
            (_, 22204) => self.laszip = Some(body),
            (up_record::USER, _) => self.up = up_record::axis(&body),
            ("copc", _) => self.copc = Some(body),
            (_, 3) => {
                let n_bytes = self.texts.iter().map(String::len).sum::<usize>() + body.len();
                if n_bytes <= MOST_TEXT {
                    self.texts.push(text(&body));
                }
            }
            // Some files have a record for each field.
            (_, 4) if self.extra_bytes.len() as u64 + len <= LONGEST => {
                self.extra_bytes.extend(body)
            }
            (_, 4) => {}
            (_, 2112) => self.wkt = text(&body),
            (_, key) => {
                if let Some(keys) = self.geo_keys.get_mut(usize::from(key.saturating_sub(34735))) {
                    *keys = body;
                }
            }
        }
        Ok(())
    }
}
