//! Memory that open pyramids take.

use std::sync::OnceLock;
use surfelshop_cloud::memory;

/// Bytes that a surfel takes while it is drawn, besides its columns: what is drawn of them, in drawing order.
const DRAWN_BYTES: u64 = 64;

/// Memory that is counted with where the system does not say what it has.
const USUAL_MEMORY: u64 = 4 << 30;

/// Memory that an open pyramid takes, bytes: all that is drawn at a time, and what is kept for the next pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget(pub u64);

/// Least memory that work on a pyramid takes, bytes: less holds no part that could be worked on.
pub const LEAST_MEMORY: u64 = 64_000_000;

/// Of this memory what a limit of the process's addresses (`ulimit -v`) leaves for work on a pyramid, bytes: where
/// that is little, [`LEAST_MEMORY`].
#[must_use]
pub fn within_limits(bytes: u64) -> u64 {
    memory::within_addresses(bytes, LEAST_MEMORY)
}

/// What was typed for all pyramids of this run.
static TYPED: OnceLock<u64> = OnceLock::new();

/// Sets the memory that each pyramid takes that is opened from now on; the first call counts.
pub fn use_memory(bytes: Option<u64>) {
    if let Some(bytes) = bytes {
        // A second call changes nothing.
        let _second = TYPED.set(bytes);
    }
}

impl Default for Budget {
    /// As typed, else half of what is free; less where the process may have so many addresses only.
    fn default() -> Self {
        let free = || within_limits(memory::available().unwrap_or(USUAL_MEMORY) / 2);
        Self(TYPED.get().copied().unwrap_or_else(free))
    }
}

impl Budget {
    /// Bytes of nodes that are kept.
    pub(super) fn kept(self) -> u64 {
        self.0 / 3
    }

    /// Surfels of so many bytes that are drawn at a time: less than are kept, so that those above them are, too.
    pub(super) fn drawn(self, surfel_bytes: u64) -> u64 {
        (self.0 / 2 / (surfel_bytes + DRAWN_BYTES)).min(self.kept() / 2 / surfel_bytes.max(1))
    }

    /// The share of each of so many.
    #[must_use]
    pub fn divided(self, n: usize) -> Self {
        Self(self.0 / n.max(1) as u64)
    }
}
