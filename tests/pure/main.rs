//! Tests that open no graphics device: what the repository holds, the plugin boundary, loading, tools and tracers.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "figures are part of what tests say")]

mod ambient_occlusion;
mod assets;
mod dependencies;
mod features;
mod formats;
mod imports;
mod invariants;
mod names;
mod packages;
mod plugins;
mod pointshop;
mod prelude;
mod preparation;
mod reference;
mod repository;
mod shader_constants;
mod static_plugin;
mod versions;
