//! Points on their way from file to file, counted.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// Points on their way.
#[derive(Debug, Default)]
pub(super) struct Counts {
    pub(super) read: AtomicU64,
    pub(super) written: AtomicU64,
    pub(super) not_finite: AtomicU64,
}

/// Counts that both ends and the caller share.
pub(super) type SharedCounts = Arc<Counts>;
