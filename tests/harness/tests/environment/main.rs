//! The renderer `environment` against sums over all texels in f64, and at its extremes.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "errors are part of the result")]

mod agreement;
mod conduct;
mod directions;
mod light;
