//! The renderer `global-illumination`: light that bounces, against what is known of it in closed form,
//! and in scenes that have nothing of it.

mod bench;
mod cornell;
mod furnace;
mod motion;
mod nothing;
mod still;
