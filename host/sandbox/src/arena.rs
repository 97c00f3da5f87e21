//! Room in a module's memory for what the host lends it.

use crate::stop::Stop;
use wasmi::{Memory, Store, StoreLimits};

const PAGE: u64 = 65536;
/// What is lent lies at multiples of this.
const ALIGNMENT: u64 = 16;

/// Parts of a memory that are the host's: what the module's allocator set aside for it, or pages that it added itself.
/// They stay, and are filled one after another until all of a call is let go.
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

/// What is set aside for `len` bytes: no less than a page, and room to align them.
pub(crate) fn with_margin(len: usize) -> u64 {
    ((len as u64).next_multiple_of(ALIGNMENT) + ALIGNMENT).max(PAGE)
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

    /// The address of room for `len` bytes, where there is some.
    pub(crate) fn take(&mut self, len: usize) -> Option<u32> {
        let len = (len as u64).next_multiple_of(ALIGNMENT);
        let has_room = |part: &&mut Part| part.end - part.used >= len;
        let part = self.parts.iter_mut().find(has_room)?;
        let address = part.used;
        part.used += len;
        Some(address as u32)
    }

    /// Adds what the module's own allocator has set aside: at least [`with_margin`] bytes.
    pub(crate) fn add(&mut self, address: u32, len: u64) {
        let (start, end) =
            (u64::from(address).next_multiple_of(ALIGNMENT), u64::from(address) + len);
        self.parts.push(Part { start, end, used: start });
    }

    /// Adds pages to the memory, with room for `len` bytes.
    pub(crate) fn grow(
        &mut self,
        (store, memory): (&mut Store<StoreLimits>, Memory),
        len: usize,
    ) -> Result<(), Stop> {
        let len = (len as u64).next_multiple_of(ALIGNMENT);
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
        Ok(())
    }
}
