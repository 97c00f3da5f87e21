//! Lines that cannot be read.

use crate::text::shown_at;
use surfelshop_api::format::{CloudSink, FileSource};
use surfelshop_api::{Error, Result};

/// Lines after which a file whose most lines cannot be read is given up.
const GIVEN_UP: u64 = 1000;

/// Lines of a file that cannot be read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Unreadable {
    n: u64,
    n_read: u64,
    /// Of the first, its number, counted from 1, and its place.
    first: Option<(u64, u64)>,
}

impl Unreadable {
    /// Counts lines, of which `first` is the first one that cannot be read.
    pub(crate) fn add(&mut self, n_read: u64, n: u64, first: Option<(u64, u64)>) {
        self.n_read += n_read;
        self.n += n;
        if self.first.is_none() && n > 0 {
            self.first = first;
        }
    }

    /// Whether there is no use in reading on.
    pub(crate) fn is_hopeless(&self) -> bool {
        self.n > self.n_read && self.n > GIVEN_UP
    }

    /// Says what was left out, in one line, at the end of a file.
    ///
    /// # Errors
    /// Where it is 1 % of the lines or more; one line alone is none.
    pub(crate) fn finish(&self, file: &FileSource, clouds: &mut CloudSink<'_>) -> Result<()> {
        let Some((number, place)) = self.first else { return Ok(()) };
        let all = self.n.saturating_add(self.n_read);
        let line = format!("line {number}: {}", shown_at(file, place));
        if self.n_read == 0 || (self.n > 1 && self.n.saturating_mul(100) >= all) {
            let n = self.n;
            return Err(Error::new(format!(
                "expected lines of numbers, found {n} of {all} that are none; the first is {line}"
            )));
        }
        clouds.warn(&match self.n {
            1 => format!("a line cannot be read and is left out: {line}"),
            n => format!("{n} of {all} lines cannot be read and are left out; the first is {line}"),
        });
        Ok(())
    }
}
