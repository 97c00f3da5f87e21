//! The guide for authors of plugins: pages that lead from an idea to a plugin, and references. They lie as
//! files in `host/manual/plugins`, too, and their examples run in the tests.
//!
#![doc = include_str!("../guide/index.md")]

pub mod shading {
    #![doc = include_str!("../guide/shading.md")]
}

pub mod graph {
    #![doc = include_str!("../guide/graph.md")]
}

pub mod splats {
    #![doc = include_str!("../guide/splats.md")]
}

pub mod tool {
    #![doc = include_str!("../guide/tool.md")]
}

pub mod hands {
    #![doc = include_str!("../guide/hands.md")]
}

pub mod tracer {
    #![doc = include_str!("../guide/tracer.md")]
}

pub mod format {
    #![doc = include_str!("../guide/format.md")]
}

pub mod wire {
    #![doc = include_str!("../guide/wire.md")]
}

pub mod versions {
    #![doc = include_str!("../guide/versions.md")]
}

pub mod may_use {
    #![doc = include_str!("../guide/may-use.md")]
}

pub mod shaders {
    #![doc = include_str!("../guide/shaders.md")]
}
