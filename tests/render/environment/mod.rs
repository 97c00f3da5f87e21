//! The renderer `environment` against sums over all texels in f64, and at its extremes.

mod agreement;
mod behavior;
mod directions;
mod light;
