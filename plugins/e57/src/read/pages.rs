//! Bytes of a file without its checksums: every 1024 bytes end with a CRC of the 1020 before.

use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Result};

/// Bytes of a page in the file.
pub(crate) const PAGE: u64 = 1024;
/// Bytes of a page without its checksum.
pub(crate) const PAYLOAD: u64 = 1020;
/// Pages that are read at once, where so many are left.
const AT_ONCE: u64 = 1024;

/// The place of a byte without checksums, from its place in the file.
///
/// # Errors
/// Inside a checksum.
pub(crate) fn place(offset: u64) -> Result<u64> {
    if offset % PAGE < PAYLOAD {
        return Ok(offset / PAGE * PAYLOAD + offset % PAGE);
    }
    Err(Error::new(format!(
        "expected a part of the file at byte {offset}, found a checksum: the file is damaged"
    )))
}

/// The place in the file of a byte, from its place without checksums.
pub(crate) fn in_file(place: u64) -> u64 {
    (place / PAYLOAD).saturating_mul(PAGE).saturating_add(place % PAYLOAD)
}

/// Reads on from a place; all places are counted without checksums.
pub(crate) struct Pages<'a> {
    file: &'a FileSource,
    /// No byte from here on is taken.
    end: u64,
    next_page: u64,
    /// Pages as they are in the file.
    raw: Vec<u8>,
    /// Bytes without checksums; those before `taken` were handed out.
    bytes: Vec<u8>,
    taken: usize,
    place: u64,
}

impl<'a> Pages<'a> {
    /// Reads from `start` to at most `end`, or the end of the file.
    pub(crate) fn new(file: &'a FileSource, start: u64, end: u64) -> Self {
        let end = end.min(file.length() / PAGE * PAYLOAD);
        let (raw, bytes) = Default::default();
        let next_page = start / PAYLOAD;
        Self { file, end, next_page, raw, bytes, taken: 0, place: start }
    }

    /// Where the next byte is.
    pub(crate) fn place(&self) -> u64 {
        self.place
    }

    /// Bytes that are left.
    pub(crate) fn left(&self) -> u64 {
        self.end.saturating_sub(self.place)
    }

    /// The next bytes.
    ///
    /// # Errors
    /// Where fewer are left, a page is damaged, or the system refuses.
    pub(crate) fn take(&mut self, len: usize) -> Result<&[u8]> {
        if self.left() < len as u64 {
            let (place, left) = (in_file(self.place), self.left());
            return Err(Error::new(format!(
                "expected {len} bytes from byte {place}, found {left}: the file is damaged or cut short"
            )));
        }
        while self.bytes.len() - self.taken < len {
            self.read_pages()?;
        }
        let first = self.taken;
        self.taken += len;
        self.place += len as u64;
        Ok(&self.bytes[first..first + len])
    }

    /// Goes on behind bytes that nobody reads; those that were not read yet are not checked.
    ///
    /// # Errors
    /// Where fewer are left.
    pub(crate) fn skip(&mut self, len: usize) -> Result<()> {
        let ready = self.bytes.len() - self.taken;
        if len <= ready {
            return self.take(len).map(|_skipped| ());
        }
        if self.left() < len as u64 {
            return self.take(len).map(|_refused| ());
        }
        *self = Self {
            raw: std::mem::take(&mut self.raw),
            ..Self::new(self.file, self.place + len as u64, self.end)
        };
        Ok(())
    }

    /// Adds the bytes of the next pages, which are there: `end` is behind their beginning.
    fn read_pages(&mut self) -> Result<()> {
        self.bytes.drain(..self.taken);
        self.taken = 0;
        let n = self.end.div_ceil(PAYLOAD).saturating_sub(self.next_page).clamp(1, AT_ONCE);
        self.raw.resize(usize::try_from(n * PAGE)?, 0);
        self.file.read_exact_at(self.next_page.saturating_mul(PAGE), &mut self.raw)?;
        self.bytes.try_reserve(usize::try_from(n * PAYLOAD)?)?;
        // The first page begins before the place where reading does.
        let first_page = self.bytes.is_empty() && self.place / PAYLOAD == self.next_page;
        let mut skipped = if first_page { usize::try_from(self.place % PAYLOAD)? } else { 0 };
        for (page, number) in self.raw.chunks_exact(PAGE as usize).zip(self.next_page..) {
            let (payload, checksum) = page.split_at(PAYLOAD as usize);
            check(payload, checksum, number)?;
            self.bytes.extend_from_slice(&payload[skipped..]);
            skipped = 0;
        }
        self.next_page += n;
        Ok(())
    }
}

/// Whether a page has its checksum, which is big-endian unlike all else in the file.
fn check(payload: &[u8], checksum: &[u8], number: u64) -> Result<()> {
    let expected = crc32c::crc32c(payload);
    if expected.to_be_bytes() == checksum {
        return Ok(());
    }
    let found = checksum.iter().fold(0u32, |word, &byte| word << 8 | u32::from(byte));
    let first = number.saturating_mul(PAGE);
    Err(Error::new(format!(
        "expected the checksum {expected:08x} for page {number} (bytes {first} to {}), found {found:08x}: the file is damaged",
        first.saturating_add(PAGE - 1)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(n_pages: u8) -> FileSource {
        let mut bytes = Vec::new();
        for page in 0..n_pages {
            let payload: Vec<u8> = (0..PAYLOAD).map(|i| (i as u8).wrapping_mul(3) ^ page).collect();
            bytes.extend_from_slice(&payload);
            bytes.extend_from_slice(&crc32c::crc32c(&payload).to_be_bytes());
        }
        FileSource::of_bytes(bytes, "a.e57")
    }

    fn expected(place: u64) -> u8 {
        ((place % PAYLOAD) as u8).wrapping_mul(3) ^ (place / PAYLOAD) as u8
    }

    #[test]
    fn bytes_are_those_between_the_checksums_from_any_place() {
        let file = file(5);
        for start in [0, 1, 1019, 1020, 1021, 3000] {
            let mut pages = Pages::new(&file, start, u64::MAX);
            let mut place = start;
            for len in [1usize, 3, 1000, 700] {
                let bytes = pages.take(len).unwrap().to_vec();
                assert!(bytes.iter().zip(place..).all(|(&byte, place)| byte == expected(place)));
                place += len as u64;
            }
            assert_eq!((pages.place(), pages.left()), (place, 5 * PAYLOAD - place));
            pages.skip(5).unwrap();
            assert_eq!(pages.take(1).unwrap()[0], expected(place + 5));
        }
        let mut pages = Pages::new(&file, 10, 2000);
        pages.skip(1500).unwrap();
        assert_eq!(pages.take(490).unwrap()[489], expected(1999));
        assert!(pages.take(1).is_err() && pages.skip(1).is_err());
        assert!(place(1023).is_err() && place(1024).unwrap() == 1020);
        assert_eq!(in_file(1020), 1024);
    }

    #[test]
    fn a_damaged_page_is_named() {
        let mut bytes = file(3).bytes_at(0, 3 * PAGE).unwrap();
        bytes[2048 + 7] ^= 1;
        let file = FileSource::of_bytes(bytes, "a.e57");
        assert!(Pages::new(&file, 0, 2040).take(2040).is_ok());
        let line = Pages::new(&file, 0, 2041).take(2041).unwrap_err().to_string();
        assert!(line.contains("page 2 (bytes 2048 to 3071)") && line.contains("damaged"), "{line}");
    }
}
