//! Room in a module's memory for what the host lends it.

use crate::stop::Stop;
use wasmi::{Memory, Store, StoreLimits};

const PAGE: u64 = 65536;
/// What is lent lies at multiples of this.
const ALIGNMENT: u64 = 16;

/// Pages that the host added to a memory, for its own use: one part after another, until all of a call is let go.
#[derive(Debug, Default)]
pub(crate) struct Arena {
    parts: Vec<Part>,
}

#[derive(Debug)]
struct Part {
    start: u64,
    end: u64,
    used: u64,
}

/// How much of an arena was in use.
pub(crate) struct Mark(Vec<u64>);

impl Mark {
    /// The mark of an arena that nothing was taken of.
    pub(crate) fn of_nothing() -> Self {
        Self(Vec::new())
    }
}

impl Arena {
    /// How much is in use now.
    pub(crate) fn mark(&self) -> Mark {
        Mark(self.parts.iter().map(|part| part.used).collect())
    }

    /// Lets go of what was taken since.
    pub(crate) fn release(&mut self, mark: &Mark) {
        for (i, part) in self.parts.iter_mut().enumerate() {
            part.used = mark.0.get(i).copied().unwrap_or(part.start);
        }
    }

    /// The address of room for `len` bytes.
    pub(crate) fn take(
        &mut self,
        (store, memory): (&mut Store<StoreLimits>, Memory),
        len: usize,
    ) -> Result<u32, Stop> {
        let len = (len as u64).next_multiple_of(ALIGNMENT);
        let has_room = |part: &&mut Part| part.end - part.used >= len;
        if let Some(part) = self.parts.iter_mut().find(has_room) {
            let address = part.used;
            part.used += len;
            return Ok(address as u32);
        }
        let pages = len.div_ceil(PAGE).max(1);
        let before = memory.grow(&mut *store, pages).map_err(|_refused| {
            Stop::Impossible(format!(
                "a sandboxed plugin cannot be lent {} MiB more: its memory has {} MiB, and the limit is in the way",
                len.div_ceil(1 << 20),
                memory.data_size(&*store) >> 20
            ))
        })?;
        let (start, end) = (before * PAGE, (before + pages) * PAGE);
        match self.parts.last_mut() {
            Some(last) if last.end == start => last.end = end,
            _ => self.parts.push(Part { start, end, used: start }),
        }
        let Some(last) = self.parts.last_mut() else {
            return Err(Stop::Impossible("there is no room".to_owned()));
        };
        let address = last.used;
        last.used += len;
        Ok(address as u32)
    }
}
