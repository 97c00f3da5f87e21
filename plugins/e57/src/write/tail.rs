//! A file that is written at its end: the end stays in memory until it is long.

use std::io::{Read, Result, Seek, SeekFrom, Write};

/// Bytes that are written at once.
const LONG: usize = 1 << 20;

/// The crate `e57` writes, reads and seeks pages of a kilobyte; here most of that is done in memory.
pub(crate) struct Tail<T: Read + Write + Seek> {
    file: T,
    /// What is in memory begins here, and goes to the end of the file.
    start: u64,
    bytes: Vec<u8>,
    place: u64,
}

impl<T: Read + Write + Seek> Tail<T> {
    /// An empty file.
    pub(crate) fn new(file: T) -> Self {
        Self { file, start: 0, bytes: Vec::new(), place: 0 }
    }

    /// The place in the bytes in memory; `None` before them.
    fn in_memory(&self) -> Option<usize> {
        usize::try_from(self.place.checked_sub(self.start)?).ok()
    }

    fn write_out(&mut self) -> Result<()> {
        if !self.bytes.is_empty() {
            self.file.seek(SeekFrom::Start(self.start))?;
            self.file.write_all(&self.bytes)?;
            self.start += self.bytes.len() as u64;
            self.bytes.clear();
        }
        Ok(())
    }
}

impl<T: Read + Write + Seek> Read for Tail<T> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let n_read = match self.in_memory() {
            Some(first) => {
                let mut rest = self.bytes.get(first..).unwrap_or_default();
                rest.read(buffer)?
            }
            None => {
                let before = usize::try_from(self.start - self.place).unwrap_or(usize::MAX);
                let len = buffer.len().min(before);
                self.file.seek(SeekFrom::Start(self.place))?;
                self.file.read(&mut buffer[..len])?
            }
        };
        self.place += n_read as u64;
        Ok(n_read)
    }
}

impl<T: Read + Write + Seek> Write for Tail<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let n_written = match self.in_memory() {
            Some(first) => {
                let end = first + bytes.len();
                if self.bytes.len() < end {
                    self.bytes.resize(end, 0);
                }
                self.bytes[first..end].copy_from_slice(bytes);
                bytes.len()
            }
            None => {
                let before = usize::try_from(self.start - self.place).unwrap_or(usize::MAX);
                let len = bytes.len().min(before);
                self.file.seek(SeekFrom::Start(self.place))?;
                self.file.write(&bytes[..len])?
            }
        };
        self.place += n_written as u64;
        if self.bytes.len() >= LONG {
            self.write_out()?;
        }
        Ok(n_written)
    }

    fn flush(&mut self) -> Result<()> {
        self.write_out()?;
        self.file.flush()
    }
}

impl<T: Read + Write + Seek> Seek for Tail<T> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let end = self.start + self.bytes.len() as u64;
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(by) => end.checked_add_signed(by),
            SeekFrom::Current(by) => self.place.checked_add_signed(by),
        };
        let outside =
            || std::io::Error::new(std::io::ErrorKind::InvalidInput, "a place outside the file");
        self.place = place.filter(|place| *place <= end).ok_or_else(outside)?;
        Ok(self.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn a_tail_is_a_file() {
        let (mut plain, mut tail) = (Cursor::new(Vec::new()), Tail::new(Cursor::new(Vec::new())));
        let mut state = 7u64;
        let mut random = |below: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for round in 0..4000u64 {
            let end = plain.seek(SeekFrom::End(0)).unwrap();
            assert_eq!(tail.seek(SeekFrom::End(0)).unwrap(), end);
            if random(3) == 0 {
                let place = SeekFrom::Start(random(end + 1));
                assert_eq!(tail.seek(place).unwrap(), plain.seek(place).unwrap());
            }
            let bytes = vec![round as u8; random(3000) as usize];
            tail.write_all(&bytes).unwrap();
            plain.write_all(&bytes).unwrap();
            let place = SeekFrom::Start(random(end + 1));
            tail.seek(place).unwrap();
            plain.seek(place).unwrap();
            let (mut found, mut expected) = ([0; 100], [0; 100]);
            let len = plain.read(&mut expected).unwrap();
            tail.read_exact(&mut found[..len]).unwrap();
            assert_eq!(found, expected);
            if random(500) == 0 {
                tail.flush().unwrap();
            }
        }
        assert!(plain.get_ref().len() > LONG, "{}", plain.get_ref().len());
        tail.flush().unwrap();
        assert_eq!(tail.file.into_inner(), plain.into_inner());
        assert!(Tail::new(Cursor::new(Vec::new())).seek(SeekFrom::Start(1)).is_err());
    }
}
