//! The WGSL modules that the passes share.

use surfelshop_api::prelude::*;

/// A module: its import path, the file's name for messages, and its text.
pub(crate) struct Module {
    path: &'static str,
    file: &'static str,
    wgsl: &'static str,
}

pub(crate) const HEMISPHERE: Module = Module {
    path: "gi::hemisphere",
    file: "hemisphere.wgsl",
    wgsl: include_str!("shadow_maps/hemisphere.wgsl"),
};
pub(crate) const LIGHT_VIEWS: Module = Module {
    path: "gi::light_views",
    file: "light_views.wgsl",
    wgsl: include_str!("light_views/light_views.wgsl"),
};
pub(crate) const MAPS: Module =
    Module { path: "gi::maps", file: "maps.wgsl", wgsl: include_str!("shadow_maps/maps.wgsl") };
pub(crate) const MATERIAL: Module = Module {
    path: "gi::material",
    file: "material.wgsl",
    wgsl: include_str!("shading/material.wgsl"),
};
pub(crate) const RANDOM: Module =
    Module { path: "gi::random", file: "random.wgsl", wgsl: include_str!("vpls/random.wgsl") };
pub(crate) const VPL: Module =
    Module { path: "gi::vpl", file: "vpl.wgsl", wgsl: include_str!("vpls/vpl.wgsl") };

/// A pass with these modules.
pub(crate) fn with(pass: Pass, modules: &[Module]) -> Pass {
    modules.iter().fold(pass, |pass, module| pass.module(module.path, module.file, module.wgsl))
}
