//! Tests that measure the memory of their own process, one after the other.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "figures are part of what tests say")]

use peak_alloc::PeakAlloc;

mod convert;
mod corpus;
mod gaussians;
mod mutations;
mod resident;
mod size;

/// Counts what this process takes.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;
