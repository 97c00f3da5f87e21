//! The parameters of the renderer.

use surfelshop_api::prelude::*;

choices! {
    /// What a virtual light is to a surface near it.
    pub enum Near {
        /// A disc, which shines no stronger than it is wide.
        Disc = "disc",
        /// A point, bounded within the disc's radius.
        Bounded = "bounded",
    }
}

choices! {
    /// What of the light is shown.
    pub enum Show {
        /// All of it.
        All = "all",
        /// What comes from the lamps without a detour.
        Direct = "direct",
        /// What was reflected before.
        Indirect = "indirect",
    }
}

params! {
    /// Settings of the renderer.
    pub struct Settings {
        /// Reflections between surfaces; 0 is direct light.
        bounces: u32 { default: 2, range: 0..=4, quality: true },
        /// Virtual point lights of each bounce in a frame; 0 is direct light.
        vpls: u32 { default: 64, range: 0..=1024, quality: true, label: "virtual lights" },
        /// Frames that are added up while nothing moves, each with other lights.
        frames: u32 { default: 8, range: 1..=64, quality: true, logarithmic: true },
        /// Texels on a side of all shadow maps of a bounce together; 32 for each point at most.
        ism_size: u32 { default: 512, range: 128..=2048, quality: true, logarithmic: true, label: "shadow texels" },
        /// Surfels that go over all these maps.
        ism_points: u32 { default: 200_000, range: 1_000..=4_000_000, quality: true, logarithmic: true, label: "shadow points" },
        /// How wide holes of the shadow maps are filled: twice 2^n texels, 8 where something lies behind;
        /// 0 fills none.
        pull_push: u32 { default: 2, range: 0..=4, quality: true, label: "hole filling" },
        /// Of n x n pixels each takes every n^2-th light.
        interleaving: u32 { default: 4, range: 1..=8, quality: true },
        /// How far interleaved pixels are merged: not at all, over a block, or over those around it too.
        smoothing: u32 { default: 2, range: 0..=2, quality: true },
        /// What a virtual light is to a surface near it.
        near: Near { default: Near::Disc, label: "near a light" },
        /// How large the disc or the bound is; 1 goes with the number of lights.
        softening: f32 { default: 1.0, range: 0.0..=8.0 },
        /// Places around each pixel by which is made up for light that lights leave out near surfaces;
        /// 0 is none.
        compensation: u32 { default: 8, range: 0..=64, quality: true },
        /// Texels on a side of what a lamp sees: its shadow map, and where first lights are placed. A power
        /// of two; four million for all lamps at most.
        light_map: u32 { default: 512, range: 64..=2048, quality: true, logarithmic: true, label: "lamp texels" },
        /// Factor on the diffuse term.
        diffuse: f32 { default: 1.0, range: 0.0..=1.0 },
        /// Radiance of the highlight's peak under a white light.
        specular: f32 { default: 0.0, range: 0.0..=1.0 },
        /// Exponent of the highlight: large is small and sharp.
        shininess: f32 { default: 64.0, range: 1.0..=1024.0, logarithmic: true },
        /// Highlights have Schlick's factor of this index of refraction; 1 leaves it out.
        ior: f32 { default: 1.0, range: 1.0..=4.0, label: "refraction index" },
        /// What of the light is shown.
        show: Show { default: Show::All },
    }
}
