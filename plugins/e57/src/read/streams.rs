//! What was read of a scan's fields and not decoded yet.

use crate::read::fields::Field;
use surfelshop_api::{Error, Result};

/// Most bytes of fields that wait for others to catch up. Files have some ten thousand.
const MOST_WAITING: u64 = 1 << 29;

/// Bytes of a field: numbers packed one behind the other, through all packets.
#[derive(Default)]
struct Stream {
    /// Bits of a number.
    bits: u64,
    /// Whether anybody reads it; else only its length is counted.
    needed: bool,
    bytes: Vec<u8>,
    /// Bits before the first number, fewer than 8.
    first: usize,
    /// Bits from there on.
    n_bits: u64,
}

/// Bytes of all fields of a scan.
pub(crate) struct Streams {
    streams: Vec<Stream>,
    n_bytes: u64,
}

impl Streams {
    /// Empty ones; `needed` says which of the fields are read.
    pub(crate) fn new(fields: &[Field], needed: impl Fn(usize) -> bool) -> Self {
        let stream = |(i, field): (usize, &Field)| Stream {
            bits: u64::from(field.bits),
            needed: needed(i),
            ..Stream::default()
        };
        Self { streams: fields.iter().enumerate().map(stream).collect(), n_bytes: 0 }
    }

    /// Number of fields.
    pub(crate) fn len(&self) -> usize {
        self.streams.len()
    }

    /// Adds bytes of a field.
    ///
    /// # Errors
    /// Where there is no memory, or fields are so far apart that the file cannot be right.
    pub(crate) fn append(&mut self, field: usize, bytes: &[u8]) -> Result<()> {
        let stream = &mut self.streams[field];
        stream.n_bits += bytes.len() as u64 * 8;
        if stream.needed && stream.bits > 0 {
            stream.bytes.try_reserve(bytes.len())?;
            stream.bytes.extend_from_slice(bytes);
            self.n_bytes += bytes.len() as u64;
        }
        if self.n_bytes > MOST_WAITING {
            return Err(Error::new(
                "expected packets with as many values of each field, found fields far apart: the file is damaged",
            ));
        }
        Ok(())
    }

    /// Points whose values are all there; `None` where no field has bits, so that any number is.
    pub(crate) fn n_points(&self) -> Option<u64> {
        let with_bits = self.streams.iter().filter(|stream| stream.bits > 0);
        with_bits.map(|stream| stream.n_bits / stream.bits).min()
    }

    /// The bytes of a field, and the bit where the value of a point begins.
    pub(crate) fn at(&self, field: usize, point: usize) -> (&[u8], usize) {
        let stream = &self.streams[field];
        (&stream.bytes, stream.first + point * stream.bits as usize)
    }

    /// Forgets the values of the first points, which are there.
    pub(crate) fn forget(&mut self, n_points: u64) {
        for stream in self.streams.iter_mut().filter(|stream| stream.bits > 0) {
            let n_bits = (n_points * stream.bits).min(stream.n_bits);
            stream.n_bits -= n_bits;
            if stream.needed {
                let first = stream.first + n_bits as usize;
                let n_bytes = (first / 8).min(stream.bytes.len());
                stream.bytes.drain(..n_bytes);
                stream.first = first % 8;
                self.n_bytes -= n_bytes as u64;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{Record, RecordDataType, RecordName};

    #[test]
    fn points_are_there_when_all_fields_are() {
        let field = |max| {
            let data_type = RecordDataType::Integer { min: 0, max };
            Field::new(&Record { name: RecordName::Intensity, data_type })
        };
        let fields = [field(7), field(0), field(255)];
        let mut streams = Streams::new(&fields, |i| i != 2);
        assert_eq!(streams.n_points(), Some(0));
        streams.append(0, &[0b1010_1001, 0xff]).unwrap();
        assert_eq!(streams.n_points(), Some(0));
        streams.append(2, &[9; 6]).unwrap();
        assert_eq!(streams.n_points(), Some(5));
        streams.forget(3);
        assert_eq!(streams.n_points(), Some(2));
        assert_eq!(streams.at(0, 1), (&[0xff][..], 4));
        assert_eq!(Streams::new(&fields[1..2], |_| true).n_points(), None);
    }
}
