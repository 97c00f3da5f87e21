//! The parameters of the tool.

use surfelshop_api::prelude::*;

choices! {
    /// How occlusion is found.
    pub enum Method {
        /// The octree, and rays where it cannot know.
        Hybrid = "hybrid",
        /// Rays against discs: the reference.
        Rays = "rays",
        /// Form factors of every pair of surfels.
        BruteForce = "brute-force",
        /// Form factors from an octree.
        Octree = "octree",
    }
}

choices! {
    /// Which side of an emitter casts its shadow.
    pub enum Side {
        /// The side that faces away from the receiver.
        Back = "back",
        /// The side that faces the receiver, as the thesis is worded.
        Front = "front",
    }
}

params! {
    /// Settings of the bake.
    pub struct Settings {
        /// How occlusion is found.
        method: Method { default: Method::Hybrid },
        /// Rays of each surfel: of the method `rays`, and at most of `hybrid`.
        rays: u32 { default: 256, range: 1..=65536, quality: true, logarithmic: true },
        /// Error that a node may make where it stands in for its surfels, as a share of the sky.
        tolerance: f32 { default: 0.008, range: 0.0..=1.0, quality: true, logarithmic: true },
        /// Error at which a surfel gets no more rays of `hybrid`, as a share of the sky.
        error: f32 { default: 0.018, range: 0.0..=1.0, quality: true, logarithmic: true },
        /// Passes of the form factors.
        passes: u32 { default: 2, range: 1..=8, quality: true },
        /// Start of the random numbers.
        seed: u32 { default: 0, range: 0..=0x7fff_ffff },
        /// Distance beyond which nothing casts a shadow; 0 is unlimited.
        max_distance: f32 { default: 0.0, range: 0.0..=1e30, unit: "scene units", logarithmic: true },
        /// Side of an emitter that casts its shadow, of the form factors.
        cast_from: Side { default: Side::Back },
        /// Leave out what is lower than 15 degrees above the horizon, as the thesis does.
        cone: bool { default: false },
    }
}
